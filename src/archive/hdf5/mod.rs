//! HDF5 archives: what lies in them, and how they are told apart. Reading and writing them needs the cargo
//! feature `hdf5`, since the format is left to its C library; what is here without it says so.
//!
//! Two layouts are read: a list of images with a pair of directions each (`ground_color`, as the NeuralBTF project
//! publishes them), and our own, which has the arrays and attributes of a measurement store. `docs/formats/hdf5.md` has both.

#[cfg(feature = "hdf5")]
mod archive;
#[cfg(feature = "hdf5")]
mod attribute;
#[cfg(feature = "hdf5")]
mod dataset;
#[cfg(feature = "hdf5")]
mod grid;
#[cfg(feature = "hdf5")]
mod image_list;
#[cfg(feature = "hdf5")]
mod measurement;
#[cfg(feature = "hdf5")]
pub(super) mod source;
#[cfg(feature = "hdf5")]
mod writer;

#[cfg(feature = "hdf5")]
pub use archive::Archive;
#[cfg(feature = "hdf5")]
pub use writer::Writer;

/// The error of a program built without HDF5 that meets such a file.
#[cfg(not(feature = "hdf5"))]
pub(crate) fn not_built_in(path: &std::path::Path) -> crate::Error {
    crate::Error::usage(format!("{}: an HDF5 file, which this program was built without", path.display()))
        .hint("install HDF5's headers (Debian: libhdf5-dev) and build with `cargo build --release --features hdf5`")
}

#[cfg(all(test, not(feature = "hdf5")))]
mod tests {
    use super::*;

    #[test]
    fn without_the_feature_the_error_says_how_to_build_with_it() {
        let error = not_built_in(std::path::Path::new("a.h5"));
        assert!(error.guidance().is_some_and(|hint| hint.contains("--features hdf5")), "{error}");
    }
}

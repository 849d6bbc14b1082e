//! Readers and writers of BTF archives over byte slices.
//!
//! The caller maps or reads a file; this crate interprets the bytes. It starts no thread, opens no
//! file, prints nothing, and holds every allocation whose size a file claims under a [`Limits`].
//!
//! # Wording
//!
//! | word | meaning |
//! | --- | --- |
//! | archive | a zip, or a folder, of images |
//! | entry | one file in a zip; entries are numbered from 0 in the order of the central directory |
//! | image | one photograph of the material: one light direction and one view direction |
//! | view, light | indices of directions, sorted by theta, then phi |
//! | theta, phi | polar angle from the surface normal and azimuth: **degrees** in [`Angles`], as in file names, radians in [`Direction`] |
//!
//! # Where to start
//!
//! An UBO2003 zip is read in four steps: [`zip::ZipIndex::open`] lists the entries,
//! [`ubo2003::Catalogue::from_names`] finds the image of every view and light,
//! [`zip::ZipIndex::read`] gives the bytes of one entry and [`jpeg::decode`] its samples. A folder of
//! images needs the second and the last only. Where names are others, [`named`] finds the angles in them, and a
//! [`table`] or a light list ([`rti`]) says them; all lead to a [`Catalogue`].
//!
//! ```
//! use btfkit_formats::{Limits, jpeg, ubo2003, zip};
//!
//! fn mean_of_first_image(archive: &[u8]) -> Result<f64, Box<dyn std::error::Error>> {
//!     let limits = Limits::default();
//!     let index = zip::ZipIndex::open(archive, &limits)?;
//!     let catalogue = ubo2003::Catalogue::from_names(index.entries().iter().map(|e| e.name()))?;
//!     let entry = catalogue.image(0, 0).ok_or("a complete catalogue has an image (0, 0)")?;
//!     let image = jpeg::decode(&index.read(archive, entry)?, &limits)?;
//!     let sum: f64 = image.samples.iter().map(|&s| f64::from(s)).sum();
//!     Ok(sum / image.samples.len() as f64)
//! }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects
    )
)]

mod angles;
mod assumption;
mod behind;
pub mod big;
pub mod bonn;
mod catalogue;
mod container;
mod contents;
mod direction;
pub mod directions;
mod doubt;
mod error;
mod fields;
mod file_name;
pub mod jpeg;
mod labels;
mod limits;
pub mod mif;
pub mod mlvq;
pub mod named;
pub mod npy;
pub mod picture;
mod reader;
mod request;
pub mod rti;
mod samples;
mod spare;
pub mod table;
pub mod text;
pub mod ubo2003;
pub mod utia;
pub mod words;
pub mod zip;

pub use angles::Angles;
pub use assumption::{About, Assumption};
pub use catalogue::{Catalogue, CatalogueErrors, Duplicate, Pair};
pub use container::ContainerKind;
pub use contents::{Contents, Images};
pub use direction::{Direction, azimuth_digits, six_digits};
pub use doubt::Doubt;
pub use error::{Error, ErrorKind, Result};
pub use limits::Limits;
pub use samples::{SampleType, Samples, f16};
pub use spare::Without;

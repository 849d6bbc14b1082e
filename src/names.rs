//! Names of files made of others, byte by byte: names need not be text, and two that differ stay different.

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// The name of a file without the first of these endings that it has, if it has one, and with another one.
pub fn with_ending(path: &Path, endings: &[&str], new: &str) -> OsString {
    let name = path.file_name().unwrap_or_default().as_bytes();
    let stem = endings.iter().find_map(|ending| name.strip_suffix(ending.as_bytes())).unwrap_or(name);
    let mut name = OsStr::from_bytes(stem).to_owned();
    name.push(new);
    name
}

/// Whether the name of a file ends so.
pub fn ends_with(path: &Path, ending: &str) -> bool {
    path.file_name().is_some_and(|name| name.as_bytes().ends_with(ending.as_bytes()))
}

/// A path as reports hold it, which are text: what is no text in it is replaced.
pub(crate) fn serialize_path<S: serde::Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_no_text_keep_their_bytes() {
        let path = |bytes| Path::new(OsStr::from_bytes(bytes));
        let name = |bytes, endings: &[&str]| with_ending(path(bytes), endings, "-1.zarr");
        assert_eq!(name(b"a/w\xff.model.zarr", &[".model.zarr", ".zarr"]).as_bytes(), b"w\xff-1.zarr");
        assert_eq!(name(b"w\xfe.zarr/", &[".model.zarr", ".zarr"]).as_bytes(), b"w\xfe-1.zarr");
        assert_eq!(name(b"w.zip", &[".zarr"]).as_bytes(), b"w.zip-1.zarr");
        assert!(ends_with(path(b"\xff.zarr"), ".zarr") && !ends_with(path(b"\xff"), ".zarr"));
    }
}

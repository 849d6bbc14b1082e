//! What the first directories of a TIFF, or of Exif data, say that need no picture.

use super::directory::{Directory, tag};
use crate::Result;

/// The orientation that the first directory of a TIFF, or of Exif data, asks for; 1 where it says nothing.
pub(in crate::picture) fn orientation(bytes: &[u8]) -> Result<u64> {
    Directory::first(bytes)?.number(tag::ORIENTATION, Some(1))
}

/// The colour space that Exif data state (tag 40961 in the directory that tag 34665 leads to).
pub(in crate::picture) fn colour_space(bytes: &[u8]) -> Result<Option<u64>> {
    let first = Directory::first(bytes)?;
    let Some(offset) = first.list(tag::EXIF_IFD)?.and_then(|list| list.first().copied()) else {
        return Ok(None);
    };
    Ok(first.sibling(offset)?.list(tag::COLOUR_SPACE)?.and_then(|list| list.first().copied()))
}

//! What the first directories of a TIFF, or of Exif data, say that need no picture.

use super::directory::{Directory, tag};
use crate::Result;
use crate::picture::unapplied;

/// The orientation that the first directory of a TIFF, or of Exif data, asks for; 1 where it says nothing.
pub(in crate::picture) fn orientation(bytes: &[u8]) -> Result<u64> {
    Directory::first(bytes)?.number(tag::ORIENTATION, Some(1))
}

/// The colour space that Exif data state (tag 40961 in the directory that tag 34665 leads to).
pub(in crate::picture) fn colour_space(bytes: &[u8]) -> Result<Option<u64>> {
    let Some(below) = below(&Directory::first(bytes)?)? else { return Ok(None) };
    Ok(below.list(tag::COLOUR_SPACE)?.and_then(|list| list.first().copied()))
}

/// The directory of Exif data.
fn below<'a>(first: &Directory<'a>) -> Result<Option<Directory<'a>>> {
    let offset = first.list(tag::EXIF_IFD)?.and_then(|list| list.first().copied());
    offset.map(|offset| first.sibling(offset)).transpose()
}

/// What Exif data say of samples beside the colour space, a sentence each; nothing where they are damaged.
pub(in crate::picture) fn unapplied(bytes: &[u8]) -> Vec<String> {
    let Ok(first) = Directory::first(bytes) else { return Vec::new() };
    let in_first = [
        (tag::TRANSFER_FUNCTION, "TransferFunction"),
        (tag::WHITE_POINT, "WhitePoint"),
        (tag::PRIMARIES, "PrimaryChromaticities"),
    ];
    of_tags(&first, &in_first).into_iter().chain(gamma(&first)).collect()
}

/// The gamma of the Exif data that a directory leads to.
pub(super) fn gamma(first: &Directory<'_>) -> Vec<String> {
    below(first).ok().flatten().map_or_else(Vec::new, |below| of_tags(&below, &[(tag::EXIF_GAMMA, "Gamma")]))
}

/// A sentence on each tag that is there.
pub(super) fn of_tags(directory: &Directory<'_>, tags: &[(u16, &str)]) -> Vec<String> {
    let there = tags.iter().filter(|(tag, _)| directory.bytes_of(*tag).is_some());
    there
        .filter_map(|(tag, name)| unapplied::remark_of(name, &directory.reals(*tag).unwrap_or_default()))
        .collect()
}

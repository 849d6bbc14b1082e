//! Exif data of JPEG and PNG: a block that is a TIFF without a picture (Exif 2.3).

use super::{orientation, profile, tiff};

/// What Exif data in a JPEG begin with.
pub(crate) const MARK: &[u8] = b"Exif\0\0";

/// The block as a TIFF.
fn as_tiff(block: &[u8]) -> Vec<u8> {
    // Where a block stands alone, some writers leave what it begins with in a JPEG.
    let block = block.strip_prefix(MARK).unwrap_or(block);
    // Not every camera writes the offset of a next directory behind the last.
    [block, &[0; 8]].concat()
}

/// The orientation of a block: 1..=8, and 1 where it says nothing usable.
pub(crate) fn orientation(block: &[u8]) -> u8 {
    let found = tiff::exif::orientation(&as_tiff(block)).unwrap_or(1);
    u8::try_from(found).ok().filter(|value| (1..=8).contains(value)).unwrap_or(1)
}

/// A colour space that is none or another than sRGB, as cameras state Adobe RGB.
pub(crate) fn colours(block: &[u8]) -> Option<String> {
    profile::of_exif_space(tiff::exif::colour_space(&as_tiff(block)).ok().flatten())
}

/// What else says something of samples, a sentence each: gamma, white point, primaries, transfer function.
pub(crate) fn unapplied(block: &[u8]) -> Vec<String> {
    tiff::exif::unapplied(&as_tiff(block))
}

/// The orientation in the data of a JPEG's segment for applications: Exif or XMP.
pub(crate) fn orientation_of_segment(segment: &[u8]) -> u8 {
    match (segment.strip_prefix(MARK), segment.strip_prefix(orientation::XMP)) {
        (Some(block), _) => orientation(block),
        (_, Some(packet)) => orientation::of_xmp(packet),
        _ => 1,
    }
}

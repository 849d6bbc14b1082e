//! How a picture asks to be turned before it is shown (TIFF 6.0, tag 274; Exif 2.3; PNG's eXIf; XMP's
//! `tiff:Orientation`).
//!
//! Samples are handed out as stored, whatever is asked for: a camera that looks down writes what its sensor of
//! gravity makes of that, and the lights' directions are of the picture as it was taken. The caller is told.

use super::{tiff, xmp};

/// What XMP in a JPEG begins with.
pub(crate) const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// What Exif data in a JPEG begin with.
pub(crate) const EXIF: &[u8] = b"Exif\0\0";

/// Of a block of Exif data, which is a TIFF without a picture: 1..=8, and 1 where it says nothing usable.
pub(crate) fn of_exif(block: &[u8]) -> u8 {
    // Where a block stands alone, some writers leave what it begins with in a JPEG.
    let block = block.strip_prefix(EXIF).unwrap_or(block);
    // Not every camera writes the offset of a next directory behind the first.
    let found = tiff::orientation(&[block, &[0; 8]].concat()).unwrap_or(1);
    u8::try_from(found).ok().filter(|value| (1..=8).contains(value)).unwrap_or(1)
}

/// Of a packet of XMP, as an attribute or an element; 1 where it says nothing.
pub(crate) fn of_xmp(packet: &[u8]) -> u8 {
    let stated = xmp::values(packet, "http://ns.adobe.com/tiff/1.0/", "tiff", "Orientation");
    let one_digit = |value: &&[u8]| match value {
        [digit @ b'1'..=b'8'] => digit.checked_sub(b'0'),
        _ => None,
    };
    stated.iter().find_map(one_digit).unwrap_or(1)
}

/// Of the data of a JPEG's segment for applications: Exif or XMP.
pub(crate) fn of_segment(segment: &[u8]) -> u8 {
    match (segment.strip_prefix(EXIF), segment.strip_prefix(XMP)) {
        (Some(block), _) => of_exif(block),
        (_, Some(packet)) => of_xmp(packet),
        _ => 1,
    }
}

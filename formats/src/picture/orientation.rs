//! How a picture asks to be turned before it is shown (TIFF 6.0, tag 274; Exif 2.3; PNG's eXIf; XMP's
//! `tiff:Orientation`).
//!
//! Samples are handed out as stored, whatever is asked for: a camera that looks down writes what its sensor of
//! gravity makes of that, and the lights' directions are of the picture as it was taken. The caller is told.

use super::xmp;

/// What XMP in a JPEG begins with.
pub(crate) const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// Of a packet of XMP, as an attribute or an element; 1 where it says nothing.
pub(crate) fn of_xmp(packet: &[u8]) -> u8 {
    let stated = xmp::values(packet, "http://ns.adobe.com/tiff/1.0/", "tiff", "Orientation");
    let one_digit = |value: &&[u8]| match value {
        [digit @ b'1'..=b'8'] => digit.checked_sub(b'0'),
        _ => None,
    };
    stated.iter().find_map(one_digit).unwrap_or(1)
}

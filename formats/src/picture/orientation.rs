//! How a picture asks to be turned before it is shown (TIFF 6.0, tag 274; Exif 2.3; PNG's eXIf; XMP's
//! `tiff:Orientation`).
//!
//! Samples are handed out as stored, whatever is asked for: a camera that looks down writes what its sensor of
//! gravity makes of that, and the lights' directions are of the picture as it was taken. The caller is told.

use super::tiff;

/// What XMP in a JPEG begins with.
pub(crate) const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// What Exif data in a JPEG begin with.
pub(crate) const EXIF: &[u8] = b"Exif\0\0";

/// Of a block of Exif data, which is a TIFF without a picture: 1..=8, and 1 where it says nothing usable.
pub(crate) fn of_exif(block: &[u8]) -> u8 {
    // Not every camera writes the offset of a next directory behind the first.
    let found = tiff::orientation(&[block, &[0; 8]].concat()).unwrap_or(1);
    u8::try_from(found).ok().filter(|value| (1..=8).contains(value)).unwrap_or(1)
}

/// Of a packet of XMP, as an attribute or an element; 1 where it says nothing.
pub(crate) fn of_xmp(packet: &[u8]) -> u8 {
    const NAME: &[u8] = b"tiff:Orientation";
    let value = memchr::memmem::find(packet, NAME).and_then(|at| packet.get(at.checked_add(NAME.len())?..));
    let digit = value.and_then(|rest| rest.iter().find(|byte| !b"=\"'> \t\r\n".contains(byte)));
    digit.and_then(|digit| digit.checked_sub(b'0')).filter(|value| (1..=8).contains(value)).unwrap_or(1)
}

/// Of the data of a JPEG's segment for applications: Exif or XMP.
pub(crate) fn of_segment(segment: &[u8]) -> u8 {
    match (segment.strip_prefix(EXIF), segment.strip_prefix(XMP)) {
        (Some(block), _) => of_exif(block),
        (_, Some(packet)) => of_xmp(packet),
        _ => 1,
    }
}

//! How a picture asks to be turned before it is shown (TIFF 6.0, tag 274; Exif 2.3; PNG's eXIf).
//!
//! Samples are handed out as stored, whatever is asked for: a camera that looks down writes what its sensor of
//! gravity makes of that, and the lights' directions are of the picture as it was taken. The caller is told.

use super::tiff;

/// Of a block of Exif data, which is a TIFF without a picture: 1..=8, and 1 where it says nothing usable.
pub(crate) fn of_exif(block: &[u8]) -> u8 {
    // Not every camera writes the offset of a next directory behind the first.
    let found = tiff::orientation(&[block, &[0; 8]].concat()).unwrap_or(1);
    u8::try_from(found).ok().filter(|value| (1..=8).contains(value)).unwrap_or(1)
}

//! JPEG images: baseline and progressive, 8 bit, grey or three components.
//!
//! Decoders are built to show what they can of a damaged picture; a measurement wants the opposite. So a
//! file is walked marker by marker first and refused unless it ends with an EOI marker, every coefficient of
//! every component was sent to full precision, restart markers are all there, and its scans have enough
//! bytes for the size that the header claims. Only then are pixels decoded, in the decoder's strict mode, and there it
//! is found where data end too early (before a restart marker, a further scan, the end of the picture), and where more
//! than 16 bytes of them are left at the end, as those of rows that the header does not claim.
//!
//! What this cannot see: bytes changed or left out inside a scan that still decode, and data that are left over in an
//! interval that is not the last. A zip's CRC-32 does.

mod decode;
mod encode;
mod frame;
mod huffman;
mod interleave;
mod marker;
mod means;
pub(crate) mod profile;
mod progress;
mod structure;
mod watched;

pub use decode::{Image, decode};
pub use encode::{Chroma, EncodeOptions, encode};

use crate::{Limits, Result};

/// What the frame header of a JPEG says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Columns, 1..=65535.
    pub width: u32,
    /// Rows, 1..=65535.
    pub height: u32,
    /// 1 (grey) or 3 (red, green, blue).
    pub channels: u8,
    /// Progressive, else sequential.
    pub progressive: bool,
    /// The orientation that Exif data before the frame header ask a viewer for, 1..=8; 1 (as stored) where they
    /// say nothing. Samples are handed out as stored.
    pub orientation: u8,
}

/// Reads the header only: nothing after the frame header is looked at, so an image that is cut later passes.
///
/// # Errors
///
/// Like [`decode()`], for what precedes the frame header and for the header itself.
pub fn header(bytes: &[u8], limits: &Limits) -> Result<Header> {
    structure::header(bytes, limits)
}

/// Walks the whole file without decoding a pixel: cheap, and it finds whatever [`decode()`] finds in the
/// structure of the file.
///
/// # Errors
///
/// Like [`decode()`], but for errors in entropy-coded data and in tables.
pub fn check(bytes: &[u8], limits: &Limits) -> Result<Header> {
    structure::walk(bytes, limits).map(|walked| walked.header)
}

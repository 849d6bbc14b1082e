//! Zip archives: stored and deflated entries, Zip64, no encryption.
//!
//! A reader must not trust a zip. [`ZipIndex::open`] refuses, with a reason, whatever could make two
//! programs see two different archives or make one write outside its folder; [`ZipIndex::read`] never
//! returns bytes whose size and CRC-32 do not match the directory.

mod cp437;
mod index;
mod name;
mod writer;

pub use index::{Method, ZipEntry, ZipIndex};
pub use writer::ZipWriter;

pub(crate) use name::unsafe_reason;

use crate::{Error, ErrorKind};

/// CRC-32 (IEEE 802.3) as zip uses it.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// What the zip parser says, in this crate's words.
fn translate(error: rawzip::Error, expected: &'static str) -> Error {
    let offset = error.eocd_offset();
    let translated = match error.into_kind() {
        rawzip::ErrorKind::IO(io) => Error::io("writing the archive", io),
        rawzip::ErrorKind::InvalidInput { msg } => Error::new(ErrorKind::Argument, msg, expected),
        other => Error::malformed(rawzip::Error::from(other).to_string(), expected),
    };
    match offset {
        Some(offset) => translated.at(offset),
        None => translated,
    }
}

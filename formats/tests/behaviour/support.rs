//! Pictures, and zips that no honest writer makes.

use std::io::Write;

use btfkit_formats::jpeg::{Chroma, EncodeOptions, encode};

/// A smooth picture with a little structure, `height * width * channels` samples.
pub(crate) fn picture(width: u32, height: u32, channels: u8) -> Vec<u8> {
    let mut samples = Vec::new();
    for y in 0..height {
        for x in 0..width {
            for c in 0..u32::from(channels) {
                let (x, y, c) = (f64::from(x), f64::from(y), f64::from(c));
                let value = 128.0 + 60.0 * (0.11 * x + 0.7 * c).sin() + 50.0 * (0.07 * y - 0.4 * c).cos();
                samples.push(value.round() as u8);
            }
        }
    }
    samples
}

pub(crate) fn options(quality: u8, progressive: bool, chroma: Chroma) -> EncodeOptions {
    EncodeOptions { quality, progressive, chroma }
}

/// A JPEG of [`picture`].
pub(crate) fn jpeg_of(width: u32, height: u32, channels: u8, options: &EncodeOptions) -> Vec<u8> {
    encode(&picture(width, height, channels), width, height, channels, options).unwrap()
}

pub(crate) fn deflate(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

pub(crate) fn crc32(data: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(data);
    crc.sum()
}

/// One entry of a [`raw_zip`]; every field goes into both headers as it is.
#[derive(Clone)]
pub(crate) struct RawEntry {
    pub(crate) name: Vec<u8>,
    pub(crate) flags: u16,
    pub(crate) method: u16,
    pub(crate) crc32: u32,
    pub(crate) uncompressed: u64,
    pub(crate) data: Vec<u8>,
    /// Sizes in a Zip64 extra field.
    pub(crate) zip64: bool,
    /// Other extra fields.
    pub(crate) more: Vec<u8>,
}

impl RawEntry {
    pub(crate) fn stored(name: &str, data: &[u8]) -> RawEntry {
        RawEntry {
            name: name.as_bytes().to_vec(),
            flags: 0,
            method: 0,
            crc32: crc32(data),
            uncompressed: data.len() as u64,
            data: data.to_vec(),
            zip64: false,
            more: Vec::new(),
        }
    }

    pub(crate) fn deflated(name: &str, data: &[u8]) -> RawEntry {
        RawEntry { method: 8, data: deflate(data), ..RawEntry::stored(name, data) }
    }

    /// Flags to sizes: the part that both headers have in common.
    fn common(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(self.flags.to_le_bytes());
        out.extend(self.method.to_le_bytes());
        out.extend([0, 0, 0x21, 0]);
        out.extend(self.crc32.to_le_bytes());
        let size = |size: u64| if self.zip64 { u32::MAX } else { u32::try_from(size).unwrap() };
        out.extend(size(self.data.len() as u64).to_le_bytes());
        out.extend(size(self.uncompressed).to_le_bytes());
        out
    }

    fn extra(&self) -> Vec<u8> {
        let mut out = self.more.clone();
        if self.zip64 {
            out.extend([1, 0, 16, 0]);
            out.extend(self.uncompressed.to_le_bytes());
            out.extend((self.data.len() as u64).to_le_bytes());
        }
        out
    }
}

/// A zip written field by field, independently of the writer under test.
pub(crate) fn raw_zip(entries: &[RawEntry]) -> Vec<u8> {
    raw_zip_declaring(entries, entries.len() as u16)
}

/// The same with another number of entries in its end record.
pub(crate) fn raw_zip_declaring(entries: &[RawEntry], declared: u16) -> Vec<u8> {
    let mut out = Vec::new();
    let mut directory = Vec::new();
    for entry in entries {
        let offset = out.len() as u32;
        let (name_len, extra_len) = (entry.name.len() as u16, entry.extra().len() as u16);
        out.extend(*b"PK\x03\x04\x2d\x00");
        out.extend(entry.common());
        out.extend(name_len.to_le_bytes());
        out.extend(extra_len.to_le_bytes());
        out.extend(&entry.name);
        out.extend(entry.extra());
        out.extend(&entry.data);
        directory.extend(*b"PK\x01\x02\x2d\x00\x2d\x00");
        directory.extend(entry.common());
        directory.extend(name_len.to_le_bytes());
        directory.extend(extra_len.to_le_bytes());
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(&entry.name);
        directory.extend(entry.extra());
    }
    let (start, size) = (out.len() as u32, directory.len() as u32);
    out.extend(directory);
    out.extend(*b"PK\x05\x06\0\0\0\0");
    out.extend(declared.to_le_bytes());
    out.extend(declared.to_le_bytes());
    out.extend(size.to_le_bytes());
    out.extend(start.to_le_bytes());
    out.extend([0, 0]);
    out
}

//! Every cut and every flipped bit: no panic, no allocation that the bytes have not earned.

use btfkit_formats::jpeg::{Chroma, check, decode};
use btfkit_formats::zip::{Method, ZipIndex, ZipWriter};
use btfkit_formats::{ErrorKind, Limits};

use crate::support::{RawEntry, jpeg_of, options, raw_zip};

/// A block of 64 pixels takes at least one bit, and a pixel has at most three samples.
const MAX_SAMPLES_PER_BYTE: usize = 8 * 64 * 3;

/// Small JPEGs of every flavour that the encoder writes.
fn jpegs() -> Vec<(String, Vec<u8>)> {
    let mut list = Vec::new();
    for (width, height) in [(17, 11), (16, 16)] {
        for channels in [1u8, 3] {
            for progressive in [false, true] {
                for chroma in [Chroma::Full, Chroma::Half] {
                    let name = format!("{width} x {height} x {channels}, {progressive}, {chroma:?}");
                    list.push((name, jpeg_of(width, height, channels, &options(60, progressive, chroma))));
                }
            }
        }
    }
    list
}

/// Two JPEGs, one stored and one deflated.
fn small_zip() -> Vec<u8> {
    let stored = jpeg_of(9, 9, 3, &options(50, true, Chroma::Half));
    let deflated = jpeg_of(8, 8, 1, &options(50, false, Chroma::Full));
    raw_zip(&[
        RawEntry::stored("00000 tl000 pl000 tv000 pv000.jpg", &stored),
        RawEntry::deflated("00001 tl015 pl000 tv000 pv000.jpg", &deflated),
    ])
}

/// Reads everything that can be read; the number of entries that decoded.
fn read_all(zip: &[u8]) -> usize {
    let limits = Limits::default();
    let Ok(index) = ZipIndex::open(zip, &limits) else { return 0 };
    let images = (0..index.entries().len()).filter_map(|i| {
        let bytes = index.read(zip, i).ok()?;
        let image = decode(&bytes, &limits).ok()?;
        assert!(image.samples.len() <= MAX_SAMPLES_PER_BYTE * bytes.len());
        Some(())
    });
    images.count()
}

#[test]
fn a_jpeg_cut_anywhere_is_an_error() {
    for (name, whole) in jpegs() {
        assert!(decode(&whole, &Limits::default()).is_ok(), "{name}");
        for end in 0..whole.len() {
            let error = decode(&whole[..end], &Limits::default()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed, "{name}, {end} of {}: {error}", whole.len());
            assert!(check(&whole[..end], &Limits::default()).is_err(), "{name}, {end}");
        }
    }
}

#[test]
fn a_jpeg_cut_and_padded_with_zeros_is_an_error() {
    for (name, whole) in jpegs() {
        for end in 0..whole.len() {
            let mut padded = whole.clone();
            padded[end..].fill(0);
            assert!(decode(&padded, &Limits::default()).is_err(), "{name}, {end} of {}", whole.len());
        }
    }
}

#[test]
fn a_zip_cut_anywhere_is_an_error() {
    let mut writer = ZipWriter::new(Vec::new());
    writer.write_entry("a/b.txt", b"hello").unwrap();
    writer.write_entry("c", &[0; 50]).unwrap();
    for whole in [small_zip(), writer.finish().unwrap()] {
        assert!(ZipIndex::open(&whole, &Limits::default()).is_ok());
        for end in 0..whole.len() {
            let error = ZipIndex::open(&whole[..end], &Limits::default()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed, "{end} of {}: {error}", whole.len());
        }
    }
}

#[test]
fn a_flipped_bit_in_a_zip_never_panics() {
    let whole = small_zip();
    assert_eq!(read_all(&whole), 2);
    let mut harmless = 0;
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        harmless += usize::from(read_all(&flipped) == 2);
    }
    // Times, versions and attributes mean nothing to this reader; every bit of the two images does.
    assert!(harmless < 8 * 200, "{harmless} of {} flips went unnoticed", whole.len() * 8);
}

#[test]
fn a_flipped_bit_in_the_data_of_an_entry_is_always_noticed() {
    let whole = small_zip();
    let index = ZipIndex::open(&whole, &Limits::default()).unwrap();
    for (i, entry) in index.entries().iter().enumerate() {
        for byte in entry.compressed_range() {
            for bit in 0..8 {
                let mut flipped = whole.clone();
                flipped[byte] ^= 1 << bit;
                // Bits after the end of a deflate stream, in its last byte, carry nothing.
                let same = index.read(&flipped, i).is_ok_and(|data| *data == *index.read(&whole, i).unwrap());
                let padding = entry.method() == Method::Deflated && byte + 1 == entry.compressed_range().end;
                assert!(index.read(&flipped, i).is_err() || (same && padding), "{i}, byte {byte}, bit {bit}");
            }
        }
    }
}

#[test]
fn a_flipped_bit_in_a_bare_jpeg_never_panics() {
    for (_, whole) in jpegs() {
        for bit in 0..whole.len() * 8 {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            if let Ok(image) = decode(&flipped, &Limits::default()) {
                assert!(image.samples.len() <= MAX_SAMPLES_PER_BYTE * flipped.len());
            }
        }
    }
}

//! Pictures cut, bent and lying about themselves.

use btfkit_formats::picture::{check, decode, header};
use btfkit_formats::{Angles, Catalogue, ErrorKind, Limits, Pair, Samples, table};

use crate::picture_files::{
    HdrCoding, Png, RGBE, Tiff, all, exr_by_crate, exr_picture, hdr_of, png_chunk, png_ihdr, png_of, pngs,
    rgbe,
};

fn flipped(whole: &[u8], bit: usize) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    bytes[bit / 8] ^= 1 << (bit % 8);
    bytes
}

/// Small limits, so that the loops do not spend their time on pictures that a flipped bit made large.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_pixels_per_image = 1 << 16;
    limits
}

#[test]
fn a_whole_picture_passes_all_three() {
    for (name, whole) in all() {
        let picture = decode(&whole, &limits()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let checked = check(&whole, &limits()).unwrap();
        assert_eq!(checked, header(&whole, &limits()).unwrap(), "{name}");
        assert_eq!((checked.width, checked.height), (picture.width, picture.height), "{name}");
        assert_eq!(checked.channels, picture.channels, "{name}");
        assert_eq!(checked.sample_type, picture.samples.sample_type(), "{name}");
        let samples = picture.width as usize * picture.height as usize * picture.channels.len();
        assert_eq!(picture.samples.len(), samples, "{name}");
    }
}

#[test]
fn a_picture_cut_anywhere_is_an_error() {
    for (name, whole) in all() {
        for end in 0..whole.len() {
            let cut = &whole[..end];
            assert!(decode(cut, &limits()).is_err(), "{name}, decoded at {end} of {}", whole.len());
            assert!(check(cut, &limits()).is_err(), "{name}, passed at {end} of {}", whole.len());
        }
    }
}

#[test]
fn a_flipped_bit_never_panics_and_what_decodes_is_whole() {
    for (name, whole) in all() {
        for bit in 0..whole.len() * 8 {
            let bytes = flipped(&whole, bit);
            let Ok(picture) = decode(&bytes, &limits()) else { continue };
            let samples = picture.width as usize * picture.height as usize * picture.channels.len();
            assert_eq!(picture.samples.len(), samples, "{name}, bit {bit}");
            let checked =
                check(&bytes, &limits()).unwrap_or_else(|e| panic!("{name}, bit {bit}, decoded but: {e}"));
            assert_eq!(checked.channels, picture.channels, "{name}, bit {bit}");
        }
    }
}

#[test]
fn every_flipped_bit_of_a_png_is_noticed_without_decoding() {
    for (name, whole) in pngs() {
        for bit in 0..whole.len() * 8 {
            assert!(check(&flipped(&whole, bit), &limits()).is_err(), "{name}, bit {bit}");
        }
    }
}

/// The data of a ZIP-compressed OpenEXR file carry a checksum.
#[test]
fn every_flipped_bit_of_a_deflated_exr_chunk_is_noticed() {
    let picture = exr_picture(40, 16, &["Y"], true);
    let whole = exr_by_crate(&picture, exr::prelude::Compression::ZIP16, None);
    let wanted = decode(&whole, &limits()).unwrap();
    let start = whole.len() - 50;
    for bit in start * 8..whole.len() * 8 {
        let read = decode(&flipped(&whole, bit), &limits());
        assert!(read.is_err() || read.is_ok_and(|p| p == wanted), "bit {bit} of {}", whole.len() * 8);
    }
}

#[track_caller]
fn refuse(bytes: &[u8], kind: ErrorKind, words: &str) {
    let error = decode(bytes, &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), kind, "{error}");
    assert!(error.to_string().contains(words), "{error}");
    assert_eq!(check(bytes, &Limits::default()).unwrap_err().kind(), kind);
}

#[test]
fn a_header_of_absurd_size_is_refused_by_every_format() {
    let size = 1u32 << 31;
    for (width, height) in [(size - 1, size - 1), (size - 1, 1), (1, size - 1)] {
        let png = png_of(&[png_ihdr(width, height, 16, 6, false), png_chunk(b"IDAT", b"")]);
        refuse(&png, ErrorKind::Limit, "max_pixels_per_image");

        let mut tiff = Tiff::new((width as usize, height as usize, 3), 16, 1, 1);
        tiff.chunks.push(vec![0; 12]);
        refuse(&tiff.bytes(), ErrorKind::Limit, "max_pixels_per_image");
        tiff.big = true;
        refuse(&tiff.bytes(), ErrorKind::Limit, "max_pixels_per_image");

        let resolution = format!("-Y {height} +X {width}");
        let hdr = hdr_of(RGBE, &resolution, &rgbe(8), 8, HdrCoding::Components);
        refuse(&hdr, ErrorKind::Limit, "max_pixels_per_image");

        let exr = resized_exr(width as i32 - 1, height as i32 - 1);
        refuse(&exr, ErrorKind::Limit, "max_pixels_per_image");
    }
}

#[test]
fn a_size_that_the_limits_allow_but_the_bytes_do_not_is_refused() {
    let png = Png { width: 4, height: 4, ..Png::new(1, 1, 8, 0, false) };
    let lying = png_of(&[png_ihdr(8000, 8000, 8, 0, false), png_chunk(b"IDAT", &deflated(&[0; 20]))]);
    assert_eq!(png.samples.len(), 1);
    assert!(decode(&lying, &Limits::default()).unwrap_err().to_string().contains("pixel data"));

    let mut tiff = Tiff::new((8000, 8000, 1), 8, 1, 8000);
    tiff.chunks.push(vec![0; 100]);
    refuse(&tiff.bytes(), ErrorKind::Malformed, "enough for 64000000 bytes");
    refuse(&tiff.set(259, &[8]).bytes(), ErrorKind::Malformed, "enough for 64000000 bytes");

    let hdr = hdr_of(RGBE, "-Y 8000 +X 8000", &rgbe(16), 8, HdrCoding::Flat);
    refuse(&hdr, ErrorKind::Malformed, "end of the data");

    refuse(&resized_exr(7999, 7999), ErrorKind::Malformed, "a table of");
    refuse(&resized_exr(7999, 8), ErrorKind::Malformed, "a length from which");
}

#[test]
fn too_many_channels_are_refused() {
    let names: Vec<String> = (0..6).map(|n| format!("{}nm", 400 + n)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let exr = exr_by_crate(&exr_picture(3, 3, &names, true), exr::prelude::Compression::RLE, None);
    let mut few = Limits::default();
    few.max_channels = 5;
    let error = decode(&exr, &few).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");

    let mut little = Limits::default();
    little.max_decoded_bytes = 3 * 3 * 6 * 2 - 1;
    assert_eq!(decode(&exr, &little).unwrap_err().kind(), ErrorKind::Limit);
    little.max_decoded_bytes += 1;
    assert!(decode(&exr, &little).is_ok());
}

fn deflated(data: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn a_png_that_inflates_to_more_or_less_than_its_pixels_is_refused() {
    let png = Png::new(9, 5, 8, 2, false);
    let raw = png.filtered();
    let bomb = png.bytes_with_data(&deflated(&[raw.clone(), vec![0; 50_000_000]].concat()));
    assert!(bomb.len() < 100_000);
    let say = |bytes: &[u8]| decode(bytes, &Limits::default()).unwrap_err().to_string();
    assert!(say(&bomb).contains("more pixel data"), "{}", say(&bomb));
    let one_more = png.bytes_with_data(&deflated(&[raw.clone(), vec![0]].concat()));
    assert!(say(&one_more).contains("more pixel data"));
    let one_less = png.bytes_with_data(&deflated(&raw[..raw.len() - 1]));
    assert!(say(&one_less).contains("bytes of pixel data"));
}

#[test]
fn a_png_with_a_wrong_checksum_of_its_pixels_or_bytes_after_them_is_refused() {
    let png = Png::new(9, 5, 8, 2, false);
    let good = deflated(&png.filtered());
    let mut bad = good.clone();
    *bad.last_mut().unwrap() ^= 1;
    assert!(decode(&png.bytes_with_data(&good), &Limits::default()).is_ok());
    let error = decode(&png.bytes_with_data(&bad), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("do not inflate"), "{error}");
    let longer = [good, vec![0; 3]].concat();
    assert!(decode(&png.bytes_with_data(&longer), &Limits::default()).is_err());
}

fn small_tiff() -> Tiff {
    let tiff = Tiff::new((4, 4, 1), 8, 1, 2);
    let samples = crate::picture_files::tiff_samples(&tiff, 16, "u8");
    tiff.with_strips(&samples, 2, false)
}

#[test]
fn a_tiff_that_lies_about_its_strips_is_refused() {
    let good = small_tiff();
    let len = good.bytes().len() as u64;
    assert!(decode(&good.bytes(), &Limits::default()).is_ok());
    let with = |tag: u16, values: &[u64]| good.clone().set(tag, values).bytes();
    refuse(&with(273, &[len - 8, len]), ErrorKind::Malformed, "within the");
    refuse(&with(273, &[u64::from(u32::MAX), 8]), ErrorKind::Malformed, "within the");
    refuse(&with(279, &[8, 1 << 31]), ErrorKind::Malformed, "within the");
    refuse(&with(279, &[8, 7]), ErrorKind::Malformed, "enough for 8 bytes");
    refuse(&with(279, &[8, 8, 8]), ErrorKind::Malformed, "as many");
    refuse(&with(273, &[8, 8]), ErrorKind::Malformed, "overlap");
    refuse(&with(278, &[1]), ErrorKind::Malformed, "4 for 4 x 4");
    refuse(&with(278, &[0]), ErrorKind::Malformed, "no side of 0");
    refuse(&with(277, &[65535]), ErrorKind::Limit, "max_channels");
}

#[test]
fn a_tiff_strip_that_unpacks_to_more_or_less_or_wrongly_is_refused() {
    let raw: Vec<u8> = (0..16).collect();
    let with = |compression: u64, strip: &[u8]| {
        let mut tiff = Tiff::new((4, 4, 1), 8, 1, 4);
        tiff.chunks.push(strip.to_vec());
        decode(&tiff.set(259, &[compression]).bytes(), &Limits::default())
    };
    let refused = |compression, strip: &[u8], words: &str| {
        let error = with(compression, strip).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed);
        assert!(error.to_string().contains(words), "{error}");
    };
    let good = deflated(&raw);
    assert_eq!(with(8, &good).unwrap().samples, Samples::U8(raw.clone()));
    refused(8, &deflated(&raw[..15]), "15 bytes unpacked");
    refused(8, &deflated(&[raw.as_slice(), &[0; 1000]].concat()), "17 bytes unpacked");
    let mut wrong = good.clone();
    *wrong.last_mut().unwrap() ^= 1;
    refused(8, &wrong, "do not inflate");
    refused(8, &good[..good.len() - 3], "do not inflate");

    let packed = [[7u8].as_slice(), &raw[..8], &[128, 7], &raw[8..]].concat();
    assert_eq!(with(32773, &packed).unwrap().samples, Samples::U8(raw.clone()));
    refused(32773, &packed[..packed.len() - 1], "end of the data");
    refused(32773, &[241 - 1, 5], "17 bytes unpacked");
    assert_eq!(with(32773, &[241, 5]).unwrap().samples, Samples::U8(vec![5; 16]));

    // Clear, 16 codes of 9 bits, end; then without its last bytes, and with its bits in the other order.
    let codes = std::iter::once(256).chain(0..16).chain([257]);
    let bits: Vec<u8> =
        codes.flat_map(|code: u16| (0..9).rev().map(move |bit| (code >> bit & 1) as u8)).collect();
    let byte = |bits: &[u8]| bits.iter().enumerate().fold(0, |sum, (i, bit)| sum | bit << (7 - i));
    let lzw: Vec<u8> = bits.chunks(8).map(byte).collect();
    assert_eq!(with(5, &lzw).unwrap().samples, Samples::U8(raw));
    refused(5, &lzw[..12], "bytes unpacked");
    refused(5, &[&[0, 1], &lzw[2..]].concat(), "clear code");
}

#[test]
fn a_tiff_whose_directories_form_a_loop_or_are_nowhere_is_refused() {
    let mut looped = small_tiff();
    looped.next = 8;
    refuse(&looped.bytes(), ErrorKind::Malformed, "in a ring");
    looped.big = true;
    looped.next = 16;
    refuse(&looped.bytes(), ErrorKind::Malformed, "in a ring");

    for little_endian in [true, false] {
        let mut tiff = small_tiff();
        tiff.little_endian = little_endian;
        let mut away = tiff.bytes();
        away[4..8].copy_from_slice(&[0x7F; 4]);
        refuse(&away, ErrorKind::Malformed, "end of the data");
    }
    // 65535 entries, and as many as 2^64 can hold.
    let mut many = small_tiff().bytes();
    many[8..10].copy_from_slice(&[0xFF; 2]);
    refuse(&many, ErrorKind::Malformed, "end of the data");
    let mut tiff = small_tiff();
    tiff.big = true;
    let mut many = tiff.bytes();
    many[16..24].copy_from_slice(&[0xFF; 8]);
    refuse(&many, ErrorKind::Malformed, "end of the data");
}

#[test]
fn a_tiff_with_tiles_larger_than_the_world_is_refused() {
    let mut tiff = Tiff::new((4, 4, 1), 8, 1, 2);
    tiff.tags.retain(|(tag, _)| *tag != 278);
    tiff.chunks.push(vec![0; 16]);
    tiff.set(322, &[1 << 31]).set(323, &[1 << 31]);
    refuse(&tiff.bytes(), ErrorKind::Limit, "max_pixels_per_image");
    tiff.set(322, &[4096]).set(323, &[4096]);
    refuse(&tiff.bytes(), ErrorKind::Malformed, "enough for 16777216 bytes");
}

/// A valid little picture whose data window is moved to `[0, right] x [0, bottom]`.
fn resized_exr(right: i32, bottom: i32) -> Vec<u8> {
    let mut bytes = exr_by_crate(&exr_picture(9, 9, &["Y"], true), exr::prelude::Compression::ZIP16, None);
    let chunks_at = attribute(&bytes, b"chunkCount\0int\0");
    let stated = (bottom / 16 + 1).to_le_bytes();
    bytes[chunks_at..chunks_at + 4].copy_from_slice(&stated);
    let window = attribute(&bytes, b"dataWindow\0box2i\0");
    bytes[window + 8..window + 12].copy_from_slice(&right.to_le_bytes());
    bytes[window + 12..window + 16].copy_from_slice(&bottom.to_le_bytes());
    bytes
}

/// Where the value of an attribute starts.
fn attribute(bytes: &[u8], name_and_type: &[u8]) -> usize {
    let at = bytes.windows(name_and_type.len()).position(|window| window == name_and_type).unwrap();
    at + name_and_type.len() + 4
}

#[test]
fn an_exr_with_an_absurd_chunk_table_is_refused() {
    let whole = exr_by_crate(&exr_picture(9, 40, &["Y"], true), exr::prelude::Compression::ZIP16, None);
    assert!(decode(&whole, &Limits::default()).is_ok());
    // Three chunks: the table is the only place with three offsets, of the lines 0, 16 and 32.
    let leads_to = |at: usize, line: i32| {
        let offset = u64::from_le_bytes(whole[at..at + 8].try_into().unwrap());
        usize::try_from(offset).is_ok_and(|o| whole.get(o..o.wrapping_add(4)) == Some(&line.to_le_bytes()))
    };
    let is_table = |&at: &usize| leads_to(at, 0) && leads_to(at + 8, 16) && leads_to(at + 16, 32);
    let table = (0..whole.len() - 24).find(is_table).unwrap();
    let with = |entry: usize, offset: u64| {
        let mut bytes = whole.clone();
        bytes[table + entry * 8..table + entry * 8 + 8].copy_from_slice(&offset.to_le_bytes());
        bytes
    };
    let second = u64::from_le_bytes(whole[table + 8..table + 16].try_into().unwrap());
    for offset in [0, u64::MAX, whole.len() as u64, 1 << 40, table as u64, second] {
        assert_eq!(
            decode(&with(0, offset), &Limits::default()).unwrap_err().kind(),
            ErrorKind::Malformed,
            "{offset}"
        );
    }
    refuse(&with(0, u64::MAX), ErrorKind::Malformed, "the offset");
    refuse(&with(0, second), ErrorKind::Malformed, "a chunk at [16]");

    let mut stated = whole.clone();
    let at = attribute(&whole, b"chunkCount\0int\0");
    stated[at..at + 4].copy_from_slice(&i32::MAX.to_le_bytes());
    refuse(&stated, ErrorKind::Malformed, "2147483647 chunks");
}

#[test]
fn tiles_of_one_pixel_of_a_huge_exr_are_refused_before_they_are_counted_out() {
    let mut bytes =
        exr_by_crate(&exr_picture(9, 9, &["Y"], true), exr::prelude::Compression::RLE, Some((8, 8)));
    let tiles = attribute(&bytes, b"tiles\0tiledesc\0");
    bytes[tiles..tiles + 8].copy_from_slice(&[1, 0, 0, 0, 1, 0, 0, 0]);
    let window = attribute(&bytes, b"dataWindow\0box2i\0");
    for corner in [8, 12] {
        bytes[window + corner..window + corner + 4].copy_from_slice(&7999i32.to_le_bytes());
    }
    let chunks_at = attribute(&bytes, b"chunkCount\0int\0");
    bytes[chunks_at..chunks_at + 4].copy_from_slice(&64_000_000i32.to_le_bytes());
    refuse(&bytes, ErrorKind::Malformed, "a table of 64000000 offsets");
}

#[test]
fn counters_of_a_dwa_chunk_reserve_no_memory() {
    let picture = exr_picture(40, 40, &["B", "G", "R", "depth"], true);
    let whole = exr_by_crate(&picture, exr::prelude::Compression::DWAA(None), None);
    let good = decode(&whole, &Limits::default()).unwrap();
    assert!(matches!(good.samples, Samples::F16(_)));
    // Version 2, then the counters of one chunk.
    let start = whole.windows(8).position(|w| w == 2u64.to_le_bytes()).unwrap();
    let mut noticed = 0;
    for counter in 1..10 {
        for value in [u64::MAX >> 1, 1 << 62, 1 << 40, 1 << 32] {
            let mut bytes = whole.clone();
            bytes[start + counter * 8..start + counter * 8 + 8].copy_from_slice(&value.to_le_bytes());
            noticed += usize::from(decode(&bytes, &Limits::default()).is_err());
        }
    }
    assert_eq!(noticed, 36);
}

/// The decompressor calculates without a check for it.
#[test]
fn a_b44_block_that_leads_below_the_least_half_is_refused() {
    let picture = exr_picture(4, 4, &["Y"], true);
    let whole = exr_by_crate(&picture, exr::prelude::Compression::B44, None);
    assert!(decode(&whole, &Limits::default()).is_ok());
    // The only chunk is one block of 14 bytes: no first sample, no shift, and differences of -32.
    let start = whole.len() - 14;
    let mut low = whole.clone();
    low[start..].fill(0);
    refuse_only_when_decoded(&low, "least half");
    // Differences of none.
    let none = (0..15).fold(0u128, |bits, _| bits << 6 | 32);
    low[start..].copy_from_slice(&none.to_be_bytes()[2..]);
    let Samples::F16(read) = decode(&low, &Limits::default()).unwrap().samples else { unreachable!() };
    assert!(read.iter().all(|sample| sample.to_bits() == !0));
}

#[track_caller]
fn refuse_only_when_decoded(bytes: &[u8], words: &str) {
    assert!(check(bytes, &Limits::default()).is_ok());
    let error = decode(bytes, &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Malformed);
    assert!(error.to_string().contains(words), "{error}");
}

#[test]
fn one_of_a_thing_is_singular_in_every_message() {
    let wrong = |text: &str| {
        let words: Vec<&str> = text.split_whitespace().collect();
        let is_plural =
            |word: &str| word.trim_end_matches(|c: char| !c.is_alphabetic()).ends_with('s') && word != "is";
        words.windows(2).any(|pair| pair[0] == "1" && is_plural(pair[1]))
    };
    assert!(wrong("found 1 bytes, expected 2") && !wrong("found 1 byte, expected 11 bytes"));
    for (name, bytes) in all() {
        for end in 0..bytes.len() {
            if let Err(error) = check(&bytes[..end], &Limits::default()) {
                assert!(!wrong(&error.to_string()), "{name} cut to {end}: {error}");
            }
        }
        for more in 1..3 {
            if let Err(error) = check(&[&bytes[..], &vec![1; more]].concat(), &Limits::default()) {
                assert!(!wrong(&error.to_string()), "{name} with {more} more: {error}");
            }
        }
    }
    let pair = |theta| Pair { view: Angles::FRONTAL, light: Angles::new(theta, 0.0).unwrap() };
    for files in [vec![("a", None)], vec![("a", Some(pair(1.0))), ("b", Some(pair(1.0)))]] {
        let error = Catalogue::from_pairs(files).unwrap_err().to_string();
        assert!(!wrong(&error), "{error}");
    }
    for text in ["file,theta_i,phi_i\na,1\n", "file\n", "file,theta_i,phi_i\na,1,2,3\n"] {
        let error = table::read(text.as_bytes(), &Limits::default()).unwrap_err().to_string();
        assert!(!wrong(&error), "{error}");
    }
}

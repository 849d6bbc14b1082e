//! JPEGs that are whole decode to what was encoded; others are refused.

use btfkit_formats::jpeg::{Chroma, EncodeOptions, check, decode, encode, header};
use btfkit_formats::{Error, ErrorKind, Limits};

use crate::support::{jpeg_of, options, picture};

const SIZES: [(u32, u32); 8] = [(1, 1), (8, 8), (16, 16), (17, 9), (7, 100), (100, 7), (33, 31), (64, 48)];

fn refusal(bytes: &[u8]) -> Error {
    let error = decode(bytes, &Limits::default()).unwrap_err();
    let from_check = check(bytes, &Limits::default());
    assert!(from_check.is_err(), "check() must see it too: {error}");
    error
}

/// Byte position just after the marker `ff code`, counted from the `nth`.
fn after_marker(bytes: &[u8], code: u8, nth: usize) -> usize {
    let mut found = bytes.windows(2).enumerate().filter(|(_, pair)| *pair == [0xFF, code]);
    found.nth(nth).unwrap().0 + 2
}

#[test]
fn every_flavour_and_size_round_trips() {
    for (width, height) in SIZES {
        for channels in [1u8, 3] {
            let samples = picture(width, height, channels);
            for progressive in [false, true] {
                for chroma in [Chroma::Full, Chroma::Half] {
                    let what = format!("{width} x {height} x {channels}, {progressive}, {chroma:?}");
                    let bytes = encode(&samples, width, height, channels, &options(100, progressive, chroma))
                        .unwrap();
                    let head = header(&bytes, &Limits::default()).unwrap();
                    assert_eq!((head.width, head.height, head.channels), (width, height, channels), "{what}");
                    assert_eq!(head.progressive, progressive, "{what}");
                    assert_eq!(check(&bytes, &Limits::default()).unwrap(), head, "{what}");
                    let image = decode(&bytes, &Limits::default()).unwrap();
                    assert_eq!(
                        (image.width, image.height, image.channels),
                        (width, height, channels),
                        "{what}"
                    );
                    assert_eq!(image.samples.len(), samples.len(), "{what}");
                    // Rounding to YCbCr and back, and of the transform; then what half chroma loses of this picture.
                    let bound = if chroma == Chroma::Half && channels == 3 { 6 } else { 4 };
                    let worst =
                        image.samples.iter().zip(&samples).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
                    assert!(worst <= bound, "{what}: off by {worst}");
                }
            }
        }
    }
}

#[test]
fn long_rows_and_columns_decode() {
    for (width, height) in [(65_535, 1), (1, 65_535)] {
        let bytes = jpeg_of(width, height, 1, &options(90, true, Chroma::Full));
        let image = decode(&bytes, &Limits::default()).unwrap();
        assert_eq!((image.width, image.height), (width, height));
    }
}

#[test]
fn half_chroma_is_the_mean_of_its_pixels() {
    let samples = [[200u8, 100, 100], [100, 100, 200]].concat().repeat(32 * 16);
    let bytes = encode(&samples, 32, 32, 3, &EncodeOptions::UBO2003).unwrap();
    let image = decode(&bytes, &Limits::default()).unwrap();
    for channel in [0, 2] {
        let sum: u32 = image.samples.iter().skip(channel).step_by(3).map(|&s| u32::from(s)).sum();
        assert!((149.0..151.0).contains(&(f64::from(sum) / 1024.0)), "channel {channel}: {sum}");
    }
}

#[test]
fn encoding_is_reproducible() {
    let samples = picture(40, 30, 3);
    let once = encode(&samples, 40, 30, 3, &EncodeOptions::UBO2003).unwrap();
    assert_eq!(once, encode(&samples, 40, 30, 3, &EncodeOptions::UBO2003).unwrap());
}

#[test]
fn the_ubo2003_flavour_has_steps_of_one_and_half_chroma() {
    let bytes = jpeg_of(32, 32, 3, &EncodeOptions::UBO2003);
    let table = after_marker(&bytes, 0xDB, 0) + 3;
    assert_eq!(bytes[table..table + 64], [1; 64]);
    let frame = after_marker(&bytes, 0xC2, 0);
    let factors: Vec<u8> = (0..3).map(|c| bytes[frame + 9 + 3 * c]).collect();
    assert_eq!(factors, [0x22, 0x11, 0x11]);
}

#[test]
fn arguments_that_cannot_be_encoded_are_refused() {
    let samples = picture(10, 10, 3);
    let ok = options(90, true, Chroma::Half);
    for (n, width, height, channels, quality) in [
        (300, 0, 10, 3, 90),
        (300, 10, 65_536, 3, 90),
        (300, 10, 10, 2, 90),
        (300, 10, 10, 3, 0),
        (300, 10, 10, 3, 101),
        (299, 10, 10, 3, 90),
        (300, 10, 10, 1, 90),
    ] {
        let error =
            encode(&samples[..n], width, height, channels, &EncodeOptions { quality, ..ok }).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Argument, "{error}");
    }
}

#[test]
fn a_scan_that_is_cut_is_noticed_even_if_the_end_marker_is_there() {
    for (channels, options, scans) in [
        (1, options(90, false, Chroma::Full), 1),
        (3, options(90, false, Chroma::Half), 1),
        (3, options(100, false, Chroma::Full), 1),
        (3, EncodeOptions::UBO2003, 12),
    ] {
        let whole = jpeg_of(40, 24, channels, &options);
        decode(&whole, &Limits::default()).unwrap();
        let (start, end) = (after_marker(&whole, 0xDA, scans - 1) + 12, whole.len() - 2);
        // The last byte may hold nothing but bits that fill it, and the codes of the last block.
        for cut in (start..end - 3).filter(|&cut| whole[cut - 1] != 0xFF) {
            let bytes = [&whole[..cut], &[0xFF, 0xD9]].concat();
            let ended = decode(&bytes, &Limits::default());
            assert!(ended.is_err(), "{options:?}: {} of {} bytes", cut - start, end - start);
        }
    }
}

#[test]
fn what_follows_the_end_is_not_the_picture() {
    for options in [EncodeOptions::UBO2003, options(90, false, Chroma::Half)] {
        let whole = jpeg_of(16, 16, 3, &options);
        let clean = decode(&whole, &Limits::default()).unwrap();
        // Zeros, a preview, a film, anything.
        let preview = jpeg_of(8, 8, 3, &options);
        for tail in [&[0; 100][..], &preview, b"ftypmp42", &[1]] {
            let bytes = [&whole, tail].concat();
            assert_eq!(
                check(&bytes, &Limits::default()).unwrap(),
                header(&whole, &Limits::default()).unwrap()
            );
            assert_eq!(decode(&bytes, &Limits::default()).unwrap(), clean);
            // A picture that is cut does not become whole by what follows.
            for end in [whole.len() - 2, whole.len() - 1, whole.len() / 2] {
                assert_eq!(refusal(&[&whole[..end], tail].concat()).kind(), ErrorKind::Malformed);
            }
        }
    }
}

/// A JPEG with Exif data that ask for an orientation.
fn with_orientation(jpeg: &[u8], orientation: u8, little_endian: bool) -> Vec<u8> {
    let mut exif = b"\xFF\xE1\0\x22Exif\0\0".to_vec();
    exif.extend(if little_endian {
        [&b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"[..], &[orientation, 0, 0, 0], &[0; 4]].concat()
    } else {
        [&b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01"[..], &[0, orientation, 0, 0], &[0; 4]].concat()
    });
    [&jpeg[..2], &exif, &jpeg[2..]].concat()
}

#[test]
fn an_orientation_is_told_and_not_applied() {
    let plain = jpeg_of(16, 8, 3, &EncodeOptions::UBO2003);
    let samples = decode(&plain, &Limits::default()).unwrap().samples;
    assert_eq!(header(&plain, &Limits::default()).unwrap().orientation, 1);
    for (written, told) in [(1, 1), (3, 3), (6, 6), (8, 8), (0, 1), (9, 1)] {
        for little_endian in [false, true] {
            let bytes = with_orientation(&plain, written, little_endian);
            assert_eq!(header(&bytes, &Limits::default()).unwrap().orientation, told);
            assert_eq!(check(&bytes, &Limits::default()).unwrap().orientation, told);
            assert_eq!(decode(&bytes, &Limits::default()).unwrap().samples, samples);
        }
    }
}

#[test]
fn a_jfif_file_is_ycbcr_whatever_an_adobe_segment_says() {
    let adobe = |transform: u8| [b"\xFF\xEE\0\x0EAdobe\0\x64\0\0\0\0", &[transform][..]].concat();
    for progressive in [false, true] {
        let plain = jpeg_of(16, 16, 3, &options(95, progressive, Chroma::Half));
        assert_eq!(plain[..11], *b"\xFF\xD8\xFF\xE0\0\x10JFIF\0");
        let (start, jfif, rest) = (&plain[..2], &plain[2..20], &plain[20..]);
        let samples = |bytes: &[u8]| decode(bytes, &Limits::default()).unwrap().samples;
        let expected = samples(&plain);
        for transform in 0..=2 {
            let adobe = adobe(transform);
            assert_eq!(samples(&[start, jfif, &adobe, rest].concat()), expected, "{transform}");
            assert_eq!(samples(&[start, &adobe, jfif, rest].concat()), expected, "{transform}");
        }
        assert_eq!(samples(&[start, rest].concat()), expected);
        assert_eq!(samples(&[start, &adobe(1), rest].concat()), expected);
        // Alone it counts: what was luminance is red.
        let rgb = samples(&[start, &adobe(0), rest].concat());
        let short = [start, b"\xFF\xE0\0\x07JFIF\0", &adobe(0), rest].concat();
        assert_eq!(samples(&short), rgb, "a segment that is too short to be JFIF's");
        for (rgb, expected) in rgb.chunks(3).zip(expected.chunks(3)) {
            let [r, g, b] = [0, 1, 2].map(|channel| f64::from(expected[channel]));
            let luminance = 0.299 * r + 0.587 * g + 0.114 * b;
            assert!((f64::from(rgb[0]) - luminance).abs() < 16.0, "{rgb:?} {expected:?}");
        }
        assert_ne!(rgb, expected);
        // What no other word is spoken of, the ids say; libjpeg takes other ids and transforms for YCbCr.
        let named = |ids: &[u8; 3], parts: &[&[u8]]| {
            let mut bytes = [parts, &[rest]].concat().concat();
            let frame = after_marker(&bytes, if progressive { 0xC2 } else { 0xC0 }, 0);
            let old: Vec<u8> = (0..3).map(|n| bytes[frame + 8 + 3 * n]).collect();
            (0..3).for_each(|n| bytes[frame + 8 + 3 * n] = ids[n]);
            let mut at = frame;
            while let Some(found) = bytes[at..].windows(2).position(|pair| pair == [0xFF, 0xDA]) {
                at += found + 4;
                for n in 0..usize::from(bytes[at]) {
                    let place = at + 1 + 2 * n;
                    bytes[place] = ids[old.iter().position(|&id| id == bytes[place]).unwrap()];
                }
            }
            samples(&bytes)
        };
        assert_eq!(named(b"RGB", &[start]), rgb);
        assert_eq!(named(b"RGB", &[start, jfif]), expected);
        assert_eq!(named(b"RGB", &[start, &adobe(1)]), expected);
        assert_eq!(named(b"RGB", &[start, &adobe(0)]), rgb);
        assert_eq!(named(b"\x01\x02\x03", &[start, &adobe(0), &adobe(1)]), expected, "the last one counts");
        for ids in [b"rgb", b"\0\x01\x02", b"BGR", b"YUV"] {
            assert_eq!(named(ids, &[start]), expected, "{ids:?}");
        }
        for transform in [2, 3, 255] {
            assert_eq!(named(b"\x01\x02\x03", &[start, &adobe(transform)]), expected);
        }
        if progressive {
            let end = after_marker(&plain, 0xDA, 1) - 2;
            let late = [start, &plain[20..end], &adobe(0), &plain[end..]].concat();
            assert_eq!(samples(&late), expected, "behind the first scan");
        }
    }
}

#[test]
fn a_missing_scan_is_noticed_even_if_the_end_marker_is_there() {
    for (channels, scans) in [(1, 4), (3, 12)] {
        let whole = jpeg_of(24, 24, channels, &EncodeOptions::UBO2003);
        let count = whole.windows(2).filter(|pair| *pair == [0xFF, 0xDA]).count();
        assert_eq!(count, scans);
        for scan in 1..count {
            let mut cut = whole[..after_marker(&whole, 0xDA, scan) - 2].to_vec();
            cut.extend([0xFF, 0xD9]);
            let error = refusal(&cut);
            assert!(error.to_string().contains("all scans"), "{error}");
        }
        // A scan left out of the middle.
        let (from, to) = (after_marker(&whole, 0xDA, 1) - 2, after_marker(&whole, 0xDA, 2) - 2);
        let holed = [&whole[..from], &whole[to..]].concat();
        assert_eq!(refusal(&holed).kind(), ErrorKind::Malformed);
        // A scan sent twice.
        let doubled = [&whole[..to], &whole[from..]].concat();
        assert_eq!(refusal(&doubled).kind(), ErrorKind::Malformed);
    }
}

#[test]
fn sizes_that_the_data_cannot_fill_are_refused_before_allocating() {
    for progressive in [false, true] {
        let bytes = jpeg_of(16, 16, 3, &options(90, progressive, Chroma::Half));
        let frame = after_marker(&bytes, if progressive { 0xC2 } else { 0xC0 }, 0);
        let claim = |width: u16, height: u16| {
            let mut lying = bytes.clone();
            lying[frame + 3..frame + 5].copy_from_slice(&height.to_be_bytes());
            lying[frame + 5..frame + 7].copy_from_slice(&width.to_be_bytes());
            refusal(&lying)
        };
        assert_eq!(claim(65_535, 65_535).kind(), ErrorKind::Limit);
        assert_eq!(claim(0, 16).kind(), ErrorKind::Malformed);
        let error = claim(8192, 8192);
        assert_eq!(error.kind(), ErrorKind::Malformed);
        assert!(error.to_string().contains("one bit a code"), "{error}");
    }
}

#[test]
fn limits_are_kept() {
    let bytes = jpeg_of(16, 16, 3, &EncodeOptions::UBO2003);
    let mut limits = Limits::default();
    limits.max_pixels_per_image = 255;
    assert_eq!(decode(&bytes, &limits).unwrap_err().kind(), ErrorKind::Limit);
    assert_eq!(header(&bytes, &limits).unwrap_err().kind(), ErrorKind::Limit);
    limits.max_pixels_per_image = 256;
    limits.max_scans_per_image = 11;
    assert_eq!(decode(&bytes, &limits).unwrap_err().kind(), ErrorKind::Limit);
    limits.max_scans_per_image = 12;
    assert!(decode(&bytes, &limits).is_ok());
}

#[test]
fn other_kinds_of_jpeg_are_unsupported() {
    let bytes = jpeg_of(16, 16, 3, &options(90, false, Chroma::Half));
    let frame = after_marker(&bytes, 0xC0, 0);
    let change = |at: usize, value: u8| {
        let mut changed = bytes.clone();
        changed[at] = value;
        refusal(&changed)
    };
    assert_eq!(change(frame - 1, 0xC9).kind(), ErrorKind::Unsupported, "arithmetic coding");
    assert_eq!(change(frame - 1, 0xC3).kind(), ErrorKind::Unsupported, "lossless");
    assert_eq!(change(frame + 2, 12).kind(), ErrorKind::Unsupported, "12 bits");
    assert_eq!(change(frame + 9, 0x31).kind(), ErrorKind::Unsupported, "a third of the chroma");
    assert_eq!(change(frame + 7, 4).kind(), ErrorKind::Unsupported, "four components");
    assert_eq!(change(0, 0).kind(), ErrorKind::Malformed, "no JPEG");
}

#[test]
fn restart_markers_must_all_be_there_and_in_order() {
    let samples = picture(40, 16, 1);
    let mut whole = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut whole, 90);
    encoder.set_restart_interval(2);
    encoder.encode(&samples, 40, 16, jpeg_encoder::ColorType::Luma).unwrap();
    assert!(decode(&whole, &Limits::default()).is_ok());

    let third = after_marker(&whole, 0xD2, 0);
    let mut swapped = whole.clone();
    swapped[third - 1] = 0xD3;
    assert!(refusal(&swapped).to_string().contains("RST"));
    // The data end after the third interval, and an end marker says that this is all.
    let mut cut = whole[..third - 2].to_vec();
    cut.extend([0xFF, 0xD9]);
    assert!(refusal(&cut).to_string().contains("restart markers"));
}

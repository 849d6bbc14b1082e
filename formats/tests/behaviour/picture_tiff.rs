//! TIFF: types, byte orders, strips, tiles, planes, channels of no meaning.

use btfkit_formats::picture::{Picture, check, decode, header};
use btfkit_formats::{ErrorKind, Limits, Samples};

use crate::picture_files::{Tiff, pattern_samples, tiff_by_crate, tiff_samples};

fn read(bytes: &[u8]) -> Picture {
    decode(bytes, &Limits::default()).unwrap()
}

const KINDS: [(&str, u64, u64); 4] = [("u8", 8, 1), ("u16", 16, 1), ("f16", 16, 3), ("f32", 32, 3)];

#[test]
fn samples_are_those_written_in_every_order_of_bytes_and_planes() {
    for (kind, bits, format) in KINDS {
        for little_endian in [true, false] {
            for big in [true, false] {
                for (channels, planar) in [(1, false), (3, false), (3, true), (7, false), (7, true)] {
                    for rows in [1, 2, 5, 100] {
                        let mut tiff = Tiff::new((3, 5, channels), bits, format, rows);
                        (tiff.little_endian, tiff.big) = (little_endian, big);
                        let samples = tiff_samples(&tiff, 3 * 5 * channels, kind);
                        let bytes = tiff.with_strips(&samples, rows.min(5), planar).bytes();
                        let picture = read(&bytes);
                        assert_eq!(
                            picture.samples,
                            pattern_samples(3 * 5 * channels, kind),
                            "{kind} {channels} {planar}"
                        );
                        let names = ["Y", "", "RGB", "", "", "", "C0C1C2C3C4C5C6"];
                        assert_eq!(picture.channels.concat(), names[channels - 1]);
                        assert_eq!(header(&bytes, &Limits::default()).unwrap().linear, format == 3);
                    }
                }
            }
        }
    }
}

#[test]
fn tiles_are_put_together() {
    for (kind, bits, format) in KINDS {
        for (width, height, channels) in [(40, 20, 1), (40, 20, 3), (16, 16, 1), (5, 3, 4)] {
            let mut tiff = Tiff::new((width, height, channels), bits, format, 1);
            tiff.tags.retain(|(tag, _)| *tag != 278);
            let samples = tiff_samples(&tiff, width * height * channels, kind);
            let empty = tiff.uint(0, bits as usize / 8);
            for top in (0..height).step_by(16) {
                for left in (0..width).step_by(16) {
                    let mut tile = Vec::new();
                    for y in top..top + 16 {
                        for x in (left..left + 16).flat_map(|x| std::iter::repeat_n(x, channels).zip(0..)) {
                            let inside = y < height && x.0 < width;
                            let number = (y * width + x.0) * channels + x.1;
                            tile.extend(if inside { &samples[number] } else { &empty });
                        }
                    }
                    tiff.chunks.push(tile);
                }
            }
            let bytes = tiff.set(322, &[16]).set(323, &[16]).bytes();
            assert_eq!(
                read(&bytes).samples,
                pattern_samples(width * height * channels, kind),
                "{kind} x {channels}"
            );
        }
    }
}

#[test]
fn compressed_samples_are_those_of_the_encoder() {
    use tiff::encoder::{Compression, DeflateLevel};
    use tiff::tags::Predictor;
    let plain = read(&tiff_by_crate(Compression::Uncompressed, Predictor::None));
    assert!(matches!(&plain.samples, Samples::U16(list) if list.iter().any(|&s| s > 0xF000)));
    for compression in [Compression::Lzw, Compression::Deflate(DeflateLevel::Fast), Compression::Packbits] {
        assert_eq!(read(&tiff_by_crate(compression, Predictor::None)), plain);
    }
    for compression in [Compression::Lzw, Compression::Deflate(DeflateLevel::Fast)] {
        assert_eq!(read(&tiff_by_crate(compression, Predictor::Horizontal)), plain);
    }
}

#[test]
fn opaque_alpha_is_dropped_and_other_alpha_refused() {
    for (channels, photometric) in [(2usize, 1), (4, 2)] {
        for opaque in [true, false] {
            let mut tiff = Tiff::new((3, 2, channels), 8, 1, 2);
            tiff.set(262, &[photometric]).set(338, &[2]);
            let mut samples = tiff_samples(&tiff, 6 * channels, "u8");
            for alpha in samples.iter_mut().skip(channels - 1).step_by(channels) {
                *alpha = vec![255];
            }
            let Samples::U8(expected) = pattern_samples(6 * channels, "u8") else { unreachable!() };
            let expected =
                expected.chunks(channels).flat_map(|pixel| pixel[..channels - 1].to_vec()).collect();
            if !opaque {
                samples[5 * channels - 1] = vec![254];
            }
            let read = decode(&tiff.with_strips(&samples, 2, false).bytes(), &Limits::default());
            if opaque {
                assert_eq!(read.unwrap().samples, Samples::U8(expected));
            } else {
                let error = read.unwrap_err();
                assert!(error.to_string().contains("pixel 4"), "{error}");
            }
        }
    }
}

#[test]
fn what_is_not_read_is_refused_with_its_reason() {
    let good = Tiff::new((4, 4, 3), 8, 1, 4);
    let samples = tiff_samples(&good, 48, "u8");
    let good = good.with_strips(&samples, 4, false);
    assert!(decode(&good.bytes(), &Limits::default()).is_ok());
    for (tag, values, words) in [
        (259, vec![7], "compression 7"),
        (259, vec![4], "compression 4"),
        (262, vec![0], "photometric interpretation 0"),
        (262, vec![3], "photometric interpretation 3"),
        (262, vec![5], "photometric interpretation 5"),
        (262, vec![6], "photometric interpretation 6"),
        (262, vec![32803], "a camera's raw picture"),
        (266, vec![2], "fill order"),
        (317, vec![2], "predictor 2"),
        (258, vec![12; 3], "12 bits"),
        (258, vec![8, 8, 16], "values [8, 8, 16]"),
        (339, vec![2; 3], "format 2"),
        (338, vec![0], "extra samples [0]"),
    ] {
        let error = decode(&good.clone().set(tag, &values).bytes(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    let mut doubled = good.clone();
    doubled.tags.push((256, vec![4]));
    let error = decode(&doubled.bytes(), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("two entries of tag 256"), "{error}");
}

#[test]
fn an_orientation_is_told_and_not_applied() {
    let good = Tiff::new((4, 4, 3), 8, 1, 4);
    let samples = tiff_samples(&good, 48, "u8");
    let good = good.with_strips(&samples, 4, false);
    for (written, told) in [(0, 1), (1, 1), (6, 6), (8, 8)] {
        let bytes = good.clone().set(274, &[written]).bytes();
        assert_eq!(header(&bytes, &Limits::default()).unwrap().orientation, told);
        assert_eq!(read(&bytes), read(&good.bytes()));
    }
    let error = decode(&good.clone().set(274, &[9]).bytes(), &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Malformed);
}

/// A directory of a grey picture of `side * side` samples of one value.
#[derive(Clone)]
struct Part {
    side: u32,
    tags: Vec<(u16, u32)>,
    /// Reached by the SubIFDs of the first directory, else in the chain.
    child: bool,
}

fn part(side: u32, tags: &[(u16, u32)], child: bool) -> Part {
    Part { side, tags: tags.to_vec(), child }
}

/// A little-endian TIFF of these directories; the first is in the chain.
fn file_of(parts: &[Part]) -> Vec<u8> {
    let mut at = 8u32;
    let places: Vec<u32> = parts
        .iter()
        .map(|part| {
            let place = at;
            at += part.side * part.side + 12 * 20 + 6;
            place
        })
        .collect();
    let offset = |n: usize| places[n] + parts[n].side * parts[n].side;
    let children: Vec<u32> = (0..parts.len()).filter(|&n| parts[n].child).map(offset).collect();
    let list_at = at;
    let mut out = [&b"II*\0"[..], &offset(0).to_le_bytes()].concat();
    for (n, part) in parts.iter().enumerate() {
        out.resize(places[n] as usize, 0);
        out.extend(vec![u8::try_from(part.side).unwrap(); (part.side * part.side) as usize]);
        let mut tags: Vec<(u16, u32, u32)> =
            vec![(256, 1, part.side), (257, 1, part.side), (258, 1, 8), (262, 1, 1)];
        tags.extend([(273, 1, places[n]), (279, 1, part.side * part.side)]);
        tags.extend(part.tags.iter().map(|&(tag, value)| (tag, 1, value)));
        match children.as_slice() {
            [] => {}
            &[only] if n == 0 => tags.push((330, 1, only)),
            list if n == 0 => tags.push((330, u32::try_from(list.len()).unwrap(), list_at)),
            _ => {}
        }
        out.extend(u16::try_from(tags.len()).unwrap().to_le_bytes());
        for (tag, count, value) in tags {
            out.extend([tag.to_le_bytes(), 4u16.to_le_bytes()].concat());
            out.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        let next = (n + 1..parts.len()).find(|&later| !part.child && !parts[later].child);
        out.extend(next.map_or(0, offset).to_le_bytes());
    }
    out.resize(list_at as usize, 0);
    out.extend(children.iter().flat_map(|child| child.to_le_bytes()));
    out
}

#[test]
fn the_picture_is_the_one_that_is_no_smaller_version() {
    let (full, small, older_small) = (&[][..], &[(254, 1)][..], &[(255, 2)][..]);
    for (parts, side) in [
        (vec![part(9, full, false)], 9),
        (vec![part(9, &[(254, 0)], false), part(3, small, false)], 9),
        (vec![part(3, small, false), part(9, full, false)], 9),
        (vec![part(3, older_small, false), part(9, &[(255, 1)], false)], 9),
        (vec![part(9, &[(254, 2)], false), part(3, &[(254, 3)], false)], 9),
        // A camera's: a thumbnail, the picture below it, perhaps with a preview.
        (vec![part(3, small, false), part(9, full, true)], 9),
        (vec![part(3, small, false), part(5, small, true), part(9, full, true)], 9),
        (vec![part(3, &[(254, 1), (274, 6)], false), part(9, full, true)], 9),
        // Smaller versions below the picture, which need not say that they are.
        (vec![part(9, full, false), part(5, full, true), part(3, full, true)], 9),
        (vec![part(9, full, false), part(9, small, true)], 9),
        (vec![part(9, full, false), part(5, small, true), part(3, small, true)], 9),
    ] {
        let bytes = file_of(&parts);
        let found = header(&bytes, &Limits::default()).unwrap();
        assert_eq!(found.width, side);
        // A camera states the turn where its thumbnail is.
        let turned = parts.iter().any(|part| part.tags.contains(&(274, 6)));
        assert_eq!(found.orientation, if turned { 6 } else { 1 });
        check(&bytes, &Limits::default()).unwrap();
        assert_eq!(read(&bytes).samples, Samples::U8(vec![9; 81]));
    }
    for (parts, words) in [
        (vec![part(3, small, false)], "only smaller versions"),
        (vec![part(3, older_small, false)], "only smaller versions"),
        (vec![part(3, small, false), part(5, small, true)], "only smaller versions"),
        (vec![part(9, full, false), part(9, full, false)], "2 pictures"),
        (vec![part(3, full, false), part(9, full, false)], "(3 x 3 and 9 x 9)"),
        // A thumbnail that does not say that it is one.
        (vec![part(3, full, false), part(9, full, true)], "pictures of 3 x 3 and 9 x 9 pixels"),
        (vec![part(3, full, false), part(2, small, true), part(9, full, true)], "of 3 x 3 and 9 x 9"),
        (vec![part(3, full, false), part(9, small, true)], "of 3 x 3 and 9 x 9"),
        (vec![part(3, full, false), part(9, small, false)], "of 3 x 3 and 9 x 9"),
        (vec![part(3, small, false), part(5, full, false), part(9, full, true)], "of 5 x 5 and 9 x 9"),
        (vec![part(9, full, false), part(9, full, true)], "of 9 x 9 and 9 x 9"),
        (vec![part(9, &[(254, 2)], false), part(9, &[(254, 2)], false)], "2 pictures"),
        (vec![part(3, small, false), part(9, full, true), part(7, full, true)], "2 pictures"),
        (vec![part(9, full, false), part(9, &[(254, 4)], false)], "transparency mask"),
    ] {
        let bytes = file_of(&parts);
        for error in [
            header(&bytes, &Limits::default()).unwrap_err(),
            check(&bytes, &Limits::default()).unwrap_err(),
            decode(&bytes, &Limits::default()).unwrap_err(),
        ] {
            assert_eq!(error.kind(), ErrorKind::Unsupported);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}

#[test]
fn a_stack_in_one_directory_is_refused() {
    let plane = Tiff::new((4, 3, 1), 8, 1, 3);
    let samples = tiff_samples(&plane, 12, "u8");
    let plane = plane.with_strips(&samples, 3, false);
    let described = |text: &str| {
        let mut text = text.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), 0);
        let words: Vec<u64> =
            text.chunks(4).map(|word| u64::from(u32::from_le_bytes(word.try_into().unwrap()))).collect();
        plane.clone().set(270, &words).bytes()
    };
    let four_more = vec![7; 48];
    let five = r#"{"shape": [5, 3, 4]}"#;
    for (bytes, number) in [
        (described(five), "5"),
        (described(r#"{"axes": "ZYX", "shape": [1, 5, 3, 4, 1], "x": [9]}"#), "5"),
        (described("shape=(5, 3, 4)"), "5"),
        (described("ImageJ=1.53t\nimages=5\nslices=5\n"), "5"),
        (plane.clone().set(32997, &[5]).bytes(), "5"),
        (plane.clone().set(33629, &[0; 30]).bytes(), "30"),
        (plane.clone().set(279, &[60]).bytes(), "several"),
    ] {
        let error = decode(&[bytes, four_more.clone()].concat(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().contains(&format!("a stack of {number} pictures")), "{error}");
    }
    // One picture; the description of a stack that it was saved from, without the others; no description of a shape.
    for bytes in [
        [described(r#"{"shape": [3, 4]}"#), four_more.clone()].concat(),
        [described("ImageJ=1.53t\nunit=mm"), four_more.clone()].concat(),
        [described("the shape [5, 3, 4]"), four_more.clone()].concat(),
        described(five),
        plane.clone().set(32997, &[1]).bytes(),
    ] {
        assert_eq!(read(&bytes).samples, pattern_samples(12, "u8"));
    }
}

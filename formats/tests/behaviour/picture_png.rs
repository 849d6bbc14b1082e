//! PNG: depths, palettes, interlacing, alpha; and what is written.

use btfkit_formats::picture::{Picture, check, decode, header, png::encode};
use btfkit_formats::{ErrorKind, Limits, SampleType, Samples};

use crate::picture_files::{Png, png_chunk};

fn read(bytes: &[u8]) -> Picture {
    decode(bytes, &Limits::default()).unwrap()
}

fn samples_of(picture: &Picture) -> Vec<u16> {
    match &picture.samples {
        Samples::U8(list) => list.iter().map(|&s| u16::from(s)).collect(),
        Samples::U16(list) => list.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn samples_are_those_written_interlaced_or_not() {
    for interlaced in [false, true] {
        for (width, height) in [(1, 1), (2, 3), (9, 5), (17, 11)] {
            for (colour, depth) in [(0, 8), (0, 16), (2, 8), (2, 16)] {
                let png = Png::new(width, height, depth, colour, interlaced);
                let picture = read(&png.bytes());
                assert_eq!(samples_of(&picture), png.samples, "{colour}, {depth}, {width} x {height}");
                let expected = if depth == 16 { SampleType::U16 } else { SampleType::U8 };
                assert_eq!(picture.samples.sample_type(), expected);
                assert_eq!(picture.channels.join(""), if colour == 0 { "Y" } else { "RGB" });
            }
        }
    }
}

#[test]
fn small_depths_are_stretched_to_8_bits() {
    for (depth, factor) in [(1, 255), (2, 85), (4, 17)] {
        let png = Png::new(11, 4, depth, 0, false);
        let expected: Vec<u16> = png.samples.iter().map(|sample| sample * factor).collect();
        assert_eq!(samples_of(&read(&png.bytes())), expected, "{depth} bits");
    }
}

#[test]
fn a_palette_becomes_colours() {
    for depth in [1, 2, 4, 8] {
        let mut png = Png::new(7, 5, depth, 3, depth == 4);
        let palette: Vec<u8> = (0..3usize << depth).map(|n| (n * 37 % 256) as u8).collect();
        png.before = png_chunk(b"PLTE", &palette);
        let expected: Vec<u16> =
            png.samples.iter().flat_map(|&i| (0..3).map(move |c| (i * 3 + c) * 37 % 256)).collect();
        let picture = read(&png.bytes());
        assert_eq!(samples_of(&picture), expected, "{depth} bits");
        assert_eq!(header(&png.bytes(), &Limits::default()).unwrap().channels, picture.channels);
        // An opaque transparency table says nothing; another one does.
        png.before.extend(png_chunk(b"tRNS", &[255, 255]));
        assert_eq!(samples_of(&read(&png.bytes())), expected);
    }
}

#[test]
fn opaque_alpha_is_dropped_and_other_alpha_refused() {
    for (colour, depth, channels) in [(4, 8, 2), (4, 16, 2), (6, 8, 4), (6, 16, 4)] {
        let mut png = Png::new(5, 4, depth, colour, false);
        let expected: Vec<u16> =
            png.samples.chunks(channels).flat_map(|pixel| pixel[..channels - 1].to_vec()).collect();
        assert_eq!(samples_of(&read(&png.bytes())), expected);
        png.samples[7 * channels + channels - 1] -= 1;
        let error = decode(&png.bytes(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().contains("pixel 7"), "{error}");
    }
    let mut keyed = Png::new(5, 4, 8, 0, false);
    keyed.before = png_chunk(b"tRNS", &[0, keyed.samples[3] as u8]);
    assert_eq!(decode(&keyed.bytes(), &Limits::default()).unwrap_err().kind(), ErrorKind::Unsupported);
}

#[test]
fn what_a_png_says_about_colours_changes_no_sample() {
    let mut png = Png::new(6, 6, 8, 2, false);
    png.before = png_chunk(b"gAMA", &45_455u32.to_be_bytes());
    png.before.extend(png_chunk(b"sBIT", &[5, 5, 5]));
    png.before.extend(png_chunk(b"tEXt", b"Comment\0made by hand"));
    png.before.extend(png_chunk(b"iCCP", b"broken\0\0nonsense"));
    assert_eq!(samples_of(&read(&png.bytes())), png.samples);
}

#[test]
fn chunks_out_of_place_are_refused() {
    let refused = |before: Vec<u8>, kind, words: &str| {
        let png = Png { before, ..Png::new(6, 6, 8, 2, false) };
        let error = decode(&png.bytes(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    refused(png_chunk(b"acTL", &[0, 0, 0, 1, 0, 0, 0, 0]), ErrorKind::Unsupported, "animation");
    refused(png_chunk(b"NEWC", b""), ErrorKind::Unsupported, "NEWC");
    refused(png_chunk(b"IHDR", &[0; 13]), ErrorKind::Malformed, "second IHDR");
    refused([png_chunk(b"IDAT", b""), png_chunk(b"tEXt", b"a\0b")].concat(), ErrorKind::Malformed, "IDAT");
    let bytes = Png::new(6, 6, 8, 2, false).bytes();
    assert_eq!(read(&[bytes.clone(), vec![0; 9]].concat()), read(&bytes));
    assert_eq!(
        read(&[bytes.clone(), b"more".to_vec()].concat()),
        read(&bytes),
        "what follows the end is not the picture"
    );
}

#[test]
fn an_orientation_is_told_and_not_applied() {
    let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0";
    let plain = Png::new(6, 4, 8, 2, false);
    let turned = Png { before: png_chunk(b"eXIf", exif), ..Png::new(6, 4, 8, 2, false) };
    for (png, expected) in [(&plain, 1), (&turned, 6)] {
        let bytes = png.bytes();
        assert_eq!(header(&bytes, &Limits::default()).unwrap().orientation, expected);
        assert_eq!(check(&bytes, &Limits::default()).unwrap().orientation, expected);
        assert_eq!(read(&bytes), read(&plain.bytes()));
    }
}

#[test]
fn what_is_written_is_read_again() {
    for (channels, samples) in [
        ("Y", Samples::U8((0..35).collect())),
        ("RGB", Samples::U8((0..105).collect())),
        ("Y", Samples::U16((0..35).map(|n| n * 1871).collect())),
        ("RGB", Samples::U16((0..105).map(|n| n * 623).collect())),
    ] {
        let channels = channels.chars().map(String::from).collect();
        let picture = Picture { width: 7, height: 5, channels, samples };
        let bytes = encode(&picture).unwrap();
        assert_eq!(bytes, encode(&picture).unwrap());
        assert_eq!(read(&bytes), picture);
    }
}

#[test]
fn what_a_png_cannot_hold_is_refused() {
    let picture = |channels: usize, samples| Picture {
        width: 2,
        height: 2,
        channels: (0..channels).map(|n| n.to_string()).collect(),
        samples,
    };
    for bad in [
        picture(2, Samples::U8(vec![0; 8])),
        picture(3, Samples::F32(vec![0.0; 12])),
        picture(3, Samples::U8(vec![0; 11])),
        picture(0, Samples::U8(vec![])),
    ] {
        assert_eq!(encode(&bad).unwrap_err().kind(), ErrorKind::Argument, "{bad:?}");
    }
}

#[test]
fn a_number_without_a_colour_is_refused_by_its_place() {
    for (depth, interlaced) in [(1, false), (2, true), (4, false), (8, true), (8, false)] {
        let mut png = Png::new(7, 5, depth, 3, interlaced);
        png.samples.fill(0);
        png.before = png_chunk(b"PLTE", &[10, 20, 30]);
        assert_eq!(samples_of(&read(&png.bytes())), [10, 20, 30].repeat(35));
        png.samples[2 * 7 + 4] = 1;
        let error = decode(&png.bytes(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed);
        let words = "the colour number 1 at column 4, row 2, expected one of the 1 of the palette";
        assert!(error.to_string().contains(words), "{error}");
        png.before = [png_chunk(b"PLTE", &[10, 20, 30, 1, 2, 3]), png_chunk(b"tRNS", &[255, 9])].concat();
        let error = decode(&png.bytes(), &Limits::default()).unwrap_err().to_string();
        assert!(error.contains("not opaque at pixel 18"), "{error}");
    }
}

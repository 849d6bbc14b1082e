//! Radiance: codings, exposures, orientations.

use btfkit_formats::picture::{DecodeOptions, HdrOrientation, Picture, check, decode, decode_with, header};
use btfkit_formats::{ErrorKind, Limits, Samples};

use crate::picture_files::{HdrCoding, RGBE, hdr_of, rgbe};

const CODINGS: [HdrCoding; 3] = [HdrCoding::Flat, HdrCoding::OldRuns, HdrCoding::Components];

fn floats(picture: &Picture) -> &[f32] {
    match &picture.samples {
        Samples::F32(list) => list,
        other => panic!("{other:?}"),
    }
}

fn values(pixels: &[[u8; 4]]) -> Vec<f32> {
    let value = |&[r, g, b, e]: &[u8; 4]| {
        let scale = if e == 0 { 0.0 } else { 2f64.powi(i32::from(e) - 136) };
        [r, g, b].map(|mantissa| (f64::from(mantissa) * scale) as f32)
    };
    pixels.iter().flat_map(value).collect()
}

fn read(bytes: &[u8]) -> Picture {
    decode(bytes, &Limits::default()).unwrap()
}

#[test]
fn every_coding_gives_the_same_exact_values() {
    for (width, height) in [(8, 1), (11, 5), (300, 2), (1000, 3)] {
        let pixels = rgbe(width * height);
        for coding in CODINGS {
            let bytes = hdr_of(RGBE, &format!("-Y {height} +X {width}"), &pixels, width, coding);
            let picture = read(&bytes);
            assert_eq!(floats(&picture), values(&pixels), "{coding:?}");
            assert_eq!(picture.channels, ["R", "G", "B"]);
            let header = header(&bytes, &Limits::default()).unwrap();
            assert_eq!((header.linear, header.scanlines_are_columns), (true, false));
        }
    }
    // Too short for components.
    let pixels = rgbe(7 * 3);
    assert_eq!(floats(&read(&hdr_of(RGBE, "-Y 3 +X 7", &pixels, 7, HdrCoding::OldRuns))), values(&pixels));
}

#[test]
fn long_runs_of_the_old_coding_count_in_bytes() {
    let pixels = vec![[9, 8, 7, 130]; 70_000];
    let bytes = hdr_of(RGBE, "-Y 1 +X 70000", &pixels, 70_000, HdrCoding::OldRuns);
    assert!(bytes.len() < 100);
    assert_eq!(floats(&read(&bytes)), values(&pixels));
}

#[test]
fn the_whole_range_of_exponents_is_exact() {
    let pixels: Vec<[u8; 4]> = (0..=255).map(|e| [255, 128, 3, e]).collect();
    let picture = read(&hdr_of(RGBE, "-Y 1 +X 256", &pixels, 256, HdrCoding::Components));
    assert_eq!(floats(&picture), values(&pixels));
    assert_eq!(floats(&picture)[3 * 255], 255.0 * 2f32.powi(119));
    assert!(floats(&picture)[3 + 2] > 0.0, "a small value is not lost");
}

#[test]
fn exposures_and_colour_corrections_are_undone() {
    let pixels = rgbe(16);
    let lines =
        format!("EXPOSURE=2\nEXPOSURE= 4.0 \nCOLORCORR=1 2 0.5\n{RGBE}PIXASPECT=1\nVIEW= rvu\npfilt -1\n");
    let picture = read(&hdr_of(&lines, "-Y 2 +X 8", &pixels, 8, HdrCoding::Flat));
    let expected: Vec<f32> =
        values(&pixels).chunks(3).flat_map(|p| [p[0] / 8.0, p[1] / 16.0, p[2] / 4.0]).collect();
    assert_eq!(floats(&picture), expected);
}

#[test]
fn variables_are_read_in_any_case_and_spacing_or_refused() {
    let pixels = rgbe(16);
    let with = |line: &str| {
        let bytes = hdr_of(&format!("{RGBE}{line}\n"), "-Y 2 +X 8", &pixels, 8, HdrCoding::Flat);
        decode(&bytes, &Limits::default())
    };
    let halved: Vec<f32> = values(&pixels).iter().map(|value| value / 2.0).collect();
    for line in [
        "EXPOSURE=2",
        "EXPOSURE = 2",
        "exposure=2",
        "EXPOSURE= 2",
        " Exposure =2 ",
        "EXPOSURE\t=2",
        "ColorCorr = 2 2 2",
    ] {
        assert_eq!(floats(&with(line).unwrap()), halved, "{line:?}");
    }
    // What a picture was made of, comments and commands.
    for line in [
        "\tEXPOSURE=2",
        "# EXPOSURE=2",
        "pfilt -e 2",
        "gamma=1",
        "GAMMA = 1.0",
        "exposure by hand",
        "VIEW= -vf 2",
    ] {
        assert_eq!(floats(&with(line).unwrap()), values(&pixels), "{line:?}");
    }
    for line in [
        "gamma=2.2",
        "Gamma = 2.2",
        "GAMMA 2.2",
        "EXPOSURE 2",
        "exposure: 2",
        "COLORCORR 1 2 3",
        "pixaspect=0",
    ] {
        let error = with(line).unwrap_err().to_string();
        assert!(error.contains(line.split([' ', '=', ':']).next().unwrap()), "{line:?}: {error}");
    }
    let one = with("EXPOSURE = x").unwrap_err().to_string();
    assert!(one.contains("expected a positive number"), "{one}");
}

#[test]
fn xyz_keeps_its_channels() {
    let bytes = hdr_of("FORMAT=32-bit_rle_xyze\n", "-Y 2 +X 8", &rgbe(16), 8, HdrCoding::Components);
    assert_eq!(read(&bytes).channels, ["X", "Y", "Z"]);
}

/// Where the eight orientations put the pixel in scan line `l` at position `p`, of 9 lines of 12.
#[test]
fn every_orientation_is_read_by_the_rules() {
    let pixels: Vec<[u8; 4]> = (0..108).map(|n| [n, 2 * n, 255 - n, 136]).collect();
    type Place = fn(usize, usize) -> (usize, usize);
    let cases: [(&str, usize, Place); 8] = [
        ("-Y 9 +X 12", 12, |l, p| (l, p)),
        ("-Y 9 -X 12", 12, |l, p| (l, 11 - p)),
        ("+Y 9 +X 12", 12, |l, p| (8 - l, p)),
        ("+Y 9 -X 12", 12, |l, p| (8 - l, 11 - p)),
        ("+X 9 -Y 12", 9, |l, p| (p, l)),
        ("-X 9 -Y 12", 9, |l, p| (p, 8 - l)),
        ("+X 9 +Y 12", 9, |l, p| (11 - p, l)),
        ("-X 9 +Y 12", 9, |l, p| (11 - p, 8 - l)),
    ];
    for (resolution, width, place) in cases {
        let bytes = hdr_of(RGBE, resolution, &pixels, 12, HdrCoding::Components);
        let picture = read(&bytes);
        assert_eq!(picture.width as usize, width, "{resolution}");
        assert_eq!(check(&bytes, &Limits::default()).unwrap().scanlines_are_columns, width == 9);
        for line in 0..9 {
            for position in 0..12 {
                let (row, column) = place(line, position);
                let expected = f32::from(pixels[line * 12 + position][0]);
                assert_eq!(
                    floats(&picture)[(row * width + column) * 3],
                    expected,
                    "{resolution}: {line}, {position}"
                );
            }
        }
    }
}

#[test]
fn the_atrium_reading_takes_columns_for_rows_from_the_bottom() {
    let atrium = DecodeOptions { hdr_orientation: HdrOrientation::Atrium };
    let pixels = rgbe(100);
    let bytes = hdr_of(&format!("GAMMA=1\n{RGBE}"), "+X 10 -Y 10", &pixels, 10, HdrCoding::Components);
    let rows: Vec<f32> = values(&pixels).chunks(30).rev().flatten().copied().collect();
    let picture = decode_with(&bytes, &atrium, &Limits::default()).unwrap();
    assert_eq!(floats(&picture), rows);
    assert_ne!(read(&bytes), picture);

    // A usual picture is the same under both; one that is not square does not tell its rows.
    let usual = hdr_of(RGBE, "-Y 10 +X 10", &pixels, 10, HdrCoding::Components);
    assert_eq!(decode_with(&usual, &atrium, &Limits::default()).unwrap(), read(&usual));
    let oblong = hdr_of(RGBE, "+X 5 -Y 20", &pixels, 20, HdrCoding::Components);
    let error = decode_with(&oblong, &atrium, &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("square"), "{error}");
}

#[test]
fn headers_that_break_the_rules_are_refused() {
    let pixels = rgbe(16);
    let with = |lines: &str, resolution: &str| {
        decode(&hdr_of(lines, resolution, &pixels, 8, HdrCoding::Components), &Limits::default())
    };
    assert!(with(RGBE, "-Y 2 +X 8").is_ok());
    for (lines, resolution, words) in [
        ("", "-Y 2 +X 8", "no FORMAT"),
        ("FORMAT=jpeg\n", "-Y 2 +X 8", "FORMAT=jpeg"),
        ("FORMAT=32-bit_rle_rgbe\nFORMAT=32-bit_rle_xyze\n", "-Y 2 +X 8", "differ"),
        ("FORMAT=32-bit_rle_rgbe\nGAMMA=2.2\n", "-Y 2 +X 8", "GAMMA"),
        ("FORMAT=32-bit_rle_rgbe\nEXPOSURE=0\n", "-Y 2 +X 8", "positive"),
        ("FORMAT=32-bit_rle_rgbe\nEXPOSURE=nan\n", "-Y 2 +X 8", "positive"),
        ("FORMAT=32-bit_rle_rgbe\nCOLORCORR=1 1\n", "-Y 2 +X 8", "3 positive"),
        ("FORMAT=32-bit_rle_rgbe\nEXPOSURE=1e-300\nEXPOSURE=1e-300\n", "-Y 2 +X 8", "out of range"),
        (RGBE, "-Y 2 -Y 8", "resolution"),
        (RGBE, "-Y 2", "resolution"),
        (RGBE, "-Y 2 +X 8 9", "resolution"),
        (RGBE, "-Y +2 +X 8", "resolution"),
        (RGBE, "-Y 0 +X 8", "at least 1 x 1"),
        (RGBE, "-Y 2 +X 9", "a scan line of 8 pixels"),
        (RGBE, "-Y 1 +X 8", "after the last scan line"),
        (RGBE, "-Y 3 +X 8", "end of the data"),
    ] {
        let error = with(lines, resolution).unwrap_err();
        assert!(error.to_string().contains(words), "{lines:?} {resolution:?}: {error}");
    }
    let endless = [b"#?RADIANCE\n".to_vec(), vec![b'#'; 10_000]].concat();
    assert!(decode(&endless, &Limits::default()).unwrap_err().to_string().contains("without an end of line"));
    let many = [b"#?RADIANCE\n".to_vec(), b"#\n".repeat(5000)].concat();
    assert!(decode(&many, &Limits::default()).unwrap_err().to_string().contains("lines"));
}

#[test]
fn runs_that_leave_their_scan_line_are_refused() {
    let start = format!("#?RGBE\n{RGBE}\n-Y 1 +X 8\n").into_bytes();
    let with = |data: &[u8]| decode(&[start.clone(), data.to_vec()].concat(), &Limits::default());
    let component = [136u8, 5];
    assert!(
        with(&[[2, 2, 0, 8].as_slice(), &component, &component, &component, &component].concat()).is_ok()
    );
    let error = |data: &[u8]| with(data).unwrap_err().to_string();
    assert!(error(&[2, 2, 0, 8, 137, 5]).contains("a run of 9"));
    assert!(error(&[2, 2, 0, 8, 9, 5]).contains("a run of 9"));
    assert!(error(&[2, 2, 0, 8, 0, 5]).contains("a run of 0"));
    assert!(error(&[2, 2, 0, 8, 128, 5]).contains("a run of 128"));
    assert!(error(&[1, 1, 1, 3]).contains("a pixel before it"));
    assert!(error(&[5, 5, 5, 128, 1, 1, 1, 8]).contains("at most 7"));
    assert!(with(&[5, 5, 5, 128, 1, 1, 1, 7]).is_ok());
    // A repetition of nothing, again and again, ends with the data.
    assert!(error(&[[5, 5, 5, 128].as_slice(), &[1, 1, 1, 0].repeat(20)].concat()).contains("found"));
}

#[test]
fn a_value_beyond_single_precision_is_refused() {
    let bytes =
        hdr_of(&format!("EXPOSURE=1e-10\n{RGBE}"), "-Y 1 +X 8", &[[255, 1, 1, 255]; 8], 8, HdrCoding::Flat);
    assert!(decode(&bytes, &Limits::default()).unwrap_err().to_string().contains("beyond single precision"));
}

//! MLVQ databases: real ones against values that another decoder found, small ones against values found by hand.

use std::fs;
use std::path::{Path, PathBuf};

use btfkit_formats::mlvq::{Database, ZeroBytes, recognise};
use btfkit_formats::{ErrorKind, Images, Limits, SampleType, Samples};

use crate::mlvq_files::{Sketch, constant, grey, ints, reals};

const MATERIALS: [&str; 4] = ["alu", "corduroy", "impalla", "wallpaper"];

fn folder(material: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/mlvq-btf").join(material);
    if !folder.is_dir() {
        println!("no {material} beside the checkout: nothing was read");
        return None;
    }
    Some(folder)
}

fn known(folder: &Path) -> ZeroBytes {
    ZeroBytes::parse(&fs::read_to_string(folder.join("zero_bytes.txt")).unwrap()).unwrap()
}

pub(crate) fn floats(samples: &Samples) -> &[f32] {
    match samples {
        Samples::F32(list) => list,
        other => panic!("samples of type {}", other.sample_type().name()),
    }
}

/// Number of the direction of these angles, degrees.
fn direction(database: &Database, theta: f64, phi: f64) -> usize {
    let near = |a: f64, b: f64| (a.to_degrees() - b).abs() < 1e-9;
    database.contents().views.iter().position(|d| near(d.theta_rad, theta) && near(d.phi_rad, phi)).unwrap()
}

#[test]
fn values_are_those_of_another_decoder() {
    for material in MATERIALS {
        let Some(folder) = folder(material) else { return };
        let bytes = fs::read(folder.join("binary.btf")).unwrap();
        assert!(recognise(&bytes));
        let database = Database::open(&bytes, &known(&folder), &Limits::default()).unwrap();
        let contents = database.contents();
        assert_eq!((contents.views.len(), contents.lights.len()), (81, 81));
        assert_eq!((contents.sample_type, contents.channels.len()), (SampleType::F32, 3));

        let width = contents.width as usize;
        let mut worst = 0.0f64;
        let mut compared = 0;
        for line in csv::Reader::from_path(folder.join("expected_samples.csv")).unwrap().deserialize() {
            let (row, column, theta_i, phi_i, theta_v, phi_v, red, green, blue): (
                usize,
                usize,
                f64,
                f64,
                f64,
                f64,
                f64,
                f64,
                f64,
            ) = line.unwrap();
            let view = direction(&database, theta_v, phi_v);
            let light = direction(&database, theta_i, phi_i);
            let image = database.read_images(&bytes, view, light..light + 1).unwrap();
            let pixel = &floats(&image)[3 * (row * width + column)..][..3];
            for (&found, expected) in pixel.iter().zip([red, green, blue]) {
                worst = worst.max((255.0 * f64::from(found) - expected).abs());
            }
            compared += 1;
        }
        assert_eq!(compared, 200, "{material}");
        // The other decoder works on the text copies, whose densities of 0.01 to 0.3 have six decimals. Half of the
        // last one times a luminance scale of up to 2363, and 1.164 of YCbCr, is 0.0014; what is found is 0.0009 at
        // most.
        assert!(worst < 9e-4, "{material}: {worst}");
    }
}

/// Luminance 100 without colour, as a display value: 1.1643828 (100 - 16).
const GREY: f64 = 97.8087 / 255.0;

fn open(sketch: &Sketch) -> (Vec<u8>, Database) {
    let bytes = sketch.bytes();
    let database = Database::open(&bytes, &ZeroBytes::default(), &Limits::default()).unwrap();
    (bytes, database)
}

/// Green of the pixel at the top left, in units of [`GREY`], by angles in degrees of light and view.
fn green(sketch: &Sketch, light: (f64, f64), view: (f64, f64)) -> f64 {
    let (bytes, database) = open(sketch);
    let light = direction(&database, light.0, light.1);
    let image = database.read_images(&bytes, direction(&database, view.0, view.1), light..light + 1).unwrap();
    f64::from(floats(&image)[1]) / GREY
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 2e-5, "{found} where {expected} was expected");
}

#[test]
fn grey_is_grey_everywhere() {
    let (bytes, database) = open(&grey());
    let images = database.read_images(&bytes, 80, 0..81).unwrap();
    assert_eq!(images.len(), 81 * 6 * 3);
    assert!(floats(&images).iter().all(|&value| (f64::from(value) - GREY).abs() < 1e-5));
    let contents = database.contents();
    assert_eq!((contents.width, contents.height, contents.linear), (3, 2, false));
    assert!(contents.cosine_included);
    assert!(contents.assumptions.iter().all(|text| !text.contains("zero bytes")));
    assert_eq!(contents.remarks, [("material".to_owned(), "grey".to_owned())]);
}

#[test]
fn rows_and_columns_lie_as_in_the_tables() {
    let mut sketch = grey();
    sketch.slices_6d = ints(3, &[1, 2, 1, 2, 1, 1]);
    sketch.scale_6d = reals(3, 1.0, 2.0, &[16, 32, 64, 96, 128, 160]);
    sketch.slices_4d = ints(4, &[0; 8]);
    sketch.scale_4d = reals(4, 1.0, 3.0, &[128, 128, 128, 128, 64, 64, 64, 64]);
    let (bytes, database) = open(&sketch);
    let image = database.read_images(&bytes, 0, 7..8).unwrap();
    let factors = [1.0625 * 2.0, 1.125 * 1.5, 1.25 * 2.0, 1.375 * 1.5, 1.5 * 2.0, 1.625 * 2.0];
    for (pixel, factor) in floats(&image).chunks_exact(3).zip(factors) {
        assert_near(f64::from(pixel[1]) / GREY, factor);
    }
}

#[test]
fn the_view_is_interpolated_in_theta_and_phi() {
    let mut sketch = grey();
    sketch.scale_3d = reals(3, 1.0, 2.0, &[64, 128, 192]);
    for (theta, factor) in [(0.0, 1.25), (15.0, 1.25 + 0.25 / 3.0), (45.0, 1.5), (60.0, 1.5 + 0.25 / 3.0)] {
        assert_near(green(&sketch, (30.0, 90.0), (theta, 0.0)), factor);
    }
    let mut sketch = grey();
    sketch.scale_4d = reals(4, 1.0, 2.0, &[64, 128, 192, 32]);
    // Node k stands for the azimuth -90 k.
    let expected = [(0.0, 1.25), (90.0, 1.125), (180.0, 1.75), (270.0, 1.5), (330.0, 1.25 + 0.25 / 3.0)];
    for (phi, factor) in expected {
        assert_near(green(&sketch, (0.0, 0.0), (30.0, phi)), factor);
    }
}

#[test]
fn the_light_turns_with_the_view() {
    let mut sketch = grey();
    // Densities 0.1 to 0.3 at sines of beta -1, -1/2, 0, 1/2, 1.
    sketch.luminance_1d = reals(5, 0.1, 0.3, &[1, 64, 127, 192, 255]);
    let factor = |q: f64| (1.1643828 * (0.1 + 0.2 * q / 256.0) * 500.0 - 18.63) / 97.8087;
    assert_near(green(&sketch, (30.0, 90.0), (0.0, 0.0)), factor(64.0));
    assert_near(green(&sketch, (30.0, 270.0), (0.0, 0.0)), factor(192.0));
    assert_near(green(&sketch, (30.0, 0.0), (0.0, 0.0)), factor(127.0));
    // A quarter turn of the view takes the light with it.
    assert_near(green(&sketch, (30.0, 180.0), (30.0, 90.0)), factor(64.0));
    assert_near(green(&sketch, (30.0, 0.0), (30.0, 90.0)), factor(192.0));

    let mut sketch = grey();
    sketch.scale_2d = reals(3, 400.0, 600.0, &[64, 128, 192]);
    let factor = |scale: f64| (1.1643828 * 0.2 * scale - 18.63) / 97.8087;
    assert_near(green(&sketch, (45.0, 0.0), (0.0, 0.0)), factor(475.0));
    assert_near(green(&sketch, (45.0, 180.0), (0.0, 0.0)), factor(525.0));
    assert_near(green(&sketch, (45.0, 180.0), (45.0, 0.0)), factor(525.0));
}

#[test]
fn colours_follow_beta() {
    let mut sketch = grey();
    // (Cb, Cr) = (101, 102), (104, 108).
    sketch.colors = reals(2, 100.0, 116.0, &[16, 32, 64, 128]);
    sketch.color_rows = ints(5, &[0, 0, 0, 1, 1]);
    let (bytes, database) = open(&sketch);
    for (phi, cb, cr) in [(90.0, 101.0, 102.0), (270.0, 104.0, 108.0)] {
        let light = direction(&database, 30.0, phi);
        let image = database.read_images(&bytes, 0, light..light + 1).unwrap();
        let y = 116.43828;
        let expected = [
            y + 1.5960273 * cr - 222.921,
            y - 0.39176172 * cb - 0.81296875 * cr + 135.576,
            y + 2.0172344 * cb - 276.836,
        ];
        for (&found, expected) in floats(&image).iter().zip(expected) {
            assert_near(255.0 * f64::from(found), expected);
        }
    }
}

#[test]
fn zero_bytes_follow_their_neighbours() {
    let mut sketch = grey();
    sketch.scale_6d = reals(3, 1.0, 2.0, &[20, 0, 30, 200, 240, 0]);
    let (bytes, database) = open(&sketch);
    let values = |database: &Database| -> Vec<f64> {
        let image = database.read_images(&bytes, 0, 0..1).unwrap();
        floats(&image).chunks_exact(3).map(|pixel| f64::from(pixel[1]) / GREY).collect()
    };
    // Beside the first are 20, 30 and 240, beside the second 30 and 240: the second is the nearer to the maximum.
    let found = values(&database);
    assert_near(found[1], 1.0);
    assert_near(found[5], 2.0);
    assert!(database.contents().assumptions.iter().any(|text| text.contains("resolved by continuity: 2.")));

    let known = ZeroBytes::parse("PDF6Dscale 0 1 2.0 text\nPDF6Dscale 1 2 1.000001 text").unwrap();
    let database = Database::open(&bytes, &known, &Limits::default()).unwrap();
    let found = values(&database);
    assert_near(found[1], 2.0);
    assert_near(found[5], 1.0);
}

#[test]
fn densities_sum_to_one() {
    let mut sketch = grey();
    sketch.slices_2d = ints(3, &[0, 1, 0]);
    // Without their last values the rows sum to 0.7125 and 0.9; the last is 0.1 or 0.3.
    sketch.luminance_1d = reals(5, 0.1, 0.3, &[16, 64, 128, 192, 0, 160, 160, 160, 160, 0]);
    let (bytes, _) = open(&sketch);
    // A table of the same sums whose zero bytes are said to be otherwise is another one.
    for (text, same) in
        [("PDF1Dslice 0 4 0.3", true), ("PDF1Dslice 0 4 0.1", false), ("PDF1Dslice 1 4 0.1", true)]
    {
        let by_rule = Database::open(&bytes, &ZeroBytes::default(), &Limits::default()).unwrap();
        let known = Database::open(&bytes, &ZeroBytes::parse(text).unwrap(), &Limits::default()).unwrap();
        let images = |database: &Database| database.read_images(&bytes, 0, 0..81).unwrap();
        assert_eq!(images(&by_rule) == images(&known), same, "{text}");
    }
}

#[test]
fn what_is_said_that_changes_nothing_is_accepted() {
    let mut sketch = grey();
    sketch.scale_6d = reals(3, 1.0, 2.0, &[64, 0, 30, 200, 240, 0]);
    let bytes = sketch.bytes();
    let open = |text: &str| Database::open(&bytes, &ZeroBytes::parse(text).unwrap(), &Limits::default());
    let plain = open("").unwrap();
    let image = plain.read_images(&bytes, 0, 0..81).unwrap();
    // Tables of one value, and a byte that is not ambiguous.
    for text in ["PDF3Dscale 0 0 1.0", "PDF1Dslice 0 4 0.2", "PDF6Dscale 0 0 1.25", "PDF2Dscale 0 0 500.001"]
    {
        let database = open(text).unwrap();
        assert_eq!(database.read_images(&bytes, 0, 0..81).unwrap(), image, "{text}");
    }
    for text in ["PDF3Dscale 0 0 2.0", "PDF1Dslice 0 4 0.3", "PDF3Dscale 99 0 1.0", "PDF3Dscale 0 99 1.0"] {
        let error = open(text).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Argument, "{text}");
        assert!(error.to_string().contains(text.trim_end_matches(".0")), "{error}");
    }
}

#[test]
fn what_is_said_of_other_bytes_is_refused() {
    let mut sketch = grey();
    sketch.scale_6d = reals(3, 1.0, 2.0, &[20, 0, 30, 200, 240, 0]);
    let bytes = sketch.bytes();
    for (text, words) in [
        ("PDF6Dscale 0 0 1.0", "not ambiguous"),
        ("PDF6Dscale 0 1 1.5", "the value 1 or 2"),
        ("PDF6Dscale 9 1 1.0", "places in the table's 2 rows and 3 columns"),
        ("PDF6Dscale 0 4 1.0", "places in the table's 2 rows and 3 columns"),
        ("colors 0 0 127.0", "not ambiguous"),
    ] {
        let error = Database::open(&bytes, &ZeroBytes::parse(text).unwrap(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Argument, "{text}: {error}");
        assert!(error.to_string().contains(words), "{text}: {error}");
    }
    for text in ["PDF7Dscale 0 0 1.0", "PDF6Dscale 0 1", "PDF6Dscale -1 0 1", "PDF6Dscale 0 0 nan"] {
        let error = ZeroBytes::parse(&format!("# comment\n{text}\n")).unwrap_err();
        assert_eq!((error.kind(), error.offset()), (ErrorKind::Malformed, Some(10)), "{text}");
    }
    assert!(ZeroBytes::parse("colors 0 0 1\ncolors 1 0 1\ncolors 0 0 2").is_err());
}

#[test]
fn a_database_cut_anywhere_is_an_error() {
    let whole = grey().bytes();
    for end in 0..whole.len() {
        let error = Database::open(&whole[..end], &ZeroBytes::default(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{end} of {}: {error}", whole.len());
    }
    let mut longer = whole;
    longer.push(0);
    assert!(Database::open(&longer, &ZeroBytes::default(), &Limits::default()).is_err());
}

#[test]
fn a_flipped_bit_in_a_database_never_panics() {
    let mut sketch = grey();
    sketch.slices_6d = ints(3, &[1, 2, 1, 2, 1, 1]);
    sketch.slices_4d = ints(4, &[0; 8]);
    sketch.scale_4d = reals(4, 1.0, 3.0, &[128, 0, 128, 128, 64, 0, 64, 64]);
    let whole = sketch.bytes();
    let mut read = 0;
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(database) = Database::open(&flipped, &ZeroBytes::default(), &Limits::default()) {
            let images = database.read_images(&flipped, 17, 3..5).unwrap();
            assert!(images.len() <= 2 * 3 * 8 * flipped.len());
            read += 1;
        }
    }
    assert!(read > 0 && read < 8 * whole.len());
}

#[test]
fn nonsense_is_refused_with_a_reason() {
    let cases: [(usize, &str, ErrorKind, &str); 13] = [
        (1, "2", ErrorKind::Unsupported, "format 2"),
        (4, "3", ErrorKind::Unsupported, "number of materials 3"),
        (9, "151", ErrorKind::Unsupported, "views 151"),
        (12, "1 11 0 11 0 7 0 16 0 0 0 1", ErrorKind::Unsupported, "0 0 0 1"),
        (12, "1 2000000000 0 3 0 3 0 4 0 0 0 0", ErrorKind::Unsupported, "nodes"),
        (12, "1 5 0 3 0 3 0 4 0 0 0", ErrorKind::Malformed, "12 numbers"),
        (14, "4294967295 1 1 1 1 1 1 0 1 0", ErrorKind::Malformed, "4294967295 x 5"),
        (14, "1 1 4611686018427387904 1 1 1 1 0 1 0", ErrorKind::Malformed, "4611686018427387904 x 5"),
        (14, "1 1 1099511627776 1 1 1 1 0 1 0", ErrorKind::Malformed, "1099511627776 x 5"),
        (14, "1 1 1 1 1 1 -1 0 1 0", ErrorKind::Malformed, "positive"),
        (17, "grey a b c 0 0 2147483648 2147483648 0.0", ErrorKind::Limit, "max_pixels_per_image"),
        (17, "grey a b c 0 0 2 0 0.0", ErrorKind::Malformed, "0 x 2"),
        (17, "grey a b c 0 0 2 3 1.5", ErrorKind::Unsupported, "HDR scale 1.5"),
    ];
    for (number, line, kind, part) in cases {
        let sketch = Sketch { lines: vec![(number, line.to_owned())], ..grey() };
        let error = Database::open(&sketch.bytes(), &ZeroBytes::default(), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{line}: {error}");
        assert!(error.to_string().contains(part), "{line}: {error}");
        assert!(error.offset().is_some(), "{line}: {error}");
    }
    // A number of a function that is not there, in every table of numbers.
    let places: [fn(&mut Sketch) -> &mut Vec<i32>; 7] = [
        |s| &mut s.slices_6d.values,
        |s| &mut s.color_rows.values,
        |s| &mut s.slices_2d.values,
        |s| &mut s.colors_2d.values,
        |s| &mut s.indices_2d.values,
        |s| &mut s.slices_3d.values,
        |s| &mut s.slices_4d.values,
    ];
    for (table, values) in places.into_iter().enumerate() {
        for wrong in [-1, 2] {
            let mut sketch = grey();
            values(&mut sketch)[1] = wrong;
            let error =
                Database::open(&sketch.bytes(), &ZeroBytes::default(), &Limits::default()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed, "table {table}, {wrong}: {error}");
        }
    }
    for (min, max) in [(f32::NAN, 1.0), (2.0, 1.0), (0.0, f32::INFINITY)] {
        let mut sketch = grey();
        sketch.scale_2d = reals(3, min, max, &[1; 3]);
        assert!(Database::open(&sketch.bytes(), &ZeroBytes::default(), &Limits::default()).is_err());
    }
    let mut sketch = grey();
    sketch.scale_6d = constant(2, 3, 1.0);
    let error = Database::open(&sketch.bytes(), &ZeroBytes::default(), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("3 x 2 values"), "{error}");
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let (bytes, database) = open(&grey());
    let argument = |view, lights, bytes: &[u8]| {
        assert_eq!(database.read_images(bytes, view, lights).unwrap_err().kind(), ErrorKind::Argument);
    };
    argument(81, 0..1, &bytes);
    argument(0, 80..82, &bytes);
    argument(0, 0..1, &bytes[1..]);
    assert!(database.read_images(&bytes, 0, 5..5).unwrap().is_empty());

    let mut limits = Limits::default();
    limits.max_decoded_bytes = 6 * 3 * 4 * 2;
    let database = Database::open(&bytes, &ZeroBytes::default(), &limits).unwrap();
    assert_eq!(database.read_images(&bytes, 0, 0..2).unwrap().len(), 36);
    assert_eq!(database.read_images(&bytes, 0, 0..3).unwrap_err().kind(), ErrorKind::Limit);
}

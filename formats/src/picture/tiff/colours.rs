//! What a TIFF says of its colours and levels (TIFF 6.0, section 20; TIFF/EP and DNG for the levels). Nothing of it is
//! applied.

use super::directory::{Directory, tag};
use crate::picture::profile::{of_chromaticities, of_exif_space, of_icc, of_xmp};

/// What is said if it is not that samples are sRGB over their full range. `most` is the largest sample of an integer
/// type.
pub(super) fn said(directory: &Directory<'_>, exif_space: Option<u64>, most: Option<f64>) -> Option<String> {
    let colours = match directory.bytes_of(tag::ICC_PROFILE) {
        Some(icc) => of_icc(icc),
        None => of_tags(directory)
            .or_else(|| of_exif_space(exif_space))
            .or_else(|| of_xmp(directory.bytes_of(tag::XMP)?)),
    };
    let said: Vec<String> = colours.into_iter().chain(levels(directory, most)).collect();
    (!said.is_empty()).then(|| said.join(", with "))
}

fn of_tags(directory: &Directory<'_>) -> Option<String> {
    for (tag, what) in [
        (tag::TRANSFER_FUNCTION, "a transfer function of its own"),
        (tag::GRAY_RESPONSE_CURVE, "a grey response curve of its own"),
    ] {
        if directory.bytes_of(tag).is_some() {
            return Some(what.to_owned());
        }
    }
    let white = directory.reals(tag::WHITE_POINT);
    let Some(primaries) = directory.reals(tag::PRIMARIES) else {
        // The white of sRGB is D65.
        let is_srgb = |white: &Vec<f64>| matches!(white[..], [x, y] if (x - 0.3127).abs() < 2e-3 && (y - 0.329).abs() < 2e-3);
        return white.filter(|white| !is_srgb(white)).map(|white| format!("the white point {white:?}"));
    };
    of_chromaticities(&[primaries, white.unwrap_or_default()].concat())
}

/// What samples stand for black and white, where these are not the ends of the range.
fn levels(directory: &Directory<'_>, most: Option<f64>) -> Vec<String> {
    let of = |tag| directory.bytes_of(tag).map(|_| directory.reals(tag).unwrap_or_default());
    let mut said = Vec::new();
    let mut say = |what: &str, values: &[f64]| said.push(format!("{what} {values:?}"));
    if let Some(levels) = of(tag::REFERENCE_BLACK_WHITE) {
        let full = |pair: &[f64]| matches!(pair, [black, white] if *black == 0.0 && Some(*white) == most);
        if levels.is_empty() || !levels.chunks(2).all(full) {
            say("the reference black and white", &levels);
        }
    }
    if let Some(levels) =
        of(tag::BLACK_LEVEL).filter(|list| list.is_empty() || list.iter().any(|&v| v != 0.0))
    {
        say("the black level", &levels);
    }
    // White in floats is 1, whatever the tag's integers say.
    let full = |list: &Vec<f64>| !list.is_empty() && list.iter().all(|&v| v == most.unwrap_or(1.0));
    if let Some(levels) = of(tag::WHITE_LEVEL).filter(|list| !full(list)) {
        say("the white level", &levels);
    }
    // Most writers state the largest sample that there is; all ones in binary are the range of a sensor of fewer bits.
    let fewer_bits =
        |&value: &f64| (15.0..most.unwrap_or(0.0)).contains(&value) && (value + 1.0).log2().fract() == 0.0;
    if let Some(levels) = of(tag::MAX_SAMPLE_VALUE).filter(|list| list.iter().any(fewer_bits)) {
        say("the largest sample value", &levels);
    }
    if of(tag::LINEARIZATION_TABLE).is_some() {
        said.push("a linearization table".to_owned());
    }
    said
}

//! What a TIFF says of its pixels that is not applied: a crop (DNG), samples that are none and scales (GDAL), pixels that
//! are not square, the range and the calibration of samples (ImageJ, OME).

use super::directory::{Directory, tag};
use super::exif;
use crate::picture::{aspect, unapplied};

/// Longest text of a tag that is told, bytes.
const LONGEST: usize = 60;

/// A sentence each, of a picture of `size` columns and rows.
/// `most` is the largest sample of an integer type.
pub(super) fn of(directory: &Directory<'_>, (width, height): (u64, u64), most: Option<f64>) -> Vec<String> {
    let whole = |list: &[f64], expected: &[f64]| list == expected;
    let (width, height) = (width as f64, height as f64);
    let crops = [
        (tag::DEFAULT_CROP_ORIGIN, "the crop's origin", vec![0.0, 0.0]),
        (tag::DEFAULT_CROP_SIZE, "the crop's size", vec![width, height]),
        (tag::ACTIVE_AREA, "the active area", vec![0.0, 0.0, height, width]),
        (tag::DEFAULT_USER_CROP, "the user's crop", vec![0.0, 0.0, 1.0, 1.0]),
    ];
    let crops = crops.into_iter().filter_map(|(tag, what, expected)| {
        directory.bytes_of(tag)?;
        let found = directory.reals(tag).unwrap_or_default();
        (!whole(&found, &expected)).then(|| {
            format!("{what} {found:?} (DNG) is not applied: all {width} x {height} pixels are the picture")
        })
    });
    let no_data = text(directory, tag::GDAL_NODATA).map(|value| {
        format!(
            "samples of {value:?} are no data by GDAL_NODATA, which is not applied: they are read as they are"
        )
    });
    crops
        .chain(no_data)
        .chain(scaled(directory))
        .chain(not_square(directory))
        .chain(range(directory, most))
        .chain(exif::of_tags(directory, &[(tag::BASELINE_EXPOSURE, "BaselineExposure")]))
        .chain(exif::gamma(directory))
        .chain(described(directory, most))
        .collect()
}

/// The range of samples (SMinSampleValue, SMaxSampleValue), where it is not that of their type: 0 to 1 for floats.
fn range(directory: &Directory<'_>, most: Option<f64>) -> Vec<String> {
    let ends = [
        (tag::SMIN_SAMPLE_VALUE, "SMinSampleValue", 0.0),
        (tag::SMAX_SAMPLE_VALUE, "SMaxSampleValue", most.unwrap_or(1.0)),
    ];
    let told = ends.into_iter().filter_map(|(tag, name, ordinary)| {
        directory.bytes_of(tag)?;
        let values = directory.reals(tag).unwrap_or_default();
        let is_ordinary = !values.is_empty() && values.iter().all(|value| *value == ordinary);
        if is_ordinary { None } else { unapplied::remark_of(name, &values) }
    });
    told.collect()
}

/// What the description says of samples: the calibration of ImageJ (`cf`, its function, and its coefficients), the bits
/// that OME says are used.
fn described(directory: &Directory<'_>, most: Option<f64>) -> Option<String> {
    let text = String::from_utf8_lossy(directory.bytes_of(tag::IMAGE_DESCRIPTION)?);
    if text.starts_with("ImageJ=") {
        let function = text.lines().find_map(|line| line.strip_prefix("cf="))?;
        return unapplied::remark("ImageJ:CalibrationFunction", function);
    }
    let (_, value) = text.split_once("SignificantBits=")?;
    let bits = value.trim_start_matches(['"', '\'']).split(['"', '\'']).next()?;
    let is_all =
        bits.parse::<u32>().is_ok_and(|bits| most.map(|most| (most + 1.0).log2()) == Some(f64::from(bits)));
    if is_all { None } else { unapplied::remark("OME:SignificantBits", bits) }
}

/// A scale other than 1 or an offset other than 0 in GDAL's metadata, `<Item name="SCALE" role="scale">0.1</Item>`.
fn scaled(directory: &Directory<'_>) -> Option<String> {
    let metadata = String::from_utf8_lossy(directory.bytes_of(tag::GDAL_METADATA)?).to_lowercase();
    let differs = |item: &str| {
        let (attributes, value) = item.split_once('>').unwrap_or((item, ""));
        let value = value.split('<').next().unwrap_or_default().trim().parse::<f64>();
        let attributes = attributes.replace('\'', "\"");
        let is = |name: &str| attributes.contains(&format!("\"{name}\""));
        is("scale") && value != Ok(1.0) || is("offset") && value != Ok(0.0)
    };
    metadata.split("<item").skip(1).any(differs).then(|| {
        "the scale and the offset of samples in GDAL_METADATA are not applied: samples are read as stored"
            .to_owned()
    })
}

fn not_square(directory: &Directory<'_>) -> Option<String> {
    let number = |tag, at: usize| directory.reals(tag)?.get(at).copied();
    let resolutions = number(tag::X_RESOLUTION, 0).zip(number(tag::Y_RESOLUTION, 0));
    let sizes = number(tag::MODEL_PIXEL_SCALE, 0).zip(number(tag::MODEL_PIXEL_SCALE, 1));
    let by_size = || sizes.and_then(|(width, height)| aspect::remark(width / height, "ModelPixelScale"));
    resolutions
        .and_then(|(across, down)| aspect::of_densities(across, down, "the resolutions"))
        .or_else(by_size)
}

/// A text without what ends it.
fn text(directory: &Directory<'_>, tag: u16) -> Option<String> {
    let bytes = directory.bytes_of(tag)?;
    let text = String::from_utf8_lossy(bytes.get(..bytes.len().min(LONGEST))?);
    Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned())
}

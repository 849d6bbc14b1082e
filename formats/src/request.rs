//! What a caller of [`Images::read_images`](crate::Images::read_images) may ask for.

use std::ops::Range;

use crate::words::counted;
use crate::{Contents, Error, ErrorKind, Limits, Result};

/// Bytes and contents of a container as they were when it was opened.
pub(crate) fn check(
    contents: &Contents,
    opened_bytes: usize,
    bytes: &[u8],
    view: usize,
    lights: &Range<usize>,
) -> Result<()> {
    let argument = |found: String, expected: String| Error::new(ErrorKind::Argument, found, expected);
    if bytes.len() != opened_bytes {
        return Err(argument(
            format!("a file of {}", counted(bytes.len(), "byte")),
            format!("{opened_bytes}, as when it was opened"),
        ));
    }
    let (views, all_lights) = (contents.views.len(), contents.lights.len());
    if view >= views {
        return Err(argument(format!("view {view}"), format!("less than {views}")));
    }
    if lights.start > lights.end || lights.end > all_lights {
        return Err(argument(format!("lights {lights:?}"), format!("a range within 0..{all_lights}")));
    }
    Ok(())
}

/// Samples of that many images, if [`Limits::max_decoded_bytes`] allows them.
pub(crate) fn samples(contents: &Contents, images: usize, limits: &Limits) -> Result<usize> {
    let pixels = u64::from(contents.width).checked_mul(u64::from(contents.height));
    let channels = u64::try_from(contents.channels.len()).ok();
    let samples = pixels
        .zip(channels)
        .and_then(|(pixels, channels)| pixels.checked_mul(channels))
        .and_then(|one| one.checked_mul(u64::try_from(images).ok()?));
    let size = u64::try_from(contents.sample_type.bytes()).ok();
    let total = samples.zip(size).and_then(|(samples, size)| samples.checked_mul(size));
    match samples.and_then(|samples| usize::try_from(samples).ok()) {
        Some(samples) if total.is_some_and(|total| total <= limits.max_decoded_bytes) => Ok(samples),
        _ => Err(Error::new(
            ErrorKind::Limit,
            format!(
                "{} of {} x {} x {} {}",
                counted(images, "image"),
                contents.width,
                contents.height,
                contents.channels.len(),
                contents.sample_type.name()
            ),
            format!("at most {} in one call (max_decoded_bytes)", counted(limits.max_decoded_bytes, "byte")),
        )),
    }
}

/// Refuses planes that are empty or larger than the limits allow; sizes as `u32` columns and rows.
pub(crate) fn plane(width: u64, height: u64, channels: u64, limits: &Limits) -> Result<(u32, u32)> {
    if width == 0 || height == 0 || channels == 0 {
        return Err(Error::malformed(
            format!("images of {width} x {height} pixels, {}", counted(channels, "channel")),
            "at least 1 x 1, 1",
        ));
    }
    if width.checked_mul(height).is_none_or(|pixels| pixels > limits.max_pixels_per_image) {
        return Err(Error::new(
            ErrorKind::Limit,
            format!("images of {width} x {height} pixels"),
            format!("at most {} (max_pixels_per_image)", counted(limits.max_pixels_per_image, "pixel")),
        ));
    }
    if channels > limits.max_channels {
        return Err(Error::new(
            ErrorKind::Limit,
            counted(channels, "channel"),
            format!("at most {} (max_channels)", limits.max_channels),
        ));
    }
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(width), Ok(height)) => Ok((width, height)),
        _ => Err(Error::new(
            ErrorKind::Limit,
            format!("images of {width} x {height} pixels"),
            format!("sides of at most {}", u32::MAX),
        )),
    }
}

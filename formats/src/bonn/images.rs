//! Images out of factors: block over pixels, so that nothing is expanded but what is asked for.

use std::ops::Range;

use half::slice::HalfFloatSliceExt;

use super::color::expand_range;
use super::factors::{Factors, Product};
use super::product::{LANES, PackedLights, PackedPixels, Scratch, multiply};
use crate::{Error, Result, f16};

/// Pixels that are worked on at a time: their factors and their values stay in the cache.
const BLOCK: usize = 8 * LANES;

/// The plane, and which of its rows is stored first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) bottom_first: bool,
}

impl Plane {
    pub(super) fn pixels(&self) -> usize {
        self.width.saturating_mul(self.height)
    }

    /// The runs of pixels within one row that a range of stored pixels consists of, in order: number of the
    /// first pixel in the image (row 0 at the top), and length.
    pub(super) fn runs(self, stored: Range<usize>) -> impl Iterator<Item = (usize, usize)> {
        let mut at = stored.start;
        std::iter::from_fn(move || {
            let (row, column) = (at.checked_div(self.width)?, at.checked_rem(self.width)?);
            let len = self.width.checked_sub(column)?.min(stored.end.checked_sub(at)?);
            let row = if self.bottom_first { self.height.checked_sub(row)?.checked_sub(1)? } else { row };
            at = at.checked_add(len)?;
            (len > 0).then_some((row.checked_mul(self.width)?.checked_add(column)?, len))
        })
    }
}

/// A type that samples are handed out in.
pub(super) trait Sample: Copy + Default {
    /// Rounds values, which are finite, to samples.
    fn store(values: &mut [f32], samples: &mut [Self]);
}

impl Sample for f32 {
    fn store(values: &mut [f32], samples: &mut [f32]) {
        samples.copy_from_slice(values);
    }
}

impl Sample for f16 {
    /// Values beyond the range become its ends.
    fn store(values: &mut [f32], samples: &mut [f16]) {
        let (least, most) = (f16::MIN.to_f32(), f16::MAX.to_f32());
        values.iter_mut().for_each(|value| *value = value.clamp(least, most));
        samples.convert_from_f32_slice(values);
    }
}

/// The images of a view under a range of lights, `[light, y, x, channel]`. `samples` is the number of them.
pub(super) fn read<S: Sample>(
    factors: &Factors,
    bytes: &[u8],
    plane: Plane,
    products: &[Product],
    lights: Range<usize>,
    samples: usize,
) -> Result<Vec<S>> {
    let channels = products.len();
    let pixels = plane.pixels();
    let mut scratch = Scratch::default();
    let mut light_factors = Vec::new();
    for product in products {
        let mut packed = PackedLights::default();
        packed.fetch(bytes, product, &product.lights, lights.clone(), &mut scratch)?;
        light_factors.push(packed);
    }
    let mut images = vec![S::default(); samples];
    let stride = BLOCK.saturating_mul(channels);
    let mut values = vec![0.0; stride.saturating_mul(lights.len())];
    let mut pixel_factors = PackedPixels::default();
    for start in (0..pixels).step_by(BLOCK) {
        let block = start..start.saturating_add(BLOCK).min(pixels);
        for (channel, (product, light_factors)) in products.iter().zip(&light_factors).enumerate() {
            pixel_factors.fetch(bytes, product, &product.pixels, block.clone(), &mut scratch)?;
            multiply(light_factors, &pixel_factors, &mut values, (stride, channels, channel));
        }
        let image = pixels.saturating_mul(channels);
        for ((light, values), image) in
            lights.clone().zip(values.chunks_exact_mut(stride)).zip(images.chunks_exact_mut(image))
        {
            let values = values.get_mut(..block.len().saturating_mul(channels)).unwrap_or_default();
            factors.color.undo(values, channels);
            if factors.log {
                expand_range(values);
            }
            if values.iter().any(|value| !value.is_finite()) {
                let found = format!("a value that is not finite under light {light}, pixels {block:?}");
                return Err(Error::malformed(found, "finite reflectances"));
            }
            store_runs(values, plane.runs(block.clone()), channels, image);
        }
    }
    Ok(images)
}

/// Puts the values of consecutive stored pixels where they belong in an image.
fn store_runs<S: Sample>(
    values: &mut [f32],
    runs: impl Iterator<Item = (usize, usize)>,
    channels: usize,
    image: &mut [S],
) {
    let mut rest = values;
    for (first, len) in runs {
        let (start, len) = (first.saturating_mul(channels), len.saturating_mul(channels));
        let Some((run, others)) = rest.split_at_mut_checked(len) else { return };
        if let Some(samples) = image.get_mut(start..start.saturating_add(len)) {
            S::store(run, samples);
        }
        rest = others;
    }
}

//! The multiply-adds: rows of lights times rows of pixels.
//!
//! Every value is a sum in f32 in the order of the components, without fused operations, so that it does not
//! depend on the machine or on how the work is cut.

use super::factors::{Factor, Last, Product};
use crate::{Error, Result, f16};

/// Lights whose sums are kept in registers at the same time.
const PACK: usize = 4;

/// Pixels whose sums are kept in registers at the same time; two vectors of SSE2.
pub(super) const LANES: usize = 8;

/// One factor of a view and channel, rounded to f32 and laid out for the multiplication: `N` rows at a time,
/// component by component.
#[derive(Debug, Default)]
pub(super) struct Packed<const N: usize> {
    values: Vec<[f32; N]>,
    components: usize,
}

pub(super) type PackedLights = Packed<PACK>;
pub(super) type PackedPixels = Packed<LANES>;

/// Room that is used again from row to row.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    row: Vec<f32>,
    halves: Vec<f16>,
}

impl<const N: usize> Packed<N> {
    /// Fetches the rows `indices` of one factor of a product.
    pub(super) fn fetch(
        &mut self,
        bytes: &[u8],
        product: &Product,
        factor: &Factor,
        indices: std::ops::Range<usize>,
        scratch: &mut Scratch,
    ) -> Result<()> {
        self.components = product.rank.saturating_add(usize::from(factor.last.is_some()));
        self.values.clear();
        self.values.resize(self.components.saturating_mul(indices.len().div_ceil(N)), [0.0; N]);
        scratch.row.resize(self.components, 0.0);
        let mut indices = indices;
        for pack in self.values.chunks_exact_mut(self.components) {
            for (lane, index) in indices.by_ref().take(N).enumerate() {
                read_row(bytes, product, factor, index, scratch)?;
                for (values, &value) in pack.iter_mut().zip(&scratch.row) {
                    if let Some(place) = values.get_mut(lane) {
                        *place = value;
                    }
                }
            }
        }
        Ok(())
    }

    fn packs(&self) -> std::slice::ChunksExact<'_, [f32; N]> {
        self.values.chunks_exact(self.components.max(1))
    }
}

fn read_row(
    bytes: &[u8],
    product: &Product,
    factor: &Factor,
    index: usize,
    scratch: &mut Scratch,
) -> Result<()> {
    let Scratch { row, halves } = scratch;
    let (components, mean) = row.split_at_mut_checked(product.rank).ok_or_else(gone)?;
    product.scalar.decode(factor.rows.row(bytes, index).ok_or_else(gone)?, components, halves);
    match factor.last {
        None => {}
        Some(Last::One) => mean.fill(1.0),
        Some(Last::Mean(means)) => {
            product.scalar.decode(means.row(bytes, index).ok_or_else(gone)?, mean, halves);
        }
    }
    Ok(())
}

fn gone() -> Error {
    Error::malformed("the end of the data", "the matrices that were there when the archive was opened")
}

/// Multiplies, and puts the value of light l and pixel p of the block at `l * stride + p * channels + channel`.
pub(super) fn multiply(
    lights: &PackedLights,
    pixels: &PackedPixels,
    values: &mut [f32],
    (stride, channels, channel): (usize, usize, usize),
) {
    for (values, lights) in values.chunks_mut(stride.saturating_mul(PACK)).zip(lights.packs()) {
        for (group, pixels) in pixels.packs().enumerate() {
            let first_pixel = group.saturating_mul(LANES);
            for (values, sums) in values.chunks_exact_mut(stride).zip(tile(lights, pixels)) {
                let pixels = values.chunks_exact_mut(channels).skip(first_pixel);
                for (pixel, sum) in pixels.zip(sums) {
                    if let Some(value) = pixel.get_mut(channel) {
                        *value = sum;
                    }
                }
            }
        }
    }
}

/// All products of a pack of lights and a pack of pixels.
fn tile(lights: &[[f32; PACK]], pixels: &[[f32; LANES]]) -> [[f32; LANES]; PACK] {
    let mut sums = [[0.0; LANES]; PACK];
    for (light, pixel) in lights.iter().zip(pixels) {
        for (sums, &factor) in sums.iter_mut().zip(light) {
            for (sum, &value) in sums.iter_mut().zip(pixel) {
                *sum += factor * value;
            }
        }
    }
    sums
}

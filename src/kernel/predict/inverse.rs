//! From residuals to samples.

use super::forward::{predict, share};
use super::lane::{BLOCK, Lane, block, block_mut};
use super::mode::{DISTANCES, Mode, Spatial, Weight};
use super::{Masks, SLACK, Shape};

/// Buffers that are used again from channel to channel.
#[derive(Default)]
pub(super) struct Scratch<T> {
    residual: Vec<T>,
    lower: Vec<T>,
}

/// Adds to the residuals of a row what the lights around them predict, as the encoder took it away.
///
/// Reads one buffer and writes another: the bytes just written are not yet where a shifted read finds them fast.
#[inline(always)]
fn unlift<T: Lane>(from: &[T], out: &mut [T], level: usize, weight: Weight, mask: &[T]) {
    let n = mask.len();
    let before = &from[SLACK - DISTANCES[level]..];
    let after = &from[SLACK + DISTANCES[level]..];
    let (from, before, after) = (&from[SLACK..SLACK + n], &before[..n], &after[..n]);
    let out = &mut out[SLACK..SLACK + n];
    macro_rules! give {
        ($weight:expr) => {
            for i in 0..n {
                out[i] = from[i].plus(share($weight, before[i], after[i]).and(mask[i]));
            }
        };
    }
    match weight {
        Weight::None => {}
        Weight::Half => give!(Weight::Half),
        Weight::Whole => give!(Weight::Whole),
    }
}

/// One texel of the plane, in blocks from the last to the first. The last reaches into the texel after it, which is
/// written later; in this order no block reads what was just overwritten in part.
#[inline(always)]
fn texel<T: Lane>(
    plane: &mut [T],
    residual: &[T],
    n: usize,
    [at, left, above, corner, right]: [usize; 5],
    f: impl Fn(T, T, T, T) -> T,
) {
    for start in (0..n).step_by(BLOCK).rev() {
        let here = block(residual, start);
        let (l, u) = (block(plane, left + start), block(plane, above + start));
        let (c, r) = (block(plane, corner + start), block(plane, right + start));
        let mut out = [T::default(); BLOCK];
        for i in 0..BLOCK {
            out[i] = here[i].minus(T::HALF).plus(f(l[i], u[i], c[i], r[i]));
        }
        *block_mut(plane, at + start) = out;
    }
}

#[inline(always)]
fn row<T: Lane>(plane: &mut [T], residual: &[T], shape: Shape, y: usize, spatial: Spatial) {
    let (n, columns) = (shape.lights, shape.columns);
    let start = y * columns * n;
    if y == 0 {
        let mut before = T::HALF;
        for (out, &residual) in plane[..n].iter_mut().zip(residual) {
            before = before.plus(residual.minus(T::HALF));
            *out = before;
        }
        for x in 1..columns {
            let left = (x - 1) * n;
            texel(plane, &residual[x * n..], n, [x * n, left, left, left, left], |l, _, _, _| l);
        }
        return;
    }
    let up = start - columns * n;
    texel(plane, residual, n, [start, up, up, up, up], |_, u, _, _| u);
    macro_rules! interior {
        ($spatial:expr) => {
            for x in 1..columns {
                let (at, above) = (start + x * n, up + x * n);
                let right = if x + 1 == columns { above } else { above + n };
                texel(plane, &residual[x * n..], n, [at, at - n, above, above - n, right], |l, u, c, r| {
                    predict($spatial, l, u, c, r)
                });
            }
        };
    }
    match spatial {
        Spatial::Median => interior!(Spatial::Median),
        Spatial::Smooth => interior!(Spatial::Smooth),
        Spatial::Mean => interior!(Spatial::Mean),
    }
}

/// One channel of planes of bytes, the highest first; `plane` has [`SLACK`] after its samples.
#[inline(always)]
pub(super) fn samples<T: Lane>(
    bytes: &[u8],
    shape: Shape,
    mode: Mode,
    masks: &Masks<T>,
    scratch: &mut Scratch<T>,
    plane: &mut [T],
) {
    let (length, n) = (shape.columns * shape.lights, shape.lights);
    let Scratch { residual, lower } = scratch;
    residual.resize(length + 2 * SLACK, T::HALF);
    lower.resize(length + 2 * SLACK, T::HALF);
    for y in 0..shape.rows {
        let values = &mut residual[SLACK..SLACK + length];
        for (number, plane) in bytes.chunks_exact(shape.samples()).enumerate() {
            let place = T::BYTES - 1 - number;
            let bytes = &plane[y * length..(y + 1) * length];
            for (value, &byte) in values.iter_mut().zip(bytes) {
                let higher = if number == 0 { T::default() } else { *value };
                *value = higher.or(T::at(byte, place));
            }
        }
        for value in values.iter_mut() {
            *value = value.unzigzag().plus(T::HALF);
        }
        // The very first texel was not predicted from the lights around.
        let skipped = if y == 0 { n } else { 0 };
        for (level, mask) in masks.iter().enumerate() {
            if mode.weights[level] != Weight::None {
                unlift(residual, lower, level, mode.weights[level], mask);
                lower[SLACK..SLACK + skipped].copy_from_slice(&residual[SLACK..SLACK + skipped]);
                std::mem::swap(residual, lower);
            }
        }
        row(plane, &residual[SLACK..], shape, y, mode.spatial);
    }
}

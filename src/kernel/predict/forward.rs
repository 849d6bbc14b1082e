//! From samples to residuals.

use super::lane::{BLOCK, Lane, block, block_mut};
use super::mode::{DISTANCES, Mode, Spatial, Weight};
use super::{Masks, SLACK, Shape};

/// Buffers that are used again from channel to channel.
#[derive(Default)]
pub(super) struct Scratch<T> {
    residual: Vec<T>,
    lifted: Vec<T>,
    costs: Vec<T>,
}

/// The median of left, above and their plane: clamping the corner does it without overflow.
#[inline(always)]
pub(super) fn median<T: Lane>(left: T, above: T, corner: T) -> T {
    let (low, high) = (left.min(above), left.max(above));
    low.plus(high).minus(corner.clamp(low, high))
}

#[inline(always)]
pub(super) fn predict<T: Lane>(spatial: Spatial, left: T, above: T, corner: T, right: T) -> T {
    match spatial {
        Spatial::Median => median(left, above, corner),
        Spatial::Smooth => median(left, above, corner).mean(left.mean(above)),
        Spatial::Mean => left.mean(above.mean(right)),
    }
}

/// Residuals, centred on half, of the texels `columns` of row `y`; `columns` starts after 0.
#[inline(always)]
fn interior<T: Lane>(
    spatial: Spatial,
    plane: &[T],
    shape: Shape,
    y: usize,
    columns: std::ops::Range<usize>,
    out: &mut [T],
) {
    let n = shape.lights;
    let row = y * shape.columns * n;
    let (from, to) = (row + columns.start * n, row + columns.end * n);
    let (here, left) = (&plane[from..to], &plane[from - n..to - n]);
    let out = &mut out[..to - from];
    if y == 0 {
        for ((out, &here), &left) in out.iter_mut().zip(here).zip(left) {
            *out = here.minus(left).plus(T::HALF);
        }
        return;
    }
    let up = shape.columns * n;
    let (above, corner) = (&plane[from - up..to - up], &plane[from - up - n..to - up - n]);
    // Nothing lies above right of the last column.
    let last = if columns.end == shape.columns { n.min(to - from) } else { 0 };
    let body = to - from - last;
    let right = &plane[from - up + n..];
    macro_rules! subtract {
        ($spatial:expr, $range:expr, $right:expr) => {{
            let range = $range;
            let (out, here, left) = (&mut out[range.clone()], &here[range.clone()], &left[range.clone()]);
            let (above, corner) = (&above[range.clone()], &corner[range.clone()]);
            let right = &$right[range];
            for i in 0..out.len() {
                let foretold = predict($spatial, left[i], above[i], corner[i], right[i]);
                out[i] = here[i].minus(foretold).plus(T::HALF);
            }
        }};
    }
    match spatial {
        Spatial::Median => subtract!(Spatial::Median, 0..to - from, above),
        Spatial::Smooth => subtract!(Spatial::Smooth, 0..to - from, above),
        Spatial::Mean => {
            subtract!(Spatial::Mean, 0..body, right);
            subtract!(Spatial::Mean, body..to - from, above);
        }
    }
}

/// Residuals, centred on half, of the first texel of row `y`.
#[inline(always)]
fn first<T: Lane>(plane: &[T], shape: Shape, y: usize, out: &mut [T]) {
    let n = shape.lights;
    let row = y * shape.columns * n;
    let here = &plane[row..row + n];
    if y == 0 {
        let mut before = T::HALF;
        for (out, &here) in out.iter_mut().zip(here) {
            *out = here.minus(before).plus(T::HALF);
            before = here;
        }
    } else {
        let up = row - shape.columns * n;
        for ((out, &here), &above) in out.iter_mut().zip(here).zip(&plane[up..up + n]) {
            *out = here.minus(above).plus(T::HALF);
        }
    }
}

/// What of the mean of two residuals is taken away, all centred on half.
#[inline(always)]
pub(super) fn share<T: Lane>(weight: Weight, a: T, b: T) -> T {
    match weight {
        Weight::None => T::default(),
        Weight::Half => a.mean(b).mean(T::HALF).minus(T::HALF),
        Weight::Whole => a.mean(b).minus(T::HALF),
    }
}

/// Takes from the residuals of one row in `out` what the lights around them predict; `residual` has
/// [`SLACK`] before and after it.
#[inline(always)]
fn lift<T: Lane>(residual: &[T], out: &mut [T], level: usize, weight: Weight, mask: &[T]) {
    let n = out.len();
    let before = &residual[SLACK - DISTANCES[level]..];
    let after = &residual[SLACK + DISTANCES[level]..];
    let (before, after, mask) = (&before[..n], &after[..n], &mask[..n]);
    // A loop of its own for each weight, which is vectorised.
    macro_rules! take {
        ($weight:expr) => {
            for i in 0..n {
                out[i] = out[i].minus(share($weight, before[i], after[i]).and(mask[i]));
            }
        };
    }
    match weight {
        Weight::None => {}
        Weight::Half => take!(Weight::Half),
        Weight::Whole => take!(Weight::Whole),
    }
}

/// The mode that makes the residuals of two rows small.
#[inline(always)]
fn judge<T: Lane>(plane: &[T], shape: Shape, masks: &Masks<T>, scratch: &mut Scratch<T>) -> Mode {
    let n = shape.lights;
    // The first texel is predicted otherwise; more than 15 would not fit a sum in a byte.
    let columns = 1..shape.columns.min(16);
    let length = columns.len() * n;
    let rows = [shape.rows / 3, shape.rows * 2 / 3];
    let rows = if rows[0] == rows[1] { &rows[..1] } else { &rows };
    let Scratch { residual, lifted, costs } = scratch;
    // Blocks reach beyond the last texel.
    lifted[length..length + BLOCK].fill(T::default());
    let mut best = (u32::MAX, Mode { spatial: Spatial::Median, weights: [Weight::None; 3] });
    for spatial in Spatial::ALL {
        // Bits by weight: of lights without others around them, then of those of each level.
        let mut bits = [[0; 4]; 3];
        for (weight, bits) in Weight::ALL.into_iter().zip(&mut bits) {
            costs.fill(T::default());
            for &y in rows {
                interior(spatial, plane, shape, y, columns.clone(), &mut residual[SLACK..]);
                lifted[..length].copy_from_slice(&residual[SLACK..SLACK + length]);
                for (level, mask) in masks.iter().enumerate() {
                    lift(residual, &mut lifted[..length], level, weight, mask);
                }
                for value in &mut lifted[..length] {
                    *value = value.minus(T::HALF).magnitude_bits();
                }
                for texel in (0..length).step_by(n) {
                    for start in (0..n).step_by(BLOCK) {
                        let costs = block_mut(costs, start);
                        let texel = block(lifted, texel + start);
                        let mut sums = [T::default(); BLOCK];
                        for i in 0..BLOCK {
                            sums[i] = costs[i].plus(texel[i]);
                        }
                        *costs = sums;
                    }
                }
            }
            let all: u32 = costs[..n].iter().map(|cost| cost.count()).sum();
            let level =
                |mask: &Vec<T>| -> u32 { costs[..n].iter().zip(mask).map(|(c, &m)| c.and(m).count()).sum() };
            let levels = masks.each_ref().map(level);
            *bits = [all - levels.iter().sum::<u32>(), levels[0], levels[1], levels[2]];
        }
        let mut total = bits[0][0];
        let weights = std::array::from_fn(|level| {
            let of = |n: usize| bits[n][level + 1];
            let least = (0..Weight::ALL.len()).min_by_key(|&n| of(n)).unwrap_or(0);
            total += of(least);
            Weight::ALL[least]
        });
        if total < best.0 {
            best = (total, Mode { spatial, weights });
        }
    }
    best.1
}

/// Residuals of one channel as planes of bytes, the highest first; returns how they were predicted.
#[inline(always)]
pub(super) fn residuals<T: Lane>(
    plane: &[T],
    shape: Shape,
    masks: &Masks<T>,
    scratch: &mut Scratch<T>,
    bytes: &mut [u8],
) -> Mode {
    let (row, n) = (shape.columns * shape.lights, shape.lights);
    scratch.residual.resize(row + 2 * SLACK, T::HALF);
    scratch.lifted.resize(row + BLOCK, T::HALF);
    scratch.costs.resize(n + BLOCK, T::default());
    let mode = judge(plane, shape, masks, scratch);
    let Scratch { residual, lifted, .. } = scratch;
    let lifted = &mut lifted[..row];
    for y in 0..shape.rows {
        first(plane, shape, y, &mut residual[SLACK..]);
        interior(mode.spatial, plane, shape, y, 1..shape.columns, &mut residual[SLACK + n..]);
        lifted.copy_from_slice(&residual[SLACK..SLACK + row]);
        for (level, mask) in masks.iter().enumerate() {
            lift(residual, lifted, level, mode.weights[level], mask);
        }
        if y == 0 {
            // The very first texel has been predicted along its lights already.
            lifted[..n].copy_from_slice(&residual[SLACK..SLACK + n]);
        }
        for (number, plane) in bytes.chunks_exact_mut(shape.samples()).enumerate() {
            let place = T::BYTES - 1 - number;
            for (byte, &value) in plane[y * row..(y + 1) * row].iter_mut().zip(&*lifted) {
                *byte = value.minus(T::HALF).zigzag().byte(place);
            }
        }
    }
    mode
}

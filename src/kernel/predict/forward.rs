//! From samples to residuals.

use super::lane::Lane;
use super::mode::{DISTANCES, Mode, Spatial, Weight};
use super::{Masks, SLACK, Shape};

/// Buffers that are used again from channel to channel.
#[derive(Default)]
pub(super) struct Scratch<T> {
    residual: Vec<T>,
    lifted: Vec<T>,
    costs: Vec<T>,
}

/// Fills `out` with `f` of three slices that are at least as long, element by element.
#[inline(always)]
fn map3<T: Lane>(out: &mut [T], a: &[T], b: &[T], c: &[T], f: impl Fn(T, T, T) -> T) {
    let n = out.len();
    let (a, b, c) = (&a[..n], &b[..n], &c[..n]);
    for i in 0..n {
        out[i] = f(a[i], b[i], c[i]);
    }
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
    match spatial {
        Spatial::Median => map3(out, left, above, corner, |l, u, c| predict(Spatial::Median, l, u, c, u)),
        Spatial::Smooth => map3(out, left, above, corner, |l, u, c| predict(Spatial::Smooth, l, u, c, u)),
        Spatial::Mean => {
            // The last column has nothing above right of it.
            let last = if columns.end == shape.columns { n } else { 0 };
            let (body, end) = out.split_at_mut(to - from - last);
            let right = &plane[from - up + n..];
            map3(body, left, above, right, |l, u, r| predict(Spatial::Mean, l, u, u, r));
            let at = body.len();
            map3(end, &left[at..], &above[at..], &above[at..], |l, u, r| predict(Spatial::Mean, l, u, u, r));
        }
    }
    for (out, &here) in out.iter_mut().zip(here) {
        *out = here.minus(*out).plus(T::HALF);
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

/// Takes from the residuals of one row in `out` what the lights around them foretell; `residual` has
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
    let mut best = (u32::MAX, Mode { spatial: Spatial::Median, weights: [Weight::None; 3] });
    let length = (shape.columns - 1) * shape.lights;
    let rows = [shape.rows / 3, shape.rows * 2 / 3];
    let rows = if rows[0] == rows[1] { &rows[..1] } else { &rows };
    let Scratch { residual, lifted, costs } = scratch;
    let (lifted, costs) = (&mut lifted[..length], &mut costs[..length]);
    for spatial in Spatial::ALL {
        // Sums by weight: of all residuals, then of those of each level.
        let mut sums = [[0; 4]; 3];
        for (weight, sums) in Weight::ALL.into_iter().zip(&mut sums) {
            costs.fill(T::default());
            for &y in rows {
                // The first texel is predicted otherwise.
                interior(spatial, plane, shape, y, 1..shape.columns, &mut residual[SLACK..]);
                lifted.copy_from_slice(&residual[SLACK..SLACK + length]);
                for (level, mask) in masks.iter().enumerate() {
                    lift(residual, lifted, level, weight, mask);
                }
                for (cost, &residual) in costs.iter_mut().zip(&*lifted) {
                    *cost = cost.plus(residual.minus(T::HALF).magnitude_bits());
                }
            }
            let sum = |mask: Option<&Vec<T>>| -> u32 {
                match mask {
                    None => costs.iter().map(|cost| cost.count()).sum(),
                    Some(mask) => costs.iter().zip(mask).map(|(cost, &mask)| cost.and(mask).count()).sum(),
                }
            };
            *sums = [sum(None), sum(Some(&masks[0])), sum(Some(&masks[1])), sum(Some(&masks[2]))];
        }
        let mut total = sums[0][0];
        let weights = std::array::from_fn(|level| {
            let of = |n: usize| sums[n][level + 1];
            let chosen = (0..3).min_by_key(|&n| of(n)).unwrap_or(0);
            total -= of(0) - of(chosen);
            Weight::ALL[chosen]
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
    scratch.lifted.resize(row, T::HALF);
    scratch.costs.resize(row, T::default());
    let mode = judge(plane, shape, masks, scratch);
    let Scratch { residual, lifted, .. } = scratch;
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

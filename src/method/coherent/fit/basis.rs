//! The basis of a level: principal components of the windowed surroundings, in fixed point.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::method::coherent::appearance::{Basis, FEATURES, INPUTS, dims_of, passes_of, repetition_of};
use crate::method::coherent::appearance_image::Features;

/// Texels that a basis is fitted to; of larger exemplars every n-th row and column.
const TEXELS: usize = 1 << 16;

/// Standard deviation of the Gaussian window over the surroundings, in spacings.
const WINDOW: f64 = 1.2;

/// The first dimension spans so many standard deviations to each side.
const DEVIATIONS: f64 = 4.0;

/// Largest absolute value of a blurred feature: 16 times 127.
const INPUT_MOST: f64 = 2032.0;

/// Fits principal components to the surroundings of texels at a level.
pub(super) fn fit(features: &Features, level: usize, levels: usize) -> Basis {
    let (spacing, dims) = (1 << level, dims_of(level, levels));
    let (mean, covariance) = moments(features, spacing);
    let window: Vec<f64> = (0..INPUTS)
        .map(|input| {
            let (row, column) = (input / FEATURES / 3, input / FEATURES % 3);
            let squared = [row, column].iter().map(|&n| (n as f64 - 1.0) * (n as f64 - 1.0)).sum::<f64>();
            libm::exp(-0.5 * squared / (WINDOW * WINDOW))
        })
        .collect();
    let windowed =
        DMatrix::from_fn(INPUTS, INPUTS, |i, j| window[i] * covariance[i * INPUTS + j] * window[j]);
    let eigen = windowed.symmetric_eigen();
    let mut order: Vec<usize> = (0..INPUTS).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let deviation = eigen.eigenvalues[order[0]].max(0.0).sqrt();
    let gain = if deviation > 0.0 { 127.0 / (DEVIATIONS * deviation) } else { 0.0 };
    let exact: Vec<Vec<f64>> = order[..dims]
        .iter()
        .map(|&component| {
            let column = eigen.eigenvectors.column(component);
            // Either sign is right; the same one always.
            let largest =
                column.iter().copied().fold(0.0, |most: f64, v| if v.abs() > most.abs() { v } else { most });
            window.iter().zip(column.iter()).map(|(w, v)| w * v * gain * largest.signum()).collect()
        })
        .collect();
    let (weights, offset, shift) = in_fixed_point(&exact, &mean);
    let (passes, repetition) = (passes_of(level), repetition_of(level, features.size()));
    Basis { dims, weights, offset, shift, passes, repetition }
}

/// Weights in i16 with as many binary places as keep every sum within 32 bits; offsets, and those places.
fn in_fixed_point(exact: &[Vec<f64>], mean: &[f64]) -> (Vec<i16>, Vec<i32>, u32) {
    let most = exact.iter().flatten().fold(0.0, |most: f64, w| most.max(w.abs()));
    let sum = exact.iter().map(|weights| weights.iter().map(|w| w.abs()).sum::<f64>()).fold(0.0, f64::max);
    let fits = |shift: u32| {
        let scale = f64::from(1u32 << shift);
        // An offset is at most as large as a sum; half a step is added before the shift.
        most * scale <= 32767.0 && 2.0 * sum * scale * INPUT_MOST + scale < f64::from(i32::MAX)
    };
    let shift = (1..=20).rev().find(|&shift| fits(shift)).unwrap_or(1);
    // So little contrast that even one binary place is too many: less gain.
    let damp = if fits(shift) { 1.0 } else { (16383.0 / most).min(f64::from(1 << 28) / (sum * INPUT_MOST)) };
    let scale = f64::from(1u32 << shift) * damp;
    let dims = exact.len();
    let mut weights = vec![0; INPUTS * dims];
    let mut offset = vec![0; dims];
    for (dim, exact) in exact.iter().enumerate() {
        for (input, weight) in exact.iter().enumerate() {
            weights[input * dims + dim] = (weight * scale).round() as i16;
        }
        offset[dim] = (exact.iter().zip(mean).map(|(w, m)| w * m).sum::<f64>() * scale).round() as i32;
    }
    (weights, offset, shift)
}

/// Mean and covariance of the surroundings, from sums of whole numbers: the same for every number of threads.
fn moments(features: &Features, spacing: usize) -> (Vec<f64>, Vec<f64>) {
    let size = features.size();
    let step =
        (1..).find(|step| size.height.div_ceil(*step) * size.width.div_ceil(*step) <= TEXELS).unwrap_or(1);
    let zero = || (vec![0i64; INPUTS], vec![0i64; INPUTS * INPUTS]);
    let rows: Vec<usize> = (0..size.height).step_by(step).collect();
    let add = |(mut sums, mut products): (Vec<i64>, Vec<i64>), &y: &usize| {
        for x in (0..size.width).step_by(step) {
            let inputs = features.surroundings(spacing, y, x);
            for (i, &input) in inputs.iter().enumerate() {
                sums[i] += i64::from(input);
                for (product, &other) in products[i * INPUTS..][i..INPUTS].iter_mut().zip(&inputs[i..]) {
                    *product += i64::from(i32::from(input) * i32::from(other));
                }
            }
        }
        (sums, products)
    };
    let merge = |(mut sums, mut products): (Vec<i64>, Vec<i64>),
                 (other_sums, other_products): (Vec<i64>, Vec<i64>)| {
        sums.iter_mut().zip(other_sums).for_each(|(sum, other)| *sum += other);
        products.iter_mut().zip(other_products).for_each(|(product, other)| *product += other);
        (sums, products)
    };
    let (sums, products) = rows.par_iter().fold(zero, add).reduce(zero, merge);
    let count = (rows.len() * size.width.div_ceil(step)) as f64;
    let mean: Vec<f64> = sums.iter().map(|&sum| sum as f64 / count).collect();
    let covariance = (0..INPUTS * INPUTS)
        .map(|at| {
            let (i, j) = (at / INPUTS, at % INPUTS);
            products[i.min(j) * INPUTS + i.max(j)] as f64 / count - mean[i] * mean[j]
        })
        .collect();
    (mean, covariance)
}

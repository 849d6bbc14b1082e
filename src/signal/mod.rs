//! Planes of numbers, row by row: the Fourier transform, and smoothing.

pub(crate) mod fourier;
pub(crate) mod smooth;

/// The transpose of a matrix of rows of `width` values.
fn transposed<T: Copy>(values: &[T], width: usize) -> Vec<T> {
    let column = |x: usize| values[x.min(values.len())..].iter().step_by(width).copied();
    (0..width).flat_map(column).collect()
}

//! The Fourier transform of a plane, by a planner that takes the same steps on every machine.

use std::sync::Arc;

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};

use super::transposed;
use crate::shape::Size;

/// Transforms of planes of one size. Frequencies go from 0 up, the negative ones last.
pub(crate) struct Fourier {
    size: Size,
    /// Along rows and along columns.
    forward: [Arc<dyn Fft<f64>>; 2],
    inverse: [Arc<dyn Fft<f64>>; 2],
}

impl Fourier {
    pub(crate) fn new(size: Size) -> Self {
        let mut planner = FftPlannerScalar::new();
        let sides = [size.width, size.height];
        let forward = sides.map(|side| planner.plan_fft_forward(side));
        Self { size, forward, inverse: sides.map(|side| planner.plan_fft_inverse(side)) }
    }

    /// The spectrum, not scaled, of a plane; rows that it lacks below are zeros.
    pub(crate) fn forward(&self, mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        let Size { height, width } = self.size;
        lines(&mut values, &*self.forward[0]);
        let rows = values.len() / width;
        let columns = transposed(&values, width);
        let mut values = vec![Complex::new(0.0, 0.0); self.size.texels()];
        for (to, column) in values.chunks_exact_mut(height).zip(columns.chunks_exact(rows)) {
            to[..rows].copy_from_slice(column);
        }
        lines(&mut values, &*self.forward[1]);
        transposed(&values, height)
    }

    /// The same of real values.
    pub(crate) fn forward_real(&self, values: impl IntoIterator<Item = f64>) -> Vec<Complex<f64>> {
        self.forward(values.into_iter().map(|value| Complex::new(value, 0.0)).collect())
    }

    /// The plane of a spectrum, divided by the number of texels.
    pub(crate) fn inverse(&self, spectrum: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let mut values = transposed(spectrum, self.size.width);
        lines(&mut values, &*self.inverse[1]);
        let mut values = transposed(&values, self.size.height);
        lines(&mut values, &*self.inverse[0]);
        let texels = self.size.texels() as f64;
        values.iter_mut().for_each(|value| *value /= texels);
        values
    }
}

/// Transforms every line of a matrix.
fn lines(values: &mut [Complex<f64>], transform: &dyn Fft<f64>) {
    let scratch = || vec![Complex::new(0.0, 0.0); transform.get_inplace_scratch_len()];
    values
        .par_chunks_exact_mut(transform.len())
        .for_each_init(scratch, |scratch, line| transform.process_with_scratch(line, scratch));
}

/// The frequency, in cycles a side, of a place in a spectrum of so many: from `-side / 2` up.
pub(crate) fn frequency(place: usize, side: usize) -> i64 {
    let place = place as i64;
    if 2 * place < side as i64 { place } else { place - side as i64 }
}

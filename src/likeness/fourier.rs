//! The Fourier transform of a plane, by a planner that takes the same steps on every machine.

use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};

use crate::shape::Size;

/// Transforms of planes of one size. Frequencies go from 0 up, the negative ones last.
pub(super) struct Fourier {
    size: Size,
    /// Along rows and along columns.
    forward: [Arc<dyn Fft<f64>>; 2],
    inverse: [Arc<dyn Fft<f64>>; 2],
}

impl Fourier {
    pub(super) fn new(size: Size) -> Self {
        let mut planner = FftPlannerScalar::new();
        let sides = [size.width, size.height];
        let forward = sides.map(|side| planner.plan_fft_forward(side));
        Self { size, forward, inverse: sides.map(|side| planner.plan_fft_inverse(side)) }
    }

    /// The spectrum of real values, not scaled.
    pub(super) fn forward(&self, values: impl IntoIterator<Item = f64>) -> Vec<Complex<f64>> {
        let values = values.into_iter().map(|value| Complex::new(value, 0.0)).collect();
        self.both(values, &self.forward)
    }

    /// The plane of a spectrum, divided by the number of texels.
    pub(super) fn inverse(&self, spectrum: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        let mut values = self.both(spectrum, &self.inverse);
        let scale = 1.0 / self.size.texels() as f64;
        values.iter_mut().for_each(|value| *value *= scale);
        values
    }

    fn both(
        &self,
        mut values: Vec<Complex<f64>>,
        [rows, columns]: &[Arc<dyn Fft<f64>>; 2],
    ) -> Vec<Complex<f64>> {
        rows.process(&mut values);
        let mut values = transposed(&values, self.size.width);
        columns.process(&mut values);
        transposed(&values, self.size.height)
    }
}

fn transposed(values: &[Complex<f64>], width: usize) -> Vec<Complex<f64>> {
    (0..width).flat_map(|x| values[x..].iter().step_by(width).copied()).collect()
}

/// The frequency, in cycles a side, of a place in a spectrum of so many: from `-side / 2` up.
pub(super) fn frequency(place: usize, side: usize) -> i64 {
    let place = place as i64;
    if 2 * place < side as i64 { place } else { place - side as i64 }
}

//! Gains of the levels: how loud each is to be, for their sum to have the second-order statistics of the data.
//!
//! The bands of a pyramid overlap. In the data they add up in amplitude, drawn independently in power, which at the
//! frequencies shared by two bands is half of it. A gain a level makes up for that, and for what an estimate near its
//! limit of stability has too much or too little.

use nalgebra::{DMatrix, DVector};

use super::second_order::Autocovariance;
use super::spectrum::Share;
use crate::error::{Error, Result};

/// How much the variance per band counts beside the autocovariance and the variance of the whole.
const BAND_WEIGHT: f64 = 0.3;

/// A level that is not wanted keeps this gain, for its noise to have a covariance.
const LEAST_GAIN: f64 = 1e-3;

/// What a field should have.
pub(super) struct Target<'a> {
    pub(super) autocovariance: &'a Autocovariance,
    /// Variance of each channel in each band.
    pub(super) variances: &'a [&'a [f64]],
}

/// The gains (not below 0.001) whose squares minimise, by least squares, the relative errors of autocovariance,
/// variance of the channels and variance of the channels in each band.
pub(super) fn matched(shares: &[&Share], target: &Target<'_>) -> Result<Vec<f64>> {
    let mut equations = Equations::new(shares.len());
    let truth = target.autocovariance;
    let scale = truth.scale();
    let norm = truth.at.iter().map(|at| at.component_mul(&scale).norm_squared()).sum::<f64>().sqrt();
    if norm > 0.0 {
        for (lag, at) in truth.at.iter().enumerate() {
            for (entry, (&value, &scale)) in at.iter().zip(scale.iter()).enumerate() {
                let of = |share: &&Share| share.autocovariance.at[lag].as_slice()[entry] * scale / norm;
                equations.add(1.0, shares.iter().map(of), value * scale / norm);
            }
        }
    }
    let (channels, levels) = (truth.covariance().nrows(), shares.len());
    let each = (channels as f64).sqrt().recip();
    let mut relative = |weight: f64, of: &dyn Fn(&Share) -> f64, value: f64| {
        if value > 0.0 {
            equations.add(weight * each, shares.iter().map(|share| of(share) / value), 1.0);
        }
    };
    for channel in 0..channels {
        let place = (channel, channel);
        relative(1.0, &|share| share.autocovariance.covariance()[place], truth.covariance()[place]);
        for (band, variances) in target.variances.iter().enumerate() {
            relative(BAND_WEIGHT, &|share| share.band_variances(levels)[band][channel], variances[channel]);
        }
    }
    let squares = equations.solve_non_negative()?;
    Ok(squares.iter().map(|&square| square.sqrt().max(LEAST_GAIN)).collect())
}

/// The autocovariance of the sum of all levels, each at its gain.
pub(super) fn total(shares: &[&Share], gains: &[f64]) -> Option<Autocovariance> {
    let mut total = shares.first()?.autocovariance.clone();
    for (n, at) in total.at.iter_mut().enumerate() {
        let parts = shares.iter().zip(gains).map(|(share, gain)| &share.autocovariance.at[n] * (gain * gain));
        *at = parts.fold(DMatrix::zeros(at.nrows(), at.ncols()), |sum, part| sum + part);
    }
    Some(total)
}

/// Normal equations of a least squares problem.
struct Equations {
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
}

impl Equations {
    fn new(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), vector: DVector::zeros(unknowns) }
    }

    fn add(&mut self, weight: f64, coefficients: impl Iterator<Item = f64>, value: f64) {
        let row = DVector::from_iterator(self.vector.len(), coefficients) * weight;
        self.matrix.ger(1.0, &row, &row, 1.0);
        self.vector.axpy(weight * value, &row, 1.0);
    }

    /// The minimum over non-negative unknowns: some are 0 and the others solve the equations that are left. With at
    /// most eight unknowns all choices can be tried.
    fn solve_non_negative(&self) -> Result<DVector<f64>> {
        let unknowns = self.vector.len();
        let mut best = DVector::zeros(unknowns);
        let mut least = 0.0;
        for choice in 1..1_usize << unknowns {
            let free: Vec<usize> = (0..unknowns).filter(|&n| choice >> n & 1 == 1).collect();
            let matrix = self.matrix.select_rows(&free).select_columns(&free);
            let vector = self.vector.select_rows(&free);
            let Some(factor) = matrix.cholesky() else { continue };
            let found = factor.solve(&vector);
            // The objective less its constant.
            let objective = -found.dot(&vector);
            if objective < least && found.iter().all(|&value| value >= 0.0) {
                least = objective;
                best.fill(0.0);
                free.iter().zip(found.iter()).for_each(|(&n, &value)| best[n] = value);
            }
        }
        if best.iter().all(|value| value.is_finite()) {
            return Ok(best);
        }
        Err(Error::input("the autocovariance of the field is not finite"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn unknowns_that_would_be_negative_are_zero() {
        let mut equations = Equations::new(2);
        equations.add(1.0, [1.0, 1.0].into_iter(), 1.0);
        equations.add(1.0, [1.0, 3.0].into_iter(), 0.0);
        // Without bounds: (1.5, -0.5).
        let found = equations.solve_non_negative().unwrap();
        assert!((found[0] - 0.5).abs() < 1e-12 && found[1] == 0.0, "{found}");
        let mut equations = Equations::new(2);
        equations.add(1.0, [2.0, 0.0].into_iter(), 1.0);
        equations.add(3.0, [0.0, 1.0].into_iter(), 2.0);
        let found = equations.solve_non_negative().unwrap();
        assert!((found[0] - 0.5).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12, "{found}");
    }
}

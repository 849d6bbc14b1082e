//! The estimates of (10) to (13) in recursive form: one rank-one update a texel, no matrix to factor.

use nalgebra::{DMatrix, DVector};

use super::car::Prior;
use crate::error::{Error, Result};

/// Running estimates after any number of samples. Equal to the batch estimate of the same samples up to rounding.
#[derive(Clone, Debug)]
pub(crate) struct Recursion {
    prior: Prior,
    count: usize,
    gamma: DMatrix<f64>,
    lambda: DMatrix<f64>,
    /// V_XX^-1.
    inverse_xx: DMatrix<f64>,
}

impl Recursion {
    /// The state before the first sample: Gamma = 0, lambda = V_YY(0).
    pub(super) fn new(channels: usize, sites: usize, prior: &Prior) -> Self {
        let order = channels * sites;
        Self {
            prior: *prior,
            count: 0,
            gamma: DMatrix::zeros(channels, order),
            lambda: DMatrix::from_diagonal_element(channels, channels, prior.yy),
            inverse_xx: DMatrix::from_diagonal_element(order, order, 1.0 / prior.xx),
        }
    }

    /// Takes in one texel `y` (channels) with its neighbours `x` (sites, channels innermost).
    ///
    /// # Errors
    /// When the lengths are not those of the model.
    pub(super) fn update(&mut self, y: &[f64], x: &[f64]) -> Result<()> {
        if [y.len(), x.len()] != [self.gamma.nrows(), self.gamma.ncols()] {
            return Err(Error::internal(format!(
                "a sample of {} and {} values for a model of {} and {}",
                y.len(),
                x.len(),
                self.gamma.nrows(),
                self.gamma.ncols()
            )));
        }
        let x = DVector::from_column_slice(x);
        let error = DVector::from_column_slice(y) - &self.gamma * &x;
        let gain = &self.inverse_xx * &x;
        let scale = 1.0 / self.spread(&x);
        self.gamma.ger(scale, &error, &gain, 1.0);
        self.lambda.ger(scale, &error, &error, 1.0);
        self.inverse_xx.ger(-scale, &gain, &gain, 1.0);
        self.count += 1;
        Ok(())
    }

    /// Gamma of (10), `[channels, channels * sites]`.
    pub(super) fn gamma(&self) -> &DMatrix<f64> {
        &self.gamma
    }

    /// lambda of (12), `[channels, channels]`.
    pub(crate) fn lambda(&self) -> &DMatrix<f64> {
        &self.lambda
    }

    /// Sigma of (11), `[channels, channels]`.
    pub(super) fn sigma(&self) -> DMatrix<f64> {
        &self.lambda / (self.prior.beta + self.count as f64)
    }

    /// 1 + X^T V_XX^-1 X: how much wider than Sigma the prediction for neighbours `x` is.
    fn spread(&self, x: &DVector<f64>) -> f64 {
        1.0 + x.dot(&(&self.inverse_xx * x))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::fit::car::{Moments, Positions, Posterior};
    use crate::method::field::fit::neighbourhood::nested;
    use crate::method::field::raster::{Boundary, Field};
    use crate::random::Hash;

    /// A field that is smooth enough for its neighbours to tell something, of 2 channels.
    fn smooth() -> Field {
        let hash = Hash::new(9, 0);
        let mut samples = Vec::new();
        for y in 0..14 {
            for x in 0..13 {
                let [a, b, c, _] = hash.normals(y, x, 0);
                let wave = f64::from(y * 3 + x * 5).sin();
                samples.extend([wave + 0.3 * a, 0.5 * wave + 0.2 * b + 0.1 * c]);
            }
        }
        Field::new(14, 13, 2, samples).unwrap().centred().0
    }

    /// Calls `visit` with Y_r and X_r of every interior texel.
    fn each(field: &Field, sites: &[[i32; 2]], mut visit: impl FnMut(&[f64], &[f64])) {
        let Positions::Interior { rows, columns } = Positions::new(Boundary::Mirrored, sites) else { return };
        for y in rows..field.height {
            for x in columns..field.width - columns {
                let neighbour = |s: &[i32; 2]| {
                    field.texel((y as i32 - s[0]) as usize, (x as i32 - s[1]) as usize).to_vec()
                };
                let stacked: Vec<f64> = sites.iter().flat_map(neighbour).collect();
                visit(field.texel(y, x), &stacked);
            }
        }
    }

    #[test]
    fn recursive_and_batch_estimates_agree() {
        let field = smooth();
        for (channels, field) in [(2, field.clone()), (1, field.channel(0))] {
            let sites = &nested()[3];
            let prior = Prior::weak(field.second_moments().trace() / channels as f64, channels);
            let positions = Positions::new(Boundary::Mirrored, sites);
            let moments = Moments::accumulate(&field, sites, positions).unwrap();
            let batch = Posterior::new(&moments, &prior).unwrap();
            let mut recursion = Recursion::new(channels, sites.len(), &prior);
            each(&field, sites, |y, x| recursion.update(y, x).unwrap());
            assert_eq!(recursion.count, moments.count);
            assert!((recursion.gamma() - &batch.gamma).amax() < 1e-9);
            assert!((recursion.lambda() - &batch.lambda).amax() < 1e-9);
            assert!((recursion.sigma() - batch.sigma()).amax() < 1e-9);
        }
    }

    /// The evidence is also the product of the predictive densities of the samples in turn, each a multivariate
    /// Student density (Bishop 2006, 2.162).
    #[test]
    fn the_evidence_is_the_product_of_the_predictions() {
        let field = smooth();
        for (channels, field) in [(2, field.clone()), (1, field.channel(1))] {
            let sites = &nested()[1];
            let prior = Prior { xx: 0.7, yy: 0.4, beta: 2.0, degrees: channels as f64 + 2.0 };
            let mut recursion = Recursion::new(channels, sites.len(), &prior);
            let mut sum = 0.0;
            each(&field, sites, |y, x| {
                let x_vector = DVector::from_column_slice(x);
                let c = channels as f64;
                let degrees = prior.degrees + recursion.count as f64 - c + 1.0;
                let shape = recursion.lambda() * (recursion.spread(&x_vector) / degrees);
                let error = DVector::from_column_slice(y) - recursion.gamma() * &x_vector;
                let distance = error.dot(&(shape.clone().try_inverse().unwrap() * &error));
                sum += libm::lgamma(0.5 * (degrees + c))
                    - libm::lgamma(0.5 * degrees)
                    - 0.5 * c * (degrees * std::f64::consts::PI).ln()
                    - 0.5 * shape.determinant().ln()
                    - 0.5 * (degrees + c) * (1.0 + distance / degrees).ln();
                recursion.update(y, x).unwrap();
            });
            let positions = Positions::new(Boundary::Mirrored, sites);
            let moments = Moments::accumulate(&field, sites, positions).unwrap();
            let evidence = Posterior::new(&moments, &prior).unwrap().log_evidence().unwrap();
            assert!((evidence - sum).abs() < 1e-8 * sum.abs(), "{evidence} against {sum}");
        }
    }

    #[test]
    fn samples_of_another_model_are_refused() {
        let mut recursion = Recursion::new(2, 2, &Prior::weak(1.0, 2));
        assert!(recursion.update(&[0.0], &[0.0; 4]).is_err());
        assert!(recursion.update(&[0.0; 2], &[0.0; 3]).is_err());
    }
}

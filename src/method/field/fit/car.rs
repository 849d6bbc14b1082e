//! The causal autoregressive model Y_r = Gamma X_r + e_r: its statistics, estimates and evidence.
//!
//! Equations (6) to (13) for several channels at once (3D), (17) to (23) for one (2D): the scalar model is this code
//! on a field of one channel. X_r stacks Y_(r-s) site by site, channels innermost.

use std::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, Dyn};

use super::neighbourhood::reach;
use crate::error::{Error, Result};
use crate::method::field::raster::{Boundary, Field};

/// A field whose variance is less than this (in squared units of the samples) counts as constant.
const LEAST_VARIANCE: f64 = 1e-24;

/// The conjugate normal-Wishart prior of (10) to (13): V_XX(0) = xx I, V_YY(0) = yy I, V_XY(0) = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// k of V_XX(0) = k I, in squared units of the samples.
    pub xx: f64,
    /// k of V_YY(0) = k I, in squared units of the samples.
    pub yy: f64,
    /// beta(0) of (11), above 1.
    pub beta: f64,
    /// Degrees of freedom nu_0 of the inverse Wishart prior of Sigma, for the evidence.
    pub degrees: f64,
}

impl Prior {
    /// The weak prior for a model of `channels` joint channels on data of the given mean variance: as much as a
    /// hundredth of one sample says, beta(0) = 2, nu_0 = channels + 2 (the least whole number with a mean).
    pub(crate) fn weak(mean_variance: f64, channels: usize) -> Self {
        let k = 0.01 * mean_variance.max(LEAST_VARIANCE);
        Self { xx: k, yy: k, beta: 2.0, degrees: channels as f64 + 2.0 }
    }
}

/// The texels r whose Y_r and X_r count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Positions {
    /// All of them; neighbours beyond the border are found by wrapping.
    Periodic,
    /// Those at least `rows` below the top and `columns` from the left and right border.
    Interior {
        /// Rows left out at the top.
        rows: usize,
        /// Columns left out at the left and at the right.
        columns: usize,
    },
}

impl Positions {
    /// All positions of a periodic field; otherwise those where every site lies inside.
    pub(crate) fn new(boundary: Boundary, sites: &[[i32; 2]]) -> Self {
        match boundary {
            Boundary::Periodic => Self::Periodic,
            Boundary::Mirrored => {
                let [rows, columns] = reach(sites);
                Self::Interior { rows, columns }
            }
        }
    }

    /// How many positions a field of this size has.
    pub(crate) fn count(&self, height: usize, width: usize) -> usize {
        match *self {
            Self::Periodic => height * width,
            Self::Interior { rows, columns } => {
                height.saturating_sub(rows) * width.saturating_sub(2 * columns)
            }
        }
    }
}

/// The sums of (8) over the positions of a field.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    /// How many positions were summed.
    pub count: usize,
    /// V_XX, `[channels * sites, channels * sites]`.
    pub xx: DMatrix<f64>,
    /// V_XY, `[channels * sites, channels]`.
    pub xy: DMatrix<f64>,
    /// V_YY, `[channels, channels]`.
    pub yy: DMatrix<f64>,
}

impl Moments {
    /// Sums over a field of mean 0.
    ///
    /// # Errors
    /// When the positions leave out less of the border than the sites reach over.
    pub(crate) fn accumulate(field: &Field, sites: &[[i32; 2]], positions: Positions) -> Result<Self> {
        let (top, side) = match positions {
            Positions::Periodic => (0, 0),
            Positions::Interior { rows, columns } => {
                let [far_rows, far_columns] = reach(sites);
                if rows < far_rows || columns < far_columns {
                    return Err(Error::internal(
                        "neighbours beyond the border of a field that does not wrap",
                    ));
                }
                (rows, columns)
            }
        };
        let channels = field.channels;
        let order = channels * sites.len();
        // Lower triangle of the sums for X_r followed by Y_r.
        let mut joint = DMatrix::zeros(order + channels, order + channels);
        let mut sample = vec![0.0; order + channels];
        for y in top..field.height {
            for x in side..field.width.saturating_sub(side) {
                for (part, &[dy, dx]) in sample.chunks_exact_mut(channels).zip(sites) {
                    let row = Boundary::Periodic.index(y as isize - dy as isize, field.height);
                    let column = Boundary::Periodic.index(x as isize - dx as isize, field.width);
                    part.copy_from_slice(field.texel(row, column));
                }
                sample[order..].copy_from_slice(field.texel(y, x));
                for (j, &factor) in sample.iter().enumerate() {
                    let column = &mut joint.as_mut_slice()[j * (order + channels)..][..order + channels];
                    for (sum, &value) in column[j..].iter_mut().zip(&sample[j..]) {
                        *sum += value * factor;
                    }
                }
            }
        }
        joint.fill_upper_triangle_with_lower_triangle();
        Ok(Self {
            count: positions.count(field.height, field.width),
            xx: joint.view((0, 0), (order, order)).into_owned(),
            xy: joint.view((0, order), (order, channels)).into_owned(),
            yy: joint.view((order, order), (channels, channels)).into_owned(),
        })
    }

    /// The sums for the first `sites` sites only, over the same positions.
    #[must_use]
    pub(crate) fn leading(&self, sites: usize) -> Self {
        let channels = self.yy.nrows();
        let order = sites * channels;
        Self {
            count: self.count,
            xx: self.xx.view((0, 0), (order, order)).into_owned(),
            xy: self.xy.rows(0, order).into_owned(),
            yy: self.yy.clone(),
        }
    }

    /// Noise covariance that belongs to any `gamma`, not only to the estimate of (10): residual sums over beta(r).
    pub(crate) fn residual_covariance(&self, gamma: &DMatrix<f64>, prior: &Prior) -> DMatrix<f64> {
        let mut xx = self.xx.clone();
        let mut residual = self.yy.clone();
        add_to_diagonal(&mut xx, prior.xx);
        add_to_diagonal(&mut residual, prior.yy);
        let explained = gamma * &self.xy;
        residual -= &explained;
        residual -= explained.transpose();
        residual += gamma * xx * gamma.transpose();
        symmetrised(&residual) / (prior.beta + self.count as f64)
    }
}

/// Estimates of (10) to (13), respectively (20) to (23), and what the evidence needs.
#[derive(Clone, Debug)]
pub(crate) struct Posterior {
    /// Gamma of (10), `[channels, channels * sites]`.
    pub gamma: DMatrix<f64>,
    /// lambda of (12), `[channels, channels]`.
    pub lambda: DMatrix<f64>,
    /// log |V_XX| with the prior.
    log_det_xx: f64,
    count: usize,
    prior: Prior,
}

impl Posterior {
    /// Batch estimate from sums.
    ///
    /// # Errors
    /// When V_XX is not positive definite, which happens to values that are not finite only.
    pub(crate) fn new(moments: &Moments, prior: &Prior) -> Result<Self> {
        let mut xx = moments.xx.clone();
        let mut yy = moments.yy.clone();
        add_to_diagonal(&mut xx, prior.xx);
        add_to_diagonal(&mut yy, prior.yy);
        let factor = cholesky(xx)?;
        let gamma = factor.solve(&moments.xy).transpose();
        let lambda = symmetrised(&(yy - &gamma * &moments.xy));
        Ok(Self { gamma, lambda, log_det_xx: log_det(&factor), count: moments.count, prior: *prior })
    }

    /// Noise covariance Sigma of (11), `[channels, channels]`; beta(r) = beta(0) + r - 1 after r - 1 samples.
    pub(crate) fn sigma(&self) -> DMatrix<f64> {
        &self.lambda / (self.prior.beta + self.count as f64)
    }

    /// Log of the marginal likelihood of all Y_r given their X_r, with Gamma and Sigma integrated out under the
    /// matrix normal, inverse Wishart prior. Comparable between neighbourhoods over the same positions only.
    ///
    /// # Errors
    /// When lambda is not positive definite, which happens to values that are not finite only.
    pub(crate) fn log_evidence(&self) -> Result<f64> {
        let channels = self.lambda.nrows();
        let c = channels as f64;
        let order = self.gamma.ncols() as f64;
        let before = self.prior.degrees;
        let after = before + self.count as f64;
        let log_det_lambda = log_det(&cholesky(self.lambda.clone())?);
        Ok(-0.5 * c * self.count as f64 * libm::log(PI)
            + 0.5 * c * (order * libm::log(self.prior.xx) - self.log_det_xx)
            + 0.5 * (before * c * libm::log(self.prior.yy) - after * log_det_lambda)
            + log_gamma(channels, 0.5 * after)
            - log_gamma(channels, 0.5 * before))
    }
}

/// Lower factor of a symmetric positive definite matrix.
pub(in crate::method::field) fn cholesky(matrix: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix).ok_or_else(|| Error::input("a covariance matrix is not positive definite"))
}

fn log_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|&d| libm::log(d)).sum::<f64>()
}

/// Log of the multivariate gamma function, less the constant that cancels in ratios.
fn log_gamma(channels: usize, a: f64) -> f64 {
    (0..channels).map(|j| libm::lgamma(a - 0.5 * j as f64)).sum()
}

fn add_to_diagonal(matrix: &mut DMatrix<f64>, value: f64) {
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += value;
    }
}

/// Removes the asymmetry that rounding leaves.
fn symmetrised(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    (matrix + matrix.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::fit::neighbourhood::nested;
    use crate::random::Hash;

    fn noise(height: usize, width: usize, channels: usize) -> Field {
        let hash = Hash::new(5, 0);
        let samples = (0..(height * width * channels) as u32).map(|i| hash.normals(i, 0, 0)[0]).collect();
        Field::new(height, width, channels, samples).unwrap()
    }

    #[test]
    fn moments_of_a_tiny_field_are_those_computed_by_hand() {
        let field = Field::new(2, 3, 1, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        let sites = [[0, 1], [1, 0]];
        let periodic = Moments::accumulate(&field, &sites, Positions::Periodic).unwrap();
        // Left neighbours 3 1 2 6 4 5, upper ones 4 5 6 1 2 3.
        assert_eq!(periodic.xx, DMatrix::from_row_slice(2, 2, &[91.0, 58.0, 58.0, 91.0]));
        assert_eq!(periodic.xy, DMatrix::from_row_slice(2, 1, &[85.0, 64.0]));
        assert_eq!((periodic.yy[(0, 0)], periodic.count), (91.0, 6));
        // Interior: the texel 5 alone, with 4 at its left and 2 above.
        let positions = Positions::new(Boundary::Mirrored, &sites);
        let interior = Moments::accumulate(&field, &sites, positions).unwrap();
        assert_eq!(interior.xx, DMatrix::from_row_slice(2, 2, &[16.0, 8.0, 8.0, 4.0]));
        assert_eq!(interior.xy, DMatrix::from_row_slice(2, 1, &[20.0, 10.0]));
        assert_eq!((interior.yy[(0, 0)], interior.count), (25.0, 1));
        assert!(Moments::accumulate(&field, &[[1, 2]], positions).is_err());
    }

    #[test]
    fn channels_are_innermost_and_smaller_sets_lead() {
        let field = noise(9, 8, 2);
        let sets = nested();
        let all = Moments::accumulate(&field, &sets[2], Positions::Periodic).unwrap();
        let few = Moments::accumulate(&field, &sets[0], Positions::Periodic).unwrap();
        let leading = all.leading(2);
        assert_eq!((leading.xx, leading.xy, leading.yy), (few.xx, few.xy, few.yy));
        // Entry for site 1 = (1, 0), channel 1, against Y of channel 0.
        let expected: f64 =
            (0..72).map(|r| field.texel((r / 8 + 8) % 9, r % 8)[1] * field.texel(r / 8, r % 8)[0]).sum();
        assert!((all.xy[(3, 0)] - expected).abs() < 1e-12);
    }

    #[test]
    fn the_estimate_is_ridge_regression() {
        let field = noise(12, 12, 1);
        let moments = Moments::accumulate(&field, &[[0, 1]], Positions::Periodic).unwrap();
        let prior = Prior { xx: 3.0, yy: 2.0, beta: 4.0, degrees: 3.0 };
        let posterior = Posterior::new(&moments, &prior).unwrap();
        let (xx, xy, yy) = (moments.xx[(0, 0)] + 3.0, moments.xy[(0, 0)], moments.yy[(0, 0)] + 2.0);
        assert!((posterior.gamma[(0, 0)] - xy / xx).abs() < 1e-15);
        assert!((posterior.sigma()[(0, 0)] - (yy - xy * xy / xx) / 148.0).abs() < 1e-14);
        let again = moments.residual_covariance(&posterior.gamma, &prior);
        assert!((again[(0, 0)] - posterior.sigma()[(0, 0)]).abs() < 1e-14);
        let unexplained = moments.residual_covariance(&DMatrix::zeros(1, 1), &prior);
        assert!((unexplained[(0, 0)] - yy / 148.0).abs() < 1e-14);
    }

    #[test]
    fn the_evidence_prefers_the_set_that_made_the_field() {
        // Each texel is half its right-upper neighbour and noise: the first set that has it has four sites.
        let mut field = noise(64, 64, 1);
        for y in 1..64 {
            for x in 0..63 {
                field.samples[y * 64 + x] += 0.5 * field.samples[(y - 1) * 64 + x + 1];
            }
        }
        let sets = nested();
        let moments = Moments::accumulate(&field, &sets[12], Positions::Periodic).unwrap();
        let prior = Prior::weak(field.second_moments()[(0, 0)], 1);
        let evidence = |set: &Vec<[i32; 2]>| {
            Posterior::new(&moments.leading(set.len()), &prior).unwrap().log_evidence().unwrap()
        };
        let scores: Vec<f64> = sets.iter().map(evidence).collect();
        let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
        assert_eq!(best.map(|n| sets[n].len()), Some(4), "{scores:?}");
    }
}

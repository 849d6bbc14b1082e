//! A fitted model: what a synthesis needs, and what the recipe should tell about it.

use std::fmt;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::fit::car::{Prior, cholesky};
use super::fit::stability::{self, STABLE_RADIUS};
use super::raster::Boundary;
use crate::error::{Error, Result};

/// How far a covariance may be from its transpose, relative to its largest entry.
const SYMMETRY_TOLERANCE: f64 = 1e-9;

/// How far T T^T may be from the identity, in any entry.
const ORTHONORMAL_TOLERANCE: f64 = 1e-6;

/// Whether the channels are modelled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CarKind {
    /// 3D CAR, (9): all channels at once.
    #[serde(rename = "3d")]
    Car3d,
    /// 2D CAR, (18): one scalar model a channel, after the Karhunen-Loeve transformation.
    #[serde(rename = "2d")]
    Car2d,
}

impl fmt::Display for CarKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Car3d => "3D CAR",
            Self::Car2d => "2D CAR",
        })
    }
}

/// How loud each level of a synthesis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gains {
    /// As estimated. The bands of a pyramid overlap, so their sum, drawn independently, has too little spread.
    None,
    /// Such that the sum has the second-order statistics of the data, as near as one gain a level can bring it.
    Matched,
}

/// What to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Channels together or one by one.
    pub kind: CarKind,
    /// Pyramid levels; `None` chooses by autocovariance among all numbers that keep ten samples per parameter at the
    /// coarsest for four neighbours, at least 1 and at most 5.
    pub levels: Option<usize>,
    /// How loud each level is.
    pub gains: Gains,
    /// Periodic for a tile that wraps. Otherwise the pyramid is mirrored, and only texels whose neighbours all lie
    /// inside count for the statistics.
    pub boundary: Boundary,
}

/// A field model: mean, transformation, and one causal autoregressive field a pyramid level.
#[derive(Clone, Debug)]
pub struct Model {
    /// Which equations hold.
    pub kind: CarKind,
    /// Mean of each channel of the data.
    pub mean: Vec<f64>,
    /// T of (15), `[channels, channels]`, rows the eigenvectors; 2D only.
    pub transform: Option<DMatrix<f64>>,
    /// Level 0 is the finest.
    pub levels: Vec<Level>,
    /// Covariance of the channels that a synthesis has, `[channels, channels]`.
    pub covariance: DMatrix<f64>,
    /// Root mean square difference of the autocovariance of a synthesis from that of the data, in units of the
    /// channels' variances.
    pub autocovariance_error: f64,
}

/// The autoregressive field of one pyramid level.
#[derive(Clone, Debug)]
pub struct Level {
    /// Sites (dy, dx) of Y_{r-s}.
    pub neighbourhood: Vec<[i32; 2]>,
    /// 3D: Gamma of (9), `[channels, channels * sites]`, sites outermost. 2D: gamma of (19), `[channels, sites]`.
    pub gamma: DMatrix<f64>,
    /// 3D: the covariance of e, `[channels, channels]`. 2D: its variances, `[channels, 1]`.
    pub sigma: DMatrix<f64>,
    /// What the field is multiplied by before it is added to the others, above 0.
    pub gain: f64,
    /// The prior that the estimates hold.
    pub prior: Prior,
    /// Log evidence of the neighbourhood, the sum over channels if 2D.
    pub log_evidence: f64,
    /// Spectral radius of the recursion ([`stability::radius`]), below 1.
    pub radius: f64,
    /// Height and width of the level that was fitted.
    pub size: [usize; 2],
    /// What had to be done to make the field stable, if anything.
    pub note: Option<String>,
}

impl Model {
    /// The number of channels.
    pub fn channels(&self) -> usize {
        self.mean.len()
    }

    /// Checks what a synthesis relies on: shapes, finite values, causal neighbours, an orthonormal transformation,
    /// positive definite noise, and stability, which is computed anew.
    ///
    /// # Errors
    /// When any of it does not hold; the message says which, at which level.
    pub fn check(&self) -> Result<()> {
        let channels = self.channels();
        if channels == 0 || self.levels.is_empty() {
            return Err(Error::input("a field model needs at least one channel and one level"));
        }
        if !self.mean.iter().chain(self.covariance.iter()).all(|value| value.is_finite()) {
            return Err(Error::input("the mean or the covariance of a field model is not finite"));
        }
        if self.covariance.shape() != (channels, channels) {
            return Err(Error::input(format!("a field model of {channels} channels has another covariance")));
        }
        check_covariance(&self.covariance).map_err(|error| error.context("covariance"))?;
        match (self.kind, &self.transform) {
            (CarKind::Car3d, None) => {}
            (CarKind::Car2d, Some(t)) if t.shape() == (channels, channels) => {
                let off = (t * t.transpose() - DMatrix::identity(channels, channels)).map(f64::abs);
                if !off.iter().all(|&entry| entry <= ORTHONORMAL_TOLERANCE) {
                    return Err(Error::input(
                        "the rows of the Karhunen-Loeve transformation are not orthonormal",
                    ));
                }
            }
            (CarKind::Car3d, Some(_)) => {
                return Err(Error::input("a 3D field model has no Karhunen-Loeve transformation"));
            }
            (CarKind::Car2d, _) => {
                return Err(Error::input(format!(
                    "a 2D field model of {channels} channels needs a {channels} x {channels} transformation"
                )));
            }
        }
        for (k, level) in self.levels.iter().enumerate() {
            level.check(self.kind, channels).map_err(|error| error.context(format!("level {k}")))?;
        }
        Ok(())
    }
}

/// Checks that a matrix is symmetric, but for rounding, and positive definite.
fn check_covariance(matrix: &DMatrix<f64>) -> Result<()> {
    let off = (matrix - matrix.transpose()).amax();
    if off > SYMMETRY_TOLERANCE * matrix.amax() {
        return Err(Error::input("a covariance matrix is not symmetric"));
    }
    cholesky(matrix.clone()).map(drop)
}

impl Level {
    /// Sigma at the level's gain, shaped as it is.
    pub(super) fn noise_covariance(&self) -> DMatrix<f64> {
        &self.sigma * (self.gain * self.gain)
    }

    /// Gamma `[channels, channels * sites]` and Sigma `[channels, channels]` of all channels together, at the level's
    /// gain. Scalar models become diagonal blocks, so what reads these need not know the kind.
    pub(super) fn joint(&self, kind: CarKind) -> (DMatrix<f64>, DMatrix<f64>) {
        let sigma = self.noise_covariance();
        if kind == CarKind::Car3d {
            return (self.gamma.clone(), sigma);
        }
        let (channels, sites) = self.gamma.shape();
        let mut gamma = DMatrix::zeros(channels, channels * sites);
        for i in 0..channels {
            for s in 0..sites {
                gamma[(i, s * channels + i)] = self.gamma[(i, s)];
            }
        }
        (gamma, DMatrix::from_diagonal(&sigma.column(0).into_owned()))
    }

    /// The spectral radius of the field, of its worst channel if 2D.
    pub(super) fn measure_radius(&self, kind: CarKind) -> Result<f64> {
        stability::radius(&self.joint(kind).0, &self.neighbourhood)
    }

    fn check(&self, kind: CarKind, channels: usize) -> Result<()> {
        let sites = self.neighbourhood.len();
        let (gamma, sigma) = match kind {
            CarKind::Car3d => ((channels, channels * sites), (channels, channels)),
            CarKind::Car2d => ((channels, sites), (channels, 1)),
        };
        for (name, matrix, shape) in [("gamma", &self.gamma, gamma), ("sigma", &self.sigma, sigma)] {
            if matrix.shape() != shape {
                let (got, expected) = (matrix.shape(), shape);
                return Err(Error::input(format!("{name} has the shape {got:?}, expected {expected:?}")));
            }
            if !matrix.iter().all(|value| value.is_finite()) {
                return Err(Error::input(format!("{name} is not finite")));
            }
        }
        let mut seen = self.neighbourhood.clone();
        seen.sort_unstable();
        if let Some(pair) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::input(format!("neighbour {:?} is there twice", pair[0])));
        }
        if !(self.gain.is_finite() && self.gain > 0.0) {
            return Err(Error::input(format!("the gain is {}, expected a finite number above 0", self.gain)));
        }
        check_covariance(&self.joint(kind).1).map_err(|error| error.context("sigma"))?;
        let radius = self.measure_radius(kind)?;
        if radius < STABLE_RADIUS {
            return Ok(());
        }
        Err(Error::input(format!(
            "the field is not stable: radius {radius:.4}, it must be below {STABLE_RADIUS}"
        ))
        .hint("fit the model again"))
    }
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A model of one level from coefficients as they are stored.
    pub(in crate::method::field) fn single(
        kind: CarKind,
        sites: &[[i32; 2]],
        gamma: &[f64],
        sigma: &[f64],
    ) -> Model {
        let channels = if kind == CarKind::Car3d { sigma.len().isqrt() } else { sigma.len() };
        let level = Level {
            neighbourhood: sites.to_vec(),
            gamma: DMatrix::from_row_slice(channels, gamma.len() / channels, gamma),
            sigma: DMatrix::from_row_slice(channels, sigma.len() / channels, sigma),
            gain: 1.0,
            prior: Prior::weak(1.0, channels),
            log_evidence: 0.0,
            radius: 0.5,
            size: [64, 64],
            note: None,
        };
        let transform = (kind == CarKind::Car2d).then(|| DMatrix::identity(channels, channels));
        let covariance = DMatrix::identity(channels, channels);
        let mean = vec![0.0; channels];
        Model { kind, mean, transform, levels: vec![level], covariance, autocovariance_error: 0.0 }
    }

    #[test]
    fn scalar_models_become_diagonal_blocks() {
        let model = single(CarKind::Car2d, &[[0, 1], [1, 0]], &[0.1, 0.2, 0.3, 0.4], &[5.0, 6.0]);
        let (gamma, sigma) = model.levels[0].joint(model.kind);
        assert_eq!(gamma, DMatrix::from_row_slice(2, 4, &[0.1, 0.0, 0.2, 0.0, 0.0, 0.3, 0.0, 0.4]));
        assert_eq!(sigma, DMatrix::from_row_slice(2, 2, &[5.0, 0.0, 0.0, 6.0]));
        model.check().unwrap();
    }

    #[test]
    fn damaged_models_are_refused() {
        let sound = single(CarKind::Car3d, &[[0, 1]], &[0.5, 0.1, 0.0, 0.5], &[1.0, 0.3, 0.3, 1.0]);
        sound.check().unwrap();
        let damages: [fn(&mut Model); 11] = [
            |m| m.levels.clear(),
            |m| m.levels[0].gain = 0.0,
            |m| m.covariance = DMatrix::identity(3, 3),
            |m| m.mean[0] = f64::INFINITY,
            |m| m.transform = Some(DMatrix::identity(2, 2)),
            |m| m.kind = CarKind::Car2d,
            |m| m.levels[0].gamma[(0, 0)] = f64::NAN,
            |m| m.levels[0].gamma[(0, 0)] = 1.01,
            |m| m.levels[0].sigma[(1, 0)] = 1.5,
            |m| m.levels[0].neighbourhood = vec![[0, -1]],
            |m| m.levels[0].neighbourhood.push([1, 0]),
        ];
        for (n, damage) in damages.iter().enumerate() {
            let mut model = sound.clone();
            damage(&mut model);
            assert!(model.check().is_err(), "damage {n}");
        }
        let mut skewed = single(CarKind::Car2d, &[[0, 1]], &[0.5, 0.5], &[1.0, 1.0]);
        skewed.transform = Some(DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.0, 1.0]));
        assert!(skewed.check().is_err());
    }
}

//! How many levels a model takes and how loud each is: by the statistics that its synthesis will have.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::budget::most_levels;
use super::gain::{self, Target};
use super::level::fit_level;
use super::second_order::{Autocovariance, Lags, variances};
use super::spectrum::Share;
use crate::error::{Error, Result};
use crate::method::field::model::{Gains, Level, Options};
use crate::method::field::pyramid;
use crate::method::field::raster::Field;

/// All levels that a model of a field may consist of, fitted.
pub(super) struct Fitted {
    /// The band-passes of every level but the coarsest, the finest first.
    bands: Vec<Part>,
    /// The low-pass of every level that may be the coarsest, the finest first.
    low_passes: Vec<Part>,
    target: Autocovariance,
}

/// A level of the data and what was fitted to it.
struct Part {
    /// Variance of each channel.
    variances: Vec<f64>,
    level: Level,
    share: Share,
}

/// A number of levels, and what comes of it.
pub(super) struct Choice {
    pub(super) levels: Vec<Level>,
    /// Covariance of the channels of a synthesis.
    pub(super) covariance: DMatrix<f64>,
    /// Of a synthesis, see [`Autocovariance::error`].
    pub(super) autocovariance_error: f64,
}

impl Fitted {
    /// Fits every band, and every low-pass that is one of the choices, of a field of mean 0.
    pub(super) fn new(centred: &Field, options: &Options) -> Result<Self> {
        let boundary = options.boundary;
        let most = most_levels([centred.height, centred.width], centred.channels, options)?;
        let lags = Lags::of(centred.height, centred.width);
        let mut bands = pyramid::decompose(centred, most, boundary)?;
        bands.pop();
        let next = |fine: &Field| Some(pyramid::reduce(fine, boundary));
        let low_passes: Vec<Field> = std::iter::successors(Some(centred.clone()), next).take(most).collect();
        let least = options.levels.unwrap_or(1);
        let fitted = |fields: &[Field], first: usize| {
            let part = |(n, field): (usize, &Field)| {
                let number = first + n;
                let level = fit_level(field, options).map_err(|error| {
                    error
                        .context(format!("pyramid level {number}"))
                        .hint("ask for fewer levels, or take a larger tile")
                })?;
                let share = Share::of(&level, options.kind, number, most, lags)?;
                Ok(Part { variances: variances(field), level, share })
            };
            fields.par_iter().enumerate().map(part).collect::<Result<Vec<_>>>()
        };
        Ok(Self {
            bands: fitted(&bands, 0)?,
            low_passes: fitted(&low_passes[least - 1..], least - 1)?,
            target: Autocovariance::of_field(centred, boundary, lags),
        })
    }

    pub(super) fn most_levels(&self) -> usize {
        self.bands.len() + 1
    }

    /// What comes of `levels` levels.
    pub(super) fn choice(&self, levels: usize, gains: Gains) -> Result<Choice> {
        let first = self.most_levels() - self.low_passes.len();
        let coarsest = &self.low_passes[levels - 1 - first];
        let parts: Vec<&Part> = self.bands[..levels - 1].iter().chain([coarsest]).collect();
        let shares: Vec<&Share> = parts.iter().map(|part| &part.share).collect();
        let gains = match gains {
            Gains::None => vec![1.0; levels],
            Gains::Matched => {
                let variances: Vec<&[f64]> = parts.iter().map(|part| &part.variances[..]).collect();
                gain::matched(&shares, &Target { autocovariance: &self.target, variances: &variances })?
            }
        };
        let made = gain::total(&shares, &gains).ok_or_else(|| Error::internal("a pyramid of no levels"))?;
        let with_gain = |(part, gain): (&&Part, &f64)| Level { gain: *gain, ..part.level.clone() };
        Ok(Choice {
            levels: parts.iter().zip(&gains).map(with_gain).collect(),
            covariance: made.covariance().clone(),
            autocovariance_error: made.error(&self.target),
        })
    }
}

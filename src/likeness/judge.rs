use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::co_occurrence::{Edges, edges};
use super::{LEAST_SIDE, Lightness, Measure, Statistics};
use crate::error::{Error, Result};
use crate::shape::Size;

/// Real crops of a material, and how far they are from each other.
pub struct Judge {
    size: Size,
    edges: Edges,
    reals: Vec<Statistics>,
    floor: [f64; Measure::ALL.len()],
}

/// How far pictures are from real crops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// Mean distance of each measure in the order of [`Measure::ALL`], in units of the mean distance between real crops:
    /// 1 is another real crop.
    pub measures: [f64; Measure::ALL.len()],
    /// The largest of them: J.
    pub j: f64,
    /// Whose it is.
    pub worst: Measure,
    /// By how much the largest autocorrelation at a far shift exceeds that of real crops, -2 to 2.
    pub excess_peak: f64,
}

impl Judge {
    /// By real crops that do not overlap.
    ///
    /// # Errors
    /// Fewer than two crops, crops of different sizes or smaller than [`LEAST_SIDE`], with values that are not finite,
    /// without any contrast, or all the same.
    pub fn new(reals: &[Lightness]) -> Result<Self> {
        let [first, _, ..] = reals else {
            return Err(Error::usage(format!("got {} real crops, expected at least two", reals.len())));
        };
        for crop in reals {
            if crop.size != first.size || crop.size.height.min(crop.size.width) < LEAST_SIDE {
                return Err(Error::usage(format!(
                    "got real crops of {} and {}, expected one size of at least {LEAST_SIDE} texels a side",
                    first.size, crop.size
                )));
            }
            if !(crop.deviation().is_finite() && crop.deviation() > 0.0) {
                return Err(Error::input("a real crop has one value all over: there is nothing to judge by"));
            }
        }
        let edges = edges(first);
        let reals: Vec<Statistics> = reals.par_iter().map(|crop| Statistics::of(crop, &edges)).collect();
        let pairs: Vec<_> = (0..reals.len()).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        let distances: Vec<_> = pairs.par_iter().map(|&(i, j)| reals[i].distances(&reals[j])).collect();
        let floor = means(&distances);
        match floor.iter().position(|distance| *distance <= 0.0) {
            None => Ok(Self { size: first.size, edges, reals, floor }),
            Some(at) => Err(Error::input(format!(
                "the real crops do not differ in {}: are they the same?",
                Measure::ALL[at].name()
            ))),
        }
    }

    /// Mean distance between real crops, in the order of [`Measure::ALL`].
    pub fn floor(&self) -> [f64; Measure::ALL.len()] {
        self.floor
    }

    /// Judges pictures of the size of the real crops, all together, each against every real crop.
    ///
    /// # Errors
    /// No picture, or one of another size than the real crops.
    pub fn judge(&self, pictures: &[Lightness]) -> Result<Judgement> {
        self.judge_by(pictures, |_, _| true)
    }

    /// Judges pictures of which number n was chosen to look like real crop n, modulo their number: each against the other
    /// real crops only.
    ///
    /// # Errors
    /// Those of [`Judge::judge`].
    pub(crate) fn judge_partners(&self, pictures: &[Lightness]) -> Result<Judgement> {
        self.judge_by(pictures, |picture, real| picture % self.reals.len() != real)
    }

    fn judge_by(&self, pictures: &[Lightness], counts: impl Fn(usize, usize) -> bool) -> Result<Judgement> {
        if pictures.is_empty() || pictures.iter().any(|picture| picture.size != self.size) {
            let sizes: Vec<String> = pictures.iter().map(|picture| picture.size.to_string()).collect();
            return Err(Error::usage(format!(
                "got pictures of {sizes:?} to judge, expected at least one, each of {} as the real crops",
                self.size
            )));
        }
        let found: Vec<Statistics> =
            pictures.par_iter().map(|picture| Statistics::of(picture, &self.edges)).collect();
        let pairs: Vec<_> = (0..found.len())
            .flat_map(|picture| (0..self.reals.len()).map(move |real| (picture, real)))
            .filter(|&(picture, real)| counts(picture, real))
            .collect();
        let distances: Vec<_> =
            pairs.par_iter().map(|&(picture, real)| found[picture].distances(&self.reals[real])).collect();
        let distances = means(&distances);
        let measures = std::array::from_fn(|n| distances[n] / self.floor[n]);
        let worst = largest(&measures);
        let peak = |statistics: &[Statistics]| {
            statistics.iter().map(Statistics::peak).sum::<f64>() / statistics.len() as f64
        };
        Ok(Judgement {
            measures,
            j: measures[worst],
            worst: Measure::ALL[worst],
            excess_peak: peak(&found) - peak(&self.reals),
        })
    }
}

impl Judgement {
    /// Means of judgements; the worst measure is the one whose mean is the largest. None of none.
    pub fn mean(judgements: &[Self]) -> Option<Self> {
        if judgements.is_empty() {
            return None;
        }
        let measures = means(&judgements.iter().map(|judgement| judgement.measures).collect::<Vec<_>>());
        let worst = largest(&measures);
        let of =
            |value: fn(&Self) -> f64| judgements.iter().map(value).sum::<f64>() / judgements.len() as f64;
        Some(Self {
            measures,
            j: of(|judgement| judgement.j),
            worst: Measure::ALL[worst],
            excess_peak: of(|judgement| judgement.excess_peak),
        })
    }
}

/// Number of the largest value, the first of equals.
fn largest(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |largest, n| if values[n] > values[largest] { n } else { largest })
}

/// Means of rows.
fn means<const N: usize>(rows: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|n| rows.iter().map(|row| row[n]).sum::<f64>() / rows.len().max(1) as f64)
}

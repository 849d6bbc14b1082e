//! How like the material is a picture of it? Pure functions over pictures of L*.
//!
//! Five measures tell two pictures apart, each blind to something that another sees: how grey levels neighbour each
//! other ([`co_occurrence`]), a steerable pyramid's statistics and the similarity of its bands ([`bands`]), the power in
//! rings and directions of the spectrum ([`spectrum`]), and the distribution of small patches ([`patches`]).
//! [`Judge`] puts them in units of how far real crops of the material are from each other.
//!
//! What those five do not see is measured apart: repetition ([`autocorrelation`], [`repetition`]), pieces copied whole
//! ([`copies`]) and lost clusters ([`verdict`]). `docs/how-to/judge.md` says what each is good for.

pub mod autocorrelation;
pub mod bands;
pub(crate) mod co_occurrence;
pub mod copies;
mod draws;
mod judge;
mod lightness;
pub mod patches;
pub mod repetition;
pub mod spectrum;
mod statistics;
mod steerable;
#[cfg(test)]
mod tests;
pub mod verdict;

pub use judge::{Judge, Judgement};
pub use lightness::Lightness;
pub use statistics::{Measure, Statistics};

/// Least side of a picture that is judged: the coarsest band of the pyramid then has 8 x 8 coefficients.
pub(crate) const LEAST_SIDE: usize = 64;

/// Mean of values; 0 of none.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Variance of values about their mean.
pub(crate) fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len().max(1) as f64
}

/// Pearson's correlation of two series; 0 where one of them does not change.
pub(crate) fn correlation(a: impl Iterator<Item = f64> + Clone, b: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = a.clone().count().max(1) as f64;
    let (mean_a, mean_b) = (a.clone().sum::<f64>() / count, b.clone().sum::<f64>() / count);
    let (mut both, mut own_a, mut own_b) = (0.0, 0.0, 0.0);
    for (a, b) in a.zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        (both, own_a, own_b) = (both + a * b, own_a + a * a, own_b + b * b);
    }
    let scale = (own_a * own_b).sqrt();
    if scale > 0.0 { both / scale } else { 0.0 }
}

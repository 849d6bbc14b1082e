//! What a fitted level contributes to the synthesised field, computed from its coefficients: no probe, no noise.
//!
//! The field of (9) has the spectrum S(w) = A(w)^-1 Sigma A(w)^-H with A(w) = I - sum of A_s e^(-i w s). Expansion to
//! the next finer lattice multiplies it, averaged over the four phases, by 4 H(w)^2, H the kernel of the pyramid.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix};
use rayon::prelude::*;

use super::neighbourhood::reach;
use super::second_order::{Autocovariance, Lags};
use crate::error::{Error, Result};
use crate::method::field::model::{CarKind, Level};

/// Fewest and most frequencies along each axis of a level's lattice. A sum over N of them is the covariance of a field
/// that repeats every N texels, so N must be some times as far as a disturbance reaches, which the radius tells.
const FEWEST: usize = 128;
const MOST: usize = 1024;
const REACHES: f64 = 4.0;

/// More levels than any picture needs.
pub(super) const MOST_LEVELS: usize = 8;

/// Second-order statistics of one level's field on the finest lattice.
#[derive(Clone, Debug)]
pub(super) struct Share {
    pub(super) autocovariance: Autocovariance,
    /// What pyramids find in it: variance of each channel in each level, the finest first.
    variances: Vec<LevelVariances>,
}

/// Variance of each channel in a level of a pyramid.
#[derive(Clone, Debug)]
struct LevelVariances {
    /// In its Laplacian band.
    band: Vec<f64>,
    /// In its low-pass, which the coarsest level keeps whole.
    low_pass: Vec<f64>,
}

impl Share {
    /// Of `level` as number `number` of its pyramid; looked at with pyramids of up to `most_levels` levels (at most
    /// [`MOST_LEVELS`]).
    pub(super) fn of(
        level: &Level,
        kind: CarKind,
        number: usize,
        most_levels: usize,
        lags: Lags,
    ) -> Result<Self> {
        let reach = (REACHES / (1.0 - level.radius).max(REACHES / MOST as f64)) as usize;
        let side = reach.next_power_of_two().clamp(FEWEST, MOST);
        let (gamma, sigma) = level.joint(kind);
        let channels = sigma.nrows();
        // The lower half of the frequencies is the conjugate of the upper.
        let rows: Vec<Vec<Complex<f64>>> = (0..=side / 2)
            .into_par_iter()
            .map(|row| spectrum_row(&gamma, &sigma, &level.neighbourhood, row, side))
            .collect::<Result<_>>()?;
        let autocovariance = Autocovariance { lags, at: autocovariance(&rows, channels, number, lags) };
        let variances = (0..most_levels).map(|band| variances(&rows, channels, number, band)).collect();
        Ok(Self { autocovariance, variances })
    }

    /// Variance of each channel in each band of a pyramid of `levels` levels, the finest first.
    pub(super) fn band_variances(&self, levels: usize) -> Vec<&[f64]> {
        let bands = self.variances.iter().take(levels - 1).map(|level| &level.band[..]);
        bands.chain(self.variances.get(levels - 1).map(|level| &level.low_pass[..])).collect()
    }
}

/// S at the frequencies of one row, `[column][channel][channel]`.
fn spectrum_row(
    gamma: &DMatrix<f64>,
    sigma: &DMatrix<f64>,
    sites: &[[i32; 2]],
    row: usize,
    side: usize,
) -> Result<Vec<Complex<f64>>> {
    let channels = sigma.nrows();
    let [rows, columns] = reach(sites);
    let turn = |n: f64, frequency: usize| unit(-n * TAU * frequency as f64 / side as f64);
    let down: Vec<_> = (0..=rows).map(|dy| turn(dy as f64, row)).collect();
    let sigma = sigma.map(|value| Complex::new(value, 0.0));
    let mut values = Vec::with_capacity(side * channels * channels);
    for column in 0..side {
        let along: Vec<_> = (0..=2 * columns).map(|n| turn(n as f64 - columns as f64, column)).collect();
        let mut transfer = DMatrix::<Complex<f64>>::identity(channels, channels);
        for (s, &[dy, dx]) in sites.iter().enumerate() {
            let phase = down[dy as usize] * along[(dx + columns as i32) as usize];
            for j in 0..channels {
                for i in 0..channels {
                    transfer[(i, j)] -= phase * gamma[(i, s * channels + j)];
                }
            }
        }
        let inverse =
            transfer.try_inverse().ok_or_else(|| Error::internal("a stable field has no spectrum"))?;
        let spectrum = &inverse * &sigma * inverse.adjoint();
        values.extend(spectrum.transpose().iter());
    }
    Ok(values)
}

/// R(d) = mean over w of weight(w) S(w) e^(i w d), one axis after the other.
fn autocovariance(
    rows: &[Vec<Complex<f64>>],
    channels: usize,
    number: usize,
    lags: Lags,
) -> Vec<DMatrix<f64>> {
    let square = channels * channels;
    let side = rows[0].len() / square;
    let side_lags = 2 * lags.columns + 1;
    let along: Vec<Vec<Complex<f64>>> =
        (0..side_lags).map(|n| folded(side, number, n as f64 - lags.columns as f64)).collect();
    // [row][lag][channel][channel]
    let partly: Vec<Vec<Complex<f64>>> = rows
        .par_iter()
        .map(|row| {
            let mut sums = vec![Complex::new(0.0, 0.0); side_lags * square];
            for (sums, weights) in sums.chunks_exact_mut(square).zip(&along) {
                for (spectrum, weight) in row.chunks_exact(square).zip(weights) {
                    for (sum, value) in sums.iter_mut().zip(spectrum) {
                        *sum += value * weight;
                    }
                }
            }
            sums
        })
        .collect();
    let at = |down: &[Complex<f64>], lag: usize| {
        let mut sum = DMatrix::zeros(channels, channels);
        for (row, sums) in partly.iter().enumerate() {
            for i in 0..channels {
                for j in 0..channels {
                    let value = (down[row] * sums[lag * square + i * channels + j]).re;
                    sum[(i, j)] += stands_for(row, side) * value;
                }
            }
        }
        sum
    };
    let rows_of_lags = (0..=lags.rows).map(|dy| folded(side, number, dy as f64));
    rows_of_lags.flat_map(|down| (0..side_lags).map(|lag| at(&down, lag)).collect::<Vec<_>>()).collect()
}

/// Rows of frequencies that a row of the upper half stands for: itself and, but for 0 and the highest, its conjugate.
fn stands_for(row: usize, side: usize) -> f64 {
    if row == 0 || 2 * row == side { 1.0 } else { 2.0 }
}

/// Factors of the `side` frequencies of one axis of level `number` in the autocovariance at lag `lag` of the finest
/// lattice, whose frequencies are 2^number times as many.
fn folded(side: usize, number: usize, lag: f64) -> Vec<Complex<f64>> {
    let mut sums = vec![Complex::new(0.0, 0.0); side];
    for (n, w) in finest(side, number) {
        sums[n] += unit(w * lag) * (expansion(number, w) / (side << number) as f64);
    }
    sums
}

/// The frequencies of one axis of the finest lattice, each with the number of the one that it is on the level's own.
fn finest(side: usize, number: usize) -> impl Iterator<Item = (usize, f64)> {
    let count = side << number;
    (0..count).map(move |n| (n % side, TAU * n as f64 / count as f64))
}

/// Variance of each channel in level `level` of a pyramid.
///
/// A Laplacian band is its field less reduction and expansion, which lets a frequency w through at K(w) = H(w)^2 along
/// each axis, and its alias at H(w) H(w + pi). So the power of a frequency (v, w) becomes 1 - 2 K(v) K(w) +
/// K(v) A(v) K(w) A(w) times as much, A(w) = H(w)^2 + H(w + pi)^2: three terms, each a product of its axes.
fn variances(rows: &[Vec<Complex<f64>>], channels: usize, number: usize, level: usize) -> LevelVariances {
    let side = rows[0].len() / (channels * channels);
    let mut axis = vec![[0.0; 3]; side];
    for (n, w) in finest(side, number) {
        let reduction: f64 = (0..level).map(|j| squared(w * f64::from(1 << j))).product();
        let weight = expansion(number, w) * reduction / (side << number) as f64;
        let own = w * f64::from(1 << level);
        let (kept, alias) = (squared(own), squared(own + PI));
        for (sum, factor) in axis[n].iter_mut().zip([1.0, kept, kept * (kept + alias)]) {
            *sum += weight * factor;
        }
    }
    let mut sums = LevelVariances { band: vec![0.0; channels], low_pass: vec![0.0; channels] };
    for (y, row) in rows.iter().enumerate() {
        for (x, spectrum) in row.chunks_exact(channels * channels).enumerate() {
            let [whole, kept, reduced] =
                [0, 1, 2].map(|term| stands_for(y, side) * axis[y][term] * axis[x][term]);
            for i in 0..channels {
                let power = spectrum[i * channels + i].re;
                sums.low_pass[i] += whole * power;
                sums.band[i] += (whole - 2.0 * kept + reduced) * power;
            }
        }
    }
    sums
}

/// Power that the expansions from level `number` let through, along one axis.
fn expansion(number: usize, w: f64) -> f64 {
    (0..number).map(|j| 2.0 * squared(w * f64::from(1 << j))).product()
}

/// H(w)^2 of the binomial [1 4 6 4 1] / 16: cos^8(w / 2).
fn squared(w: f64) -> f64 {
    libm::cos(w / 2.0).powi(8)
}

fn unit(angle: f64) -> Complex<f64> {
    Complex::new(libm::cos(angle), libm::sin(angle))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::field::fit::second_order;
    use crate::method::field::model::tests::single;
    use crate::method::field::{Boundary, Field, Model, fit, pyramid};

    fn model() -> Model {
        let sites = [[0, 1], [1, 0], [1, -1]];
        single(
            CarKind::Car3d,
            &sites,
            &[0.5, 0.1, 0.3, 0.0, 0.1, -0.05, -0.2, 0.4, 0.1, 0.3, 0.0, 0.1],
            &[1.0, 0.4, 0.4, 0.5],
        )
    }

    /// A field of only the level `number`, the finer ones silent.
    fn alone(level: &Level, number: usize) -> Field {
        let mut model = model();
        let mut silent = level.clone();
        silent.sigma *= 1e-12;
        model.levels = vec![silent; number];
        model.levels.push(level.clone());
        fit::tests::synthesised(&model, 3, 1024, 1024)
    }

    #[test]
    fn the_statistics_of_a_level_are_those_of_a_long_synthesis() {
        let level = &model().levels[0];
        let lags = Lags { rows: 3, columns: 3 };
        for number in [0, 1, 2] {
            let share = Share::of(level, CarKind::Car3d, number, 3, lags).unwrap();
            let (field, _) = alone(level, number).centred();
            let found = Autocovariance::of_field(&field, Boundary::Mirrored, lags);
            let error = share.autocovariance.error(&found);
            assert!(error < 0.02, "level {number}: {error}");
            let bands = pyramid::decompose(&field, 3, Boundary::Mirrored).unwrap();
            for (band, expected) in bands.iter().zip(share.band_variances(3)) {
                for (found, expected) in second_order::variances(band).iter().zip(expected) {
                    assert!((found / expected - 1.0).abs() < 0.06, "level {number}: {found} for {expected}");
                }
            }
        }
    }
}

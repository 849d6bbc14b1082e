//! Statistics of the bands of a steerable pyramid: those that J. Portilla and E. P. Simoncelli found to tell textures
//! apart ("A parametric texture model based on joint statistics of complex wavelet coefficients", 2000), and the terms of
//! STSIM-2 (J. Zujovic, T. N. Pappas and D. L. Neuhoff, "Structural texture similarity metrics for image analysis and
//! retrieval", 2013).

use super::steerable::{ORIENTATIONS, SCALES, bands};
use super::{Lightness, correlation, mean, variance};
use crate::shape::Size;

/// Shifts (rows, columns) of the autocorrelation of magnitudes.
const SHIFTS: [[isize; 2]; 8] = [[0, 1], [1, 0], [0, 2], [2, 0], [1, 1], [1, -1], [0, 4], [4, 0]];

/// Keeps logarithms and quotients finite in bands that hold nothing.
const TINY: f64 = 1e-12;

/// The same for variances under a logarithm.
const TINY_VARIANCE: f64 = 1e-9;

/// And for the similarity of means and deviations.
const TINY_SIMILARITY: f64 = 1e-6;

/// Statistics of one picture.
#[derive(Clone, Debug)]
pub(crate) struct BandStatistics {
    /// Of each band: log variance and a third of the kurtosis of the real part, autocorrelation of the magnitude at eight
    /// shifts; correlations of magnitudes between orientations and to the next coarser scale; skew and a third of the
    /// kurtosis of the picture.
    pub joint: Vec<f64>,
    /// Mean and standard deviation of each band's magnitude.
    pub amplitudes: Vec<f64>,
    /// Its correlation with the neighbour at right and below, and those between bands.
    pub correlations: Vec<f64>,
}

/// The magnitude of a band.
struct Magnitude {
    size: Size,
    values: Vec<f64>,
}

impl BandStatistics {
    /// Of a picture.
    pub(crate) fn of(picture: &Lightness) -> Self {
        let mut joint = Vec::new();
        let mut amplitudes = Vec::new();
        let mut correlations = Vec::new();
        let mut magnitudes = Vec::new();
        for band in bands(picture).into_iter().flatten() {
            let real: Vec<f64> = band.values.iter().map(|value| value.re).collect();
            let spread = variance(&real);
            joint.push(libm::log(spread + TINY_VARIANCE));
            joint.push(moment(&real, 4) / (spread * spread + TINY) / 3.0);
            let magnitude: Vec<f64> = band.values.iter().map(|value| value.norm()).collect();
            let middle = mean(&magnitude);
            let centred: Vec<f64> = magnitude.iter().map(|value| value - middle).collect();
            let spread = variance(&magnitude);
            joint.extend(SHIFTS.map(|shift| circular(&centred, band.size, shift) / (spread + TINY)));
            amplitudes.extend([middle, spread.sqrt()]);
            correlations.extend(
                [[0, 1], [1, 0]].map(|shift| neighbouring(&centred, band.size, shift) / (spread + TINY)),
            );
            magnitudes.push(Magnitude { size: band.size, values: magnitude });
        }
        let between = between_bands(&magnitudes);
        joint.extend(&between);
        correlations.extend(&between);
        let spread = variance(&picture.values);
        if spread > 0.0 {
            let third = moment(&picture.values, 3) / (spread * spread.sqrt());
            joint.extend([third, moment(&picture.values, 4) / (spread * spread) / 3.0]);
        } else {
            joint.extend([0.0; 2]);
        }
        Self { joint, amplitudes, correlations }
    }

    /// Root mean square difference of the joint statistics.
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        root_mean_square(&self.joint, &other.joint)
    }

    /// Mean dissimilarity of STSIM-2's terms: 0 to 1.
    pub(crate) fn dissimilarity(&self, other: &Self) -> f64 {
        let amplitudes = self
            .amplitudes
            .iter()
            .zip(&other.amplitudes)
            .map(|(a, b)| 1.0 - (2.0 * a * b + TINY_SIMILARITY) / (a * a + b * b + TINY_SIMILARITY));
        let correlations =
            self.correlations.iter().zip(&other.correlations).map(|(a, b)| (a - b).abs() / 2.0);
        let terms = self.amplitudes.len() + self.correlations.len();
        amplitudes.chain(correlations).sum::<f64>() / terms as f64
    }
}

/// Root mean square difference.
pub(super) fn root_mean_square(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len().max(1) as f64).sqrt()
}

/// Central moment of an order.
fn moment(values: &[f64], order: i32) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(order)).sum::<f64>() / values.len() as f64
}

/// Mean product of values and those a shift away, around the borders.
fn circular(values: &[f64], Size { height, width }: Size, [down, right]: [isize; 2]) -> f64 {
    let mut sum = 0.0;
    for y in 0..height {
        let other = (y as isize + down).rem_euclid(height as isize) as usize * width;
        for x in 0..width {
            let column = (x as isize + right).rem_euclid(width as isize) as usize;
            sum += values[y * width + x] * values[other + column];
        }
    }
    sum / values.len() as f64
}

/// The same over those pairs that do not reach over a border.
fn neighbouring(values: &[f64], Size { height, width }: Size, [down, right]: [usize; 2]) -> f64 {
    let mut sum = 0.0;
    for y in 0..height - down {
        for x in 0..width - right {
            sum += values[y * width + x] * values[(y + down) * width + x + right];
        }
    }
    sum / ((height - down) * (width - right)) as f64
}

/// Correlations of magnitudes between the orientations of a scale, and of each with its like of the next coarser scale.
fn between_bands(magnitudes: &[Magnitude]) -> Vec<f64> {
    let at = |scale: usize, orientation: usize| &magnitudes[scale * ORIENTATIONS + orientation];
    let mut found = Vec::new();
    for scale in 0..SCALES {
        for orientation in 0..ORIENTATIONS {
            let own = at(scale, orientation);
            for other in orientation + 1..ORIENTATIONS {
                let other = at(scale, other);
                found.push(correlation(own.values.iter().copied(), other.values.iter().copied()));
            }
            if scale + 1 < SCALES {
                let coarse = at(scale + 1, orientation);
                let rows = own.values.chunks_exact(own.size.width).step_by(2);
                let fine = rows.flat_map(|row| row.iter().step_by(2).copied());
                found.push(correlation(fine, coarse.values.iter().copied()));
            }
        }
    }
    found
}

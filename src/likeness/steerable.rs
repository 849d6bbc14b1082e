//! The complex steerable pyramid in the frequency domain: E. P. Simoncelli and W. T. Freeman, "The steerable pyramid: a
//! flexible architecture for multi-scale derivative computation" (1995), as J. Portilla and E. P. Simoncelli use it for
//! texture (2000). Bands have quadrature pairs, so their magnitude tells energy and their real part the texture.

use rustfft::num_complex::Complex;

use super::Lightness;
use crate::shape::Size;
use crate::signal::fourier::{Fourier, frequency};

/// Number of scales, an octave each.
pub(super) const SCALES: usize = 4;

/// Number of orientations; the angular windows are cosines to the power of one less.
pub(super) const ORIENTATIONS: usize = 4;

/// Twice the square root of 2^(2k) k!^2 / ((k + 1) (2k)!) for k = 3: squares of the angular windows then add up to 4 on
/// the half plane that each keeps.
const ANGULAR_GAIN: f64 = 1.788_854_381_999_831_7;

/// Coefficients of one scale and orientation.
pub(super) struct Band {
    pub(super) size: Size,
    pub(super) values: Vec<Complex<f64>>,
}

/// A spectrum of which some octaves have been cut off.
struct Low {
    size: Size,
    values: Vec<Complex<f64>>,
}

/// The bands of a picture, scale by scale from the finest, each in all orientations.
pub(super) fn bands(picture: &Lightness) -> Vec<Vec<Band>> {
    let full = picture.size;
    let polar = Polar { full };
    let mut low = Low { size: full, values: Fourier::new(full).forward_real(picture.values.iter().copied()) };
    low.keep_below(&polar, 0.0);
    let mut scales = Vec::with_capacity(SCALES);
    for scale in 1..=SCALES {
        let fourier = Fourier::new(low.size);
        // What all orientations share: the value in its octave, and its direction.
        let octave = |n: usize| {
            let (radius, angle) = polar.at(low.frequency(n));
            (low.values[n] * above(radius + scale as f64), angle)
        };
        let octave: Vec<(Complex<f64>, f64)> = (0..low.values.len()).map(octave).collect();
        let band = |orientation: usize| {
            let turn = std::f64::consts::PI * orientation as f64 / ORIENTATIONS as f64;
            let value = |&(value, angle): &(Complex<f64>, f64)| {
                let along = libm::cos(angle - turn);
                let window = if along > 0.0 { ANGULAR_GAIN * along * along * along } else { 0.0 };
                // (-i)^3 = i makes the filters' impulse responses real and odd before they are made complex.
                Complex::new(0.0, window) * value
            };
            Band { size: low.size, values: fourier.inverse(&octave.iter().map(value).collect::<Vec<_>>()) }
        };
        scales.push((0..ORIENTATIONS).map(band).collect());
        low = low.halved();
        low.keep_below(&polar, scale as f64);
    }
    scales
}

/// Raised cosine over an octave: 0 below an octave under the frequency, 1 above it; `octaves` is how far it is above.
fn above(octaves: f64) -> f64 {
    libm::cos(std::f64::consts::FRAC_PI_2 * octaves.clamp(-1.0, 0.0))
}

/// What remains: squares of both add up to 1.
fn below(octaves: f64) -> f64 {
    libm::sin(-std::f64::consts::FRAC_PI_2 * octaves.clamp(-1.0, 0.0))
}

/// Polar coordinates of frequencies.
struct Polar {
    full: Size,
}

impl Polar {
    /// Octaves above half the sampling rate (mostly negative), and direction. The mean counts as the lowest frequency.
    fn at(&self, [y, x]: [i64; 2]) -> (f64, f64) {
        let along = if [y, x] == [0, 0] { -1 } else { x };
        let [v, u] =
            [(y, self.full.height), (along, self.full.width)].map(|(f, side)| 2.0 * f as f64 / side as f64);
        let angle =
            libm::atan2(2.0 * y as f64 / self.full.height as f64, 2.0 * x as f64 / self.full.width as f64);
        (libm::log2(libm::hypot(v, u)), angle)
    }
}

impl Low {
    fn frequency(&self, n: usize) -> [i64; 2] {
        let Size { height, width } = self.size;
        [frequency(n / width, height), frequency(n % width, width)]
    }

    /// Takes away what lies so many octaves below half the sampling rate, or higher.
    fn keep_below(&mut self, polar: &Polar, octaves: f64) {
        let places: Vec<[i64; 2]> = (0..self.values.len()).map(|n| self.frequency(n)).collect();
        for (value, place) in self.values.iter_mut().zip(places) {
            *value *= below(polar.at(place).0 + octaves);
        }
    }

    /// The spectrum of every second texel, of what has nothing above half of its frequencies.
    fn halved(&self) -> Self {
        let size = Size::new(self.size.height.div_ceil(2), self.size.width.div_ceil(2));
        let from =
            |place: usize, side: usize, full: usize| frequency(place, side).rem_euclid(full as i64) as usize;
        let value = |n: usize| {
            let row = from(n / size.width, size.height, self.size.height);
            let column = from(n % size.width, size.width, self.size.width);
            self.values[row * self.size.width + column]
        };
        Self { size, values: (0..size.texels()).map(value).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_lies_in_the_band_of_its_frequency_and_direction() {
        let size = Size::new(64, 64);
        // 8 cycles a side: two octaves below half the sampling rate.
        for (direction, [down, right]) in [[0, 8], [6, 6], [8, 0], [6, -6]].into_iter().enumerate() {
            let value = |n: usize| {
                let (y, x) = ((n / 64) as i64, (n % 64) as i64);
                libm::cos(std::f64::consts::TAU * (down * y + right * x) as f64 / 64.0)
            };
            let scales = bands(&Lightness::new(size, (0..size.texels()).map(value).collect()));
            let energy =
                |band: &Band| band.values.iter().map(rustfft::num_complex::Complex::norm_sqr).sum::<f64>();
            let energies: Vec<f64> = scales.iter().flatten().map(energy).collect();
            let most = (0..energies.len()).max_by(|&a, &b| energies[a].total_cmp(&energies[b]));
            assert_eq!(most, Some(ORIENTATIONS + direction), "{energies:?}");
        }
    }
}

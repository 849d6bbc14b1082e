//! The autocorrelation of a plane of features, by the Fourier transform.

use rustfft::num_complex::Complex;

use crate::shape::Size;
use crate::signal::fourier::Fourier;
use crate::signal::smooth::{gaussian, wide_mean};

/// Standard deviation of the blur of the features, texels.
const BLUR: f64 = 1.0;

/// Standard deviations after which the blur is cut off.
const CUT: f64 = 4.0;

/// Standard deviation of the mean that is taken away where a plane does not wrap, parts of a side.
const WIDE: f64 = 1.0 / 6.0;

/// Largest lag of a plane that does not wrap, parts of a side.
const REACH: f64 = 0.6;

/// Autocorrelation by lag (dy, dx): 1 at 0, -1 to 1 elsewhere.
pub(super) struct Autocorrelation {
    /// Largest lags down and across.
    pub(super) reach: [isize; 2],
    /// Lags from -reach - 1 to reach + 1, row by row: one more on all sides, so that all within reach have neighbours.
    values: Vec<f64>,
}

/// One side of the lags that are stored.
fn stored(reach: isize) -> usize {
    2 * reach as usize + 3
}

impl Autocorrelation {
    /// Of features [y, x, dim], less their mean (a plane that does not wrap: less their wide mean) and blurred.
    ///
    /// Of a plane that wraps it is circular. Else each lag is divided by the energies of the two parts that overlap.
    /// None where the features do not change, or a side has less than 8 texels.
    pub(super) fn of(size: Size, dims: usize, features: &[f32], wraps: bool) -> Option<Self> {
        let Size { height, width } = size;
        if height.min(width) < 8 || dims == 0 || features.len() != size.texels() * dims {
            return None;
        }
        let reach = [height, width]
            .map(|side| if wraps { side / 2 } else { (side as f64 * REACH) as usize } as isize);
        let padded =
            |side: usize, reach: isize| if wraps { side } else { smooth_number(side + reach as usize + 1) };
        let whole = Size::new(padded(height, reach[0]), padded(width, reach[1]));
        let fourier = Fourier::new(whole);
        let mut energy = vec![0.0; size.texels()];
        let mut power = vec![Complex::new(0.0, 0.0); whole.texels()];
        for first in (0..dims).step_by(2) {
            let plane = |dim: usize| prepared(size, features.iter().skip(dim).step_by(dims), wraps);
            let real = plane(first);
            let imaginary = if first + 1 < dims { plane(first + 1) } else { vec![0.0; size.texels()] };
            for ((energy, a), b) in energy.iter_mut().zip(&real).zip(&imaginary) {
                *energy += a * a + b * b;
            }
            // The real part of the autocorrelation of a + i b is the sum of those of a and of b.
            let mut rows = Vec::with_capacity(height * whole.width);
            for (real, imaginary) in real.chunks_exact(width).zip(imaginary.chunks_exact(width)) {
                rows.extend(real.iter().zip(imaginary).map(|(&re, &im)| Complex::new(re, im)));
                rows.resize(rows.len() + whole.width - width, Complex::new(0.0, 0.0));
            }
            for (power, value) in power.iter_mut().zip(fourier.forward(rows)) {
                power.re += value.norm_sqr();
            }
        }
        let all: f64 = energy.iter().sum();
        if !(all.is_finite() && all > 0.0) {
            return None;
        }
        let sums = fourier.inverse(&power);
        let energies = Energies::of(size, &energy);
        let value = |dy: isize, dx: isize| {
            let (y, x) = (dy.rem_euclid(whole.height as isize), dx.rem_euclid(whole.width as isize));
            let sum = sums[y as usize * whole.width + x as usize].re;
            let scale = if wraps { all } else { energies.overlapping(dy, dx) };
            if scale > 0.0 { (sum / scale).clamp(-1.0, 1.0) } else { 0.0 }
        };
        let lags = |axis: usize| -reach[axis] - 1..=reach[axis] + 1;
        let values = lags(0).flat_map(|dy| lags(1).map(move |dx| value(dy, dx))).collect();
        Some(Self { reach, values })
    }

    /// The value at a lag within one texel of reach.
    pub(super) fn at(&self, dy: isize, dx: isize) -> f64 {
        let [y, x] = [dy + self.reach[0] + 1, dx + self.reach[1] + 1].map(|n| n as usize);
        self.values[y * stored(self.reach[1]) + x]
    }

    /// Whether a shift is within reach, and not 0.
    pub(super) fn reaches(&self, shift: [f64; 2]) -> bool {
        self.within(shift, 1.0) && shift.iter().any(|n| n.abs() > 0.5)
    }

    /// Whether a shift is within a part of reach.
    pub(super) fn within(&self, shift: [f64; 2], part: f64) -> bool {
        (0..2).all(|axis| shift[axis].abs() <= part * self.reach[axis] as f64)
    }

    /// The value at a shift within reach, by linear interpolation.
    pub(super) fn interpolated(&self, shift: [f64; 2]) -> f64 {
        let floor = shift.map(f64::floor);
        let [y, x] = floor.map(|n| n as isize);
        let [b, d] = [shift[0] - floor[0], shift[1] - floor[1]];
        let row = |y: isize| self.at(y, x) * (1.0 - d) + self.at(y, x + 1) * d;
        row(y) * (1.0 - b) + row(y + 1) * b
    }
}

/// One dimension of the features, ready to be correlated.
fn prepared<'a>(size: Size, values: impl Iterator<Item = &'a f32>, wraps: bool) -> Vec<f64> {
    let mut plane: Vec<f64> = values.map(|&value| f64::from(value)).collect();
    let mean = plane.iter().sum::<f64>() / plane.len() as f64;
    plane.iter_mut().for_each(|value| *value -= mean);
    if !wraps {
        let wide = wide_mean(&plane, size, WIDE);
        plane.iter_mut().zip(&wide).for_each(|(value, wide)| *value -= wide);
    }
    gaussian(&plane, size, [BLUR; 2], CUT, wraps)
}

/// The least number of at least `least` that has no prime factor but 2, 3 and 5, of which transforms are fast.
fn smooth_number(least: usize) -> usize {
    let smooth = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (least..).find(|&n| smooth(n)).unwrap_or(least)
}

/// Sums of the energy of rectangles of a plane.
struct Energies {
    size: Size,
    /// Sum over the rows above and the columns before, [height + 1, width + 1].
    before: Vec<f64>,
}

impl Energies {
    fn of(size: Size, energy: &[f64]) -> Self {
        let row = size.width + 1;
        let mut before = vec![0.0; (size.height + 1) * row];
        for (y, line) in energy.chunks_exact(size.width).enumerate() {
            let mut sum = 0.0;
            for (x, value) in line.iter().enumerate() {
                sum += value;
                before[(y + 1) * row + x + 1] = before[y * row + x + 1] + sum;
            }
        }
        Self { size, before }
    }

    /// The geometric mean of the energies of the two parts that overlap at a lag.
    fn overlapping(&self, dy: isize, dx: isize) -> f64 {
        let range = |lag: isize, side: usize| {
            let side = side as isize;
            ((-lag).clamp(0, side) as usize, (side - lag).clamp(0, side) as usize)
        };
        let sum = |dy: isize, dx: isize| {
            let ((top, bottom), (left, right)) = (range(dy, self.size.height), range(dx, self.size.width));
            let at = |y: usize, x: usize| self.before[y * (self.size.width + 1) + x];
            (at(bottom, right) - at(top, right) - at(bottom, left) + at(top, left)).max(0.0)
        };
        (sum(dy, dx) * sum(-dy, -dx)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    #[test]
    fn it_is_what_the_sum_over_all_pairs_gives() {
        let (size, dims) = (Size::new(11, 14), 3);
        let hash = Hash::new(5, 0);
        let features: Vec<f32> = (0..size.texels() as u32)
            .flat_map(|n| hash.uniforms(n, 0, 0)[..dims].to_vec())
            .map(|n| n as f32)
            .collect();
        for wraps in [true, false] {
            let planes: Vec<Vec<f64>> =
                (0..dims).map(|dim| prepared(size, features.iter().skip(dim).step_by(dims), wraps)).collect();
            let found = Autocorrelation::of(size, dims, &features, wraps).unwrap();
            assert_eq!(found.reach, if wraps { [5, 7] } else { [6, 8] });
            for (dy, dx) in [(0, 0), (0, 1), (3, -2), (-5, 7), (5, -6), (-6, 0)] {
                let (mut sum, mut here, mut there) = (0.0, 0.0, 0.0);
                for y in 0..11isize {
                    for x in 0..14isize {
                        let (mut v, mut u) = (y + dy, x + dx);
                        if wraps {
                            (v, u) = (v.rem_euclid(11), u.rem_euclid(14));
                        }
                        if !(0..11).contains(&v) || !(0..14).contains(&u) {
                            continue;
                        }
                        for plane in &planes {
                            let (a, b) = (plane[(y * 14 + x) as usize], plane[(v * 14 + u) as usize]);
                            (sum, here, there) = (sum + a * b, here + a * a, there + b * b);
                        }
                    }
                }
                let expected = sum / f64::sqrt(here * there);
                assert!((found.at(dy, dx) - expected).abs() < 1e-12, "{wraps} {dy} {dx}");
            }
        }
    }

    #[test]
    fn what_does_not_change_has_none() {
        let size = Size::new(16, 16);
        assert!(Autocorrelation::of(size, 1, &[3.0; 256], true).is_none());
        assert!(Autocorrelation::of(size, 1, &[f32::NAN; 256], false).is_none());
        assert!(Autocorrelation::of(size, 2, &[3.0; 256], true).is_none());
        assert!(Autocorrelation::of(Size::new(4, 64), 1, &[3.0; 256], true).is_none());
    }

    #[test]
    fn sizes_of_transforms_are_products_of_small_primes() {
        assert_eq!([1, 7, 11, 1281, 1500].map(smooth_number), [1, 8, 12, 1296, 1500]);
    }
}

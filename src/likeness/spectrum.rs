//! The power spectrum in rings and directions.

use super::Lightness;
use super::bands::root_mean_square;
use crate::signal::fourier::{Fourier, frequency};

/// Rings, of equal breadth in octaves from 2 cycles a side to half the sampling rate.
const RINGS: usize = 12;

/// Directions, of 45 degrees each.
const DIRECTIONS: usize = 4;

/// Least power, so that decibels are finite.
const TINY: f64 = 1e-9;

/// Mean power in decibels, [ring, direction], of a picture less its mean under a Hann window. Where a ring holds no
/// frequency it is 0.
pub fn spectrum(picture: &Lightness) -> Vec<f64> {
    let (height, width) = (picture.size.height, picture.size.width);
    let mean = picture.mean();
    let (down, across) = (hann(height), hann(width));
    let windowed = (0..height).flat_map(|y| {
        let row = &picture.values[y * width..][..width];
        let (down, across) = (down[y], &across);
        row.iter().zip(across).map(move |(value, across)| (value - mean) * down * across)
    });
    let power = Fourier::new(picture.size).forward_real(windowed);
    let half = (height.min(width) / 2) as f64;
    let mut sums = [(0.0, 0u64); RINGS * DIRECTIONS];
    for (n, value) in power.iter().enumerate() {
        let (y, x) = (frequency(n / width, height), frequency(n % width, width));
        if let Some(ring) = ring(libm::hypot(y as f64, x as f64), half) {
            let (sum, count) = &mut sums[ring * DIRECTIONS + direction(y, x)];
            (*sum, *count) = (*sum + value.norm_sqr(), *count + 1);
        }
    }
    let decibels = |(sum, count): (f64, u64)| {
        if count > 0 { 10.0 * libm::log10(sum / count as f64 + TINY) } else { 0.0 }
    };
    sums.map(decibels).to_vec()
}

/// Root mean square difference in decibels.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    root_mean_square(a, b)
}

/// Symmetric Hann window, 0 at both ends.
fn hann(length: usize) -> Vec<f64> {
    let last = length.saturating_sub(1).max(1) as f64;
    (0..length).map(|n| 0.5 - 0.5 * libm::cos(std::f64::consts::TAU * n as f64 / last)).collect()
}

/// The ring of a frequency; one that lies on a border belongs to the outer ring.
fn ring(radius: f64, half: f64) -> Option<usize> {
    const FIRST: f64 = 2.0;
    const ROUNDING: f64 = 1e-9;
    let octaves = libm::log(radius.max(TINY) / FIRST) / libm::log(half / FIRST);
    let ring = (octaves * RINGS as f64 + ROUNDING).floor();
    (0.0..RINGS as f64).contains(&ring).then_some(ring as usize)
}

/// Which 45 degrees of the half plane: from the columns' direction on; opposite frequencies are one.
fn direction(y: i64, x: i64) -> usize {
    let (y, x) = if y < 0 || (y == 0 && x < 0) { (-y, -x) } else { (y, x) };
    match x {
        x if x > y => 0,
        x if x > 0 => 1,
        x if -x < y => 2,
        _ => 3,
    }
}

//! Smoothing of a plane: a Gaussian, and a wide mean that costs no more than a narrow one.

use rayon::prelude::*;

use super::transposed;
use crate::shape::Size;

/// A plane under a Gaussian of standard deviations (texels) down and across, cut off after `cut` of them; beyond its
/// borders it goes on from the other side, or is mirrored.
pub(crate) fn gaussian(plane: &[f64], size: Size, deviations: [f64; 2], cut: f64, wraps: bool) -> Vec<f64> {
    let weights = deviations.map(|deviation| {
        let radius = (cut * deviation).ceil() as isize;
        let weight = |n: isize| libm::exp(-0.5 * libm::pow(n as f64 / deviation, 2.0));
        let weights: Vec<f64> = (-radius..=radius).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect::<Vec<f64>>()
    });
    both_axes(plane, size, |axis, line, out| {
        let weights = &weights[axis];
        let extended = extended(line, weights.len() / 2, wraps);
        for (out, around) in out.iter_mut().zip(extended.windows(weights.len())) {
            *out = around.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        }
    })
}

/// A plane under a wide, nearly Gaussian mean whose standard deviation is this part of each side: three running means
/// over the plane and its mirror images.
pub(crate) fn wide_mean(plane: &[f64], size: Size, part: f64) -> Vec<f64> {
    const MEANS: usize = 3;
    let mut plane = plane.to_vec();
    for _ in 0..MEANS {
        plane = both_axes(&plane, size, |_, line, out| {
            // Three means over 2 r + 1 texels have together the variance r (r + 1).
            let deviation = part * line.len() as f64;
            let radius = ((deviation * deviation + 0.25).sqrt() - 0.5).round() as usize;
            let extended = extended(line, radius, false);
            let breadth = 2 * radius + 1;
            let mut sum: f64 = extended[..breadth].iter().sum();
            for (n, out) in out.iter_mut().enumerate() {
                *out = sum / breadth as f64;
                sum += extended.get(n + breadth).unwrap_or(&0.0) - extended[n];
            }
        });
    }
    plane
}

/// A filter of lines (axis, line, filtered line) along rows, axis 1, and then along columns, axis 0.
fn both_axes(plane: &[f64], size: Size, filter: impl Fn(usize, &[f64], &mut [f64]) + Sync) -> Vec<f64> {
    let along = |plane: &[f64], axis: usize, length: usize| {
        let mut out = vec![0.0; plane.len()];
        out.par_chunks_exact_mut(length)
            .zip(plane.par_chunks_exact(length))
            .for_each(|(out, line)| filter(axis, line, out));
        out
    };
    let Size { height, width } = size;
    let rows = along(plane, 1, width);
    let columns = along(&transposed(&rows, width), 0, height);
    transposed(&columns, height)
}

/// A line with `radius` values more on both sides.
fn extended(line: &[f64], radius: usize, wraps: bool) -> Vec<f64> {
    let length = line.len() as isize;
    let value = |n: isize| {
        let n = if wraps {
            n.rem_euclid(length)
        } else {
            let n = n.rem_euclid(2 * length);
            if n < length { n } else { 2 * length - 1 - n }
        };
        line[n as usize]
    };
    (-(radius as isize)..length + radius as isize).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impulse_becomes_the_gaussian_and_goes_around_a_plane_that_wraps() {
        let size = Size::new(16, 20);
        let mut plane = vec![0.0; size.texels()];
        plane[0] = 1.0;
        let around = gaussian(&plane, size, [1.0; 2], 4.0, true);
        assert!((around[0] - 0.159).abs() < 1e-3 && (around[19] / around[0] - (-0.5f64).exp()).abs() < 1e-12);
        assert!((around[15 * 20] - around[1]).abs() < 1e-15);
        let mirrored = gaussian(&plane, size, [1.0; 2], 4.0, false);
        assert_eq!(mirrored[19], 0.0);
        for blurred in [around, mirrored] {
            assert!((blurred.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_wide_mean_has_its_deviation_and_keeps_a_constant() {
        let size = Size::new(60, 180);
        let mut plane = vec![0.0; size.texels()];
        plane[30 * 180 + 90] = 1.0;
        let blurred = wide_mean(&plane, size, 1.0 / 12.0);
        let moment = |axis: usize| -> f64 {
            let at = |n: usize| [n / 180, n % 180][axis] as f64 - [30.0, 90.0][axis];
            blurred.iter().enumerate().map(|(n, value)| value * at(n) * at(n)).sum()
        };
        assert!((moment(0).sqrt() - 5.0).abs() < 0.5 && (moment(1).sqrt() - 15.0).abs() < 0.5);
        assert!(
            wide_mean(&vec![3.0; size.texels()], size, 1.0 / 6.0).iter().all(|n| (n - 3.0).abs() < 1e-12)
        );
    }
}

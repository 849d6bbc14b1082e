//! A multichannel image in memory, and how to index beyond its border.

use nalgebra::DMatrix;

use crate::error::{Error, Result};

/// Samples of a rectangular lattice, interleaved `[y][x][channel]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Rows, at least 1.
    pub height: usize,
    /// Columns, at least 1.
    pub width: usize,
    /// Values a texel, at least 1.
    pub channels: usize,
    /// `height * width * channels` values.
    pub samples: Vec<f64>,
}

impl Field {
    /// A field of the given samples.
    ///
    /// # Errors
    /// When a dimension is 0 or the number of samples is not their product.
    pub fn new(height: usize, width: usize, channels: usize, samples: Vec<f64>) -> Result<Self> {
        let expected = height.checked_mul(width).and_then(|texels| texels.checked_mul(channels));
        if expected != Some(samples.len()) || samples.is_empty() {
            return Err(Error::input(format!(
                "a field of {height} x {width} texels and {channels} channels cannot have {} samples",
                samples.len()
            )));
        }
        Ok(Self { height, width, channels, samples })
    }

    /// The number of texels.
    pub fn texels(&self) -> usize {
        self.height * self.width
    }

    /// The channels of the texel in row `y` and column `x`, which must lie inside.
    #[inline]
    pub fn texel(&self, y: usize, x: usize) -> &[f64] {
        let start = (y * self.width + x) * self.channels;
        &self.samples[start..start + self.channels]
    }

    /// One channel as a field of its own.
    pub fn channel(&self, channel: usize) -> Self {
        let samples = self.samples.iter().skip(channel).step_by(self.channels).copied().collect();
        Self { height: self.height, width: self.width, channels: 1, samples }
    }

    /// Mean of each channel.
    pub fn mean(&self) -> Vec<f64> {
        let mut mean = vec![0.0; self.channels];
        for texel in self.samples.chunks_exact(self.channels) {
            for (sum, &value) in mean.iter_mut().zip(texel) {
                *sum += value;
            }
        }
        mean.iter_mut().for_each(|sum| *sum /= self.texels() as f64);
        mean
    }

    /// The field less its mean, and the mean.
    pub(crate) fn centred(&self) -> (Self, Vec<f64>) {
        let mean = self.mean();
        let mut field = self.clone();
        for texel in field.samples.chunks_exact_mut(self.channels) {
            for (value, &m) in texel.iter_mut().zip(&mean) {
                *value -= m;
            }
        }
        (field, mean)
    }

    /// Second-order moments E{Y Y^T} of (14), `[channels, channels]`: the covariance when the field is centred.
    pub(crate) fn second_moments(&self) -> DMatrix<f64> {
        let mut moments = DMatrix::zeros(self.channels, self.channels);
        for texel in self.samples.chunks_exact(self.channels) {
            for (i, &a) in texel.iter().enumerate() {
                for (j, &b) in texel[..=i].iter().enumerate() {
                    moments[(i, j)] += a * b;
                }
            }
        }
        moments.fill_upper_triangle_with_lower_triangle();
        moments / self.texels() as f64
    }
}

/// What lies beyond the border of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// The field repeats: a tile that wraps.
    Periodic,
    /// The field is reflected about its outermost samples, which are not doubled.
    Mirrored,
}

impl Boundary {
    /// The sample that stands for position `i` on an axis of `length` (at least 1) samples.
    #[inline]
    pub fn index(self, i: isize, length: usize) -> usize {
        let n = length as isize;
        match self {
            Self::Periodic => i.rem_euclid(n) as usize,
            Self::Mirrored if n == 1 => 0,
            Self::Mirrored => {
                let folded = i.rem_euclid(2 * (n - 1));
                folded.min(2 * (n - 1) - folded) as usize
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn positions_beyond_the_border_are_wrapped_or_reflected() {
        let map = |boundary: Boundary, n| (-4..8).map(|i| boundary.index(i, n)).collect::<Vec<_>>();
        assert_eq!(map(Boundary::Periodic, 3), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
        assert_eq!(map(Boundary::Mirrored, 3), [0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2, 1]);
        assert_eq!(map(Boundary::Mirrored, 2), [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1]);
        for boundary in [Boundary::Periodic, Boundary::Mirrored] {
            assert!(map(boundary, 1).iter().all(|&i| i == 0));
        }
    }

    #[test]
    fn mean_moments_and_channels_of_a_small_field() {
        let field = Field::new(2, 2, 2, vec![1.0, 0.0, 3.0, 2.0, 5.0, 4.0, 7.0, -6.0]).unwrap();
        let (centred, mean) = field.centred();
        assert_eq!(mean, [4.0, 0.0]);
        assert_eq!(centred.samples, [-3.0, 0.0, -1.0, 2.0, 1.0, 4.0, 3.0, -6.0]);
        assert_eq!(centred.second_moments(), DMatrix::from_row_slice(2, 2, &[5.0, -4.0, -4.0, 14.0]));
        assert_eq!(field.channel(1).samples, [0.0, 2.0, 4.0, -6.0]);
        assert_eq!(field.texel(1, 0), [5.0, 4.0]);
    }

    #[test]
    fn a_wrong_number_of_samples_is_refused() {
        assert!(Field::new(2, 2, 3, vec![0.0; 11]).is_err());
        assert!(Field::new(0, 2, 3, Vec::new()).is_err());
        assert!(Field::new(usize::MAX, 2, 2, Vec::new()).is_err());
    }
}

//! Bands: does a picture come back one side of its exemplar away? A texture can repeat its exemplar's rows, faintly and in
//! parts, without any measure of small crops noticing; the eye sees it from afar.

use super::{Lightness, correlation, mean};
use crate::shape::Size;
use crate::signal::smooth::gaussian;

/// Shifts within so many texels of the exemplar's side are looked at.
const SLACK: usize = 2;

/// Standard deviations after which a blur is cut off.
const CUT: f64 = 3.0;

/// The means of the rows and of the columns of a plane of codes that comes row by row.
#[derive(Clone, Debug)]
pub(crate) struct Profiles {
    rows: Vec<u64>,
    columns: Vec<u64>,
}

impl Profiles {
    /// Of a plane of this width.
    pub(crate) fn new(width: usize) -> Self {
        Self { rows: Vec::new(), columns: vec![0; width] }
    }

    /// The next row.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = u8>) {
        let mut sum = 0;
        for (code, column) in row.into_iter().zip(&mut self.columns) {
            let code = u64::from(code);
            (sum, *column) = (sum + code, *column + code);
        }
        self.rows.push(sum);
    }

    /// Largest correlation of the rows' means with those about one side of the exemplar further down, and of the columns'
    /// means with those further right, -1 to 1; none where the plane has less than two sides.
    pub(crate) fn bands(&self, exemplar: Size) -> [Option<f64>; 2] {
        [(&self.rows, exemplar.height), (&self.columns, exemplar.width)].map(|(sums, side)| {
            let values: Vec<f64> = sums.iter().map(|&sum| sum as f64).collect();
            shifts(side, values.len())?
                .map(|shift| {
                    let kept = values.len() - shift;
                    correlation(values[..kept].iter().copied(), values[shift..].iter().copied())
                })
                .reduce(f64::max)
        })
    }
}

/// The same for bands that wave: of a picture blurred along the bands by half a side of the exemplar and across by a
/// texel, the largest autocorrelation about one side further down, and further right.
pub fn wavy_bands(picture: &Lightness, exemplar: Size) -> [Option<f64>; 2] {
    let centred = |picture: Lightness| {
        let mean = mean(&picture.values);
        let values: Vec<f64> = picture.values.iter().map(|value| value - mean).collect();
        Lightness::new(picture.size, values)
    };
    let down = shifts(exemplar.height, picture.size.height).and_then(|shifts| {
        let blurred = centred(blurred(picture, [1.0, exemplar.width as f64 / 2.0]));
        shifts.map(|shift| super::autocorrelation::at_shift(&blurred, [shift as isize, 0])).reduce(f64::max)
    });
    let right = shifts(exemplar.width, picture.size.width).and_then(|shifts| {
        let blurred = centred(blurred(picture, [exemplar.height as f64 / 2.0, 1.0]));
        shifts.map(|shift| super::autocorrelation::at_shift(&blurred, [0, shift as isize])).reduce(f64::max)
    });
    [down, right]
}

/// Shifts of about one side in a plane of at least two.
fn shifts(side: usize, length: usize) -> Option<std::ops::RangeInclusive<usize>> {
    (length >= 2 * side && side > SLACK && length > side + SLACK).then(|| side - SLACK..=side + SLACK)
}

/// A picture under a Gaussian of two standard deviations, down and across, mirrored at its borders.
fn blurred(picture: &Lightness, deviations: [f64; 2]) -> Lightness {
    Lightness::new(picture.size, gaussian(&picture.values, picture.size, deviations, CUT, false))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    /// Noise with bands of rows that come back after 20 rows, bent sideways by `wave` rows.
    fn banded(strength: f64, wave: f64) -> Lightness {
        let hash = Hash::new(1, 0);
        let band = |row: f64| hash.uniforms(row.rem_euclid(20.0) as u32, 0, 1)[0];
        let value = |n: usize| {
            let (y, x) = (n / 120, n % 120);
            let row = y as f64 + (wave * libm::sin(x as f64 / 19.0)).round();
            50.0 + 20.0 * (hash.uniforms(y as u32, x as u32, 0)[0] + strength * band(row))
        };
        Lightness::new(Size::new(120, 120), (0..120 * 120).map(value).collect())
    }

    #[test]
    fn straight_bands_show_in_the_rows_and_wavy_ones_in_the_blurred_picture() {
        let exemplar = Size::new(20, 20);
        let bands = |picture: &Lightness| {
            let mut profiles = Profiles::new(120);
            picture.values.chunks_exact(120).for_each(|row| profiles.push(row.iter().map(|v| *v as u8)));
            profiles.bands(exemplar)
        };
        let straight = bands(&banded(0.5, 0.0));
        assert!(straight[0].unwrap() > 0.8 && straight[1].unwrap() < 0.3, "{straight:?}");
        let wavy = wavy_bands(&banded(0.5, 6.0), exemplar);
        assert!(wavy[0].unwrap() > 0.3, "{wavy:?}");
        let none = wavy_bands(&banded(0.0, 0.0), exemplar);
        assert!(none[0].unwrap() < 0.2, "{none:?}");
        assert_eq!(bands(&banded(0.5, 0.0)).map(|found| found.is_some()), [true, true]);
        assert_eq!(wavy_bands(&banded(0.0, 0.0), Size::new(61, 20))[0], None);
    }
}

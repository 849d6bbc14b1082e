//! The Gaussian-Laplacian pyramid, (4) and (5), with reduction factor 2.
//!
//! The generating kernel is the separable binomial [1 4 6 4 1] / 16 (Burt and Adelson 1983). Coarse sample r lies
//! on fine sample 2r, so a coarse axis has ceil(fine / 2) samples.

use super::raster::{Boundary, Field};
use crate::error::{Error, Result};

/// Heights and widths of `levels` levels, the finest first.
pub fn sizes(height: usize, width: usize, levels: usize) -> Vec<[usize; 2]> {
    let next = |size: &[usize; 2]| Some(size.map(|n| n.div_ceil(2)));
    std::iter::successors(Some([height, width]), next).take(levels).collect()
}

/// One step of (4): filters and keeps every second row and column.
pub fn reduce(field: &Field, boundary: Boundary) -> Field {
    let Field { height, width, channels, .. } = *field;
    let (coarse_height, coarse_width) = (height.div_ceil(2), width.div_ceil(2));
    let rows = reduce_axis(&field.samples, width, channels, boundary);
    let samples = reduce_axis(&rows, height, coarse_width * channels, boundary);
    Field { height: coarse_height, width: coarse_width, channels, samples }
}

/// The up-sampling of (5): the same kernel, doubled, over the coarse samples spread on even places.
///
/// # Errors
/// When `field` is not the size that [`reduce`] makes of `height` x `width`.
pub(crate) fn expand(field: &Field, height: usize, width: usize, boundary: Boundary) -> Result<Field> {
    if [field.height, field.width] != [height.div_ceil(2), width.div_ceil(2)] {
        return Err(Error::internal(format!(
            "a level of {} x {} texels does not expand to {height} x {width}",
            field.height, field.width
        )));
    }
    let channels = field.channels;
    let rows = expand_axis(&field.samples, field.width, width, channels, boundary);
    let samples = expand_axis(&rows, field.height, height, width * channels, boundary);
    Ok(Field { height, width, channels, samples })
}

/// Splits a field into `levels` (at least 1) bands: 0 is the finest band-pass, the last the coarsest low-pass.
pub(crate) fn decompose(field: &Field, levels: usize, boundary: Boundary) -> Result<Vec<Field>> {
    let mut bands = Vec::new();
    let mut fine = field.clone();
    for _ in 1..levels {
        let coarse = reduce(&fine, boundary);
        let smooth = expand(&coarse, fine.height, fine.width, boundary)?;
        fine.samples.iter_mut().zip(&smooth.samples).for_each(|(value, s)| *value -= s);
        bands.push(std::mem::replace(&mut fine, coarse));
    }
    bands.push(fine);
    Ok(bands)
}

/// The inverse of [`decompose`].
///
/// # Errors
/// When there is no band, or the bands do not have the sizes of one pyramid.
#[cfg(test)]
pub(crate) fn collapse(bands: &[Field], boundary: Boundary) -> Result<Field> {
    let (coarsest, finer) = bands.split_last().ok_or_else(|| Error::internal("a pyramid of no levels"))?;
    let mut sum = coarsest.clone();
    for band in finer.iter().rev() {
        let mut smooth = expand(&sum, band.height, band.width, boundary)?;
        if smooth.channels != band.channels {
            return Err(Error::internal("the levels of a pyramid differ in channels"));
        }
        smooth.samples.iter_mut().zip(&band.samples).for_each(|(value, b)| *value += b);
        sum = smooth;
    }
    Ok(sum)
}

/// Filters and decimates the middle axis of samples `[..][length][inner]`.
fn reduce_axis(samples: &[f64], length: usize, inner: usize, boundary: Boundary) -> Vec<f64> {
    let coarse = length.div_ceil(2);
    let mut out = Vec::with_capacity(samples.len() / length * coarse);
    for line in samples.chunks_exact(length * inner) {
        for r in 0..coarse as isize {
            let [a, b, c, d, e] =
                [-2, -1, 0, 1, 2].map(|tap| &line[boundary.index(2 * r + tap, length) * inner..][..inner]);
            out.extend((0..inner).map(|i| ((a[i] + e[i]) + 4.0 * (b[i] + d[i]) + 6.0 * c[i]) / 16.0));
        }
    }
    out
}

/// Expands the middle axis of samples `[..][length][inner]` to `fine` samples.
fn expand_axis(samples: &[f64], length: usize, fine: usize, inner: usize, boundary: Boundary) -> Vec<f64> {
    let mut out = Vec::with_capacity(samples.len() / length * fine);
    for line in samples.chunks_exact(length * inner) {
        for position in 0..fine {
            let r = (position / 2) as isize;
            let [before, here, after] =
                [-1, 0, 1].map(|tap| &line[boundary.index(r + tap, length) * inner..][..inner]);
            if position % 2 == 0 {
                out.extend((0..inner).map(|i| even(before[i], here[i], after[i])));
            } else {
                out.extend((0..inner).map(|i| odd(here[i], after[i])));
            }
        }
    }
    out
}

/// Expanded value on a coarse sample, from it and its two neighbours.
#[inline]
fn even(before: f64, here: f64, after: f64) -> f64 {
    ((before + after) + 6.0 * here) / 8.0
}

/// Expanded value half-way between two coarse samples.
#[inline]
fn odd(here: f64, after: f64) -> f64 {
    (here + after) / 2.0
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    const BOUNDARIES: [Boundary; 2] = [Boundary::Periodic, Boundary::Mirrored];

    fn noise(height: usize, width: usize, channels: usize) -> Field {
        let hash = Hash::new(3, 0);
        let samples = (0..(height * width * channels) as u32).map(|i| hash.normals(i, 0, 0)[0]).collect();
        Field::new(height, width, channels, samples).unwrap()
    }

    #[test]
    fn a_row_reduces_and_expands_as_computed_by_hand() {
        let row = Field::new(1, 4, 1, vec![16.0, 0.0, 0.0, 32.0]).unwrap();
        // Periodic: (0 + 0 + 4 (32 + 0) + 6 * 16) / 16 and (16 + 16 + 4 (0 + 32) + 0) / 16.
        let coarse = reduce(&row, Boundary::Periodic);
        assert_eq!(coarse.samples, [14.0, 10.0]);
        // Mirrored: (0 + 0 + 0 + 6 * 16) / 16 and (16 + 0 + 4 (0 + 32) + 0) / 16.
        assert_eq!(reduce(&row, Boundary::Mirrored).samples, [6.0, 9.0]);
        // (10 + 6 * 14 + 10) / 8, (14 + 10) / 2, (14 + 6 * 10 + 14) / 8, (10 + 14) / 2.
        assert_eq!(expand(&coarse, 1, 4, Boundary::Periodic).unwrap().samples, [13.0, 12.0, 11.0, 12.0]);
        let column = Field::new(4, 1, 1, row.samples).unwrap();
        assert_eq!(reduce(&column, Boundary::Periodic).samples, [14.0, 10.0]);
    }

    #[test]
    fn collapse_inverts_decompose_on_any_size() {
        for boundary in BOUNDARIES {
            for (height, width, channels, levels) in
                [(16, 16, 3, 3), (17, 9, 2, 4), (5, 12, 1, 3), (1, 7, 1, 4), (2, 3, 3, 5)]
            {
                let field = noise(height, width, channels);
                let bands = decompose(&field, levels, boundary).unwrap();
                let found: Vec<_> = bands.iter().map(|band| [band.height, band.width]).collect();
                assert_eq!(found, sizes(height, width, levels));
                let back = collapse(&bands, boundary).unwrap();
                for (a, b) in back.samples.iter().zip(&field.samples) {
                    assert!((a - b).abs() <= 1e-14 * b.abs().max(1.0), "{a} against {b}");
                }
            }
        }
    }

    #[test]
    fn a_constant_has_no_band_but_the_coarsest() {
        for boundary in BOUNDARIES {
            let field = Field::new(9, 6, 1, vec![0.7; 54]).unwrap();
            let bands = decompose(&field, 3, boundary).unwrap();
            assert!(bands[..2].iter().all(|band| band.samples.iter().all(|v| v.abs() < 1e-15)));
            assert!(bands[2].samples.iter().all(|v| (v - 0.7).abs() < 1e-15));
        }
    }

    #[test]
    fn bands_of_different_pyramids_are_refused() {
        assert!(collapse(&[noise(8, 8, 1), noise(3, 4, 1)], Boundary::Periodic).is_err());
        assert!(collapse(&[noise(8, 8, 1), noise(4, 4, 2)], Boundary::Periodic).is_err());
        assert!(collapse(&[], Boundary::Periodic).is_err());
    }
}

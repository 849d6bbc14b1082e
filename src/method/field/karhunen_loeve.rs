//! The Karhunen-Loeve transformation of the channels, (14) to (16) and (24).

use nalgebra::{DMatrix, SymmetricEigen};

use super::raster::Field;
use crate::error::{Error, Result};

/// QR sweeps allowed to the eigen-solver: a matrix of a few channels needs fewer than ten.
const MAX_SWEEPS: usize = 1000;

/// T of (15) for a centred field, `[channels, channels]`: rows are the orthonormal eigenvectors of (14), the largest
/// eigenvalue first, the component of largest magnitude of each row positive.
///
/// # Errors
/// When the moments have no eigenvectors, which happens to values that are not finite only.
pub(crate) fn transform(centred: &Field) -> Result<DMatrix<f64>> {
    let moments = centred.second_moments();
    let finite = moments.iter().all(|value| value.is_finite());
    let eigen = finite.then(|| SymmetricEigen::try_new(moments, f64::EPSILON, MAX_SWEEPS)).flatten();
    let eigen = eigen.ok_or_else(|| Error::input("the covariance of the channels has no eigenvectors"))?;
    let mut order: Vec<usize> = (0..centred.channels).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut rows = DMatrix::zeros(centred.channels, centred.channels);
    for (row, &column) in order.iter().enumerate() {
        let vector = eigen.eigenvectors.column(column);
        let largest = vector.iter().fold(0.0_f64, |best, &v| if v.abs() > best.abs() { v } else { best });
        rows.row_mut(row).copy_from(&(vector.transpose() * largest.signum()));
    }
    Ok(rows)
}

/// (16): every texel multiplied by `transform`.
pub(crate) fn project(field: &Field, transform: &DMatrix<f64>) -> Field {
    let mut out = field.clone();
    for (to, from) in
        out.samples.chunks_exact_mut(field.channels).zip(field.samples.chunks_exact(field.channels))
    {
        for (i, value) in to.iter_mut().enumerate() {
            *value = from.iter().enumerate().map(|(j, v)| transform[(i, j)] * v).sum();
        }
    }
    out
}

/// (24): the inverse of [`project`]. T is orthonormal, so its inverse is its transpose.
#[cfg(test)]
fn unproject(field: &Field, transform: &DMatrix<f64>) -> Field {
    project(field, &transform.transpose())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    /// Three correlated channels.
    fn correlated() -> Field {
        let hash = Hash::new(11, 0);
        let samples = (0..400).flat_map(|i| {
            let [a, b, c, _] = hash.normals(i, 0, 0);
            [a + 0.5 * b, b - 0.2 * a, 0.3 * a + 0.1 * c]
        });
        Field::new(20, 20, 3, samples.collect()).unwrap().centred().0
    }

    #[test]
    fn transformed_channels_are_uncorrelated_and_ordered() {
        let field = correlated();
        let before = field.second_moments();
        assert!(before[(1, 0)].abs() > 0.1);
        let t = transform(&field).unwrap();
        let after = project(&field, &t).second_moments();
        for i in 0..3 {
            for j in 0..i {
                assert!(after[(i, j)].abs() < 1e-13, "{after}");
            }
        }
        assert!(after[(0, 0)] > after[(1, 1)] && after[(1, 1)] > after[(2, 2)]);
        assert!((after.trace() - before.trace()).abs() < 1e-12);
        for row in t.row_iter() {
            assert!(row.max() >= -row.min());
        }
    }

    #[test]
    fn the_inverse_restores_the_field() {
        let field = correlated();
        let t = transform(&field).unwrap();
        let back = unproject(&project(&field, &t), &t);
        assert!(back.samples.iter().zip(&field.samples).all(|(a, b)| (a - b).abs() < 1e-13));
    }

    #[test]
    fn a_diagonal_covariance_only_reorders_the_channels() {
        let field = Field::new(1, 4, 2, vec![1.0, 3.0, -1.0, 3.0, 1.0, -3.0, -1.0, -3.0]).unwrap();
        let t = transform(&field).unwrap();
        assert_eq!(t, DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]));
    }

    #[test]
    fn values_that_are_not_finite_end_in_an_error() {
        let field = Field::new(1, 2, 2, vec![f64::NAN, 1.0, 2.0, 0.5]).unwrap();
        assert!(transform(&field).is_err());
    }
}

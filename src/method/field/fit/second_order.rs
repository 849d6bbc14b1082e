//! Second-order statistics of a field, which a synthesis is to keep: autocovariance, and variance per pyramid level.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::method::field::raster::{Boundary, Field};

/// The farthest lag looked at, in texels.
const FARTHEST: usize = 16;

/// The lags d = (dy, dx) of a half plane, dy from 0 to `rows`, dx from -`columns` to `columns`. The other half follows
/// from R(-d) = R(d)^T.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lags {
    /// The farthest row.
    pub rows: usize,
    /// The farthest column to either side.
    pub columns: usize,
}

impl Lags {
    /// Up to 16 texels, and at most a quarter of the field.
    pub fn of(height: usize, width: usize) -> Self {
        Self { rows: FARTHEST.min(height / 4), columns: FARTHEST.min(width / 4) }
    }

    /// Every lag (dy, dx), row by row.
    pub fn all(self) -> impl Iterator<Item = [isize; 2]> {
        let side = self.columns as isize;
        (0..=self.rows as isize).flat_map(move |dy| (-side..=side).map(move |dx| [dy, dx]))
    }
}

/// R(d) = E{Y_r Y_(r-d)^T} of a field of mean 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Autocovariance {
    /// The lags.
    pub lags: Lags,
    /// One matrix `[channels, channels]` a lag, in the order of [`Lags::all`].
    pub at: Vec<DMatrix<f64>>,
}

impl Autocovariance {
    /// Over all pairs of texels of a wrapping field, or over the pairs that lie inside.
    pub(crate) fn of_field(centred: &Field, boundary: Boundary, lags: Lags) -> Self {
        let all: Vec<[isize; 2]> = lags.all().collect();
        Self { lags, at: all.into_par_iter().map(|lag| at_lag(centred, boundary, lag)).collect() }
    }

    /// R(0), the covariance of the channels.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.at[self.lags.columns]
    }

    /// Root mean square difference from `truth` over lags and channel pairs, in units of its channels' variances.
    pub fn error(&self, truth: &Self) -> f64 {
        let scale = truth.scale();
        let squares =
            self.at.iter().zip(&truth.at).map(|(a, b)| (a - b).component_mul(&scale).norm_squared());
        (squares.sum::<f64>() / (self.at.len() * scale.len()) as f64).sqrt()
    }

    /// What brings each entry of a covariance to units of the channels' spreads; 0 for a channel that is constant.
    pub(super) fn scale(&self) -> DMatrix<f64> {
        let variance = self.covariance().diagonal();
        DMatrix::from_fn(variance.len(), variance.len(), |i, j| {
            let product = variance[i] * variance[j];
            if product > 0.0 { product.sqrt().recip() } else { 0.0 }
        })
    }
}

fn at_lag(field: &Field, boundary: Boundary, [dy, dx]: [isize; 2]) -> DMatrix<f64> {
    let Field { height, width, channels, .. } = *field;
    let mut sum = DMatrix::zeros(channels, channels);
    let mut count = 0;
    for y in 0..height {
        if boundary == Boundary::Mirrored && y < dy as usize {
            continue;
        }
        let other_row = Boundary::Periodic.index(y as isize - dy, height);
        for x in 0..width {
            let column = x as isize - dx;
            if boundary == Boundary::Mirrored && !(0..width as isize).contains(&column) {
                continue;
            }
            let (here, there) =
                (field.texel(y, x), field.texel(other_row, Boundary::Periodic.index(column, width)));
            for (i, a) in here.iter().enumerate() {
                for (j, b) in there.iter().enumerate() {
                    sum[(i, j)] += a * b;
                }
            }
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Variance of every channel of a band.
pub(crate) fn variances(band: &Field) -> Vec<f64> {
    band.centred().0.second_moments().diagonal().iter().copied().collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_row_has_the_autocovariance_computed_by_hand() {
        // Mean 0, two channels: a and its negative at the next column.
        let field = Field::new(1, 4, 2, vec![1.0, 2.0, -1.0, -1.0, 3.0, 1.0, -3.0, -2.0]).unwrap();
        let lags = Lags { rows: 0, columns: 1 };
        let periodic = Autocovariance::of_field(&field, Boundary::Periodic, lags);
        // R(0,1)[0][1] = mean of a_x b_(x-1) = (1*-2 + -1*2 + 3*-1 + -3*1) / 4.
        assert_eq!(periodic.at[2][(0, 1)], -2.5);
        assert_eq!(periodic.at[2][(0, 1)], periodic.at[0][(1, 0)]);
        assert_eq!(periodic.covariance()[(0, 0)], 5.0);
        let inside = Autocovariance::of_field(&field, Boundary::Mirrored, lags);
        assert_eq!(inside.at[2][(0, 1)], (-2.0 - 3.0 - 3.0) / 3.0);
        assert_eq!(periodic.error(&periodic), 0.0);
        assert!(inside.error(&periodic) > 0.1);
    }
}

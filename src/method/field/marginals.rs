//! The distribution of a tile's normals, given to a Gaussian field: a map from a texel's two field values to a unit
//! normal, by place in the distributions.
//!
//! Standardised field values (z1, z2) of unit covariance go to quantiles: n_x to that of the tile's n_x at Phi(z1),
//! n_y to that of the tile's n_y, among texels of about that n_x (joint; Knothe and Rosenblatt's rearrangement) or
//! among all (channel). n_z follows from unit length. A map of single texels, so no cut of the field can show.

use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Values of z on each axis of the table.
pub(crate) const NODES: usize = 129;

/// The table spans z from -4 to 4; values beyond are taken for its border.
const REACH: f64 = 4.0;

/// Nodes a unit of z.
const DENSITY: f64 = (NODES - 1) as f64 / (2.0 * REACH);

/// Texels that count as of about the same n_x: a 48th of them to both sides, and at least 32.
const WINDOW_SHARE: usize = 48;
const LEAST_WINDOW: usize = 32;

/// What of the distribution is given to the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Matching {
    /// That of n_x and that of n_y.
    Channel,
    /// That of (n_x, n_y).
    Joint,
}

/// The map from the first two channels of a field to unit normals.
#[derive(Clone, Debug)]
pub struct Marginals {
    matching: Matching,
    /// Means of the two channels.
    mean: [f32; 2],
    /// Reciprocals of the diagonal of the Cholesky factor L of their covariance; 0 for a channel that is constant.
    scale: [f32; 2],
    /// L_21.
    coupling: f32,
    /// (n_x, n_y) at each node, z1 along rows and z2 within: `[NODES][NODES]`.
    table: Vec<[f32; 2]>,
}

impl Marginals {
    /// The map that takes a Gaussian field of this mean and covariance (its first two channels count) to the
    /// distribution of `normals`.
    ///
    /// # Errors
    /// When there are no normals or less than two channels.
    pub fn new(
        normals: &[[f32; 3]],
        matching: Matching,
        mean: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Result<Self> {
        let factor = Factor::of(covariance)?;
        if normals.is_empty() {
            return Err(Error::input("no normals to take a distribution from"));
        }
        let mut by_x: Vec<[f32; 2]> = normals.iter().map(|n| [n[0], n[1]]).collect();
        by_x.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let x: Vec<f32> = by_x.iter().map(|n| n[0]).collect();
        let mut y: Vec<f32> = by_x.iter().map(|n| n[1]).collect();
        y.sort_unstable_by(f32::total_cmp);
        let node = |n: usize| n as f64 / DENSITY - REACH;
        let correlation = factor.correlation();
        let row = |n: usize| -> Vec<[f32; 2]> {
            let z1 = node(n);
            let place = distribution(z1);
            let near = match matching {
                Matching::Channel => Vec::new(),
                Matching::Joint => around(&by_x, place),
            };
            (0..NODES)
                .map(|n| {
                    let z2 = node(n);
                    let n_y = match matching {
                        Matching::Channel => {
                            let z = correlation * z1 + (1.0 - correlation * correlation).max(0.0).sqrt() * z2;
                            quantile(&y, distribution(z))
                        }
                        Matching::Joint => quantile(&near, distribution(z2)),
                    };
                    [quantile(&x, place), n_y]
                })
                .collect()
        };
        let table = (0..NODES).into_par_iter().flat_map_iter(row).collect();
        Self::from_table(matching, table, mean, covariance)
    }

    /// The map of a stored table, `[NODES][NODES]` of (n_x, n_y).
    ///
    /// # Errors
    /// When the table has another size or holds what no unit normal has.
    pub(crate) fn from_table(
        matching: Matching,
        table: Vec<[f32; 2]>,
        mean: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Result<Self> {
        let factor = Factor::of(covariance)?;
        let sound = |&[x, y]: &[f32; 2]| (-1.0..=1.0).contains(&x) && (-1.0..=1.0).contains(&y);
        if table.len() != NODES * NODES || !table.iter().all(sound) {
            return Err(Error::input(format!(
                "a table of marginals needs {NODES} x {NODES} pairs of components from -1 to 1"
            )));
        }
        let &[first, second, ..] = mean else {
            return Err(Error::input("marginals need a field of two channels"));
        };
        let reciprocal = |value: f64| if value > 0.0 { value.recip() as f32 } else { 0.0 };
        Ok(Self {
            matching,
            mean: [first, second].map(|value| value as f32),
            scale: factor.diagonal.map(reciprocal),
            coupling: factor.coupling as f32,
            table,
        })
    }

    /// What of the distribution is given.
    pub fn matching(&self) -> Matching {
        self.matching
    }

    /// (n_x, n_y) at each node.
    pub fn table(&self) -> &[[f32; 2]] {
        &self.table
    }

    /// The unit normal of a texel from the first two channels of its field.
    #[inline]
    pub fn normal(&self, first: f32, second: f32) -> [f32; 3] {
        let z1 = (first - self.mean[0]) * self.scale[0];
        let z2 = (second - self.mean[1] - self.coupling * z1) * self.scale[1];
        let [(row, down), (column, along)] = [z1, z2].map(place);
        let at = row * NODES + column;
        let between = |a: f32, b: f32, part: f32| a + part * (b - a);
        let [x, y] = [0, 1].map(|axis| {
            let upper = between(self.table[at][axis], self.table[at + 1][axis], along);
            let lower = between(self.table[at + NODES][axis], self.table[at + NODES + 1][axis], along);
            between(upper, lower, down)
        });
        let square = x * x + y * y;
        if square <= 1.0 {
            return [x, y, (1.0 - square).sqrt()];
        }
        let length = square.sqrt();
        [x / length, y / length, 0.0]
    }
}

/// The node at or before a standardised value, not the last, and how far it is from there to the next.
#[inline]
fn place(z: f32) -> (usize, f32) {
    let position = (z.clamp(-REACH as f32, REACH as f32) + REACH as f32) * DENSITY as f32;
    let node = (position as usize).min(NODES - 2);
    (node, position - node as f32)
}

/// L of a covariance of two channels.
struct Factor {
    diagonal: [f64; 2],
    coupling: f64,
}

impl Factor {
    fn of(covariance: &DMatrix<f64>) -> Result<Self> {
        if covariance.nrows() < 2 || covariance.ncols() < 2 {
            return Err(Error::input("marginals need a field of two channels"));
        }
        let first = covariance[(0, 0)].max(0.0).sqrt();
        let coupling = if first > 0.0 { covariance[(1, 0)] / first } else { 0.0 };
        let second = (covariance[(1, 1)] - coupling * coupling).max(0.0).sqrt();
        Ok(Self { diagonal: [first, second], coupling })
    }

    fn correlation(&self) -> f64 {
        let spread = self.coupling.hypot(self.diagonal[1]);
        if spread > 0.0 { self.coupling / spread } else { 0.0 }
    }
}

/// Phi, the distribution function of the standard normal.
fn distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// n_y of the texels whose n_x lies about `place` (0 to 1) in the order, sorted.
fn around(by_x: &[[f32; 2]], place: f64) -> Vec<f32> {
    let count = by_x.len();
    let half = (count / WINDOW_SHARE).max(LEAST_WINDOW);
    let middle = (place * count as f64) as usize;
    let window = &by_x[middle.saturating_sub(half).min(count - 1)..(middle + half).min(count)];
    let mut y: Vec<f32> = window.iter().map(|n| n[1]).collect();
    y.sort_unstable_by(f32::total_cmp);
    y
}

/// The value at `place` (0 to 1) of sorted values, linear between their middles.
fn quantile(sorted: &[f32], place: f64) -> f32 {
    let last = sorted.len() - 1;
    let position = (place * sorted.len() as f64 - 0.5).clamp(0.0, last as f64);
    let below = position as usize;
    let (a, b) = (f64::from(sorted[below]), f64::from(sorted[(below + 1).min(last)]));
    (a + (position - below as f64) * (b - a)) as f32
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    const MEAN: [f64; 3] = [0.1, -0.2, 0.9];

    fn covariance() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[0.04, 0.01, 0.0, 0.01, 0.09, 0.0, 0.0, 0.0, 1.0])
    }

    /// Normals on a bent band: n_y depends on n_x, and both are skewed.
    fn bent(count: u32) -> Vec<[f32; 3]> {
        let hash = Hash::new(5, 0);
        let normal = |n| {
            let [u, v, ..] = hash.uniforms(n, 0, 0);
            let x = 0.8 * u * u - 0.2;
            let y = 0.5 * x * x + 0.1 * v - 0.1;
            [x, y, (1.0 - x * x - y * y).sqrt()].map(|value| value as f32)
        };
        (0..count).map(normal).collect()
    }

    /// Normals made from draws of the Gaussian that the map expects.
    fn mapped(marginals: &Marginals, count: u32) -> Vec<[f32; 3]> {
        let hash = Hash::new(6, 0);
        let draw = |n| {
            let [a, b, ..] = hash.normals(n, 0, 0);
            let [first, second] = [0.1 + 0.2 * a, -0.2 + 0.05 * a + (0.09_f64 - 0.0025).sqrt() * b];
            marginals.normal(first as f32, second as f32)
        };
        (0..count).map(draw).collect()
    }

    fn sorted(normals: &[[f32; 3]], of: impl Fn(&[f32; 3]) -> f32) -> Vec<f32> {
        let mut values: Vec<f32> = normals.iter().map(of).collect();
        values.sort_unstable_by(f32::total_cmp);
        values
    }

    #[test]
    fn a_gaussian_field_gets_the_distribution_of_the_normals() {
        let truth = bent(20_000);
        for matching in [Matching::Channel, Matching::Joint] {
            let marginals = Marginals::new(&truth, matching, &MEAN, &covariance()).unwrap();
            let found = mapped(&marginals, 20_000);
            for axis in 0..2 {
                let (a, b) = (sorted(&truth, |n| n[axis]), sorted(&found, |n| n[axis]));
                let most = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(most < 0.02, "{matching:?}, axis {axis}: {most}");
            }
            // How far n_y is from the bend: only the joint matching keeps that.
            let off = |normals: &[[f32; 3]]| sorted(normals, |n| (n[1] - 0.5 * n[0] * n[0]).abs())[19_000];
            let (expected, found) = (off(&truth), off(&found));
            assert_eq!(
                (found - expected).abs() < 0.01,
                matching == Matching::Joint,
                "{found} for {expected}"
            );
        }
    }

    #[test]
    fn every_value_gives_a_unit_normal() {
        let marginals = Marginals::new(&bent(50), Matching::Joint, &MEAN, &covariance()).unwrap();
        for first in [f32::NEG_INFINITY, -1e30, -0.4, 0.1, 0.7, 1e30] {
            for second in [-1e30, -0.2, 0.3, f32::INFINITY] {
                let n = marginals.normal(first, second).map(f64::from);
                let length = n.iter().map(|value| value * value).sum::<f64>().sqrt();
                assert!((length - 1.0).abs() < 1e-6, "{first}, {second}: {n:?}");
            }
        }
    }

    #[test]
    fn a_flat_surface_stays_flat_and_small_tiles_have_a_map() {
        let nothing = DMatrix::zeros(3, 3);
        let marginals =
            Marginals::new(&[[0.0, 0.0, 1.0]], Matching::Joint, &[0.0, 0.0, 1.0], &nothing).unwrap();
        assert_eq!(marginals.normal(0.3, 0.0), [0.0, 0.0, 1.0]);
        assert!(Marginals::new(&[], Matching::Joint, &MEAN, &nothing).is_err());
        assert!(Marginals::new(&bent(5), Matching::Joint, &[0.0], &DMatrix::zeros(1, 1)).is_err());
        assert!(
            Marginals::from_table(Matching::Joint, vec![[0.0, 2.0]; NODES * NODES], &MEAN, &nothing).is_err()
        );
        assert!(Marginals::from_table(Matching::Joint, vec![[0.0, 0.0]; 5], &MEAN, &nothing).is_err());
    }
}

//! The mean and the principal components of a tile's texels, as its chunks pass by.
//!
//! The matrix X has a row a texel and a column a view, light and channel; its mean row is taken away first. A randomised
//! range finder (Halko, Martinsson and Tropp 2011) multiplies a few random columns by X^T X, which one pass over the
//! texels does, twice; a last pass gives what the texels are in the space that is left, and a small eigenproblem turns
//! that into components. Sums are made in one order, so that results depend on neither threads nor memory.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use crate::random::Hash;

/// Columns more than components; they catch what the components would lose to chance.
pub(crate) const PROBES_MORE: usize = 32;

/// Passes that multiply by X^T X.
pub(crate) const ITERATIONS: usize = 2;

/// Texels whose values a thread holds.
pub(crate) const TOGETHER: usize = 64;

/// Of the strongest component's strength, what a component must have not to be rounding.
const LEAST_STRENGTH: f64 = 1e-7;

/// Tells these random numbers from others.
const PROBES: u32 = u32::from_be_bytes(*b"prin");

/// Texels whose values can be had by all of their directions, or one view after another.
pub(crate) trait Texels: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// Values of a texel under one view [light, channel].
    fn values(&self, texel: usize, view: usize, to: &mut [f32]);
}

/// Adds the values of texels to their sums, [view][light, channel].
pub(crate) fn add_to_sums(sums: &mut [Vec<f64>], texels: &impl Texels) {
    sums.par_iter_mut().enumerate().for_each(|(view, sums)| {
        let mut values = vec![0.0; sums.len()];
        for texel in 0..texels.count() {
            texels.values(texel, view, &mut values);
            sums.iter_mut().zip(&values).for_each(|(sum, &value)| *sum += f64::from(value));
        }
    });
}

/// The space that components are looked for in.
pub(crate) struct Space {
    /// Mean row, [view, light, channel].
    mean: Vec<f32>,
    /// Orthonormal (random at first) columns, [view, light, channel] x probe.
    columns: DMatrix<f32>,
    views: usize,
}

/// What a pass has summed up: X^T X times the columns, a matrix a view.
pub(crate) struct Product(Vec<DMatrix<f64>>);

/// What the last pass has summed up.
pub(crate) struct Projected {
    /// [texel, probe], texels in the order of the pass.
    texels: Vec<f32>,
    gram: DMatrix<f64>,
    /// Squared length of all rows, their mean taken away.
    pub(crate) energy: f64,
}

/// Components of unit length, the strongest first, and what texels are in them.
pub(crate) struct Components {
    /// Square roots of the energies.
    pub(crate) strengths: Vec<f64>,
    /// [component][view, light, channel].
    pub(crate) bases: Vec<Vec<f64>>,
    /// [component][texel], texels in the order of the pass.
    pub(crate) coefficients: Vec<Vec<f64>>,
}

impl Space {
    /// A random space.
    pub(crate) fn random(mean: Vec<f32>, views: usize, probes: usize, seed: u64) -> Self {
        let hash = Hash::new(seed, PROBES);
        let mut columns = DMatrix::zeros(mean.len(), probes);
        for (probe, mut column) in columns.column_iter_mut().enumerate() {
            for (four, values) in column.as_mut_slice().chunks_mut(4).enumerate() {
                let normals = hash.normals(probe as u32, four as u32, 0);
                values.iter_mut().zip(normals).for_each(|(to, normal)| *to = normal as f32);
            }
        }
        Self { mean, columns, views }
    }

    fn probes(&self) -> usize {
        self.columns.ncols()
    }

    /// Values of a view.
    fn view(&self) -> usize {
        self.mean.len() / self.views
    }

    /// Nothing yet.
    pub(crate) fn no_product(&self) -> Product {
        Product(vec![DMatrix::zeros(self.view(), self.probes()); self.views])
    }

    /// Nothing yet.
    pub(crate) fn nothing_projected(&self, texels: usize) -> Projected {
        let probes = self.probes();
        Projected {
            texels: Vec::with_capacity(texels * probes),
            gram: DMatrix::zeros(probes, probes),
            energy: 0.0,
        }
    }

    /// Texels in this space, probe x texel; their gram matrix; and their squared length.
    fn project_some(&self, texels: &impl Texels, first: usize, count: usize) -> (DMatrix<f32>, f64) {
        let mut values = DMatrix::zeros(self.mean.len(), count);
        let mut energy = 0.0;
        for (texel, mut column) in values.column_iter_mut().enumerate() {
            for (view, to) in column.as_mut_slice().chunks_exact_mut(self.view()).enumerate() {
                texels.values(first + texel, view, to);
                let mean = &self.mean[view * self.view()..][..self.view()];
                to.iter_mut().zip(mean).for_each(|(to, mean)| *to -= mean);
                energy += to.iter().map(|&value| f64::from(value) * f64::from(value)).sum::<f64>();
            }
        }
        let mut projected = DMatrix::zeros(self.probes(), count);
        projected.gemm_tr(1.0, &self.columns, &values, 0.0);
        (projected, energy)
    }

    fn pieces(&self, texels: &impl Texels) -> Vec<(DMatrix<f32>, f64)> {
        let firsts: Vec<usize> = (0..texels.count()).step_by(TOGETHER).collect();
        let piece = |&first: &usize| self.project_some(texels, first, TOGETHER.min(texels.count() - first));
        firsts.par_iter().map(piece).collect()
    }

    /// Adds what texels give of X^T X times the columns.
    pub(crate) fn multiply(&self, texels: &impl Texels, product: &mut Product) {
        let pieces = self.pieces(texels);
        product.0.par_iter_mut().enumerate().for_each(|(view, product)| {
            let mean = &self.mean[view * self.view()..][..self.view()];
            let mut first = 0;
            for (projected, _) in &pieces {
                let count = projected.ncols();
                let mut values = DMatrix::zeros(self.view(), count);
                for (texel, mut column) in values.column_iter_mut().enumerate() {
                    texels.values(first + texel, view, column.as_mut_slice());
                    column.iter_mut().zip(mean).for_each(|(to, mean)| *to -= mean);
                }
                let part: DMatrix<f32> = values * projected.transpose();
                product.iter_mut().zip(part.iter()).for_each(|(sum, &part)| *sum += f64::from(part));
                first += count;
            }
        });
    }

    /// Adds what texels are in this space.
    pub(crate) fn project(&self, texels: &impl Texels, projected: &mut Projected) {
        for (piece, energy) in self.pieces(texels) {
            let exact = piece.map(f64::from);
            projected.gram.gemm(1.0, &exact, &exact.transpose(), 1.0);
            projected.energy += energy;
            projected.texels.extend(piece.as_slice());
        }
    }

    /// The space that a product spans.
    pub(crate) fn of_product(self, product: &Product) -> Self {
        let mut all = DMatrix::zeros(self.mean.len(), self.probes());
        for (view, part) in product.0.iter().enumerate() {
            all.rows_mut(view * self.view(), self.view()).copy_from(part);
        }
        let columns = all.qr().q().map(|value| value as f32);
        Self { columns, ..self }
    }

    /// The `count` strongest components, fewer where the rest is rounding, but at least one.
    pub(crate) fn components(&self, projected: &Projected, count: usize) -> Components {
        let eigen = SymmetricEigen::new(projected.gram.clone());
        let mut order: Vec<usize> = (0..self.probes()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let strength = |at: usize| eigen.eigenvalues[at].max(0.0).sqrt();
        let least = order.first().map_or(0.0, |&at| LEAST_STRENGTH * strength(at));
        let mut kept = 0;
        order.retain(|&at| {
            kept += 1;
            kept == 1 || (kept <= count && strength(at) > least)
        });
        let exact = self.columns.map(f64::from);
        let one = |&at: &usize| {
            let weights = eigen.eigenvectors.column(at);
            let basis = &exact * weights;
            // Of a vector and its opposite, the one whose largest number is positive.
            let largest = basis
                .iter()
                .copied()
                .fold(0.0, |most: f64, value| if value.abs() > most.abs() { value } else { most });
            let sign = if largest < 0.0 { -1.0 } else { 1.0 };
            let of_texel = |texel: &[f32]| -> f64 {
                sign * texel
                    .iter()
                    .zip(weights.iter())
                    .map(|(&value, weight)| f64::from(value) * weight)
                    .sum::<f64>()
            };
            let coefficients = projected.texels.chunks_exact(self.probes()).map(of_texel).collect();
            (basis.iter().map(|value| sign * value).collect(), coefficients)
        };
        let (bases, coefficients) = order.par_iter().map(one).unzip();
        Components { strengths: order.iter().map(|&at| strength(at)).collect(), bases, coefficients }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels that are sums of few BRDFs.
    struct Mixed {
        causes: Vec<Vec<f64>>,
        count: usize,
    }

    impl Texels for Mixed {
        fn count(&self) -> usize {
            self.count
        }

        fn values(&self, texel: usize, view: usize, to: &mut [f32]) {
            let hash = Hash::new(4, 4);
            let weights = hash.normals(texel as u32, 0, 0);
            let width = to.len();
            for (at, to) in to.iter_mut().enumerate() {
                let of = |(cause, weight): (&Vec<f64>, &f64)| cause[view * width + at] * weight;
                *to = (100.0 + self.causes.iter().zip(&weights).map(of).sum::<f64>()) as f32;
            }
        }
    }

    #[test]
    fn texels_that_are_sums_of_three_brdfs_have_three_components() {
        let hash = Hash::new(9, 1);
        let cause =
            |n: u32| (0..4 * 10).map(|at| 20.0 / f64::from(n + 1) * hash.normals(n, at, 7)[0]).collect();
        let texels = Mixed { causes: (0..3).map(cause).collect(), count: 300 };
        let mut sums = vec![vec![0.0; 10]; 4];
        add_to_sums(&mut sums, &texels);
        let mean: Vec<f32> = sums.concat().iter().map(|sum| (sum / 300.0) as f32).collect();
        let mut space = Space::random(mean.clone(), 4, 20, 1);
        for _ in 0..ITERATIONS {
            let mut product = space.no_product();
            space.multiply(&texels, &mut product);
            space = space.of_product(&product);
        }
        let mut projected = space.nothing_projected(300);
        space.project(&texels, &mut projected);
        let found = space.components(&projected, 8);
        // What is left is the rounding of f32.
        assert!(
            found.strengths[2] > 1e3 * found.strengths.get(3).copied().unwrap_or(0.0),
            "{:?}",
            found.strengths
        );
        let kept: f64 = found.strengths.iter().map(|s| s * s).sum();
        assert!((kept / projected.energy - 1.0).abs() < 1e-5, "{kept} {}", projected.energy);
        for texel in [0, 77, 299] {
            let mut values = vec![0.0; 10];
            texels.values(texel, 2, &mut values);
            for (at, &value) in values.iter().enumerate() {
                let parts = found.bases.iter().zip(&found.coefficients);
                let sum: f64 = parts.map(|(basis, all)| basis[20 + at] * all[texel]).sum();
                assert!((f64::from(mean[20 + at]) + sum - f64::from(value)).abs() < 1e-2);
            }
        }
    }
}

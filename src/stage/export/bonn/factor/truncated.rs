//! Few components, found by a randomised range finder with power iterations (Halko, Martinsson and Tropp 2011,
//! algorithm 4.4), so that a matrix that does not fit in memory is only passed through.

use nalgebra::DMatrix;

use super::matrix::{Block, Factors, Size, Visit, pass};
use crate::error::{Error, Result};
use crate::random::Hash;

/// How a matrix is truncated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Options {
    /// Seed of the random test vectors.
    pub seed: u64,
    /// Test vectors more than components; they catch what the components would lose to chance.
    pub oversampling: usize,
    /// Power iterations; each costs two passes and squares the gaps between singular values.
    pub power_iterations: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 0, oversampling: 10, power_iterations: 2 }
    }
}

impl Options {
    /// How often the source is asked for the matrix.
    pub(crate) fn passes(&self) -> usize {
        2 + 2 * self.power_iterations
    }
}

/// The `rank` components (fewer if the matrix is smaller) whose product is nearly the nearest to the matrix that
/// so many can make, in the sense of least squares. U has orthonormal columns.
///
/// Memory is in proportion to (rows + columns) * (rank + oversampling), besides the blocks. The result depends on
/// the seed and on how the source cuts its blocks, the latter in the last digits only; products use fused operations
/// where the processor has them, so that another processor may differ there, too.
///
/// # Errors
/// What the source reports; entries that are not finite; a rank of 0.
pub(crate) fn truncated(
    size: Size,
    rank: usize,
    options: &Options,
    mut source: impl FnMut(&mut Visit<'_>) -> Result<()>,
) -> Result<Factors> {
    let rank = rank.min(size.full_rank());
    if rank == 0 {
        return Err(Error::usage(format!("no components of a matrix of {} x {}", size.rows, size.columns)));
    }
    let probes = rank.saturating_add(options.oversampling).min(size.full_rank());

    // All tall matrices are held transposed: a column for each row or column of the matrix.
    let mut on_columns = test_vectors(probes, size.columns, options.seed);
    let mut basis = multiplied(size, &on_columns, &mut source)?;
    for _ in 0..options.power_iterations {
        basis = orthonormal(basis).0;
        on_columns = orthonormal(multiplied_transposed(size, &basis, &mut source)?).0;
        basis = multiplied(size, &on_columns, &mut source)?;
    }
    let basis = orthonormal(basis).0;
    drop(on_columns);

    // A = Q B with Q^T the basis. B^T = Q' R, R = X S Y^T, and so A = (Q Y) (Q' X S)^T.
    let (co_basis, triangle) = orthonormal(multiplied_transposed(size, &basis, &mut source)?);
    let svd = triangle.svd(true, true);
    let (Some(mut x), Some(y_transposed)) = (svd.u, svd.v_t) else {
        return Err(Error::internal("the singular value decomposition gave no vectors"));
    };
    for (mut column, &value) in x.column_iter_mut().zip(svd.singular_values.iter()) {
        column *= value;
    }
    let directions = y_transposed.rows(0, rank) * &basis;
    let pixels = x.columns(0, rank).transpose() * &co_basis;
    Ok(Factors {
        rank,
        singular_values: svd.singular_values.iter().copied().take(rank).collect(),
        directions: directions.as_slice().to_vec(),
        pixels: pixels.as_slice().to_vec(),
    })
}

/// Independent standard normals, a column for each of `number`.
fn test_vectors(length: usize, number: usize, seed: u64) -> DMatrix<f64> {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"fact"));
    let mut vectors = DMatrix::zeros(length, number);
    for (i, mut vector) in vectors.column_iter_mut().enumerate() {
        for (four, values) in vector.as_mut_slice().chunks_mut(4).enumerate() {
            let normals = hash.normals(i as u32, (i as u64 >> 32) as u32, four as u32);
            values.copy_from_slice(&normals[..values.len()]);
        }
    }
    vectors
}

/// (A Z)^T of Z^T.
fn multiplied(
    size: Size,
    factor: &DMatrix<f64>,
    source: &mut impl FnMut(&mut Visit<'_>) -> Result<()>,
) -> Result<DMatrix<f64>> {
    let mut product = DMatrix::zeros(factor.nrows(), size.rows);
    pass(size, source, |block| {
        let transposed = transposed(&block);
        let factor = factor.columns(block.columns.start, block.columns.len());
        let mut part = product.columns_mut(block.rows.start, block.rows.len());
        part.gemm(1.0, &factor, &transposed, 1.0);
    })?;
    Ok(product)
}

/// (A^T Q)^T of Q^T.
fn multiplied_transposed(
    size: Size,
    factor: &DMatrix<f64>,
    source: &mut impl FnMut(&mut Visit<'_>) -> Result<()>,
) -> Result<DMatrix<f64>> {
    let mut product = DMatrix::zeros(factor.nrows(), size.columns);
    pass(size, source, |block| {
        let entries = transposed(&block).transpose();
        let factor = factor.columns(block.rows.start, block.rows.len());
        let mut part = product.columns_mut(block.columns.start, block.columns.len());
        part.gemm(1.0, &factor, &entries, 1.0);
    })?;
    Ok(product)
}

/// A block whose rows are columns.
fn transposed(block: &Block<'_>) -> DMatrix<f64> {
    let entries = block.values.iter().map(|&value| f64::from(value));
    DMatrix::from_iterator(block.columns.len(), block.rows.len(), entries)
}

/// Q^T and R of M = Q R, from M^T.
fn orthonormal(transposed: DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let tall = transposed.transpose();
    drop(transposed);
    let qr = tall.qr();
    let r = qr.r();
    (qr.q().transpose(), r)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::ErrorKind;

    /// Gives a matrix in blocks of so many rows and columns, and counts how often.
    fn source<'a>(
        matrix: &'a DMatrix<f32>,
        cut: (usize, usize),
        passes: &'a mut usize,
    ) -> impl FnMut(&mut Visit<'_>) -> Result<()> + 'a {
        move |visit| {
            *passes += 1;
            for rows in ranges(matrix.nrows(), cut.0) {
                for columns in ranges(matrix.ncols(), cut.1) {
                    let values: Vec<f32> = rows
                        .clone()
                        .flat_map(|row| columns.clone().map(move |column| matrix[(row, column)]))
                        .collect();
                    visit(Block { rows: rows.clone(), columns, values: &values })?;
                }
            }
            Ok(())
        }
    }

    fn ranges(end: usize, step: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        (0..end).step_by(step).map(move |start| start..(start + step).min(end))
    }

    fn factors(matrix: &DMatrix<f32>, rank: usize, options: &Options) -> Factors {
        let size = Size { rows: matrix.nrows(), columns: matrix.ncols() };
        let mut passes = 0;
        let factors = truncated(size, rank, options, source(matrix, (7, 16), &mut passes)).unwrap();
        assert_eq!(passes, options.passes());
        assert_eq!(factors.directions.len(), factors.rank * matrix.nrows());
        assert_eq!(factors.pixels.len(), factors.rank * matrix.ncols());
        factors
    }

    /// Norm of the difference between the matrix and the product.
    fn error(matrix: &DMatrix<f32>, factors: &Factors) -> f64 {
        let directions = DMatrix::from_row_slice(matrix.nrows(), factors.rank, &factors.directions);
        let pixels = DMatrix::from_row_slice(matrix.ncols(), factors.rank, &factors.pixels);
        (matrix.map(f64::from) - directions * pixels.transpose()).norm()
    }

    fn whole_numbers(rows: usize, columns: usize, domain: u32) -> DMatrix<f32> {
        let hash = Hash::new(3, domain);
        DMatrix::from_fn(rows, columns, |i, j| hash.below(17, i as u32, j as u32, 0) as f32 - 8.0)
    }

    #[test]
    fn a_matrix_of_the_rank_asked_for_is_exact() {
        for (rows, columns) in [(60, 90), (90, 60), (300, 8), (5, 200)] {
            let rank = 4;
            let matrix = whole_numbers(rows, rank, 1) * whole_numbers(rank, columns, 2);
            let factors = factors(&matrix, rank, &Options::default());
            assert!(error(&matrix, &factors) < 1e-11 * f64::from(matrix.norm()), "{rows} x {columns}");
            let directions = DMatrix::from_row_slice(rows, rank, &factors.directions);
            let gram = directions.transpose() * &directions;
            assert!((gram - DMatrix::identity(rank, rank)).norm() < 1e-12);
            let expected = matrix.map(f64::from).singular_values();
            for (found, expected) in factors.singular_values.iter().zip(expected.iter()) {
                assert!((found / expected - 1.0).abs() < 1e-11, "{found}, not {expected}");
            }
            // S*V has the singular values as the norms of its components.
            let pixels = DMatrix::from_row_slice(columns, rank, &factors.pixels);
            for (component, value) in pixels.column_iter().zip(&factors.singular_values) {
                assert!((component.norm() / value - 1.0).abs() < 1e-12);
            }
        }
    }

    /// Singular values that fall slowly, as those of measurements do, and noise.
    fn noisy(rows: usize, columns: usize) -> DMatrix<f32> {
        let hash = Hash::new(8, 5);
        let side = rows.min(columns);
        let part = |length: usize, salt: u32| {
            DMatrix::from_fn(length, side, |i, j| hash.normals(i as u32, j as u32, salt)[0])
        };
        let mut left = part(rows, 1);
        for (k, mut column) in left.column_iter_mut().enumerate() {
            column /= (k as f64 + 1.0).powf(1.2);
        }
        let noise = DMatrix::from_fn(rows, columns, |i, j| 0.02 * hash.normals(i as u32, j as u32, 3)[0]);
        (left * part(columns, 2).transpose() + noise).map(|value| value as f32)
    }

    #[test]
    fn a_noisy_matrix_is_truncated_nearly_as_well_as_can_be() {
        for (rows, columns) in [(81, 150), (150, 81)] {
            let matrix = noisy(rows, columns);
            let singular = matrix.map(f64::from).singular_values();
            for rank in [1, 5, 20, 60] {
                let best = singular.iter().skip(rank).map(|s| s * s).sum::<f64>().sqrt();
                let found = error(&matrix, &factors(&matrix, rank, &Options::default()));
                assert!(
                    found >= best * (1.0 - 1e-9) && found < 1.01 * best,
                    "{rank}: {found} against {best}"
                );
            }
        }
    }

    #[test]
    fn power_iterations_bring_the_optimum_nearer() {
        let matrix = noisy(81, 150);
        let after = |power_iterations| {
            let options = Options { power_iterations, oversampling: 0, seed: 4 };
            error(&matrix, &factors(&matrix, 5, &options))
        };
        assert!(after(1) < 0.97 * after(0) && after(3) < after(1));
    }

    #[test]
    fn the_result_is_the_same_each_time_and_hardly_depends_on_the_blocks() {
        let matrix = noisy(40, 70);
        let size = Size { rows: 40, columns: 70 };
        let run = |cut, seed| {
            let options = Options { seed, ..Options::default() };
            truncated(size, 6, &options, source(&matrix, cut, &mut 0)).unwrap()
        };
        assert_eq!(run((7, 16), 1), run((7, 16), 1));
        let (one, other) = (run((40, 1), 1), run((3, 70), 1));
        for (a, b) in one.directions.iter().zip(&other.directions) {
            assert!((a - b).abs() < 1e-9);
        }
        assert_ne!(run((7, 16), 1), run((7, 16), 2));
    }

    #[test]
    fn more_components_than_there_are_become_all() {
        let matrix = noisy(6, 9);
        let factors = factors(&matrix, 100, &Options::default());
        assert_eq!(factors.rank, 6);
        assert!(error(&matrix, &factors) < 1e-12 * f64::from(matrix.norm()));
    }

    #[test]
    fn a_source_that_errs_is_reported() {
        let size = Size { rows: 2, columns: 2 };
        let run = |rows: std::ops::Range<usize>, values: &[f32]| {
            let source = |visit: &mut Visit<'_>| visit(Block { rows: rows.clone(), columns: 0..2, values });
            truncated(size, 1, &Options::default(), source).map_err(|error| error.kind())
        };
        assert!(run(0..2, &[1.0, 2.0, 3.0, 4.0]).is_ok());
        assert_eq!(run(0..2, &[1.0, 2.0, f32::NAN, 4.0]), Err(ErrorKind::Input));
        assert_eq!(run(0..1, &[1.0, 2.0]), Err(ErrorKind::Internal));
        assert_eq!(run(1..3, &[1.0, 2.0, 3.0, 4.0]), Err(ErrorKind::Internal));
        assert_eq!(run(0..2, &[1.0, 2.0, 3.0]), Err(ErrorKind::Internal));
        let stopped = truncated(size, 1, &Options::default(), |_| Err(Error::stopped()));
        assert_eq!(stopped.unwrap_err().kind(), ErrorKind::Stopped);
        let none = truncated(size, 0, &Options::default(), |_| Ok(()));
        assert_eq!(none.unwrap_err().kind(), ErrorKind::Usage);
    }

    #[test]
    fn a_matrix_of_zeros_has_factors_too() {
        let factors = factors(&DMatrix::zeros(5, 8), 2, &Options::default());
        assert!(factors.pixels.iter().all(|&value| value == 0.0));
        assert!(factors.directions.iter().all(|value| value.is_finite()));
    }
}

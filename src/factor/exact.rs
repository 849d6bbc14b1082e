//! The factorisation of full rank: the identity times the matrix itself.

use super::matrix::{Factors, Size, Visit, pass};
use crate::error::Result;

/// Which factor is the identity; the other holds the entries of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identity {
    /// U is; row p of S*V is column p of the matrix. The rank is the number of rows.
    Directions,
    /// S*V is; U is the matrix. The rank is the number of columns.
    Pixels,
}

impl Identity {
    /// The side whose identity is the smaller one.
    pub fn of(size: Size) -> Self {
        if size.rows <= size.columns { Self::Directions } else { Self::Pixels }
    }
}

/// The rows of an identity matrix, one after another, for a writer that streams.
pub fn identity_rows(rank: usize) -> impl Iterator<Item = Vec<f64>> {
    (0..rank).map(move |one| (0..rank).map(|i| if i == one { 1.0 } else { 0.0 }).collect())
}

/// The exact factors, in memory: as large as the matrix and the identity. One pass. A writer that streams needs
/// [`Identity::of`] and [`identity_rows`] only.
///
/// # Errors
/// What the source reports; entries that are not finite.
pub fn full_rank(size: Size, mut source: impl FnMut(&mut Visit<'_>) -> Result<()>) -> Result<Factors> {
    let rank = size.full_rank();
    let identity = Identity::of(size);
    let mut matrix = vec![0.0; size.rows * size.columns];
    // Steps from an entry to the next of its row, and of its column.
    let (along_row, along_column) = match identity {
        Identity::Directions => (rank, 1),
        Identity::Pixels => (1, rank),
    };
    pass(size, &mut source, |block| {
        for (row, values) in block.rows.zip(block.values.chunks_exact(block.columns.len().max(1))) {
            for (column, &value) in block.columns.clone().zip(values) {
                matrix[row * along_column + column * along_row] = f64::from(value);
            }
        }
    })?;
    let ones: Vec<f64> = identity_rows(rank).flatten().collect();
    let (directions, pixels) = match identity {
        Identity::Directions => (ones, matrix),
        Identity::Pixels => (matrix, ones),
    };
    Ok(Factors { rank, singular_values: vec![1.0; rank], directions, pixels })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_product_is_the_matrix_and_one_factor_the_identity() {
        for size in [Size { rows: 3, columns: 5 }, Size { rows: 5, columns: 3 }, Size { rows: 4, columns: 4 }]
        {
            let values: Vec<f32> = (0..size.rows * size.columns).map(|i| (i as f32 * 0.7).sin()).collect();
            let source = |visit: &mut Visit<'_>| {
                // Row by row, each in two pieces.
                for (row, values) in values.chunks(size.columns).enumerate() {
                    for columns in [0..2, 2..size.columns] {
                        let values = &values[columns.clone()];
                        visit(super::super::Block { rows: row..row + 1, columns, values })?;
                    }
                }
                Ok(())
            };
            let factors = full_rank(size, source).unwrap();
            let identity: Vec<f64> = identity_rows(size.full_rank()).flatten().collect();
            match Identity::of(size) {
                Identity::Directions => assert_eq!(factors.directions, identity),
                Identity::Pixels => assert_eq!(factors.pixels, identity),
            }
            assert_eq!(Identity::of(size) == Identity::Pixels, size.rows > size.columns);
            for (row, left) in factors.directions.chunks(factors.rank).enumerate() {
                for (column, right) in factors.pixels.chunks(factors.rank).enumerate() {
                    let product: f64 = left.iter().zip(right).map(|(a, b)| a * b).sum();
                    assert_eq!(product, f64::from(values[row * size.columns + column]));
                }
            }
        }
    }
}

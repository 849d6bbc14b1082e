//! The matrix as it passes by, and its factors.

use std::ops::Range;

use crate::error::{Error, Result};

/// Size of a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    /// Rows: direction pairs.
    pub rows: usize,
    /// Columns: pixels.
    pub columns: usize,
}

impl Size {
    /// The largest rank that such a matrix can have.
    pub(crate) fn full_rank(self) -> usize {
        self.rows.min(self.columns)
    }
}

/// A rectangle of the matrix.
#[derive(Clone, Debug)]
pub(crate) struct Block<'a> {
    /// Which rows.
    pub rows: Range<usize>,
    /// Which columns.
    pub columns: Range<usize>,
    /// Entries, row by row.
    pub values: &'a [f32],
}

/// What a source of the matrix calls for each of its blocks. A source gives every entry in exactly one block; the
/// order and the shapes of blocks are its own, but should be the same each time, since sums are rounded in that
/// order.
pub(crate) type Visit<'a> = dyn FnMut(Block<'_>) -> Result<()> + 'a;

/// Two factors of a matrix.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Factors {
    /// Number of components.
    pub rank: usize,
    /// Largest first; ones where the factors are trivial.
    pub singular_values: Vec<f64>,
    /// U, `[row, component]`.
    pub directions: Vec<f64>,
    /// S*V, `[column, component]`.
    pub pixels: Vec<f64>,
}

/// Goes through the matrix once and checks that each block is one, and that as many entries came as there are.
pub(super) fn pass(
    size: Size,
    source: &mut impl FnMut(&mut Visit<'_>) -> Result<()>,
    mut visit: impl FnMut(Block<'_>),
) -> Result<()> {
    let mut entries = 0u64;
    source(&mut |block| {
        let Block { rows, columns, values } = &block;
        let inside = rows.end <= size.rows && columns.end <= size.columns;
        if !inside || rows.len() * columns.len() != values.len() {
            return Err(Error::internal(format!(
                "a block of rows {rows:?}, columns {columns:?} and {} entries in a matrix of {size:?}",
                values.len()
            )));
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            let (row, column) = (rows.start + at / columns.len(), columns.start + at % columns.len());
            return Err(Error::input(format!(
                "sample {} of direction pair {row}, pixel {column}, is not a finite number",
                values[at]
            )));
        }
        entries += values.len() as u64;
        visit(block);
        Ok(())
    })?;
    let all = size.rows as u64 * size.columns as u64;
    if entries != all {
        return Err(Error::internal(format!("{entries} entries of a matrix of {all}")));
    }
    Ok(())
}

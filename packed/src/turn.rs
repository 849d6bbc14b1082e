//! Matrices turned: rows become columns.

/// Rows that are turned together, so that what is written lies together too.
const TOGETHER: usize = 16;

/// The transpose of a matrix [row, column].
pub(crate) fn transposed(matrix: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let mut turned = vec![0.0; matrix.len()];
    for first in (0..rows).step_by(TOGETHER) {
        let last = (first + TOGETHER).min(rows);
        let from = &matrix[first * columns..last * columns];
        for (column, to) in turned.chunks_exact_mut(rows).enumerate() {
            for (to, row) in to[first..last].iter_mut().zip(from.chunks_exact(columns)) {
                *to = row[column];
            }
        }
    }
    turned
}

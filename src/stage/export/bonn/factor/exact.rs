//! The factorisation of full rank: the identity times the matrix itself.

use super::matrix::Size;

/// Which factor is the identity; the other holds the entries of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Identity {
    /// U is; row p of S*V is column p of the matrix. The rank is the number of rows.
    Directions,
    /// S*V is; U is the matrix. The rank is the number of columns.
    Pixels,
}

impl Identity {
    /// The side whose identity is the smaller one.
    pub(crate) fn of(size: Size) -> Self {
        if size.rows <= size.columns { Self::Directions } else { Self::Pixels }
    }
}

/// The rows of an identity matrix, one after another, for a writer that streams.
pub(crate) fn identity_rows(rank: usize) -> impl Iterator<Item = Vec<f64>> {
    (0..rank).map(move |one| (0..rank).map(|i| if i == one { 1.0 } else { 0.0 }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_side_has_the_identity() {
        for (rows, columns, identity) in
            [(3, 5, Identity::Directions), (5, 3, Identity::Pixels), (4, 4, Identity::Directions)]
        {
            assert_eq!(Identity::of(Size { rows, columns }), identity);
        }
        assert_eq!(identity_rows(2).collect::<Vec<_>>(), [[1.0, 0.0], [0.0, 1.0]]);
    }
}

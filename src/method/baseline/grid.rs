//! The endless grid of cells that patches are laid on.

use crate::random::Hash;
use crate::shape::Size;

/// Cells of one size, from an origin in all directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Rows and columns of a cell.
    pub(super) cell: Size,
    /// Size of an output that joins at its own borders, a multiple of the cell's: cells beyond are those within.
    pub(super) wrap: Option<Size>,
    /// What is drawn for cells.
    pub(super) hash: Hash,
}

impl Grid {
    /// The cell that a row or column falls in, and where in it.
    pub(super) fn split(place: i64, side: usize) -> (i64, usize) {
        (place.div_euclid(side as i64), place.rem_euclid(side as i64) as usize)
    }

    /// A whole number below `bound` for a cell; another for each `number`.
    pub(super) fn draw(&self, [row, column]: [i64; 2], bound: usize, number: u32) -> usize {
        let within = |place: i64, extent: Option<usize>, side: usize| match extent {
            Some(extent) => place.rem_euclid((extent / side) as i64) as u32,
            None => place as u32,
        };
        let row = within(row, self.wrap.map(|size| size.height), self.cell.height);
        let column = within(column, self.wrap.map(|size| size.width), self.cell.width);
        self.hash.below(bound as u64, row, column, number) as usize
    }

    /// A value for each place of a window, row by row, from its cell and where in the cell it lies.
    pub(super) fn fill(
        &self,
        [y, x]: [i64; 2],
        size: Size,
        value: impl Fn([i64; 2], [usize; 2]) -> u32,
    ) -> Vec<u32> {
        let mut values = Vec::with_capacity(size.texels());
        for y in y..y + size.height as i64 {
            let (row, within_row) = Self::split(y, self.cell.height);
            let (mut column, mut within_column) = Self::split(x, self.cell.width);
            for _ in 0..size.width {
                values.push(value([row, column], [within_row, within_column]));
                within_column += 1;
                if within_column == self.cell.width {
                    (column, within_column) = (column + 1, 0);
                }
            }
        }
        values
    }
}

//! Patches from random places of the tile on a regular grid, stitched along minimum-error paths: the stitching of
//! Haindl and Hatka's roller (2005) and of image quilting, without a choice of what to lay beside what, so that every
//! cell can be made alone.
//!
//! A patch is larger than its cell by an overlap below and at the right. Patches of a row of cells are joined from left
//! to right, by paths from the top of the row to its bottom; rows are joined by paths from left to right. Those pass the
//! middle of each cell where it costs least, so that a piece from middle to middle depends on four patches only.

use super::grid::Grid;
use super::{Exemplar, check_wrap};
use crate::error::Result;
use crate::method::tile::path_cost;
use crate::method::tile::seam::least_path;
use crate::random::Hash;
use crate::shape::Size;

/// Cost of a place that a path must not take.
const CLOSED_OFF: u64 = u64::MAX / 4;

/// A plane of stitched patches.
pub struct Roller<'a> {
    exemplar: &'a Exemplar,
    grid: Grid,
    /// Rows and columns that neighbours share.
    overlap: Size,
    /// Where patches may begin in the tile.
    origins: Size,
}

/// A cell by its row and column.
type Cell = [i64; 2];

/// Step by step the last row or column of an overlap that is the upper or left patch's.
type Path = Vec<usize>;

impl<'a> Roller<'a> {
    /// `wrap` is the size of an output that is to join at its own borders.
    ///
    /// # Errors
    /// Such an output whose sides are no multiples of a cell's.
    pub fn new(exemplar: &'a Exemplar, seed: u64, wrap: Option<Size>) -> Result<Self> {
        let cell = Size::new(exemplar.size.height / 2, exemplar.size.width / 2);
        check_wrap(wrap, cell, 1)?;
        let overlap = |side: usize| (side / 3).max(2);
        let overlap = Size::new(overlap(cell.height), overlap(cell.width));
        let origins = exemplar.origins(Size::new(cell.height + overlap.height, cell.width + overlap.width));
        let hash = Hash::new(seed, u32::from_be_bytes(*b"roll"));
        Ok(Self { exemplar, grid: Grid { cell, wrap, hash }, overlap, origins })
    }

    /// Rows and columns of a cell of the grid that patches lie on.
    pub fn cell(&self) -> Size {
        self.grid.cell
    }

    /// Texels of the tile for a window whose first row and column are `y` and `x`, negative ones too, row by row.
    pub fn window(&self, y: i64, x: i64, size: Size) -> Vec<u32> {
        let Size { height, width } = self.grid.cell;
        let range = |first: i64, extent: usize, side: usize| {
            (Grid::split(first, side).0, Grid::split(first + extent as i64 - 1, side).0)
        };
        let (rows, columns) = (range(y, size.height, height), range(x, size.width, width));
        let paths = Paths::new(self, rows, columns);
        let middle = self.middle();
        self.grid.fill([y, x], size, |[row, column], [y, x]| {
            if y < self.overlap.height {
                let (path, step) = if x < middle {
                    (paths.above([row, column]), x + width - middle)
                } else {
                    (paths.above([row, column + 1]), x - middle)
                };
                if y <= path[step] {
                    return self.of_row([row - 1, column], [y + height, x], paths.left([row - 1, column]));
                }
            }
            self.of_row([row, column], [y, x], paths.left([row, column]))
        })
    }

    /// The tile's texel at a place of a cell's patch.
    fn of_patch(&self, cell: Cell, [y, x]: [usize; 2]) -> u32 {
        let top = self.grid.draw(cell, self.origins.height, 0);
        let left = self.grid.draw(cell, self.origins.width, 1);
        self.exemplar.texel([top + y, left + x])
    }

    /// The tile's texel at a place of a cell in its row of joined patches; `path` is the joint at the cell's left.
    fn of_row(&self, cell: Cell, [y, x]: [usize; 2], path: &[usize]) -> u32 {
        if x < self.overlap.width && x <= path[y] {
            return self.of_patch([cell[0], cell[1] - 1], [y, x + self.grid.cell.width]);
        }
        self.of_patch(cell, [y, x])
    }

    /// The joint of a cell's patch with that at its left.
    fn left_of(&self, cell: Cell) -> Path {
        let before = [cell[0], cell[1] - 1];
        let (length, depth) = (self.grid.cell.height + self.overlap.height, self.overlap.width);
        let costs = path_cost(length, depth, |y, x| {
            let left = self.of_patch(before, [y, x + self.grid.cell.width]);
            self.exemplar.difference(left, self.of_patch(cell, [y, x]))
        });
        least_path(&costs, length, depth - 1, false).0
    }

    /// The joint of two rows of cells from the middle of the cell before `cell` to the middle of `cell`; `upper` and
    /// `lower` are the joints at the left of the cell above it and of itself.
    fn above(&self, cell: Cell, upper: &[usize], lower: &[usize]) -> Path {
        let (depth, width, middle) = (self.overlap.height, self.grid.cell.width, self.middle());
        let [row, column] = cell;
        let mut costs = path_cost(width + 1, depth, |step, y| {
            let x = step + middle;
            // Before the middle of a cell nothing of the cell at its right shows.
            let place = |row: i64, y: usize, path: &[usize]| match x.checked_sub(width) {
                Some(x) => self.of_row([row, column], [y, x], path),
                None => self.of_patch([row, column - 1], [y, x]),
            };
            let above = place(row - 1, y + self.grid.cell.height, upper);
            self.exemplar.difference(above, place(row, y, lower))
        });
        for end in [0, width] {
            let ends = &mut costs[end * (depth - 1)..][..depth - 1];
            let cheapest = (0..ends.len()).min_by_key(|&place| ends[place]).unwrap_or(0);
            let closed = ends.iter_mut().enumerate().filter(|(place, _)| *place != cheapest);
            closed.for_each(|(_, cost)| *cost = CLOSED_OFF);
        }
        least_path(&costs, width + 1, depth - 1, false).0
    }

    /// The column of a cell that no other patch of its row reaches from either side.
    fn middle(&self) -> usize {
        (self.overlap.width + self.grid.cell.width) / 2
    }
}

/// The joints that a window needs.
struct Paths {
    /// First row and column of cells.
    first: Cell,
    /// Columns of cells, one more than the window's.
    columns: usize,
    /// At the left of cells, from the row above the first on.
    left: Vec<Path>,
    /// Above cells.
    above: Vec<Path>,
}

impl Paths {
    /// `rows` and `columns` are the first and the last that a window touches.
    fn new(roller: &Roller<'_>, rows: (i64, i64), columns: (i64, i64)) -> Self {
        let cells = |first: i64| {
            (first..=rows.1).flat_map(move |row| (columns.0..=columns.1 + 1).map(move |column| [row, column]))
        };
        let mut paths = Self {
            first: [rows.0, columns.0],
            columns: (columns.1 - columns.0) as usize + 2,
            left: cells(rows.0 - 1).map(|cell| roller.left_of(cell)).collect(),
            above: Vec::new(),
        };
        let above = |cell: Cell| roller.above(cell, paths.left([cell[0] - 1, cell[1]]), paths.left(cell));
        paths.above = cells(rows.0).map(above).collect();
        paths
    }

    fn at(&self, [row, column]: Cell, first_row: i64) -> usize {
        (row - first_row) as usize * self.columns + (column - self.first[1]) as usize
    }

    fn left(&self, cell: Cell) -> &[usize] {
        &self.left[self.at(cell, self.first[0] - 1)]
    }

    fn above(&self, cell: Cell) -> &[usize] {
        &self.above[self.at(cell, self.first[0])]
    }
}

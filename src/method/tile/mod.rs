//! The seamless tile: a map from its texels to the measured texels that they are.
//!
//! A patch of the plane is cut so that its left border continues its right one and its top its
//! bottom one: in the overlap, texels are taken from one side or the other of a minimum-error path,
//! whole BRDFs, never mixed.

pub mod seam;
mod search;
#[cfg(test)]
mod tests;
mod visibility;

pub use search::{LONGEST_SIDE, SearchRange, search};
pub use visibility::{borders_join, seam_visibility};

use serde::{Deserialize, Serialize};

use crate::shape::{Size, Window};
use seam::least_path;

/// A tile: for each of its texels the measured texel that it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Rows and columns of the tile.
    pub size: Size,
    /// Row and column in the measurement, row by row of the tile.
    pub source: Vec<[u32; 2]>,
    /// Whether its borders join.
    pub wraps: bool,
}

impl Tile {
    /// The whole plane as it is.
    pub fn whole(size: Size, wraps: bool) -> Self {
        let source =
            (0..size.height).flat_map(|y| (0..size.width).map(move |x| [y as u32, x as u32])).collect();
        Self { size, source, wraps }
    }

    /// The smallest window of the measurement that holds every source.
    pub fn bounds(&self) -> Window {
        let extent = |axis: usize| {
            let values = self.source.iter().map(|source| source[axis] as usize);
            (values.clone().min().unwrap_or(0), values.max().unwrap_or(0))
        };
        let ((top, bottom), (left, right)) = (extent(0), extent(1));
        Window { y: top, x: left, size: Size::new(bottom - top + 1, right - left + 1) }
    }

    /// Position of each source within [`Tile::bounds`], counted row by row.
    pub(crate) fn offsets_in_bounds(&self) -> Vec<usize> {
        let Window { y, x, size } = self.bounds();
        self.source
            .iter()
            .map(|&[row, column]| (row as usize - y) * size.width + column as usize - x)
            .collect()
    }
}

/// L* codes of every texel under a few direction pairs, by which seams are judged.
pub struct Features {
    /// Size of the plane.
    pub size: Size,
    /// Number of codes of a texel.
    pub count: usize,
    /// Codes [y, x, feature].
    pub codes: Vec<u8>,
}

impl Features {
    fn texel(&self, [row, column]: [usize; 2]) -> &[u8] {
        let at = (row * self.size.width + column) * self.count;
        &self.codes[at..at + self.count]
    }

    /// Sum of squared differences of two texels.
    pub(crate) fn difference(&self, first: [usize; 2], second: [usize; 2]) -> u64 {
        let pairs = self.texel(first).iter().zip(self.texel(second));
        u64::from(pairs.map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum::<u32>())
    }
}

/// Where a patch lies: its tile's origin and size; it needs `overlap` more rows and columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Patch {
    /// Topmost measured row.
    pub y: usize,
    /// Leftmost measured column.
    pub x: usize,
    /// Rows of the tile.
    pub height: usize,
    /// Columns of the tile.
    pub width: usize,
    /// Width of the bands in which the paths run.
    pub overlap: usize,
}

impl Patch {
    /// Whether it lies, with its overlap, within a plane of so many rows and columns.
    pub(crate) fn lies_within(&self, [rows, columns]: [usize; 2]) -> bool {
        let fits = |start: usize, length: usize, all: usize| {
            start
                .checked_add(length)
                .and_then(|end| end.checked_add(self.overlap))
                .is_some_and(|end| end <= all)
        };
        fits(self.y, self.height, rows) && fits(self.x, self.width, columns)
    }

    /// The patch as it is, taken for a tile that wraps without a cut.
    pub fn uncut(self) -> Tile {
        let mut tile = Tile::whole(Size::new(self.height, self.width), true);
        for [row, column] in &mut tile.source {
            (*row, *column) = (*row + self.y as u32, *column + self.x as u32);
        }
        tile
    }
}

/// A tile with the patch that it was cut from and the places of its seams.
pub struct Cut {
    /// The tile.
    pub tile: Tile,
    /// Where it was cut.
    pub patch: Patch,
    /// For each tile texel, whether it was taken from beyond the right (bit 0) or bottom (bit 1) border.
    pub beyond: Vec<u8>,
}

/// Cuts a seamless tile at `patch`.
pub fn cut(features: &Features, patch: Patch) -> Cut {
    let Patch { y, x, height, width, overlap } = patch;
    let (columns, _) = vertical_path(features, patch);
    // The strip of height + overlap rows that already joins left to right.
    let strip = |row: usize, column: usize| {
        let beyond = column < columns[row];
        ([y + row, if beyond { x + width + column } else { x + column }], u8::from(beyond))
    };
    let cost = path_cost(width, overlap, |column, place| {
        features.difference(strip(place, column).0, strip(height + place, column).0)
    });
    let (rows, _) = least_path(&cost, width, overlap - 1, true);
    let mut source = Vec::with_capacity(height * width);
    let mut beyond = Vec::with_capacity(height * width);
    for row in 0..height {
        for (column, &path) in rows.iter().enumerate() {
            let below = row <= path && row < overlap;
            let ([r, c], right) = strip(if below { height + row } else { row }, column);
            source.push([r as u32, c as u32]);
            beyond.push(right | u8::from(below) << 1);
        }
    }
    Cut { tile: Tile { size: Size::new(height, width), source, wraps: true }, patch, beyond }
}

/// The path from top to bottom: at each row the first column that is taken from the left side, and its cost.
fn vertical_path(features: &Features, patch: Patch) -> (Vec<usize>, u64) {
    let Patch { y, x, height, width, overlap } = patch;
    let cost = path_cost(height + overlap, overlap, |row, place| {
        features.difference([y + row, x + place], [y + row, x + width + place])
    });
    let (path, total) = least_path(&cost, height + overlap, overlap - 1, false);
    (path.into_iter().map(|place| place + 1).collect(), total)
}

/// Cost of cutting between places p and p + 1: how far the two sides differ at both.
pub(crate) fn path_cost(length: usize, overlap: usize, difference: impl Fn(usize, usize) -> u64) -> Vec<u64> {
    let mut cost = Vec::with_capacity(length * (overlap - 1));
    for step in 0..length {
        let mut before = difference(step, 0);
        for place in 1..overlap {
            let after = difference(step, place);
            cost.push(before + after);
            before = after;
        }
    }
    cost
}

//! Parts of a level of an endless plane.

use std::ops::Range;

use crate::shape::Size;

/// A part of a level: place of its first texel, rows and columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub(super) y: i64,
    pub(super) x: i64,
    pub(super) size: Size,
}

impl Region {
    /// Places of its rows.
    pub(super) fn rows(&self) -> Range<i64> {
        self.y..self.y + self.size.height as i64
    }

    /// Places of its columns.
    pub(super) fn columns(&self) -> Range<i64> {
        self.x..self.x + self.size.width as i64
    }

    /// The same with so many rows and columns more on each side.
    pub(super) fn grown(self, [rows, columns]: [usize; 2]) -> Self {
        Self {
            y: self.y - rows as i64,
            x: self.x - columns as i64,
            size: Size::new(self.size.height + 2 * rows, self.size.width + 2 * columns),
        }
    }

    /// What covers it at the next coarser level.
    pub(super) fn coarser(self) -> Self {
        let (y, x) = (self.y >> 1, self.x >> 1);
        let end = |first: i64, extent: usize| ((first + extent as i64 - 1) >> 1) + 1;
        let size = Size::new(
            (end(self.y, self.size.height) - y) as usize,
            (end(self.x, self.size.width) - x) as usize,
        );
        Self { y, x, size }
    }

    /// A value for each place, row by row.
    pub(super) fn map<T>(&self, value: impl Fn([i64; 2]) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(self.size.texels());
        for y in self.rows() {
            values.extend(self.columns().map(|x| value([y, x])));
        }
        values
    }

    /// Where a place lies in such values.
    pub(super) fn at(&self, [y, x]: [i64; 2]) -> usize {
        (y - self.y) as usize * self.size.width + (x - self.x) as usize
    }
}

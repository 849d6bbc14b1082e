//! Image quilting (Efros and Freeman 2001) on the distances between clusters.
//!
//! Square blocks of the tile are laid from left to right and from the top down, each overlapping those before it. Of the
//! places that a block may come from, one is drawn among those whose overlap differs by at most a tenth more than the
//! least, and it is cut in along minimum-error paths. As in the original, but:
//!
//! - places are drawn by hash, 4096 for each block where the tile has more, and the 256 whose overlap fits best at some
//!   of its texels are compared at all;
//! - the place that merely goes on where the block at the left or above came from is left out with what is near it: it
//!   fits without an error, and a tile whose borders join would be copied on and on;
//! - the distance is D of (26) between clusters, not that of colours.
//!
//! Blocks follow each other, so no part can be made alone; what is held is one row of blocks.

use super::cut::{Shared, stays};
use super::{Exemplar, check_wrap};
use crate::error::Result;
use crate::random::Hash;
use crate::shape::Size;

/// Most places that are drawn for a block.
const DRAWN: usize = 4096;

/// Most of them that are compared at all texels of the overlap.
const CANDIDATES: usize = 256;

/// All are compared at one of so many texels of the overlap; prime, so that no row or column of it is left out.
const SKETCHED: usize = 13;

/// A block is this part of the tile's shorter side, within the limits.
const BLOCK_PART: usize = 4;
const BLOCK_SIDES: [usize; 2] = [8, 64];

/// An overlap is this part of a block.
const OVERLAP_PART: usize = 6;

/// A place may differ by this part of the least more than it.
const TOLERANCE_PART: u64 = 10;

/// A plane of quilted blocks, from the top down.
///
/// Block (i, j) covers rows `i * step - overlap` to `(i + 1) * step`, and columns alike. Where the output joins at its
/// own borders those before the first are the last ones; else they are left out.
pub struct Quilt<'a> {
    exemplar: &'a Exemplar,
    hash: Hash,
    size: Size,
    wraps: bool,
    block: usize,
    overlap: usize,
    /// The next row of blocks.
    row: usize,
    /// The tile's texels in a row of blocks; its first rows are what the row above left there.
    canvas: Vec<u32>,
    /// The first rows of the first row of blocks, which the last meets where the output wraps.
    first: Vec<u32>,
    /// Where the blocks of the row above begin in the tile.
    origins: Vec<[usize; 2]>,
}

impl<'a> Quilt<'a> {
    /// Checks that there is such an output, as [`Quilt::new`] does.
    ///
    /// # Errors
    /// Those of [`Quilt::new`].
    pub fn check(exemplar: &Exemplar, size: Size, wraps: bool) -> Result<()> {
        let step = Self::step(exemplar.size);
        check_wrap(wraps.then_some(size), Size::new(step, step), 2)
    }

    /// An output of `size`, which joins at its own borders where it `wraps`.
    ///
    /// # Errors
    /// An output that wraps whose sides are no multiples of a step, or a single one.
    pub fn new(exemplar: &'a Exemplar, seed: u64, size: Size, wraps: bool) -> Result<Self> {
        Self::check(exemplar, size, wraps)?;
        let [block, overlap] = Self::sides(exemplar.size);
        let hash = Hash::new(seed, u32::from_be_bytes(*b"quil"));
        let mut quilt = Self {
            exemplar,
            hash,
            size,
            wraps,
            block,
            overlap,
            row: 0,
            canvas: Vec::new(),
            first: Vec::new(),
            origins: Vec::new(),
        };
        quilt.canvas = vec![0; block * quilt.columns()];
        Ok(quilt)
    }

    /// Sides of a block and of an overlap, for a tile.
    fn sides(tile: Size) -> [usize; 2] {
        let [least, most] = BLOCK_SIDES;
        let block = (tile.height.min(tile.width) / BLOCK_PART).clamp(least, most);
        [block, (block / OVERLAP_PART).max(3)]
    }

    /// Rows from one row of blocks to the next, for a tile.
    pub fn step(tile: Size) -> usize {
        let [block, overlap] = Self::sides(tile);
        block - overlap
    }

    /// Bytes that an output of a width takes in memory at a time.
    pub fn bytes(tile: Size, width: usize) -> u64 {
        let [block, overlap] = Self::sides(tile);
        // The canvas, the first rows, and the rows handed out.
        ((2 * block + overlap) * (width + block) * size_of::<u32>()) as u64
    }

    /// The tile's texels of the next rows, all columns row by row; `None` after the last.
    pub(crate) fn next_rows(&mut self) -> Option<Vec<u32>> {
        let step = self.block - self.overlap;
        let rows = self.size.height.div_ceil(step);
        if self.row == rows {
            return None;
        }
        let (row, columns) = (self.row, self.columns());
        let is_last = row + 1 == rows;
        if self.wraps && is_last {
            self.canvas[step * columns..].copy_from_slice(&self.first);
        }
        self.lay_row(is_last);
        if self.wraps && row == 0 {
            self.first = self.canvas[..self.overlap * columns].to_vec();
        }
        // What the next row of blocks cannot change any more; the first overlap lies before the output.
        let top = if row == 0 { self.overlap } else { 0 };
        let done = row * step + top - self.overlap;
        let bottom = if is_last { self.size.height - done + top } else { step };
        let mut texels = Vec::with_capacity((bottom - top) * self.size.width);
        for line in self.canvas.chunks_exact(columns).take(bottom).skip(top) {
            texels.extend((0..self.size.width).map(|x| line[(x + self.overlap) % columns]));
        }
        self.canvas.copy_within(step * columns.., 0);
        self.row += 1;
        Some(texels)
    }

    /// Columns of the canvas.
    fn columns(&self) -> usize {
        let step = self.block - self.overlap;
        self.size.width.div_ceil(step) * step + if self.wraps { 0 } else { self.overlap }
    }

    /// Lays the blocks of a row.
    fn lay_row(&mut self, is_last: bool) {
        let (block, overlap, columns) = (self.block, self.overlap, self.columns());
        let step = block - overlap;
        let count = self.size.width.div_ceil(step);
        let above = std::mem::take(&mut self.origins);
        let depth = |shares: bool| if shares { overlap } else { 0 };
        for column in 0..count {
            let shared = Shared {
                top: depth(self.row > 0),
                bottom: depth(self.wraps && is_last),
                left: depth(column > 0),
                right: depth(self.wraps && column + 1 == count),
            };
            let at = |y: usize, x: usize| y * columns + (column * step + x) % columns;
            let left = self.origins.last().map(|&[y, x]| [y, x + step]);
            let up = above.get(column).map(|&[y, x]| [y + step, x]);
            let origin = self.choose(column, shared, [left, up], |y, x| self.canvas[at(y, x)]);
            let texel = |y: usize, x: usize| self.exemplar.texel([origin[0] + y, origin[1] + x]);
            let size = Size::new(block, block);
            let (stays, _) =
                stays(size, shared, |y, x| self.exemplar.difference(self.canvas[at(y, x)], texel(y, x)));
            for (number, _) in stays.iter().enumerate().filter(|(_, stays)| !**stays) {
                let (y, x) = (number / block, number % block);
                self.canvas[at(y, x)] = texel(y, x);
            }
            self.origins.push(origin);
        }
    }

    /// Chooses where the block of a column begins in the tile. `going_on` are the places that would copy on.
    fn choose(
        &self,
        column: usize,
        shared: Shared,
        going_on: [Option<[usize; 2]>; 2],
        canvas: impl Fn(usize, usize) -> u32,
    ) -> [usize; 2] {
        let size = Size::new(self.block, self.block);
        let origins = self.exemplar.origins(size);
        let (row, column) = (self.row as u32, column as u32);
        let place = |number: usize| [number / origins.width, number % origins.width];
        let all = origins.texels() <= DRAWN;
        let candidate = |number: usize| {
            if all {
                return place(number);
            }
            place(self.hash.below(origins.texels() as u64, row, column, 1 + number as u32) as usize)
        };
        let Size { height, width } = self.exemplar.size;
        let copies_on = |origin: [usize; 2]| {
            going_on.iter().flatten().any(|&[y, x]| {
                let apart = self.exemplar.apart(origin, [y % height, x % width]);
                apart.iter().all(|&apart| apart < self.block / 2)
            })
        };
        // What is there, at the places that a block is judged by.
        let there: Vec<([usize; 2], &[u32])> = (0..self.block * self.block)
            .map(|number| [number / self.block, number % self.block])
            .filter(|&[y, x]| shared.has(size, y, x))
            .map(|[y, x]| ([y, x], self.exemplar.costs_beside(canvas(y, x))))
            .collect();
        let cost = |[top, left]: [usize; 2], every: usize| -> u64 {
            let beside = there.iter().step_by(every).map(|&([y, x], costs)| {
                let texel = self.exemplar.texel([top + y, left + x]);
                u64::from(costs[usize::from(self.exemplar.index[texel as usize])])
            });
            beside.sum()
        };
        let drawn = (0..origins.texels().min(DRAWN)).map(candidate);
        let (copying, mut drawn): (Vec<_>, Vec<_>) = drawn.partition(|&origin| copies_on(origin));
        if drawn.is_empty() {
            drawn = copying;
        }
        drawn.sort_by_cached_key(|&origin| cost(origin, SKETCHED));
        drawn.truncate(CANDIDATES);
        let mut costs: Vec<_> = drawn.into_iter().map(|origin| (origin, cost(origin, 1))).collect();
        let least = costs.iter().map(|&(_, cost)| cost).min().unwrap_or(0);
        costs.retain(|&(_, cost)| cost <= least + least / TOLERANCE_PART);
        costs[self.hash.below(costs.len() as u64, row, column, 0) as usize].0
    }
}

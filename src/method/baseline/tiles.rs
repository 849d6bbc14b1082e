//! Some tiles that all join each other, laid at random: the paper's second baseline (Somol and Haindl 2005), and in one
//! form or another the usual way to tile without an obvious repeat.
//!
//! All tiles have the border of the given tile, so any of them joins any other as that joins itself. Inside, each is
//! another place of the tile, cut into the border by minimum-error paths.

use super::cut::{Shared, stays};
use super::grid::Grid;
use super::{Exemplar, check_wrap};
use crate::error::{Error, Result};
use crate::random::Hash;
use crate::shape::Size;

/// Most tiles of a set.
pub const MOST_TILES: usize = 256;

/// The paths run within this part of a side.
const BORDER_PART: usize = 5;

/// Places drawn for the inside of a tile, of which the one whose cuts cost least is taken.
const DRAWN: u32 = 32;

/// A plane of tiles.
pub struct Tiles {
    /// Each a texel of the given tile for each of its texels.
    tiles: Vec<Vec<u32>>,
    grid: Grid,
}

impl Tiles {
    /// Cuts `count` tiles, the first of which is the given one; `wrap` is the size of an output that is to join at its
    /// own borders.
    ///
    /// # Errors
    /// A tile whose borders do not join, a count out of 1 to [`MOST_TILES`], and an output that wraps whose sides are
    /// no multiples of the tile's.
    pub fn new(exemplar: &Exemplar, count: usize, seed: u64, wrap: Option<Size>) -> Result<Self> {
        let size = exemplar.size;
        if !exemplar.wraps {
            return Err(Error::usage("the borders of this tile do not join, so no tiles of its border do")
                .hint("choose another --method, or make a model whose tile joins, of a measurement large enough: btf model \
                     MEASUREMENT NEW.model.zarr --tile cut"));
        }
        if !(1..=MOST_TILES).contains(&count) {
            return Err(Error::usage(format!("got {count} tiles, expected 1 to {MOST_TILES}")));
        }
        check_wrap(wrap, size, 1)?;
        let hash = Hash::new(seed, u32::from_be_bytes(*b"tils"));
        let mut origins = vec![[0, 0]];
        let mut tiles = vec![(0..size.texels() as u32).collect()];
        for number in 1..count as u32 {
            let (origin, tile) = cut_one(exemplar, &origins, |draw, axis, bound| {
                // Numbers of the layout have the last word 0.
                hash.below(bound as u64, number, 2 * draw + axis, 1) as usize
            });
            origins.push(origin);
            tiles.push(tile);
        }
        Ok(Self { tiles, grid: Grid { cell: size, wrap, hash } })
    }

    /// Bytes that `count` tiles of a size take in memory.
    pub fn bytes(tile: Size, count: usize) -> u64 {
        (tile.texels() * count * size_of::<u32>()) as u64
    }

    /// Texels of the tile for a window whose first row and column are `y` and `x`, negative ones too, row by row.
    pub fn window(&self, y: i64, x: i64, size: Size) -> Vec<u32> {
        let width = self.grid.cell.width;
        let columns = (Grid::split(x, width).0, Grid::split(x + size.width as i64 - 1, width).0);
        let mut laid: (Option<i64>, Vec<&[u32]>) = (None, Vec::new());
        let mut texels = Vec::with_capacity(size.texels());
        for y in y..y + size.height as i64 {
            let (row, within) = Grid::split(y, self.grid.cell.height);
            if laid.0 != Some(row) {
                let tile = |column| &self.tiles[self.grid.draw([row, column], self.tiles.len(), 0)][..];
                laid = (Some(row), (columns.0..=columns.1).map(tile).collect());
            }
            let line = laid.1.iter().flat_map(|tile| &tile[within * width..][..width]);
            texels.extend(line.skip(Grid::split(x, width).1).take(size.width));
        }
        texels
    }
}

/// A tile of the given one's border, and the place that its inside is: of those drawn the one that is cut best, not
/// near a place that another tile has.
fn cut_one(
    exemplar: &Exemplar,
    taken: &[[usize; 2]],
    draw: impl Fn(u32, u32, usize) -> usize,
) -> ([usize; 2], Vec<u32>) {
    let size = exemplar.size;
    let (rows, columns) = (depth(size.height), depth(size.width));
    let shared = Shared { top: rows, bottom: rows, left: columns, right: columns };
    let place = |number: usize| [number / size.width, number % size.width];
    let moved = |origin: [usize; 2], [y, x]: [usize; 2]| exemplar.texel([origin[0] + y, origin[1] + x]);
    let origins = (0..DRAWN).map(|number| [draw(number, 0, size.height), draw(number, 1, size.width)]);
    let cuts = origins.map(|origin| {
        // Places that overlap by much would show the same things twice. Where all do, as among many tiles, the least
        // bad are taken.
        let apart = |&other: &[usize; 2]| {
            let [rows, columns] = exemplar.apart(origin, other);
            (8 * rows / size.height).max(8 * columns / size.width).min(1)
        };
        let near = 1 - taken.iter().map(apart).min().unwrap_or(1);
        let (stays, cost) =
            stays(size, shared, |y, x| exemplar.difference(exemplar.texel([y, x]), moved(origin, [y, x])));
        (near, cost, origin, stays)
    });
    let best = cuts.min_by_key(|&(near, cost, ..)| (near, cost));
    let (origin, stays) = best.map_or_else(|| ([0, 0], Vec::new()), |(_, _, origin, stays)| (origin, stays));
    let texel = |(number, stays): (usize, bool)| {
        if stays { number as u32 } else { moved(origin, place(number)) }
    };
    (origin, stays.into_iter().enumerate().map(texel).collect())
}

/// Rows or columns that the paths of one border run within.
fn depth(side: usize) -> usize {
    (side / BORDER_PART).max(3)
}

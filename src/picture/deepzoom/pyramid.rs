//! Geometry of a Deep Zoom pyramid: levels, tiles, and the pixels that neighbouring tiles share.
//!
//! Level 0 is a single pixel; each level has twice the sides of the one before, the last one those of the picture.
//! Going down, sides are halved and rounded up. Tile (column, row) of a level holds `side` x `side` pixels from
//! (column * side, row * side) on, and `overlap` more on every side that has a neighbour.

use std::ops::Range;

use crate::shape::{Size, Window};

/// A pyramid of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pyramid {
    /// The picture.
    pub size: Size,
    /// Side of a tile without its overlap.
    pub side: usize,
    /// Pixels of its neighbours that a tile holds.
    pub overlap: usize,
}

impl Pyramid {
    /// Number of the full-size level; there is one level more than that.
    pub(crate) fn top(&self) -> u32 {
        let side = self.size.height.max(self.size.width);
        usize::BITS - side.saturating_sub(1).leading_zeros()
    }

    /// Size of a level.
    pub(crate) fn level(&self, level: u32) -> Size {
        let halvings = self.top() - level.min(self.top());
        let halved = |side: usize| (((side - 1) >> halvings) + 1).max(1);
        Size::new(halved(self.size.height), halved(self.size.width))
    }

    /// Rows and columns of the tiles of a level of this size.
    pub(crate) fn grid(&self, level: Size) -> Size {
        Size::new(level.height.div_ceil(self.side), level.width.div_ceil(self.side))
    }

    /// Pixels of a tile.
    pub(crate) fn tile(&self, level: Size, row: usize, column: usize) -> Window {
        let (rows, columns) = (self.span(level.height, row), self.span(level.width, column));
        Window { y: rows.start, x: columns.start, size: Size::new(rows.len(), columns.len()) }
    }

    /// The pixels along one axis of tile `number`, with those that it shares.
    pub(crate) fn span(&self, extent: usize, number: usize) -> Range<usize> {
        let start = (number * self.side).saturating_sub(self.overlap);
        start..((number + 1) * self.side + self.overlap).min(extent)
    }

    /// Number of tiles of all levels.
    pub(crate) fn tiles(&self) -> u64 {
        (0..=self.top()).map(|level| self.grid(self.level(level)).texels() as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyramid(width: usize, height: usize) -> Pyramid {
        Pyramid { size: Size::new(height, width), side: 254, overlap: 1 }
    }

    #[test]
    fn the_top_level_is_the_logarithm_of_the_longer_side_rounded_up() {
        let tops = [1, 2, 3, 4, 5, 1023, 1024, 1025].map(|side| pyramid(side, 1).top());
        assert_eq!(tops, [0, 1, 2, 2, 3, 10, 10, 11]);
        assert_eq!(pyramid(1, 1025).top(), 11);
    }

    #[test]
    fn sides_are_halved_and_rounded_up_to_a_single_pixel() {
        let pyramid = pyramid(1000, 7);
        let levels: Vec<String> = (0..=pyramid.top()).map(|level| pyramid.level(level).to_string()).collect();
        let expected = "1x1 2x1 4x1 8x1 16x1 32x1 63x1 125x1 250x2 500x4 1000x7";
        assert_eq!(levels.join(" "), expected);
        for level in 1..=pyramid.top() {
            let (upper, lower) = (pyramid.level(level), pyramid.level(level - 1));
            assert_eq!(lower, Size::new(upper.height.div_ceil(2), upper.width.div_ceil(2)));
        }
    }

    #[test]
    fn tiles_share_pixels_with_their_neighbours_only() {
        let pyramid = pyramid(600, 254);
        let level = pyramid.size;
        assert_eq!(pyramid.grid(level), Size::new(1, 3));
        let tiles = [0, 1, 2].map(|column| pyramid.tile(level, 0, column).to_string());
        assert_eq!(tiles, ["0,0,255,254", "253,0,256,254", "507,0,93,254"]);
        assert_eq!(pyramid.tiles(), 3 + 2 + 9);
    }
}

//! The tile again and again: the paper's first baseline, and what a renderer does with any texture.

use super::check_wrap;
use super::grid::Grid;
use crate::error::Result;
use crate::shape::Size;

/// A plane of one tile.
#[derive(Clone, Copy, Debug)]
pub struct Repeat {
    tile: Size,
}

impl Repeat {
    /// `wrap` is the size of an output that is to join at its own borders.
    ///
    /// # Errors
    /// Such an output whose sides are no multiples of the tile's.
    pub fn new(tile: Size, wrap: Option<Size>) -> Result<Self> {
        check_wrap(wrap, tile, 1)?;
        Ok(Self { tile })
    }

    /// Texels of the tile for a window whose first row and column are `y` and `x`, negative ones too, row by row.
    pub fn window(&self, y: i64, x: i64, size: Size) -> Vec<u32> {
        let Size { height, width } = self.tile;
        let (_, left) = Grid::split(x, width);
        let rows = (y..y + size.height as i64).map(|y| Grid::split(y, height).1 * width);
        rows.flat_map(|row| (left..left + size.width).map(move |x| (row + x % width) as u32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_the_tile_texel_at_the_place_modulo_the_tile() {
        let repeat = Repeat { tile: Size::new(3, 4) };
        assert_eq!(repeat.window(-1, -2, Size::new(3, 5)), [10, 11, 8, 9, 10, 2, 3, 0, 1, 2, 6, 7, 4, 5, 6]);
    }
}

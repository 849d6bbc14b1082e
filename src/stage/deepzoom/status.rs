//! How much of a pyramid is there, by the names of its files.

use std::path::Path;

use super::verify::Opened;
use crate::error::Result;
use crate::shape::Size;

/// Tiles that a pyramid has, and those that are there.
pub(crate) struct TilesFound {
    /// Rows and columns of tiles, a level each.
    pub(crate) grids: Vec<Size>,
    /// The row of each tile that is there, whatever its level: parts of the work are rows of tiles of all levels.
    pub(crate) done_rows: Vec<usize>,
    /// Whether the description, the viewer and the checksums are there too, which come last.
    pub(crate) finished: bool,
}

/// Counts the tiles of the pyramid whose description, or folder of tiles, lies at a path. None is read.
///
/// # Errors
/// Where there is none, or its recipe is damaged; and those of listing.
pub(crate) fn tiles(path: &Path) -> Result<TilesFound> {
    let Opened { description, state, pyramid, place, .. } = Opened::at(path)?;
    let grids: Vec<Size> = (0..=pyramid.top()).map(|level| pyramid.grid(pyramid.level(level))).collect();
    let mut done_rows = Vec::new();
    for (level, grid) in (0..).zip(&grids) {
        let found = place.tiles_found(level)?;
        let within = |&[row, column]: &[usize; 2]| row < grid.height && column < grid.width;
        done_rows.extend(found.into_iter().filter(within).map(|[row, _]| row));
    }
    // The oldest kept no checksums.
    let has_sums = state.checksums.is_some() || state.format.is_none();
    let finished = has_sums && description.is_file() && place.page.is_file();
    Ok(TilesFound { grids, done_rows, finished })
}

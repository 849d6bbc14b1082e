//! The tile of a model: which measured texels it holds, how it was cut, and the directions that they were measured
//! under.

use btfkit_formats::{Direction, SampleType};
use serde::{Deserialize, Serialize};

use super::{Model, Stage};
use crate::color::Transfer;
use crate::error::Result;
use crate::lattice::{Lattice, WaveCounts, largest_whole_cells, wave_counts};
use crate::method::tile::{Patch, Tile};
use crate::method::value::triangulation::triangulate;
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::store::directions;
use crate::store::measurement::Description;
use crate::zarr::codec::MOST_CHANNELS;
use crate::zarr::metadata::OLDEST_FORMAT;
use crate::zarr::{Layout, samples_named};

/// Longest side of a plane.
const MOST_SIDE: usize = 1 << 24;

/// What a tile depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TileRecipe {
    /// Digest of the measurement.
    pub measurement: String,
    /// What was asked for, as on the command line.
    pub tile: String,
    /// Seed of the search.
    pub seed: u64,
    /// The lattice that was asked for, where it decides about the tile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lattice: Option<String>,
}

impl Recipe for TileRecipe {
    const STAGE: &'static str = Stage::Tile.name();
}

/// How a tile was cut.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TileReport {
    /// Rows and columns of the tile.
    pub size: [usize; 2],
    /// Whether its borders join.
    pub wraps: bool,
    /// Where it was cut; absent where the whole measurement is the tile.
    pub patch: Option<Patch>,
    /// Step across the seams relative to that between ordinary neighbours (1: cannot be told).
    pub seam_visibility: f64,
    /// The same for the patch repeated without cutting.
    pub uncut_visibility: f64,
    /// Transfer curve of the measurement's samples.
    pub transfer: Transfer,
    /// Rows and columns of the measurement.
    pub measurement_size: [usize; 2],
    /// Names of the measurement's channels; not in the oldest layout.
    #[serde(default)]
    pub channels: Option<Vec<String>>,
    /// Type of the measurement's samples; not in the oldest layout.
    #[serde(default)]
    pub samples: Option<String>,
    /// The lattice that was found in the plane, or given.
    #[serde(default)]
    pub lattice: Lattice,
    /// Cycles of each of its waves down and across the tile (of one whose borders do not join, its largest part of
    /// whole cells); none where the tile holds no whole number of cells.
    #[serde(default)]
    pub cells: Vec<[i32; 2]>,
    /// Share of the tile that is black from everywhere while the rest is not; known only where it was just cut.
    #[serde(skip)]
    pub black: f64,
}

impl TileReport {
    /// Rows and columns of the tile.
    pub fn size(&self) -> Size {
        let [height, width] = self.size;
        Size::new(height, width)
    }

    /// Names of the channels and type of the samples, where they are known.
    pub(super) fn values(&self) -> Option<(Vec<String>, SampleType)> {
        let samples = samples_named(self.samples.as_deref()?)?;
        Some((self.channels.clone()?, samples))
    }

    /// Checks the parts against each other and against the recipe, in a model of this layout.
    fn check(&self, recipe: &TileRecipe, format: u64) -> std::result::Result<(), String> {
        let sides = self.size.iter().chain(&self.measurement_size);
        if !sides.clone().all(|side| (1..=MOST_SIDE).contains(side)) {
            return Err(format!("got sides {:?}, expected 1 to {MOST_SIDE}", sides.collect::<Vec<_>>()));
        }
        match &self.patch {
            Some(patch) if [patch.height, patch.width] != self.size || !self.wraps => {
                return Err(format!(
                    "got a patch of {}x{}, which is not the tile that wraps",
                    patch.width, patch.height
                ));
            }
            None if self.size != self.measurement_size => {
                return Err("got no patch of a tile that is not the whole measurement".to_owned());
            }
            Some(patch) if !patch.lies_within(self.measurement_size) => {
                let [rows, columns] = self.measurement_size;
                return Err(format!("patch: got {patch:?}, expected one within {columns}x{rows}"));
            }
            _ => {}
        }
        if let Some((name, seen)) =
            [("seam_visibility", self.seam_visibility), ("uncut_visibility", self.uncut_visibility)]
                .into_iter()
                .find(|(_, seen)| !(seen.is_finite() && *seen >= 0.0))
        {
            return Err(format!("{name}: got {seen}, expected a number from 0 on"));
        }
        if format > OLDEST_FORMAT && self.values().is_none() {
            return Err("channels, samples: got none, or no type that samples come in".to_owned());
        }
        if let Some((channels, _)) = self.values()
            && !(1..=MOST_CHANNELS).contains(&channels.len())
        {
            return Err(format!("channels: got {} of them, expected 1 to {MOST_CHANNELS}", channels.len()));
        }
        let expected = cells(&self.lattice, self.size(), self.wraps);
        if !self.cells.is_empty() && self.cells != expected {
            return Err(format!("cells: got {:?}, expected {expected:?}, those of the lattice", self.cells));
        }
        let wraps = match recipe.tile.as_str() {
            "none" => Some(false),
            "periodic" => Some(true),
            _ => None,
        };
        if wraps.is_some_and(|wraps| wraps != self.wraps) {
            return Err(format!("wraps: got {}, the recipe says tile {}", self.wraps, recipe.tile));
        }
        Ok(())
    }
}

/// Cycles of the waves of a lattice down and across a tile (of one that does not wrap, its largest part of whole cells).
pub(crate) fn cells(lattice: &Lattice, tile: Size, wraps: bool) -> Vec<[i32; 2]> {
    let part = if wraps { Some(tile.window()) } else { largest_whole_cells(lattice, tile) };
    part.and_then(|part| wave_counts(lattice, part.size)).map_or_else(Vec::new, |WaveCounts(counts)| counts)
}

/// The arrays of a tile.
pub(super) fn arrays(
    report: &TileReport,
    directions: &[Vec<Direction>; 2],
    format: u64,
) -> Vec<(String, Layout<'static>)> {
    let mut arrays = vec![("tile_source".to_owned(), tile_layout(report.size()))];
    for (dimension, directions) in ["view", "light"].into_iter().zip(directions) {
        arrays.extend(directions::layouts(dimension, directions.len(), format));
        let count = triangulate(directions).len();
        arrays.push((format!("{dimension}_triangles"), triangle_layout(dimension, count)));
    }
    arrays
}

impl Model {
    /// How the tile was cut.
    ///
    /// # Errors
    /// Where there is no tile yet, or its parts do not fit together.
    pub fn tile_report(&self) -> Result<TileReport> {
        let report: TileReport = self.report(Stage::Tile)?;
        report
            .check(&self.recipe(Stage::Tile)?, self.format())
            .map_err(|what| self.damaged_report(Stage::Tile, &what))?;
        Ok(report)
    }

    /// Writes the directions of the measurement and their triangulations.
    pub(crate) fn write_directions(&self, description: &Description) -> Result<()> {
        for (dimension, directions) in [("view", &description.views), ("light", &description.lights)] {
            directions::write(&self.store, dimension, directions)?;
            let triangles = triangulate(directions);
            let corners: Vec<u16> = triangles.iter().flatten().copied().collect();
            let layout = triangle_layout(dimension, triangles.len());
            self.store.write(&format!("{dimension}_triangles"), &layout, &corners)?;
        }
        Ok(())
    }

    /// View directions and light directions.
    pub fn directions(&self) -> Result<[Vec<Direction>; 2]> {
        let directions = [directions::read(&self.store, "view")?, directions::read(&self.store, "light")?];
        self.expect_direction_arrays(&directions, |name| name.ends_with("direction"))?;
        Ok(directions)
    }

    /// Checks arrays of the directions against the checksums that were kept; before the tile is done there are none.
    fn expect_direction_arrays(
        &self,
        directions: &[Vec<Direction>; 2],
        wanted: impl Fn(&str) -> bool,
    ) -> Result<()> {
        let Some(entry) = self.seen(Stage::Tile)? else { return Ok(()) };
        for (dimension, directions) in ["view", "light"].into_iter().zip(directions) {
            for (name, layout) in directions::layouts(dimension, directions.len(), self.store.format()) {
                if wanted(&name) {
                    self.open_array_of(Stage::Tile, &entry, &name, &layout)?;
                }
            }
        }
        Ok(())
    }

    /// Checks that the coordinates by which other programs select are the directions.
    ///
    /// # Errors
    /// Where they are not.
    pub(crate) fn check_coordinates(&self) -> Result<()> {
        let directions = self.directions()?;
        for (dimension, directions) in ["view", "light"].into_iter().zip(&directions) {
            directions::check_coordinates(&self.store, dimension, directions)?;
        }
        self.expect_direction_arrays(&directions, |_| true)
    }

    /// Triangles of the views and of the lights: numbers of three directions each.
    ///
    /// # Errors
    /// Where they are not the spherical Delaunay triangles of the directions.
    pub fn triangles(&self) -> Result<[Vec<[u16; 3]>; 2]> {
        let [views, lights] = self.directions()?;
        let read = |dimension: &str, directions: &[Direction]| -> Result<Vec<[u16; 3]>> {
            let expected = triangulate(directions);
            let name = format!("{dimension}_triangles");
            let corners =
                self.read::<u16>(Stage::Tile, &name, &triangle_layout(dimension, expected.len()))?;
            if corners != *expected.as_flattened() {
                return Err(self.damaged(&name, &format!("not the triangles of the {dimension} directions")));
            }
            Ok(expected)
        };
        Ok([read("view", &views)?, read("light", &lights)?])
    }

    /// Writes which measured texel each tile texel is, [y, x, 2].
    pub(crate) fn write_tile(&self, tile: &Tile) -> Result<()> {
        let coordinates: Vec<u32> = tile.source.iter().flatten().copied().collect();
        self.store.write("tile_source", &tile_layout(tile.size), &coordinates)
    }

    /// The tile.
    pub fn tile(&self) -> Result<Tile> {
        let report = self.tile_report()?;
        let coordinates = self.read::<u32>(Stage::Tile, "tile_source", &tile_layout(report.size()))?;
        let source: Vec<[u32; 2]> = coordinates.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        self.expect_measured("tile_source", &source, &report)?;
        Ok(Tile { size: report.size(), source, wraps: report.wraps })
    }

    /// Checks that texels lie in the measurement.
    pub(super) fn expect_measured(
        &self,
        array: &str,
        source: &[[u32; 2]],
        report: &TileReport,
    ) -> Result<()> {
        let [rows, columns] = report.measurement_size;
        let beyond = |[row, column]: &&[u32; 2]| *row as usize >= rows || *column as usize >= columns;
        match source.iter().find(beyond) {
            None => Ok(()),
            Some([row, column]) => Err(self.damaged(
                array,
                &format!("row {row}, column {column} lie outside the measurement of {columns}x{rows}"),
            )),
        }
    }
}

fn tile_layout(size: Size) -> Layout<'static> {
    Layout::small::<u32>(&["y", "x", "row_column"], &[size.height, size.width, 2])
}

fn triangle_layout(dimension: &str, count: usize) -> Layout<'static> {
    // A name for each list: other programs take one length for one name.
    let names: &[&str] =
        if dimension == "view" { &["view_triangle", "corner"] } else { &["light_triangle", "corner"] };
    Layout::small::<u16>(names, &[count, 3])
}

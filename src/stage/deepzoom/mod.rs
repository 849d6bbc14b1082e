//! A picture of any size as a Deep Zoom pyramid of small tiles, which viewers in a browser open.
//!
//! Rows stream from the source through all levels at once ([`cascade`]); tiles are encoded by all threads as soon as
//! their rows are there. A run that goes on after an interruption runs the rows through again, but encodes
//! only tiles that are missing.

mod place;
pub mod recipe;
mod status;
mod verify;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use crate::disk::temporary::write_file;
use crate::error::{Error, Result};
use crate::picture::deepzoom::cascade::{Cascade, Sink};
use crate::picture::deepzoom::pyramid::Pyramid;
use crate::picture::deepzoom::{Encoding, page};
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::run::shard::Shard;
use crate::run::{Context, read_ahead};
use crate::shape::Size;
use crate::stage::image::{self, Scene, Subject};

use place::PyramidFiles;
use recipe::PyramidRecipe;
pub(crate) use status::{TilesFound, tiles};
pub use verify::Pyramidal;
pub(crate) use verify::{about, verify};

/// Sides of a tile that are allowed.
pub(crate) const TILE_SIDES: std::ops::RangeInclusive<usize> = 8..=4096;

/// Side of a tile unless it is given.
pub const TILE_SIDE: usize = 254;

/// Overlap of tiles unless it is given.
pub const OVERLAP: usize = 1;

/// Memory for what does not grow with the picture: the program itself, threads, packers.
const FIXED_BYTES: u64 = 16 << 20;

/// What to show, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The picture; its subject is [`Subject::Appearance`].
    pub picture: image::Options,
    /// Factor on the linear values.
    pub exposure: f64,
    /// The description to make, `NAME.dzi`; the tiles come into `NAME_files`, a viewer is `NAME.html`.
    pub output: PathBuf,
    /// Format of the tiles.
    pub encoding: Encoding,
    /// Side of a tile without its overlap, within [`TILE_SIDES`].
    pub tile_side: usize,
    /// Pixels of its neighbours that a tile holds; at most half its side.
    pub overlap: usize,
    /// The part of the rows of tiles of each level that this run encodes. All rows of the picture are gone through for
    /// it; encoding is most of the work.
    pub shard: Shard,
}

/// Memory that is enough for a pyramid of an enlargement, with tiles as they are unless something else is asked for. The
/// enlargement need not be there: it is of this size, its model's tile of at most so many texels.
pub(crate) fn enough_bytes(size: Size, tile_texels: usize, threads: usize) -> u64 {
    let pyramid = Pyramid { size, side: TILE_SIDE, overlap: OVERLAP };
    // A row of the enlargement as it is read, and the colours of the tile.
    let (row, tile) = (size.width * 2 * size_of::<u32>(), tile_texels * size_of::<[f32; 3]>());
    memory_bytes(&pyramid, threads) + (row + tile) as u64
}

/// Memory of the levels, a row of the source and the tiles in work; bands of the source come on top of it.
fn memory_bytes(pyramid: &Pyramid, threads: usize) -> u64 {
    let tile = 3 * (pyramid.side + 2 * pyramid.overlap).pow(2) as u64;
    // Pixels, filtered or transformed pixels, and the file.
    let row = (pyramid.size.width * size_of::<[f32; 3]>()) as u64;
    FIXED_BYTES + Cascade::memory_bytes(pyramid) + row + threads as u64 * 4 * tile
}

/// A pyramid, ready to be made.
pub struct Plan {
    scene: Scene,
    pyramid: Pyramid,
    encoding: Encoding,
    place: PyramidFiles,
    recipe: Value,
    shard: Shard,
}

/// How it went.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Width and height of the picture.
    pub size: [usize; 2],
    /// Number of levels.
    pub levels: u32,
    /// Tiles found done.
    pub tiles_found: u64,
    /// Tiles written by this run.
    pub tiles_written: u64,
    /// Whether all tiles are there, those of other parts too: then the page and the description are.
    pub complete: bool,
    /// What tiles do not hold, a sentence each.
    pub notes: Vec<String>,
}

/// Opens the source and checks that the place is free, or holds what the same recipe began.
///
/// # Errors
/// Settings beyond their ranges, a source that cannot be pictured, and a place that is taken.
pub fn plan(options: &Options, context: &Context<'_>) -> Result<Plan> {
    let (side, overlap) = (options.tile_side, options.overlap);
    if !TILE_SIDES.contains(&side) || overlap > side / 2 {
        return Err(Error::usage(format!(
            "got tiles of {side} with an overlap of {overlap}, expected {} to {} and at most half of it",
            TILE_SIDES.start(),
            TILE_SIDES.end()
        )));
    }
    let place = PyramidFiles::new(&options.output, options.encoding)?;
    let Subject::Appearance { view, light } = options.picture.subject else {
        return Err(Error::usage("a pyramid shows the material under a light, not its index or its normals"));
    };
    let mut scene = Scene::open(&options.picture, context)?;
    scene.expose(options.exposure);
    let recipe = PyramidRecipe {
        source: scene.recipe().clone(),
        view: view.degrees().into(),
        light: light.degrees().into(),
        exposure: options.exposure,
        tiles: options.encoding,
        tile_side: side,
        overlap,
    };
    let recipe = recipe.to_value()?;
    place.check(&recipe, context.existing)?;
    let pyramid = Pyramid { size: scene.size(), side, overlap };
    let plan = Plan { scene, pyramid, encoding: options.encoding, place, recipe, shard: options.shard };
    plan.place.expect_texts(&plan.texts()?, context.existing)?;
    Ok(plan)
}

impl Plan {
    /// What would be done.
    pub fn summary(&self, context: &Context<'_>) -> Value {
        json!({
            "stage": "deepzoom",
            "output": self.place.description.display().to_string(),
            "units": self.pyramid.tiles(),
            "unit": "tile",
            "levels": self.pyramid.top() + 1,
            "memory_bytes": memory_bytes(&self.pyramid, context.threads),
            "recipe": self.recipe,
        })
    }

    /// Makes the tiles that are not there yet, then the page and the description.
    ///
    /// # Errors
    /// A picture too wide for the memory that is allowed, and those of reading and writing.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let window = self.pyramid.size.window();
        let needed = memory_bytes(&self.pyramid, context.threads);
        let (in_flight, bands) = self.scene.bands_in_flight("a pyramid", needed, context)?;
        let texts = self.texts()?;
        self.place.begin(&self.recipe, context)?;
        self.place.expect_texts(&texts, context.existing)?;
        let total = self.pyramid.tiles();
        context.progress.begin("deepzoom", total, Counted::Items("tiles"));
        let tiles = Tiles { plan: self, context, found: AtomicU64::new(0), written: AtomicU64::new(0) };
        // What the tiles do not hold is found by going through the picture, and kept for those who find them done.
        let kept = self.place.state()?.and_then(|state| state.notes);
        let notes: Vec<String> = if let Some(notes) = kept.filter(|_| self.is_whole()) {
            tiles.found.store(total, Ordering::Relaxed);
            notes
        } else {
            let mut cascade = Cascade::new(&self.pyramid, self.scene.meaning());
            let mut pixels = vec![[0.0; 3]; window.size.width];
            let read = |rows: Range<usize>| {
                let band = self.scene.read(rows.clone(), context);
                Ok((rows.len(), band.map_err(|error| self.scene.explain(error))?))
            };
            read_ahead::for_each(context, in_flight, bands, read, |(rows, band)| {
                (0..rows).try_for_each(|row| {
                    band.row(row, &mut pixels);
                    self.scene.beyond().count_pixels(self.scene.meaning(), &pixels);
                    cascade.push(&self.pyramid, &pixels, &tiles)
                })
            })?;
            self.scene.beyond().notes()
        };
        // Of several parts whoever comes last ends the pyramid.
        let complete = self.shard == Shard::WHOLE || self.is_whole();
        if complete {
            self.end(&notes)?;
            texts
                .iter()
                .try_for_each(|(path, text)| self.place.write_beside(path, text, context.existing))?;
        }
        context.progress.end();
        Ok(Report {
            size: [window.size.width, window.size.height],
            levels: self.pyramid.top() + 1,
            tiles_found: tiles.found.into_inner(),
            tiles_written: tiles.written.into_inner(),
            complete,
            notes: self.scene.incomplete().map(str::to_owned).into_iter().chain(notes).collect(),
        })
    }

    /// The viewer and the description, which comes last: it is there only once all else is.
    fn texts(&self) -> Result<[(&Path, String); 2]> {
        let viewer = page::viewer(&self.pyramid, self.encoding, &self.place.name)?;
        let description = page::description(&self.pyramid, self.encoding);
        Ok([(&self.place.page, viewer), (&self.place.description, description)])
    }

    /// Keeps beside the recipe the checksums of all tiles, by which exchanged ones are found, and what tiles do not
    /// hold.
    fn end(&self, notes: &[String]) -> Result<()> {
        let mut state = self.place.state()?.ok_or_else(|| {
            Error::missing(format!("{}: its recipe has gone", self.place.folder().display()))
                .hint("run the same command again")
        })?;
        state.checksums = Some(verify::checksums(&self.pyramid, &self.place)?);
        state.notes = Some(notes.to_vec());
        self.place.write_state(&state)
    }

    /// Whether every tile is there.
    fn is_whole(&self) -> bool {
        (0..=self.pyramid.top()).all(|level| {
            let grid = self.pyramid.grid(self.pyramid.level(level));
            (0..grid.texels()).all(|n| self.place.tile(level, n / grid.width, n % grid.width).is_file())
        })
    }
}

/// Cuts rows into tiles and writes those that are missing.
struct Tiles<'a> {
    plan: &'a Plan,
    context: &'a Context<'a>,
    found: AtomicU64,
    written: AtomicU64,
}

impl Sink for Tiles<'_> {
    fn tile_row(&self, level: u32, tile_row: usize, rows: &[u8]) -> Result<()> {
        let pyramid = &self.plan.pyramid;
        let size = pyramid.level(level);
        let columns = pyramid.grid(size).width;
        self.context.install(|| {
            (0..columns).into_par_iter().try_for_each(|column| {
                self.context.check_stop()?;
                let path = self.plan.place.tile(level, tile_row, column);
                if !self.plan.shard.has(tile_row) {
                    // Another part's.
                } else if path.is_file() {
                    self.found.fetch_add(1, Ordering::Relaxed);
                } else {
                    let tile = pyramid.tile(size, tile_row, column);
                    let columns = 3 * tile.x..3 * (tile.x + tile.size.width);
                    let rows = rows.chunks_exact(3 * size.width);
                    let pixels: Vec<u8> = rows.flat_map(|row| &row[columns.clone()]).copied().collect();
                    write_file(&path, &self.plan.encoding.encode(tile.size, &pixels)?)?;
                    self.written.fetch_add(1, Ordering::Relaxed);
                }
                self.context.progress.advance(1);
                Ok(())
            })
        })
    }
}

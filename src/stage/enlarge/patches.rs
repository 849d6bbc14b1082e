//! Pieces of the tile on a grid: repeated, laid at random, or stitched. Any window is made alone.

use super::blocks::{self, Kept, Tile};
use super::{Output, Rule, Subject, Units};
use crate::error::{Error, Result};
use crate::method::baseline::{Exemplar, Repeat, Roller, Tiles};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::enlarged::{EnlargeRecipe, Method};

/// What pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// The tile, again and again.
    Repeat,
    /// So many tiles of one border.
    Tiles(usize),
    /// Patches from random places of the tile, cut into each other.
    Roller,
}

/// Settings of the methods that lay pieces on a grid.
#[derive(Clone, Debug)]
pub struct Options {
    /// What pieces.
    pub pieces: Pieces,
    /// Write the tile's texel that each texel is.
    pub keep_source: bool,
    /// Write normals, taken from the tile's normal map.
    pub keep_normals: bool,
}

/// Pieces of a model's tile.
pub(super) struct Patches {
    pieces: Pieces,
    kept: Kept,
    tile: Tile,
    exemplar: Exemplar,
}

/// What makes the windows of an output.
enum Maker<'a> {
    Repeat(Repeat),
    Tiles(Tiles),
    Roller(Roller<'a>),
}

impl Maker<'_> {
    fn window(&self, Window { y, x, size }: Window) -> Vec<u32> {
        let (y, x) = (y as i64, x as i64);
        match self {
            Self::Repeat(repeat) => repeat.window(y, x, size),
            Self::Tiles(tiles) => tiles.window(y, x, size),
            Self::Roller(roller) => roller.window(y, x, size),
        }
    }
}

/// Memory that a run takes: the distances, the pieces, and a block in work.
pub(super) fn bytes(exemplar_bytes: u64, pieces: Pieces, tile: Size, size: Size) -> u64 {
    let pieces = match pieces {
        Pieces::Tiles(count) => Tiles::bytes(tile, count),
        Pieces::Repeat | Pieces::Roller => 0,
    };
    exemplar_bytes + pieces + blocks::memory_bytes(size)
}

/// The tile of a model and how far its texels differ.
pub(super) fn exemplar(subject: &Subject, tile: &Tile) -> Result<Exemplar> {
    let wraps = subject.model.tile()?.wraps;
    Exemplar::new(subject.tile, wraps, tile.index().to_vec(), &subject.model.distance()?)
        .map_err(|error| error.context(subject.model.path().display()))
}

impl Patches {
    pub(super) fn open(subject: &Subject, options: &Options) -> Result<Self> {
        if options.pieces == Pieces::Repeat && subject.options.seeds.start() != subject.options.seeds.end() {
            return Err(Error::usage("--method repeat is the same for all seeds").hint("leave out --seed"));
        }
        let kept = Kept { source: options.keep_source, normals: options.keep_normals };
        let tile = Tile::open(subject, kept)?;
        let exemplar = exemplar(subject, &tile)?;
        let patches = Self { pieces: options.pieces, kept, tile, exemplar };
        // What cannot be made is known before an output is begun.
        patches.maker(subject, *subject.options.seeds.start())?;
        Ok(patches)
    }

    fn maker(&self, subject: &Subject, seed: u64) -> Result<Maker<'_>> {
        let wrap: Option<Size> = subject.options.tileable.then_some(subject.options.size);
        Ok(match self.pieces {
            Pieces::Repeat => Maker::Repeat(Repeat::new(subject.tile, wrap)?),
            Pieces::Tiles(count) => Maker::Tiles(Tiles::new(&self.exemplar, count, seed, wrap)?),
            Pieces::Roller => Maker::Roller(Roller::new(&self.exemplar, seed, wrap)?),
        })
    }
}

impl Rule for Patches {
    fn method(&self) -> Method {
        match self.pieces {
            Pieces::Repeat => Method::Repeat,
            Pieces::Tiles(_) => Method::Tiles,
            Pieces::Roller => Method::Roller,
        }
    }

    fn units(&self, subject: &Subject) -> (&'static str, usize) {
        (blocks::UNIT, blocks::count(subject.options.size))
    }

    fn describe(&self, recipe: &mut EnlargeRecipe) {
        self.kept.describe(recipe);
        if let Pieces::Tiles(count) = self.pieces {
            recipe.tiles = Some(count);
        }
    }

    fn memory_bytes(&self, subject: &Subject, _threads: usize) -> u64 {
        bytes(self.exemplar.bytes(), self.pieces, subject.tile, subject.options.size)
    }

    fn advice(&self) -> &'static str {
        ""
    }

    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>> {
        let make_one = |output: &Output| {
            let maker = self.maker(subject, output.seed)?;
            blocks::make(subject, output, &self.tile, context, |window| Ok(maker.window(window)))
        };
        outputs.iter().map(make_one).collect()
    }
}

//! Outputs whose texels are the tile's: what is written of them; and the loop over blocks of shards, for methods that
//! make any window alone. Nothing is kept between blocks, so any process makes any of them in any order, and a killed
//! run goes on with those that are missing.

use std::collections::BTreeMap;

use super::{Output, Subject, Units};
use crate::error::Result;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::shape::{Size, Window};
use crate::store::enlarged::{Description, EnlargeRecipe, Enlarged, SHARD_SIDE, Texels};

/// Shards of a block along each side.
const BLOCK_SHARDS: usize = 2;

/// What is made at once.
pub(super) const UNIT: &str = "blocks of shards";

/// Memory of a texel of a block: its position at two levels, source, cluster, and what is packed.
const TEXEL_BYTES: u64 = 24;

/// Memory for what does not grow: the program itself.
const FIXED_BYTES: u64 = 8 << 20;

/// What is written beside the index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    /// The tile's texel that each texel is.
    pub(super) source: bool,
    /// Normals, taken from the tile's normal map.
    pub(super) normals: bool,
}

impl Kept {
    /// Adds it to a recipe.
    pub(super) fn describe(self, recipe: &mut EnlargeRecipe) {
        recipe.source = Some(self.source);
        recipe.keep_normals = self.normals;
    }
}

/// What a tile gives to outputs whose texels are its.
pub(super) struct Tile {
    kept: Kept,
    index: Vec<u16>,
    /// Where they are to be kept.
    normals: Vec<[f32; 3]>,
}

impl Tile {
    pub(super) fn open(subject: &Subject, kept: Kept) -> Result<Self> {
        let normals = if kept.normals { subject.model.normals()? } else { Vec::new() };
        Ok(Self { kept, index: subject.model.index()?, normals })
    }

    /// Cluster of each of its texels.
    pub(super) fn index(&self) -> &[u16] {
        &self.index
    }

    /// Starts an output, or goes on with it.
    pub(super) fn create(
        &self,
        subject: &Subject,
        output: &Output,
        context: &Context<'_>,
    ) -> Result<Enlarged> {
        let description = Description {
            size: subject.options.size,
            clusters: subject.clusters.clusters,
            tile: subject.tile,
            keep_source: self.kept.source,
            keep_normals: self.kept.normals,
        };
        Enlarged::create(&output.path, &description, &output.recipe, &subject.options.model, context)
    }

    /// Writes a window of shards, `source` being the tile's texels in it.
    pub(super) fn write(&self, store: &Enlarged, window: Window, source: &[u32]) -> Result<()> {
        let index: Vec<u16> = source.iter().map(|&texel| self.index[texel as usize]).collect();
        let normals: Vec<[f32; 3]> = match self.normals[..] {
            [] => Vec::new(),
            _ => source.iter().map(|&texel| self.normals[texel as usize]).collect(),
        };
        store.write(window, Texels { index: &index, source, normals: normals.as_flattened() })
    }
}

/// Blocks of an output of this size.
pub(crate) fn count(size: Size) -> usize {
    let Size { height, width } = size;
    let side = BLOCK_SHARDS * SHARD_SIDE;
    height.div_ceil(side) * width.div_ceil(side)
}

/// Memory of a block in work, and what does not grow.
pub(super) fn memory_bytes(size: Size) -> u64 {
    let side = BLOCK_SHARDS * SHARD_SIDE;
    let Size { height, width } = size;
    FIXED_BYTES + (height.min(side) * width.min(side)) as u64 * TEXEL_BYTES
}

/// Makes the blocks of an output that are missing; `source` gives the tile's texels of any window.
pub(super) fn make(
    subject: &Subject,
    output: &Output,
    tile: &Tile,
    context: &Context<'_>,
    source: impl Fn(Window) -> Result<Vec<u32>> + Sync,
) -> Result<Units> {
    let store = tile.create(subject, output, context)?;
    let blocks: Vec<Window> = blocks(subject.options.size, BLOCK_SHARDS)
        .enumerate()
        .filter(|(number, _)| subject.options.shard.has(*number))
        .map(|(_, block)| block)
        .collect();
    let missing: Vec<Window> = blocks.iter().copied().filter(|&block| !is_done(&store, block)).collect();
    // Few blocks are cut into their shards, so that all threads have something to do.
    let windows: Vec<Window> = if missing.len() >= 2 * context.threads {
        missing.clone()
    } else {
        missing.iter().flat_map(|&block| parts(block)).filter(|&part| !is_done(&store, part)).collect()
    };
    let wanted: usize = windows.iter().map(|window| window.size.texels()).sum();
    context.progress.begin("enlarge", wanted as u64, Counted::Items("texels"));
    let block_texels = (BLOCK_SHARDS * SHARD_SIDE).pow(2) as u64;
    let allowed = context.memory_bytes.saturating_sub(FIXED_BYTES);
    let in_flight = (allowed / (block_texels * TEXEL_BYTES)).clamp(1, context.threads as u64) as usize;
    units::for_each(context, &windows, in_flight, |&window| {
        tile.write(&store, window, &source(window)?)?;
        context.progress.advance(window.size.texels() as u64);
        Ok(())
    })?;
    context.progress.end();
    Ok(Units { found: blocks.len() - missing.len(), written: missing.len() })
}

/// The blocks of a plane, row by row.
fn blocks(size: Size, shards: usize) -> impl Iterator<Item = Window> {
    let side = shards * SHARD_SIDE;
    (0..size.height).step_by(side).flat_map(move |y| {
        (0..size.width).step_by(side).map(move |x| Window {
            y,
            x,
            size: Size::new(side.min(size.height - y), side.min(size.width - x)),
        })
    })
}

/// How many blocks an enlarged index has, and the numbers of those that are whole on the disk, ascending.
pub(crate) fn blocks_done(enlarged: &Enlarged) -> (usize, Vec<usize>) {
    let Size { height, width } = enlarged.shards();
    let across = width.div_ceil(BLOCK_SHARDS);
    let mut found: BTreeMap<usize, usize> = BTreeMap::new();
    for [row, column] in enlarged.shards_found() {
        if enlarged.has_shard(row, column) {
            *found.entry(row / BLOCK_SHARDS * across + column / BLOCK_SHARDS).or_default() += 1;
        }
    }
    let side = |all: usize, block: usize| BLOCK_SHARDS.min(all - block * BLOCK_SHARDS);
    let whole = |&(block, shards): &(usize, usize)| {
        shards == side(height, block / across) * side(width, block % across)
    };
    (
        height.div_ceil(BLOCK_SHARDS) * across,
        found.into_iter().filter(whole).map(|(block, _)| block).collect(),
    )
}

/// The shards of a block.
fn parts(block: Window) -> impl Iterator<Item = Window> {
    blocks(block.size, 1).map(move |part| Window { y: block.y + part.y, x: block.x + part.x, ..part })
}

/// Whether every shard of a window is there.
pub(super) fn is_done(store: &Enlarged, window: Window) -> bool {
    parts(window).all(|part| store.has_shard(part.y / SHARD_SIDE, part.x / SHARD_SIDE))
}

//! Image quilting: rows of blocks flow into rows of shards, from the top down. A killed run starts over and writes the
//! rows of shards that are missing.

use super::blocks::{Kept, Tile, is_done};
use super::patches::exemplar;
use super::{Output, Rule, Subject, Units};
use crate::error::{Error, Result};
use crate::method::baseline::{Exemplar, Quilt};
use crate::run::Context;
use crate::run::budget::OWN_BYTES;
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::shape::{Size, Window};
use crate::store::enlarged::{EnlargeRecipe, Method, SHARD_SIDE};

/// Settings of image quilting.
#[derive(Clone, Debug)]
pub struct Options {
    /// Write the tile's texel that each texel is.
    pub keep_source: bool,
    /// Write normals, taken from the tile's normal map.
    pub keep_normals: bool,
}

/// Image quilting on a model.
pub(super) struct Quilting {
    kept: Kept,
    tile: Tile,
    exemplar: Exemplar,
}

impl Quilting {
    pub(super) fn open(subject: &Subject, options: &Options) -> Result<Self> {
        if subject.options.shard != Shard::WHOLE {
            return Err(Error::usage(
                "quilting goes from the top down and cannot be made in parts by --shard",
            )
            .hint("leave out --shard, or choose another --method"));
        }
        let kept = Kept { source: options.keep_source, normals: options.keep_normals };
        let tile = Tile::open(subject, kept)?;
        let exemplar = exemplar(subject, &tile)?;
        let super::Options { size, tileable, .. } = subject.options;
        Quilt::check(&exemplar, size, tileable)?;
        Ok(Self { kept, tile, exemplar })
    }

    /// Makes one output.
    fn make_one(&self, subject: &Subject, output: &Output, context: &Context<'_>) -> Result<Units> {
        let super::Options { size, tileable, .. } = subject.options;
        let store = self.tile.create(subject, output, context)?;
        let shard_rows: Vec<Window> = (0..size.height)
            .step_by(SHARD_SIDE)
            .map(|y| Window { y, x: 0, size: Size::new(SHARD_SIDE.min(size.height - y), size.width) })
            .collect();
        let missing: Vec<&Window> = shard_rows.iter().filter(|&&row| !is_done(&store, row)).collect();
        let units = Units { found: shard_rows.len() - missing.len(), written: missing.len() };
        let Some(last) = missing.last() else { return Ok(units) };
        let wanted = (last.y + last.size.height) * size.width;
        context.progress.begin("enlarge", wanted as u64, Counted::Items("texels"));
        let mut quilt = Quilt::new(&self.exemplar, output.seed, size, tileable)?;
        let mut source: Vec<u32> = Vec::with_capacity(shard_rows.first().map_or(0, |row| row.size.texels()));
        let mut windows = shard_rows.iter().take_while(|window| window.y <= last.y);
        let mut window = windows.next();
        while let Some(current) = window {
            let Some(rows) = quilt.next_rows() else { break };
            context.check_stop()?;
            context.progress.advance(rows.len() as u64);
            // A row of blocks is lower than a row of shards, so it ends at most one of them.
            let (of_this, of_next) = rows.split_at(rows.len().min(current.size.texels() - source.len()));
            source.extend(of_this);
            if source.len() == current.size.texels() {
                if missing.contains(&current) {
                    context.install(|| self.tile.write(&store, *current, &source))?;
                }
                source.clear();
                source.extend(of_next);
                window = windows.next();
            }
        }
        context.progress.end();
        Ok(units)
    }
}

/// Memory that a run takes: the distances, a row of blocks, and a row of shards with what is written of it.
pub(super) fn bytes(exemplar_bytes: u64, tile: Size, size: Size, keep_normals: bool) -> u64 {
    let Size { height, width } = size;
    let normals = if keep_normals { size_of::<[f32; 3]>() } else { 0 };
    let shards = SHARD_SIDE.min(height) * width * (size_of::<u32>() + size_of::<u16>() + normals);
    OWN_BYTES + exemplar_bytes + Quilt::bytes(tile, width) + shards as u64
}

impl Rule for Quilting {
    fn method(&self) -> Method {
        Method::Quilt
    }

    fn units(&self, subject: &Subject) -> (&'static str, usize) {
        ("rows of shards", subject.options.size.height.div_ceil(SHARD_SIDE))
    }

    fn describe(&self, recipe: &mut EnlargeRecipe) {
        self.kept.describe(recipe);
    }

    fn memory_bytes(&self, subject: &Subject, _threads: usize) -> u64 {
        bytes(self.exemplar.bytes(), subject.tile, subject.options.size, self.kept.normals)
    }

    fn advice(&self) -> &'static str {
        "choose a smaller width, or leave out --keep-normals"
    }

    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>> {
        outputs.iter().map(|output| self.make_one(subject, output, context)).collect()
    }
}

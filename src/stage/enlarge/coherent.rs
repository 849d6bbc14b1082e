//! The coherent rule: every block of shards is a window of the endless plane, made alone. Nothing is kept between
//! blocks, so any process makes any of them in any order, and a killed run goes on with those that are missing.

use serde_json::{Map, Value, json};

use super::{Output, Rule, Subject, Units};
use crate::coherent::{Plane, Variation};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::shape::{Size, Window};
use crate::store::enlarged::{Description, Enlarged, Method, SHARD_SIDE, Texels};

/// Shards of a block along each side.
const BLOCK_SHARDS: usize = 2;

/// Memory of a texel of a block: its position at two levels, source, cluster, and what is packed.
const TEXEL_BYTES: u64 = 24;

/// Memory for what does not grow: the program itself.
const FIXED_BYTES: u64 = 8 << 20;

/// Settings of the coherent rule.
#[derive(Clone, Debug)]
pub struct Options {
    /// How far positions are moved at each level, in units of 1 / 256 of its spacing; by the model where absent.
    pub jitter: Option<u32>,
    /// Write the tile's texel that each texel is.
    pub keep_source: bool,
    /// Write normals, taken from the tile's normal map.
    pub keep_normals: bool,
}

/// The coherent rule on a model.
pub(super) struct Coherent {
    options: Options,
    plane: Plane,
    index: Vec<u16>,
    /// Normals of the tile, where they are to be kept.
    normals: Vec<[f32; 3]>,
    jitter: u32,
}

impl Coherent {
    pub(super) fn open(subject: &Subject, options: &Options) -> Result<Self> {
        let appearance = subject.model.appearance()?;
        let index = subject.model.index()?;
        let plane = Plane::new(subject.tile, &index, &appearance, Kernel::fastest())?;
        let normals = if options.keep_normals { subject.model.normals()? } else { Vec::new() };
        let jitter = options.jitter.unwrap_or(plane.variation(0).jitter);
        let coherent = Self { options: options.clone(), plane, index, normals, jitter };
        for seed in [*subject.options.seeds.start(), *subject.options.seeds.end()] {
            coherent.plane.check(&coherent.variation(subject, seed)?)?;
        }
        Ok(coherent)
    }

    fn variation(&self, subject: &Subject, seed: u64) -> Result<Variation> {
        let seed = u32::try_from(seed)
            .map_err(|_| Error::usage(format!("got seed {seed}, expected at most {}", u32::MAX)))?;
        let wrap = subject.options.tileable.then_some(subject.options.size);
        Ok(Variation { seed, jitter: self.jitter, wrap })
    }

    /// Makes one output.
    fn make_one(&self, subject: &Subject, output: &Output, context: &Context<'_>) -> Result<Units> {
        let size = subject.options.size;
        let variation = self.variation(subject, output.seed)?;
        let description = Description {
            size,
            clusters: subject.clusters.clusters,
            source: self.options.keep_source.then_some(subject.tile),
            keep_normals: self.options.keep_normals,
        };
        let store = Enlarged::create(&output.path, &description, &output.recipe, &subject.options.model)?;
        let blocks: Vec<Window> = blocks(size, BLOCK_SHARDS)
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
            let source = self.plane.window(&variation, window.y as i64, window.x as i64, window.size)?;
            let index: Vec<u16> = source.iter().map(|&texel| self.index[texel as usize]).collect();
            let normals: Vec<[f32; 3]> = match self.normals[..] {
                [] => Vec::new(),
                _ => source.iter().map(|&texel| self.normals[texel as usize]).collect(),
            };
            let texels = Texels { index: &index, source: &source, normals: normals.as_flattened() };
            store.write(window, texels)?;
            context.progress.advance(window.size.texels() as u64);
            Ok(())
        })?;
        context.progress.end();
        Ok(Units { found: blocks.len() - missing.len(), written: missing.len() })
    }
}

impl Rule for Coherent {
    fn method(&self) -> Method {
        Method::Coherent
    }

    fn units(&self, subject: &Subject) -> (&'static str, usize) {
        ("blocks of shards", blocks(subject.options.size, BLOCK_SHARDS).count())
    }

    fn recipe(&self) -> Map<String, Value> {
        let Options { keep_source, keep_normals, .. } = self.options;
        let settings = [
            ("jitter", json!(self.jitter)),
            ("source", json!(keep_source)),
            ("keep_normals", json!(keep_normals)),
        ];
        settings.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// The appearance of all levels, and a block in work.
    fn memory_bytes(&self, subject: &Subject, _threads: usize) -> u64 {
        let side = BLOCK_SHARDS * SHARD_SIDE;
        let Size { height, width } = subject.options.size;
        let block = (height.min(side) * width.min(side)) as u64 * TEXEL_BYTES;
        FIXED_BYTES + self.plane.bytes() + block
    }

    fn advice(&self) -> &'static str {
        "allow a larger --memory"
    }

    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>> {
        outputs.iter().map(|output| self.make_one(subject, output, context)).collect()
    }
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

/// The shards of a block.
fn parts(block: Window) -> impl Iterator<Item = Window> {
    blocks(block.size, 1).map(move |part| Window { y: block.y + part.y, x: block.x + part.x, ..part })
}

/// Whether every shard of a block is there.
fn is_done(store: &Enlarged, block: Window) -> bool {
    parts(block).all(|part| store.has_shard(part.y / SHARD_SIDE, part.x / SHARD_SIDE))
}

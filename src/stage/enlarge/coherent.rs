//! The coherent rule: every block of shards is a window of the endless plane, made alone.

use super::blocks::{self, Kept, Tile};
use super::{Output, Rule, Subject, Units};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::{Plane, Variation};
use crate::run::Context;
use crate::stage::image::of_stage;
use crate::store::enlarged::{EnlargeRecipe, Method};
use crate::store::model::{Model, Stage};

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
    kept: Kept,
    plane: Plane,
    tile: Tile,
    jitter: u32,
}

impl Coherent {
    pub(super) fn open(subject: &Subject, options: &Options) -> Result<Self> {
        let appearance = of_stage(&subject.model, Stage::Appearance, Model::appearance)?;
        let kept = Kept { source: options.keep_source, normals: options.keep_normals };
        let tile = Tile::open(subject, kept)?;
        let plane = Plane::new(subject.tile, tile.index(), &appearance, Kernel::fastest())?;
        let jitter = options.jitter.unwrap_or(plane.variation(0).jitter);
        let coherent = Self { kept, plane, tile, jitter };
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
}

impl Rule for Coherent {
    fn method(&self) -> Method {
        Method::Coherent
    }

    fn units(&self, subject: &Subject) -> (&'static str, usize) {
        (blocks::UNIT, blocks::count(subject.options.size))
    }

    fn describe(&self, recipe: &mut EnlargeRecipe) {
        self.kept.describe(recipe);
        recipe.jitter = Some(self.jitter);
    }

    /// The appearance of all levels, and a block in work.
    fn memory_bytes(&self, subject: &Subject, _threads: usize) -> u64 {
        self.plane.bytes() + blocks::memory_bytes(subject.options.size)
    }

    fn advice(&self) -> &'static str {
        ""
    }

    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>> {
        let make_one = |output: &Output| {
            let variation = self.variation(subject, output.seed)?;
            blocks::make(subject, output, &self.tile, context, |window| {
                self.plane.window(&variation, window.y as i64, window.x as i64, window.size)
            })
        };
        outputs.iter().map(make_one).collect()
    }
}

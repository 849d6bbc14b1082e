//! Model to enlarged index, by one of several methods.
//!
//! A [`Rule`] is a method with its options, opened on a model; the plan names the outputs and hands each to the rule.

mod blocks;
pub mod coherent;
mod enough;
pub mod paper;
pub mod patches;
mod pipeline;
pub mod quilt;
mod verdict;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};

pub(crate) use blocks::{blocks_done, count as blocks_of};
pub(crate) use enough::enough_bytes;

use crate::error::{Error, Result};
use crate::names::{ends_with, with_ending};
use crate::run::Context;
use crate::run::recipe::Recipe;
use crate::run::shard::Shard;
use crate::shape::Size;
use crate::stage::cluster;
use crate::store::enlarged::{EnlargeRecipe, Enlarged, Method};
use crate::store::model::{Model, index_bytes};
use crate::words::counted;
pub use verdict::Verdict;

/// How to enlarge.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
    /// The enlarged index to make; of several seeds, what their names begin with.
    pub output: PathBuf,
    /// Rows and columns.
    pub size: Size,
    /// Seeds of all that is drawn at random, one output each.
    pub seeds: RangeInclusive<u64>,
    /// Whether the output joins at its own borders.
    pub tileable: bool,
    /// By what method.
    pub by: By,
    /// The part of the units that this run makes.
    pub shard: Shard,
}

impl Options {
    /// By the coherent rule, seed 1, with the source of each texel.
    pub fn new(model: impl Into<PathBuf>, output: impl Into<PathBuf>, size: Size) -> Self {
        let coherent = coherent::Options { jitter: None, keep_source: true, keep_normals: false };
        Self {
            model: model.into(),
            output: output.into(),
            size,
            seeds: 1..=1,
            tileable: false,
            by: By::Coherent(coherent),
            shard: Shard::WHOLE,
        }
    }
}

/// A method with its options.
#[derive(Clone, Debug)]
pub enum By {
    /// The paper's: nearest normals of a random field.
    Paper(paper::Options),
    /// Source positions that continue their neighbours.
    Coherent(coherent::Options),
    /// Pieces of the tile on a grid.
    Patches(patches::Options),
    /// Image quilting.
    Quilt(quilt::Options),
}

/// What all methods are given of a model and of the options.
struct Subject {
    model: Model,
    options: Options,
    clusters: cluster::Report,
    /// Size of the tile.
    tile: Size,
}

/// An output of a plan.
struct Output {
    seed: u64,
    path: PathBuf,
    recipe: Value,
}

/// Units of an output that were found done, and those that a run made.
struct Units {
    found: usize,
    written: usize,
}

/// A method, ready to make outputs.
trait Rule {
    /// Its name in recipes.
    fn method(&self) -> Method;
    /// What the units of an output are, in the plural, and how many there are.
    fn units(&self, subject: &Subject) -> (&'static str, usize);
    /// What the bytes of an output depend on, beside the model, the size, the seed and whether it joins at its borders.
    fn describe(&self, recipe: &mut EnlargeRecipe);
    /// Memory that a run takes.
    fn memory_bytes(&self, subject: &Subject, threads: usize) -> u64;
    /// What to do where that is too much.
    fn advice(&self) -> &'static str;
    /// Makes the outputs one after the other, each from where it was left.
    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>>;
}

/// An enlargement, ready to run.
pub struct Plan {
    subject: Subject,
    rule: Box<dyn Rule>,
    outputs: Vec<Output>,
}

/// How it went, and what it saves.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The enlarged index.
    pub output: PathBuf,
    /// Its seed.
    pub seed: u64,
    /// Bytes of the enlarged index and of the representatives that it refers to.
    pub stored_bytes: u64,
    /// Bytes of the enlarged BTF's raw samples.
    pub raw_bytes: u64,
    /// What its units are, in the plural: each is done at once, and either done or not.
    pub unit: &'static str,
    /// Units found done.
    pub found: usize,
    /// Units written by this run.
    pub written: usize,
    /// Whether it looks like its tile; absent while other runs have units to make.
    pub verdict: Option<Verdict>,
}

/// Checks that the model is complete and can be enlarged to this size.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let tile = model.tile()?.size;
    let clusters = model.cluster_report()?;
    let subject = Subject { model, options: options.clone(), clusters, tile };
    let rule: Box<dyn Rule> = match &options.by {
        By::Paper(by) => Box::new(paper::Paper::open(&subject, by)?),
        By::Coherent(by) => Box::new(coherent::Coherent::open(&subject, by)?),
        By::Patches(by) => Box::new(patches::Patches::open(&subject, by)?),
        By::Quilt(by) => Box::new(quilt::Quilting::open(&subject, by)?),
    };
    let several = options.seeds.start() != options.seeds.end();
    let output = |seed: u64| {
        let path = if several { numbered(&options.output, seed) } else { options.output.clone() };
        Ok(Output { seed, path, recipe: subject.recipe(rule.as_ref(), seed)? })
    };
    let outputs = options.seeds.clone().map(output).collect::<Result<Vec<_>>>()?;
    if outputs.is_empty() {
        return Err(Error::usage("no seed: the first of a range must not be above the last"));
    }
    Ok(Plan { subject, rule, outputs })
}

/// `plane.zarr` with a number: `plane-3.zarr`.
fn numbered(output: &Path, number: u64) -> PathBuf {
    let ending = if ends_with(output, ".zarr") { ".zarr" } else { "" };
    output.with_file_name(with_ending(output, &[ending], &format!("-{number}{ending}")))
}

impl Subject {
    fn recipe(&self, rule: &dyn Rule, seed: u64) -> Result<Value> {
        let Options { size, tileable, .. } = self.options;
        let mut recipe = EnlargeRecipe {
            model: self.model.digest_of(rule.method().stages())?,
            size: [size.height, size.width],
            seed,
            tileable,
            rule: rule.method(),
            source: None,
            keep_normals: false,
            candidates: None,
            jitter: None,
            tiles: None,
        };
        rule.describe(&mut recipe);
        recipe.to_value()
    }

    /// Bytes of one output's index.
    fn index_bytes(&self) -> u64 {
        index_bytes(self.options.size.texels(), self.clusters.clusters)
    }
}

impl Plan {
    /// What would be done.
    pub fn summary(&self, context: &Context<'_>) -> Value {
        let (unit, units) = self.rule.units(&self.subject);
        json!({
            "stage": "enlarge",
            "outputs": self.outputs.iter().map(|output| output.path.display().to_string()).collect::<Vec<_>>(),
            "units": units * self.outputs.len(),
            "unit": unit,
            "index_bytes": self.subject.index_bytes(),
            "memory_bytes": self.rule.memory_bytes(&self.subject, context.threads),
            "recipes": self.outputs.iter().map(|output| &output.recipe).collect::<Vec<_>>(),
        })
    }

    /// Makes the outputs one after the other, each from where it was left.
    pub fn run(&self, context: &Context<'_>) -> Result<Vec<Report>> {
        let needed = self.rule.memory_bytes(&self.subject, context.threads);
        let what = format!("an enlargement {} wide", counted(self.subject.options.size.width, "texel"));
        context.memory().require(&what, needed, self.rule.advice())?;
        let units = self.rule.make(&self.subject, &self.outputs, context)?;
        let clusters = &self.subject.clusters;
        let texel_bytes = clusters.tile_bytes / self.subject.tile.texels() as u64;
        let report = |(output, units): (&Output, Units)| {
            let enlarged = Enlarged::open(&output.path)?;
            enlarged.finish(context)?;
            let (subject, method) = (&self.subject, self.rule.method());
            Ok(Report {
                output: output.path.clone(),
                seed: output.seed,
                stored_bytes: self.subject.index_bytes() + clusters.representative_bytes,
                raw_bytes: texel_bytes * self.subject.options.size.texels() as u64,
                unit: self.rule.units(&self.subject).0,
                found: units.found,
                written: units.written,
                verdict: context.compute(|| subject.verdict(&enlarged, method))?,
            })
        };
        self.outputs.iter().zip(units).map(report).collect()
    }
}

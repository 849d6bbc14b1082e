//! Tile to clusters: index, centres, representatives and their distances.
//!
//! Few texels are clustered in memory. Of more, a sample is ([`initial`]), and from its centres go passes over growing
//! mini-batches ([`batches`]) and all texels ([`pass`]) that read each chunk once. What memory allows never changes a
//! result: it only says how many bounds and blocks are kept.

mod batches;
mod budget;
pub mod curve;
mod finish;
mod initial;
mod pass;
mod representatives;
mod reuse;
mod stream;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::cluster::centre::CentreRule;
pub use crate::method::cluster::choice::{Amount, First, Representation};
use crate::method::cluster::lloyd::{Limits, Method, Pass};
use crate::method::cluster::points::Arrangement;
use crate::method::cluster::selection::{Order, Selection};
use crate::method::cluster::tally::Tally;
use crate::method::tile::Tile;
use crate::run::Context;
use crate::run::recipe::{self, Recipe};
use crate::run::shard::Shard;
use crate::store::clustering::{Passes, State};
use crate::store::measurement::Measurement;
use crate::store::model::clusters::ClusterRecipe;
pub use crate::store::model::clusters::{ClusterReport as Report, Ended};
use crate::store::model::tile::TileRecipe;
use crate::store::model::{Model, Stage, measurement_name};
use crate::store::origin;
use crate::words::counted;
pub(crate) use budget::enough_bytes;
use pass::{End, Next, Work};
pub use reuse::{Options as ReuseOptions, Plan as ReusePlan, plan as plan_reuse};

/// Most clusters: the index is u16.
const MOST_CLUSTERS: usize = 1 << 16;

/// Clusters where no number is given.
pub(crate) const USUAL_CLUSTERS: usize = 256;

/// Most clusters that a search for an error goes up to.
const MOST_SEARCHED: usize = 4096;

/// The folder in a model that holds the passes of a clustering on its way.
const PASSES: &str = "clustering";

/// How to cluster.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement that the tile was cut from.
    pub measurement: PathBuf,
    /// The model with the tile.
    pub model: PathBuf,
    /// How many clusters.
    pub amount: Amount,
    /// How centres follow from their texels.
    pub centre: CentreRule,
    /// What stands for the texels of a cluster.
    pub representatives: Representation,
    /// When to stop.
    pub limits: Limits,
    /// Where first centres come from. Where absent, all texels of a tile of no more than a sample, else
    /// [`First::Sample`].
    pub first: Option<First>,
    /// Texels that are clustered in memory: all of a tile of no more, a sample of a larger one or of the first
    /// mini-batch. Where absent, as many as 192 MiB hold; of a mini-batch no more than first centres are drawn from.
    pub sample: Option<usize>,
    /// First centres are drawn so many times, and the best are taken.
    pub restarts: u32,
    /// Seed of the first centres and of the sample.
    pub seed: u64,
    /// After this time no pass begins; then the number of passes depends on the machine.
    pub time: Option<Duration>,
}

impl Options {
    /// 256 clusters, or as many as the tile has texels, with medians as centres and texels as representatives; seed 1.
    pub fn new(measurement: impl Into<PathBuf>, model: impl Into<PathBuf>) -> Self {
        Self {
            measurement: measurement.into(),
            model: model.into(),
            amount: Amount::Usual,
            centre: CentreRule::Median,
            representatives: Representation::Texel,
            limits: Limits::default(),
            first: None,
            sample: None,
            restarts: 1,
            seed: 1,
            time: None,
        }
    }
}

/// A step of a clustering that many processes share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The initial clustering, by one process.
    Prepare,
    /// One process's share of a pass; the latest where none is named.
    Assign(Option<usize>, Shard),
    /// Sums up a pass, by one process: the next one can begin, or the model is done.
    Reduce(Option<usize>),
}

/// What a step has done.
#[derive(Clone, Debug)]
pub enum Stepped {
    /// The clustering is done, by this step or before it.
    Done(Box<Report>),
    /// This pass can begin.
    Next(usize),
    /// Parts of a pass that were found done, and that were assigned.
    Assigned {
        /// The pass.
        pass: usize,
        /// Found done.
        found: usize,
        /// Written by this step.
        written: usize,
    },
    /// A pass that was asked for is over already.
    Over(usize),
}

impl Ended {
    fn of(passes: &[Pass], limits: Limits) -> Self {
        if (Limits { passes: usize::MAX, ..limits }).reached(passes) {
            Self::Converged
        } else if passes.len() >= limits.passes {
            Self::Passes
        } else {
            Self::Time
        }
    }
}

/// A clustering, ready to run.
pub struct Plan {
    measurement: Measurement,
    model: Model,
    tile: Tile,
    options: Options,
    first: First,
    arrangement: Arrangement,
    selection: Selection,
    /// Clusters that are certain, or that a search may go up to.
    most_clusters: usize,
    recipe: Value,
}

/// Digest of the measurement that a model was begun from, where it is known.
fn measurement_of(model: &Model) -> Result<Option<String>> {
    let recipe = || model.recipe::<TileRecipe>(Stage::Tile);
    Ok(if model.has(Stage::Tile)? { Some(recipe()?.measurement) } else { None })
}

/// Opens the measurement that a model was begun from.
pub(crate) fn open_measurement_of(model: &Model, path: &Path) -> Result<Measurement> {
    let measurement = Measurement::open(path)?;
    expect_measurement(model, &measurement)?;
    Ok(measurement)
}

/// Checks that a model was not begun from another measurement.
///
/// # Errors
/// Says which measurement differs, and what to run.
pub(crate) fn expect_measurement(model: &Model, measurement: &Measurement) -> Result<()> {
    let (expected, found) = (measurement_of(model)?, measurement.digest());
    let Some(expected) = expected.filter(|expected| expected != found) else { return Ok(()) };
    if model.is_unpacked() {
        let (model, measurement) = (model.path().display(), measurement.path().display());
        return Err(Error::recipe(format!(
            "{model}: btf unpack made this model of a part of a measurement, and its file does not say which part"
        ))
        .hint(format!("make a model of the measurement: btf model {measurement} NAME.model.zarr")));
    }
    let [expected, found] = [expected.as_str(), found].map(recipe::shortened);
    // Where the model says that its measurement lies, another one is the same imported anew.
    let real = |path: &Path| path.canonicalize().ok();
    let name = measurement_name(model.path());
    let places = origin::places(model.path(), origin::MEASUREMENT, name.to_str());
    let anew = places.iter().any(|place| real(place).is_some() && real(place) == real(measurement.path()));
    let (model, measurement) = (model.path().display(), measurement.path().display());
    let todo = if anew {
        format!("make the model anew of what it is now: btf model {measurement} {model} --force")
    } else {
        "name the measurement that the model was made of, or the model of this measurement".to_owned()
    };
    Err(Error::recipe(format!(
        "{measurement} is not what {model} was made of: it was imported anew since in another way, or is another \
         measurement (digest {expected}, now {found})"
    ))
    .hint(todo))
}

/// Checks options against the tile.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let tile_digest = model.stage_digest(Stage::Tile)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let tile = model.tile()?;
    let description = measurement.description();
    let most = tile.size.texels().min(MOST_CLUSTERS);
    let options = &match options.amount {
        Amount::Usual => Options { amount: Amount::Clusters(most.min(USUAL_CLUSTERS)), ..options.clone() },
        _ => options.clone(),
    };
    let most_clusters = match options.amount {
        Amount::Usual => most.min(USUAL_CLUSTERS),
        Amount::Clusters(clusters) if (1..=most).contains(&clusters) => clusters,
        Amount::Clusters(clusters) => {
            return Err(Error::usage(format!(
                "{clusters} clusters were asked for, expected 1 to {most} for a tile of {}",
                counted(tile.size.texels(), "texel")
            )));
        }
        Amount::Error(error) if error > 0.0 => most.min(MOST_SEARCHED),
        Amount::Ratio(ratio) if ratio > 0.0 => {
            let brdf = description.bytes_of(1);
            clusters_of_ratio(description.bytes(), brdf, tile.size.texels() as u64, ratio).min(most)
        }
        Amount::Error(number) | Amount::Ratio(number) => {
            return Err(Error::usage(format!("got {number}, expected a number above 0")));
        }
    };
    if options.centre == CentreRule::Mean && tile.size.texels() > Tally::MOST_TEXELS {
        return Err(Error::usage(format!(
            "means of codes are summed over at most {} texels, the tile has {}",
            Tally::MOST_TEXELS,
            tile.size.texels()
        ))
        .hint("use --centre median, or cut a tile: btf tile"));
    }
    if most_clusters == 0 {
        let raw = description.size.texels();
        return Err(Error::usage(format!(
            "one BRDF and the index are more than that part of a measurement of {raw} texels"
        ))
        .hint("choose a smaller ratio"));
    }
    let recipe = ClusterRecipe {
        tile: tile_digest,
        amount: options.amount,
        centre: options.centre,
        limits: options.limits,
        sample: options.sample,
        restarts: options.restarts,
        seed: options.seed,
        first: options.first,
        representatives: options.representatives,
    };
    let recipe = recipe.to_value()?;
    let first = options.first.unwrap_or(First::Sample);
    let order = if first == First::Sample { Order::Rows } else { Order::Drawn(options.seed) };
    let arrangement = Arrangement::new(&description.views, description.lights.len());
    let selection = Selection::new(&tile.source, description.chunk_side(), order);
    let options = options.clone();
    Ok(Plan { measurement, model, tile, options, first, arrangement, selection, most_clusters, recipe })
}

/// The most clusters whose BRDFs and index are together `ratio` times smaller than `raw` bytes.
fn clusters_of_ratio(raw: u64, brdf: u64, texels: u64, ratio: f64) -> usize {
    let left = |bytes: u64| ((raw as f64 / ratio - bytes as f64).max(0.0) / brdf.max(1) as f64) as usize;
    let by_bytes = left(texels).min(256);
    by_bytes.max(left(2 * texels))
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "cluster",
            "model": self.options.model.display().to_string(),
            "texels": self.selection.texels(),
            "clusters_at_most": self.most_clusters,
            "sample_texels": self.sample_texels(),
            "in_memory": self.fits_the_sample(),
            "unit": "part",
            "units": self.selection.parts(self.selection.blocks().len()).len(),
            "recipe": self.recipe,
        })
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Cluster, &self.recipe).unwrap_or(false)
    }

    fn method(&self, columns: usize, deadline: Option<Instant>) -> Method {
        let Options { centre: rule, limits, .. } = self.options;
        Method { rule, limits, columns, kernel: Kernel::fastest(), deadline }
    }

    fn deadline(&self) -> Option<Instant> {
        self.options.time.and_then(|time| Instant::now().checked_add(time))
    }

    fn passes(&self, context: &Context<'_>) -> Result<Passes> {
        Passes::create(&self.model.path().join(PASSES), &self.recipe, context)
    }

    /// Views and lights.
    fn brdf(&self) -> [usize; 2] {
        [self.arrangement.cosines().len(), self.arrangement.lights()]
    }

    /// Clusters the tile, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Some(_lock) = self.model.begin(Stage::Cluster, &self.recipe, context)? else {
            return self.done();
        };
        let deadline = self.deadline();
        if self.fits_the_sample() {
            return self.run_in_memory(deadline, context);
        }
        let passes = self.passes(context)?;
        let (mut pass, mut state) = match passes.latest()? {
            Some(pass) => (pass, passes.state(pass, self.brdf(), self.selection.texels())?),
            None => self.prepare(&passes, deadline, context)?,
        };
        let mut work = self.work(&state, context)?;
        loop {
            let history = match work.run(&passes, pass, &state, deadline, context)? {
                Next::Pass(next) => {
                    (pass, state) = (pass + 1, *next);
                    continue;
                }
                Next::Restart(history) => history,
                Next::Finished(result) => match work.finish(&result, context)? {
                    End::Model(report) => return Ok(*report),
                    End::TooLarge(history) => history,
                },
            };
            drop(work);
            pass += 1;
            state = self.restart(&passes, pass, *history, deadline, context)?;
            work = self.work(&state, context)?;
        }
    }

    /// How the clustering that is done went. A process that was killed at its end leaves its passes behind.
    fn done(&self) -> Result<Report> {
        Passes::remove(&self.model.path().join(PASSES));
        self.model.cluster_report()
    }

    fn work(&self, state: &State, context: &Context<'_>) -> Result<Work<'_>> {
        let [views, lights] = self.brdf();
        Work::new(self, state.centres.len() / (views * lights), context)
    }

    /// The initial clustering: the state that the first pass over all texels begins with.
    fn prepare(
        &self,
        passes: &Passes,
        deadline: Option<Instant>,
        context: &Context<'_>,
    ) -> Result<(usize, State)> {
        let state = self.initial_clustering(deadline, context)?;
        passes.write_state(0, self.brdf(), &state)?;
        Ok((0, state))
    }

    /// Runs one step; many processes may run steps of one clustering.
    pub fn step(&self, step: Step, context: &Context<'_>) -> Result<Stepped> {
        let done = || Ok(Stepped::Done(Box::new(self.done()?)));
        // One process prepares or sums up at a time; no result depends on it.
        let _lock = match step {
            Step::Assign(..) if self.model.is_done(Stage::Cluster, &self.recipe)? => return done(),
            Step::Assign(..) => None,
            Step::Prepare | Step::Reduce(_) => {
                match self.model.begin(Stage::Cluster, &self.recipe, context)? {
                    Some(lock) => Some(lock),
                    None => return done(),
                }
            }
        };
        if self.fits_the_sample() {
            return match step {
                Step::Prepare => Ok(Stepped::Done(Box::new(self.run_in_memory(None, context)?))),
                _ => Err(Error::missing(format!(
                    "{}: this tile is clustered by the first step alone",
                    self.model.path().display()
                ))
                .hint("run --step prepare first")),
            };
        }
        let passes = self.passes(context)?;
        let latest = passes.latest()?;
        let begun = |asked: Option<usize>| match latest {
            Some(latest) if asked.is_none_or(|asked| asked <= latest) => Ok(latest),
            _ => Err(Error::missing(format!(
                "{}: pass {} cannot begin yet",
                self.model.path().display(),
                asked.unwrap_or(0)
            ))
            .hint("run --step prepare first, then --step reduce after each pass")),
        };
        match step {
            Step::Prepare => match latest {
                Some(pass) => Ok(Stepped::Next(pass)),
                None => self.prepare(&passes, None, context).map(|(pass, _)| Stepped::Next(pass)),
            },
            Step::Assign(asked, shard) => match begun(asked)? {
                latest if asked.is_some_and(|asked| asked < latest) => {
                    Ok(Stepped::Over(asked.unwrap_or(latest)))
                }
                pass => self.assign_shard(&passes, pass, shard, context),
            },
            Step::Reduce(asked) => match begun(asked)? {
                latest if asked.is_some_and(|asked| asked < latest) => Ok(Stepped::Next(latest)),
                pass => self.reduce(&passes, pass, context),
            },
        }
    }
}

use std::path::{Path, PathBuf};
use std::time::Duration;

use btfkit::error::Result;
use btfkit::method::cluster::centre::CentreRule;
use btfkit::method::cluster::lloyd::Limits;
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::stage::cluster::{self, Amount, First, Representation, Step, Stepped};
use btfkit::store::{measurement, model};
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::given::{Given, expect_in_order};
use super::tile::Seed;
use super::{Console, bytes_text, number};

#[derive(Args)]
pub(super) struct ClusterOptions {
    /// Number of clusters [default: 256, or as many as the tile has texels]
    #[arg(long, group = "amount", value_parser = number::count)]
    clusters: Option<usize>,
    /// Instead of --clusters: the fewest clusters whose mean error is at most this, in units of lightness L*, between
    /// texels and the measured texels that are stored for them
    #[arg(long, group = "amount", value_name = "L*", value_parser = number::positive)]
    error: Option<f64>,
    /// Instead of --clusters: as many as make the model N times smaller than the raw measurement
    #[arg(long, group = "amount", value_name = "N", value_parser = number::positive)]
    ratio: Option<f64>,
    /// What the centre of a cluster is
    #[arg(long, value_enum, default_value = "median")]
    centre: Centre,
    /// What stands for the texels of a cluster
    #[arg(long, value_enum, default_value = "texel")]
    representatives: Representatives,
    /// Stop after this many passes over the texels
    #[arg(long, default_value_t = Limits::default().passes, value_parser = number::count)]
    passes: usize,
    /// Stop when a pass lowers the error by less than this share
    #[arg(long, default_value_t = Limits::default().tolerance, value_parser = number::share)]
    tolerance: f64,
    /// Where the first centres come from [default: all texels if they fit in 192 MiB, otherwise a sample]
    #[arg(long, value_enum)]
    first: Option<FirstName>,
    /// Number of texels in the sample [default: as many as fit in 192 MiB; for mini-batches 16384, or eight for each
    /// cluster if that is more]
    #[arg(long, value_name = "TEXELS")]
    sample: Option<usize>,
    /// Try N sets of first centres, and continue with the best
    #[arg(long, default_value_t = 1, value_name = "N")]
    restarts: u32,
    /// Begin no further pass after this many seconds
    #[arg(long, value_name = "SECONDS")]
    time: Option<u64>,
    /// Take the clusters of another model of this measurement, whose tile contains this one
    #[arg(long, value_name = "MODEL", conflicts_with_all = ["amount", "centre", "representatives", "passes", "tolerance", "first", "sample", "restarts", "time"])]
    clusters_of: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Centre {
    /// The median for each pair of directions, which has the least sum of absolute differences
    Median,
    /// The mean, as in ordinary k-means
    Mean,
}

#[derive(Clone, Copy, ValueEnum)]
enum Representatives {
    /// The measured texel nearest to the centre, as in the paper: all it shows was measured
    Texel,
    /// The mean of the cluster's texels: the least squared error, but softer
    Mean,
    /// Their median for each sample
    Median,
}

#[derive(Clone, Copy, ValueEnum)]
enum FirstName {
    /// Cluster a random sample of the texels in memory
    Sample,
    /// Pass over mini-batches drawn from the whole store, each twice as large as the one before
    Minibatch,
}

#[derive(Clone, Copy, ValueEnum)]
enum StepName {
    /// Find the first centres: one process
    Prepare,
    /// Assign a share of the texels to their centres: many processes
    Assign,
    /// Finish a pass: one process
    Reduce,
}

/// Sort the texels of a model's tile into clusters of similar BRDFs
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf cluster wood.zarr wood.model.zarr --clusters 400
  btf cluster wood.zarr wood.model.zarr --error 1.5         as few clusters as leave this mean error
  btf cluster wood.zarr wood.model.zarr --ratio 200         200 times smaller than the measurement
  btf cluster wood.zarr wood.model.zarr --representatives mean     a smaller squared error, softer pictures
  btf cluster wood.zarr second.model.zarr --clusters-of wood.model.zarr
Cluster the whole plane once, and use its clusters for any tile that is cut from it:
  btf tile wood.zarr plane.model.zarr --tile none && btf cluster wood.zarr plane.model.zarr
  btf model wood.zarr wood.model.zarr --clusters-of plane.model.zarr
Share the work between processes (exit code 66: a step before this one is not finished):
  btf cluster wood.zarr plane.model.zarr --step prepare
  btf cluster wood.zarr plane.model.zarr --step assign --pass 0 --shard 0/8     ... 7/8
  btf cluster wood.zarr plane.model.zarr --step reduce --pass 0                 and so on with pass 1
The reduce step that converges writes the model; further steps have nothing to do.
Clusters are formed by lightness alone, so texels of different hues may share one. btf compare measures the resulting
difference in colour.")]
pub(super) struct Cluster {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    #[command(flatten)]
    options: ClusterOptions,
    #[command(flatten)]
    seed: Seed,
    /// Do only one step, so that many processes share the work
    #[arg(long, value_enum, conflicts_with_all = ["clusters_of", "time"])]
    step: Option<StepName>,
    /// Number of the pass, from 0; a pass that is finished is not done again [default: the latest]
    #[arg(long, requires = "step", value_name = "N")]
    pass: Option<usize>,
    /// Assign only part K of N of the texels, K from 0; `env` takes both from the variables of Slurm or MPI
    #[arg(long, requires = "step", value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

impl Cluster {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<()> {
        expect_in_order(
            [(&self.measurement, &[measurement::KIND]), (&self.model, &[model::KIND])],
            &format!("btf cluster {} {}", self.model.display(), self.measurement.display()),
        )?;
        let Self { measurement, model, options, seed, .. } = self;
        self.refuse_idle(given)?;
        if self.dry_run {
            return match &options.clusters_of {
                Some(from) => console.plan(&taken_plan(model, from)?.summary()),
                None => console.plan(&cluster_plan(measurement, model, options, seed.seed)?.summary()),
            };
        }
        let Some(step) = self.step() else {
            let (found, report) = run_clusters(measurement, model, options, seed.seed, context)?;
            print_clusters(&report, console.found(found));
            return Ok(());
        };
        match cluster_plan(measurement, model, options, seed.seed)?.step(step, context)? {
            Stepped::Done(report) => print_clusters(&report, console),
            Stepped::Next(pass) => console.line(format!("pass {pass} can begin")),
            Stepped::Over(pass) => console.line(format!("pass {pass} is over")),
            Stepped::Assigned { pass, found, written } => {
                console
                    .line(format!("pass {pass}: {} assigned, {found} found done", counted(written, "part")));
            }
        }
        Ok(())
    }

    /// Refuses options that would change nothing.
    fn refuse_idle(&self, given: &Given) -> Result<()> {
        match self.step {
            Some(StepName::Prepare) => given.refuse_these(&["pass", "shard"], "in --step prepare")?,
            Some(StepName::Reduce) => {
                given.refuse_these(&["shard"], "in --step reduce, which is one process")?;
            }
            _ => {}
        }
        if self.options.clusters_of.is_some() {
            given.refuse_these(&["seed"], "beside --clusters-of: nothing is drawn at random")?;
        }
        Ok(())
    }

    fn step(&self) -> Option<Step> {
        Some(match self.step? {
            StepName::Prepare => Step::Prepare,
            StepName::Assign => Step::Assign(self.pass, self.shard),
            StepName::Reduce => Step::Reduce(self.pass),
        })
    }
}

/// Clusters, or takes the clusters of another model; tells whether that was found done.
pub(super) fn run_clusters(
    measurement: &Path,
    model: &Path,
    options: &ClusterOptions,
    seed: u64,
    context: &Context<'_>,
) -> Result<(bool, cluster::Report)> {
    match &options.clusters_of {
        Some(from) => {
            let plan = taken_plan(model, from)?;
            Ok((plan.is_done(), plan.run(context)?))
        }
        None => {
            let plan = cluster_plan(measurement, model, options, seed)?;
            Ok((plan.is_done(), plan.run(context)?))
        }
    }
}

fn taken_plan(model: &Path, from: &Path) -> Result<cluster::ReusePlan> {
    cluster::plan_reuse(&cluster::ReuseOptions { model: model.into(), from: from.into() })
}

fn cluster_plan(
    measurement: &Path,
    model: &Path,
    options: &ClusterOptions,
    seed: u64,
) -> Result<cluster::Plan> {
    cluster::plan(&cluster_options(measurement, model, options, seed))
}

pub(super) fn cluster_options(
    measurement: &Path,
    model: &Path,
    options: &ClusterOptions,
    seed: u64,
) -> cluster::Options {
    let centre = match options.centre {
        Centre::Median => CentreRule::Median,
        Centre::Mean => CentreRule::Mean,
    };
    let limits = Limits { passes: options.passes, tolerance: options.tolerance };
    let amount = match (options.clusters, options.error, options.ratio) {
        (_, Some(error), _) => Amount::Error(error),
        (_, _, Some(ratio)) => Amount::Ratio(ratio),
        (clusters, ..) => clusters.map_or(Amount::Usual, Amount::Clusters),
    };
    cluster::Options {
        measurement: measurement.into(),
        model: model.into(),
        amount,
        centre,
        representatives: match options.representatives {
            Representatives::Texel => Representation::Texel,
            Representatives::Mean => Representation::Mean,
            Representatives::Median => Representation::Median,
        },
        limits,
        first: options.first.map(|first| match first {
            FirstName::Sample => First::Sample,
            FirstName::Minibatch => First::Minibatch,
        }),
        sample: options.sample,
        restarts: options.restarts,
        seed,
        time: options.time.map(Duration::from_secs),
    }
}

/// A mean |dL*| above this is seen by everybody.
const LARGE: f64 = 3.0;

pub(super) fn print_clusters(report: &cluster::Report, console: Console) {
    let error = report.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
    let taken = report.taken_from.as_ref();
    let passes = match (report.batches.len(), report.passes.len()) {
        (0, all) => format!("after {}", counted(all, "pass")),
        (batches, all) => {
            format!("after {} over mini-batches and {all} over all texels", counted(batches, "pass"))
        }
    };
    // Told behind the rest, whichever of the two.
    let tell_error = || {
        if report.representative_lightness_error > LARGE {
            console.line("          a large error: more clusters leave less of it (--clusters N; btf curve shows how much)");
        }
    };
    let stored = report.representative_bytes + report.index_bytes;
    let ratio = |bytes: u64| bytes as f64 / stored as f64;
    if console.brief {
        let error = report.representative_lightness_error;
        let ratio = ratio(report.measurement_bytes);
        let text = format!(
            "{}; weighted mean |dL*| {error:.3} to representatives, 1:{ratio:.0} of the raw measurement",
            report.clusters
        );
        console.stage("clusters", &text);
        tell_error();
        return;
    }
    let how = taken
        .map_or(passes, |(name, texels)| format!("of {name}, which clustered {}", counted(*texels, "texel")));
    console.stage(
        "clusters",
        &format!(
            "{} {how}; weighted mean |dL*| {error:.3} to centres, {:.3} to representatives",
            report.clusters, report.representative_lightness_error
        ),
    );
    console.line(format!(
        "          representatives {:.3} from their centres, at most {:.3}; {} of one texel",
        report.representative_from_centre,
        report.representative_from_centre_most,
        counted(report.single_texel_clusters, "cluster")
    ));
    console.line(format!(
        "size      representatives {} + index {}: 1:{:.1} of the raw tile, 1:{:.0} of the raw measurement",
        bytes_text(report.representative_bytes),
        bytes_text(report.index_bytes),
        ratio(report.tile_bytes),
        ratio(report.measurement_bytes)
    ));
    tell_error();
}

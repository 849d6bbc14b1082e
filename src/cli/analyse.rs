use std::path::{Path, PathBuf};
use std::time::Duration;

use btfkit::error::{Error, Result};
use btfkit::method::cluster::centre::CentreRule;
use btfkit::method::cluster::lloyd::Limits;
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::{Context, progress};
use btfkit::stage::cluster::{Amount, First, Step, Stepped};
use btfkit::stage::import::Shard;
use btfkit::stage::{cluster, compare, image, normals};
use btfkit::store::measurement::{self, Measurement};
use btfkit::store::model::{Model, Stage};
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::appearance::{appearance_plan, tell_appearance};
use super::each::{Ended, Line, each};
use super::fit::{FitOptions, fit_plan, tell_field};
use super::outputs::{Naming, Pair};
use super::table::{row, table};
use super::tile::{Seed, TileOptions, tell_tile, tile_plan};
use super::{Tell, bytes_text, number};

#[derive(Args)]
struct ClusterOptions {
    /// Number of clusters, n_c [default: 256, or as many as the tile has texels]
    #[arg(long, group = "amount", value_parser = number::count)]
    clusters: Option<usize>,
    /// Instead: the fewest clusters whose mean weighted |dL*| from their centres is at most this
    #[arg(long, group = "amount", value_name = "L*", value_parser = number::positive)]
    error: Option<f64>,
    /// Instead: as many as leave the model this many times smaller than the raw measurement
    #[arg(long, group = "amount", value_name = "N", value_parser = number::positive)]
    ratio: Option<f64>,
    /// Centre of a cluster
    #[arg(long, value_enum, default_value = "median")]
    centre: Centre,
    /// Most passes
    #[arg(long, default_value_t = Limits::default().passes)]
    passes: usize,
    /// Least relative gain of the objective that is worth another pass
    #[arg(long, default_value_t = Limits::default().tolerance, value_parser = number::share)]
    tolerance: f64,
    /// Where the centres come from that passes over all texels begin with [default: all texels where 192 MiB hold
    /// them, else sample]
    #[arg(long, value_enum)]
    first: Option<FirstName>,
    /// Texels of the sample, clustered in memory [default: as many as 192 MiB hold; of a mini-batch 16384 or eight a
    /// cluster]
    #[arg(long, value_name = "TEXELS")]
    sample: Option<usize>,
    /// Draw first centres so many times and go on with the best
    #[arg(long, default_value_t = 1, value_name = "N")]
    restarts: u32,
    /// After this many seconds begin no further pass
    #[arg(long, value_name = "SECONDS")]
    time: Option<u64>,
    /// Take the clusters of another model of this measurement, whose tile holds this one
    #[arg(long, value_name = "MODEL", conflicts_with_all = ["amount", "centre", "passes", "tolerance", "first", "sample", "restarts", "time"])]
    clusters_of: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Centre {
    /// The minimiser of (1)
    Median,
    /// The textbook's K-means
    Mean,
}

#[derive(Clone, Copy, ValueEnum)]
enum FirstName {
    /// A random sample of the texels, as large as memory is set aside for
    Sample,
    /// Batches of chunks drawn over the whole store: a sample of the first, then passes over batches that double
    Minibatch,
}

#[derive(Clone, Copy, ValueEnum)]
enum StepName {
    /// The first approach, by one process
    Prepare,
    /// A share of a pass
    Assign,
    /// Sum up a pass, by one process
    Reduce,
}

#[derive(Args)]
struct NormalsOptions {
    /// Leave out shadowed and highlighted lights
    #[arg(long)]
    robust: bool,
}

/// Measurement to model: tile, clusters, normals, random field and appearance in one go
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf model wood.zarr wood.model.zarr
  btf model leather.zarr --clusters 128 --mrf 2d --tile 128x128
  btf model cloth.zarr --lattice '15.2,0;0,18.4'
  btf model stores/*.zarr --into models            a model each; a bad one does not stop the others
Stages that are done by the same recipe are not run again.")]
pub(super) struct Whole {
    /// The measurement, and the model to make [default: the measurement's name with .model.zarr]; or many measurements
    #[arg(required = true, value_name = "MEASUREMENT")]
    paths: Vec<PathBuf>,
    /// Folder for the models; every name is a measurement [default: beside each]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    #[command(flatten)]
    tile: TileOptions,
    #[command(flatten)]
    cluster: ClusterOptions,
    #[command(flatten)]
    normals: NormalsOptions,
    #[command(flatten)]
    fit: FitOptions,
    #[command(flatten)]
    seed: Seed,
    /// Only say what would be done first
    #[arg(long)]
    dry_run: bool,
}

/// Cluster the BRDFs of a model's tile, by lightness
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf cluster wood.zarr wood.model.zarr --clusters 400
  btf cluster wood.zarr wood.model.zarr --error 1.5         the fewest clusters that keep this mean |dL*|
  btf cluster wood.zarr wood.model.zarr --ratio 200         as many as fit a two hundredth of the measurement
  btf cluster wood.zarr second.model.zarr --clusters-of wood.model.zarr
The whole plane once, and any tile that is cut from it is clustered already:
  btf tile wood.zarr plane.model.zarr --tile none && btf cluster wood.zarr plane.model.zarr
  btf model wood.zarr wood.model.zarr --clusters-of plane.model.zarr
Many processes, the same bytes (exit code 66: something that this step needs is not there yet):
  btf cluster wood.zarr plane.model.zarr --step prepare
  btf cluster wood.zarr plane.model.zarr --step assign --pass 0 --shard 0/8     ... 7/8
  btf cluster wood.zarr plane.model.zarr --step reduce --pass 0                 and so on with pass 1
When nothing is gained any more, reduce writes the model, and further steps have nothing to do.
Texels of one lightness and another hue are alike to it: btf compare tells what that does to colours.")]
pub(super) struct Cluster {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    #[command(flatten)]
    options: ClusterOptions,
    #[command(flatten)]
    seed: Seed,
    /// Only one step, of work that many processes share
    #[arg(long, value_enum, conflicts_with_all = ["clusters_of", "time"])]
    step: Option<StepName>,
    /// The pass of the step, from 0; over ones have nothing to do [default: the latest]
    #[arg(long, requires = "step", value_name = "N")]
    pass: Option<usize>,
    /// Assign only part K of N of the pass
    #[arg(long, requires = "step", value_name = "K/N", default_value = "0/1")]
    shard: Shard,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

/// Estimate the normal map of a model's tile
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf normals wood.zarr wood.model.zarr
  btf normals wood.zarr wood.model.zarr --robust    leaves out shadowed and highlighted lights")]
pub(super) struct Normals {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    #[command(flatten)]
    options: NormalsOptions,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

/// Compare a model's tile, re-made from index and representatives, with the measurement
#[derive(Args)]
#[command(after_help = "\
Example:
  btf compare wood.model.zarr wood.zarr --picture side.png --light 15,0 --view 0,0")]
pub(super) struct Compare {
    /// The model
    model: PathBuf,
    /// The measurement
    measurement: PathBuf,
    /// Also write measured tile, model and their difference (4 times) side by side: .png, .jpg, .webp or .tif
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Light of the picture: theta,phi in degrees
    #[arg(long, default_value = "15,0", allow_hyphen_values = true)]
    light: Direction,
    /// View of the picture
    #[arg(long, default_value = "0,0", allow_hyphen_values = true)]
    view: Direction,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

impl Whole {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<Ended> {
        let naming = Naming { reads: measurement::KIND, ending: None, becomes: ".model.zarr" };
        let pairs = naming.pairs(&self.paths, self.into.as_deref())?;
        if let [pair] = pairs.as_slice() {
            return self.one(pair, context, tell).map(|_| Ended::Done);
        }
        let name = |pair: &Pair| pair.input.display().to_string();
        each(&pairs, name, false, context, tell, |pair| {
            let clusters = self.one(pair, context, if self.dry_run { tell } else { tell.silent() })?;
            let clusters = clusters.map(|clusters| counted(clusters, "cluster"));
            Ok((
                Line::Text(format!(
                    "{}: {}",
                    pair.output.display(),
                    clusters.unwrap_or("planned".to_owned())
                )),
                None,
            ))
        })
    }

    /// Makes one model; tells how many clusters it has, unless nothing but a plan was asked for.
    fn one(&self, pair: &Pair, context: &Context<'_>, tell: Tell) -> Result<Option<usize>> {
        let Pair { input: measurement, output: model } = pair;
        let plan = tile_plan(measurement, model, &self.tile, self.seed.seed)?;
        if self.dry_run {
            return tell.plan(&plan.summary()).map(|()| None);
        }
        let begin = |stage: Stage| {
            let number = 1 + Stage::ALL.iter().position(|&other| other == stage).unwrap_or(0);
            let stage = progress::Stage { number, of: Stage::ALL.len(), name: stage.name() };
            context.progress.stage(Some(stage));
        };
        // A line may be told only while no bar is drawn.
        let tell = tell.brief();
        let told = |found: bool, told: &dyn Fn(Tell)| context.progress.pause(&mut || told(tell.found(found)));
        begin(Stage::Tile);
        let found = plan.is_done();
        let tile = plan.run(context)?;
        told(found, &|tell| tell_tile(&tile, tell));
        begin(Stage::Cluster);
        let (found, clusters) = run_clusters(measurement, model, &self.cluster, self.seed.seed, context)?;
        told(found, &|tell| tell_clusters(&clusters, tell));
        begin(Stage::Normals);
        let plan = normals_plan(measurement, model, &self.normals)?;
        let (found, normals) = (plan.is_done(), plan.run(context)?);
        told(found, &|tell| tell_normals(&normals, tell));
        begin(Stage::Fit);
        let plan = fit_plan(model, &self.fit)?;
        let (found, field) = (plan.is_done(), plan.run(context)?);
        told(found, &|tell| tell_field(&field, tell));
        begin(Stage::Appearance);
        let plan = appearance_plan(model, &self.tile.lattice)?;
        let (found, appearance) = (plan.is_done(), plan.run(context)?);
        told(found, &|tell| tell_appearance(&appearance, tell));
        context.progress.stage(None);
        Ok(Some(clusters.clusters))
    }
}

impl Cluster {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let Self { measurement, model, options, seed, .. } = self;
        if self.dry_run {
            return match &options.clusters_of {
                Some(from) => tell.plan(&taken_plan(model, from)?.summary()),
                None => tell.plan(&cluster_plan(measurement, model, options, seed.seed)?.summary()),
            };
        }
        let Some(step) = self.step() else {
            let (found, report) = run_clusters(measurement, model, options, seed.seed, context)?;
            tell_clusters(&report, tell.found(found));
            return Ok(());
        };
        match cluster_plan(measurement, model, options, seed.seed)?.step(step, context)? {
            Stepped::Done(report) => tell_clusters(&report, tell),
            Stepped::Next(pass) => tell.line(format!("pass {pass} can begin")),
            Stepped::Over(pass) => tell.line(format!("pass {pass} is over")),
            Stepped::Assigned { pass, found, written } => {
                tell.line(format!("pass {pass}: {} assigned, {found} found done", counted(written, "part")));
            }
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

impl Normals {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = normals_plan(&self.measurement, &self.model, &self.options)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        let found = plan.is_done();
        tell_normals(&plan.run(context)?, tell.found(found));
        Ok(())
    }
}

/// Clusters, or takes the clusters of another model; tells whether that was found done.
fn run_clusters(
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

fn taken_plan(model: &Path, from: &Path) -> Result<cluster::TakenPlan> {
    cluster::plan_taken(&cluster::TakenOptions { model: model.into(), from: from.into() })
}

fn cluster_plan(
    measurement: &Path,
    model: &Path,
    options: &ClusterOptions,
    seed: u64,
) -> Result<cluster::Plan> {
    let centre = match options.centre {
        Centre::Median => CentreRule::Median,
        Centre::Mean => CentreRule::Mean,
    };
    let limits = Limits { passes: options.passes.max(1), tolerance: options.tolerance };
    let amount = match (options.clusters, options.error, options.ratio) {
        (_, Some(error), _) => Amount::Error(error),
        (_, _, Some(ratio)) => Amount::Ratio(ratio),
        (clusters, ..) => clusters.map_or(Amount::Usual, Amount::Clusters),
    };
    cluster::plan(&cluster::Options {
        measurement: measurement.into(),
        model: model.into(),
        amount,
        centre,
        limits,
        first: options.first.map(|first| match first {
            FirstName::Sample => First::Sample,
            FirstName::Minibatch => First::Minibatch,
        }),
        sample: options.sample,
        restarts: options.restarts,
        seed,
        time: options.time.map(Duration::from_secs),
    })
}

fn normals_plan(measurement: &Path, model: &Path, options: &NormalsOptions) -> Result<normals::Plan> {
    normals::plan(&normals::Options {
        measurement: measurement.into(),
        model: model.into(),
        robust: options.robust,
    })
}

fn tell_clusters(report: &cluster::Report, tell: Tell) {
    let error = report.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
    let taken = report.taken_from.as_ref();
    let passes = match (report.batches.len(), report.passes.len()) {
        (0, all) => format!("after {}", counted(all, "pass")),
        (batches, all) => {
            format!("after {} over mini-batches and {all} over all texels", counted(batches, "pass"))
        }
    };
    let stored = report.representative_bytes + report.index_bytes;
    let ratio = |bytes: u64| bytes as f64 / stored as f64;
    if tell.brief {
        let error = report.representative_lightness_error;
        let ratio = ratio(report.measurement_bytes);
        let text = format!(
            "{}; mean weighted |dL*| {error:.3}, 1:{ratio:.0} of the raw measurement",
            report.clusters
        );
        return tell.stage("clusters", &text);
    }
    let how = taken
        .map_or(passes, |(name, texels)| format!("of {name}, which clustered {}", counted(*texels, "texel")));
    tell.stage(
        "clusters",
        &format!(
            "{} {how}; mean weighted |dL*| {error:.3} from centres, {:.3} from representatives",
            report.clusters, report.representative_lightness_error
        ),
    );
    tell.line(format!(
        "          representatives {:.3} from their centres, at most {:.3}; {} of one texel",
        report.representative_from_centre,
        report.representative_from_centre_most,
        counted(report.single_texel_clusters, "cluster")
    ));
    tell.line(format!(
        "size      representatives {} + index {}: 1:{:.1} of the raw tile, 1:{:.0} of the raw measurement",
        bytes_text(report.representative_bytes),
        bytes_text(report.index_bytes),
        ratio(report.tile_bytes),
        ratio(report.measurement_bytes)
    ));
}

fn tell_normals(report: &normals::Report, tell: Tell) {
    let [x, y, z] = report.mean;
    let lights = counted(report.lights, "light");
    tell.stage(
        "normals",
        &format!(
            "by {lights} of view {}; mean ({x:.3}, {y:.3}, {z:.3}), spread {:.1} degrees",
            report.view, report.spread_deg
        ),
    );
}

impl Compare {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
        let options = compare::Options { model: self.model.clone(), measurement: self.measurement.clone() };
        let report = compare::run(&options, context)?;
        if self.json {
            let value = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
            tell.plan(&value)?;
        } else {
            let mut rows = vec![row!["view theta", "views", "mean |dL*|", "PSNR dB", "CIEDE2000", "95 %"]];
            for errors in report.elevations.iter().chain([&report.all]) {
                rows.push(row![
                    errors.view_theta_deg.map_or("all".to_owned(), |theta| format!("{theta}")),
                    errors.views,
                    format!("{:.3}", errors.lightness),
                    errors.psnr_text(),
                    format!("{:.3}", errors.ciede2000),
                    format!("{:.2}", errors.ciede2000_95)
                ]);
            }
            tell.text(&table(&rows));
            tell.line(format!(
                "CIEDE2000, its mean and what 95 % stay below, over {}, the other figures over all",
                counted(report.colour_texels, "texel")
            ));
            if report.all.hues_are_lost() {
                tell.line(format!(
                    "warning: colours are off by {:.1}, lightness only by {:.1}: clusters are formed by lightness alone, and \
                     texels of several hues share some of them; more clusters help (btf cluster --clusters N --force)",
                    report.all.ciede2000, report.all.lightness
                ));
            }
            if report.all.samples_left_out > 0 {
                let count = counted(report.all.samples_left_out, "sample");
                tell.line(format!("{count} not finite: PSNR leaves them out, elsewhere they count as 0"));
            }
        }
        match &self.picture {
            Some(path) => self.side_by_side(context)?.write(path, context.existing).map(|_| ()),
            None => Ok(()),
        }
    }

    fn side_by_side(&self, context: &Context<'_>) -> Result<Picture> {
        let model = Model::open(&self.model)?;
        let measurement = Measurement::open(&self.measurement)?;
        let tile = model.tile()?;
        let measured = image::of_measured_tile(&measurement, &tile, self.view, self.light, context)?;
        let colors = image::cluster_colors(&model, self.view, self.light)?;
        let modelled = image::look_up(tile.size, &model.index()?, &colors)?;
        let difference = false_color::difference(&measured, &modelled, 4.0);
        let factor = (384 / tile.size.height.max(tile.size.width)).max(1);
        let shown = [measured.as_display(), modelled.as_display(), difference]
            .map(|picture| picture.magnified(factor));
        Ok(Picture::side_by_side(&shown, 8))
    }
}

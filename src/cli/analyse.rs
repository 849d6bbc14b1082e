use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::mrf;
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::Context;
use btfkit::stage::{cluster, compare, fit, image, normals, tile};
use btfkit::store::field::FieldReport;
use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use btfkit::texel::cluster::centre::CentreRule;
use btfkit::texel::cluster::lloyd::Limits;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::table::{row, table};
use super::{Tell, bytes_text};

#[derive(Args)]
struct TileOptions {
    /// What to take as the tile: auto, none (all, borders do not join), periodic (all, they do) or WIDTHxHEIGHT
    #[arg(long, default_value = "auto")]
    tile: tile::Choice,
}

#[derive(Args)]
struct ClusterOptions {
    /// Number of clusters, n_c
    #[arg(long, default_value_t = 256)]
    clusters: usize,
    /// Centre of a cluster
    #[arg(long, value_enum, default_value = "median")]
    centre: Centre,
    /// Most passes
    #[arg(long, default_value_t = 50)]
    passes: usize,
    /// Least relative gain of the objective that is worth another pass
    #[arg(long, default_value_t = 1e-4)]
    tolerance: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Centre {
    /// The minimiser of (1)
    Median,
    /// The textbook's K-means
    Mean,
}

#[derive(Args)]
struct NormalsOptions {
    /// Leave out shadowed and highlighted lights
    #[arg(long)]
    robust: bool,
}

#[derive(Args)]
struct FitOptions {
    /// Random field: all channels together, or one by one after the Karhunen-Loeve transform
    #[arg(long, value_enum, default_value = "3d")]
    mrf: Field,
    /// Levels of the pyramid [default: as many as keep ten samples per parameter, at most 5]
    #[arg(long)]
    levels: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Field {
    #[value(name = "3d")]
    Car3d,
    #[value(name = "2d")]
    Car2d,
}

#[derive(Args)]
struct Seed {
    /// Seed of all that is drawn at random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Measurement to model: tile, clusters, normals and random field in one go
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf model wood.zarr wood.model.zarr
  btf model leather.zarr --clusters 128 --mrf 2d --tile 128x128
Stages that are done by the same recipe are not run again.")]
pub(super) struct Whole {
    /// The measurement
    measurement: PathBuf,
    /// The model to make [default: the measurement's name with .model.zarr]
    model: Option<PathBuf>,
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

/// Cut a seamless tile from a measurement; begins a model
#[derive(Args)]
pub(super) struct Tile {
    /// The measurement
    measurement: PathBuf,
    /// The model to begin
    model: PathBuf,
    #[command(flatten)]
    options: TileOptions,
    #[command(flatten)]
    seed: Seed,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

/// Cluster the BRDFs of a model's tile
#[derive(Args)]
pub(super) struct Cluster {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    #[command(flatten)]
    options: ClusterOptions,
    #[command(flatten)]
    seed: Seed,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

/// Estimate the normal map of a model's tile
#[derive(Args)]
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

/// Fit the random field to a model's normal map
#[derive(Args)]
pub(super) struct Fit {
    /// The model with the normal map
    model: PathBuf,
    #[command(flatten)]
    options: FitOptions,
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
    /// Also write measured tile, model and their difference (4 times) side by side
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Light of the picture: theta,phi in degrees
    #[arg(long, default_value = "15,0")]
    light: Direction,
    /// View of the picture
    #[arg(long, default_value = "0,0")]
    view: Direction,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

impl Whole {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let model = self.model.clone().unwrap_or_else(|| {
            let name = self.measurement.file_name().unwrap_or_default().to_string_lossy().into_owned();
            self.measurement
                .with_file_name(format!("{}.model.zarr", name.strip_suffix(".zarr").unwrap_or(&name)))
        });
        let plan = tile_plan(&self.measurement, &model, &self.tile, self.seed.seed)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_tile(&plan.run(context)?, tell);
        let plan = cluster_plan(&self.measurement, &model, &self.cluster, self.seed.seed)?;
        tell_clusters(&plan.run(context)?, tell);
        let plan = normals_plan(&self.measurement, &model, &self.normals)?;
        tell_normals(&plan.run(context)?, tell);
        let plan = fit_plan(&model, &self.fit)?;
        tell_field(&plan.run(context)?, tell);
        Ok(())
    }
}

impl Tile {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = tile_plan(&self.measurement, &self.model, &self.options, self.seed.seed)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_tile(&plan.run(context)?, tell);
        Ok(())
    }
}

impl Cluster {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = cluster_plan(&self.measurement, &self.model, &self.options, self.seed.seed)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_clusters(&plan.run(context)?, tell);
        Ok(())
    }
}

impl Normals {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = normals_plan(&self.measurement, &self.model, &self.options)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_normals(&plan.run(context)?, tell);
        Ok(())
    }
}

impl Fit {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = fit_plan(&self.model, &self.options)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_field(&plan.run(context)?, tell);
        Ok(())
    }
}

fn tile_plan(measurement: &Path, model: &Path, options: &TileOptions, seed: u64) -> Result<tile::Plan> {
    tile::plan(&tile::Options {
        measurement: measurement.into(),
        model: model.into(),
        choice: options.tile,
        seed,
    })
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
    let (measurement, model) = (measurement.into(), model.into());
    cluster::plan(&cluster::Options { measurement, model, clusters: options.clusters, centre, limits, seed })
}

fn normals_plan(measurement: &Path, model: &Path, options: &NormalsOptions) -> Result<normals::Plan> {
    normals::plan(&normals::Options {
        measurement: measurement.into(),
        model: model.into(),
        robust: options.robust,
    })
}

fn fit_plan(model: &Path, options: &FitOptions) -> Result<fit::Plan> {
    let kind = match options.mrf {
        Field::Car3d => mrf::Kind::Car3d,
        Field::Car2d => mrf::Kind::Car2d,
    };
    fit::plan(&fit::Options { model: model.into(), kind, levels: options.levels })
}

fn tell_tile(report: &tile::Report, tell: Tell) {
    let [height, width] = report.size;
    let seams = match &report.patch {
        Some(patch) => format!(
            "from row {}, column {}; step across its seams {:.2} of an ordinary one (uncut {:.2})",
            patch.y, patch.x, report.seam_visibility, report.uncut_visibility
        ),
        None if report.wraps => format!(
            "the whole measurement; step across its borders {:.2} of an ordinary one",
            report.seam_visibility
        ),
        None => "the whole measurement, its borders do not join".to_owned(),
    };
    tell.line(format!("tile      {width}x{height} {seams}"));
}

fn tell_clusters(report: &cluster::Report, tell: Tell) {
    let error = report.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
    tell.line(format!(
        "clusters  {} after {} passes; mean weighted |dL*| {error:.3} from centres, {:.3} from representatives",
        report.clusters,
        report.passes.len(),
        report.representative_lightness_error
    ));
    let stored = report.representative_bytes + report.index_bytes;
    let ratio = |bytes: u64| bytes as f64 / stored as f64;
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
    tell.line(format!(
        "normals   by {} lights of view {}; mean ({x:.3}, {y:.3}, {z:.3}), spread {:.1} degrees",
        report.lights, report.view, report.spread_deg
    ));
}

fn tell_field(report: &FieldReport, tell: Tell) {
    let levels: Vec<String> = report
        .levels
        .iter()
        .map(|level| {
            format!("{}x{} eta {} radius {:.3}", level.size[1], level.size[0], level.eta, level.radius)
        })
        .collect();
    tell.line(format!("field     {} CAR; {}", report.mrf, levels.join(", ")));
    for (number, level) in report.levels.iter().enumerate() {
        if let Some(note) = &level.note {
            tell.line(format!("          level {number}: {note}"));
        }
    }
}

impl Compare {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        self.picture.as_deref().map(Ending::of).transpose()?;
        let options = compare::Options { model: self.model.clone(), measurement: self.measurement.clone() };
        let report = compare::run(&options, context)?;
        if self.json {
            let value = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
            tell.plan(&value)?;
        } else {
            let mut rows = vec![row!["view theta", "views", "mean |dL*|", "PSNR dB", "CIEDE2000"]];
            for errors in report.elevations.iter().chain([&report.all]) {
                rows.push(row![
                    errors.view_theta_deg.map_or("all".to_owned(), |theta| format!("{theta}")),
                    errors.views,
                    format!("{:.3}", errors.lightness),
                    format!("{:.2}", errors.psnr_db),
                    format!("{:.3}", errors.ciede2000)
                ]);
            }
            tell.line(table(&rows));
            tell.line(format!("CIEDE2000 over {} texels, the other figures over all", report.colour_texels));
        }
        match &self.picture {
            Some(path) => self.side_by_side(context)?.write(path),
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

use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::method::cluster::centre::CentreRule;
use btfkit::method::cluster::lloyd::Limits;
use btfkit::picture::Ending;
use btfkit::run::Context;
use btfkit::stage::cluster::curve;
use btfkit::store::{measurement, model};
use btfkit::words::counted;
use clap::Args;

use super::given::expect_in_order;
use super::table::{row, table};
use super::{Console, as_json, bytes_text};

/// Show the error and the compression that 1, 2, 4, 8 ... clusters would give
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf tile wood.zarr wood.model.zarr && btf curve wood.zarr wood.model.zarr
  btf curve wood.zarr wood.model.zarr --most 256 --picture curve.png
  btf curve wood.zarr wood.model.zarr --json > curve.json
For 1, 2, 4 ... clusters it prints the weighted mean |dL*| from texels to the centres of their clusters, the bytes of
representatives and index, and how many times smaller than the raw measurement they are. If the tile does not fit in 192
MiB, a sample of it is clustered. The model does not change; choose a number, then run btf cluster --clusters N.")]
pub(super) struct Curve {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    /// Also write a chart: .png, .jpg, .webp or .tif
    #[arg(long, alias = "out", value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// The largest number of clusters to try; never more than a quarter of the texels
    #[arg(long, default_value_t = 1024, value_name = "N")]
    most: usize,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
}

impl Curve {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        expect_in_order(
            [(&self.measurement, &[measurement::KIND]), (&self.model, &[model::KIND])],
            &format!("btf curve {} {}", self.model.display(), self.measurement.display()),
        )?;
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
        let plan = curve::plan(&curve::Options {
            measurement: self.measurement.clone(),
            model: self.model.clone(),
            most: self.most,
            // As btf cluster does unless told otherwise.
            centre: CentreRule::Median,
            limits: Limits::default(),
            seed: self.seed,
        })?;
        let curve = plan.run(context)?;
        if self.json {
            let value = as_json(&curve)?;
            console.plan(&value)?;
        } else {
            print_curve(&curve, console);
        }
        if let Some(path) = &self.picture {
            curve.chart().draw().write(path, context.existing)?;
        }
        Ok(())
    }
}

fn print_curve(curve: &curve::Curve, console: Console) {
    let mut rows = vec![row!["clusters", "mean |dL*|", "size", "of raw measurement"]];
    for point in &curve.points {
        rows.push(row![
            point.clusters,
            format!("{:.3}", point.mean_lightness_error),
            bytes_text(point.bytes),
            curve::ratio_text(point.ratio)
        ]);
    }
    console.text(&table(&rows));
    if curve.sample_texels < curve.tile_texels {
        console.line(format!(
            "of a sample of {} of {}",
            curve.sample_texels,
            counted(curve.tile_texels, "texel")
        ));
    }
}

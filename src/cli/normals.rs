use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::normals;
use btfkit::store::{measurement, model};
use btfkit::words::counted;
use clap::Args;

use super::Console;
use super::given::expect_in_order;

#[derive(Args)]
pub(super) struct NormalsOptions {
    /// At each texel, leave out the lights under which it is in shadow or shows a highlight
    #[arg(long)]
    robust: bool,
}

/// Estimate the normal map of a model's tile by photometric stereo
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf normals wood.zarr wood.model.zarr
  btf normals wood.zarr wood.model.zarr --robust    for materials with shadows or highlights")]
pub(super) struct Normals {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    #[command(flatten)]
    options: NormalsOptions,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

impl Normals {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        expect_in_order(
            [(&self.measurement, &[measurement::KIND]), (&self.model, &[model::KIND])],
            &format!("btf normals {} {}", self.model.display(), self.measurement.display()),
        )?;
        let plan = normals_plan(&self.measurement, &self.model, &self.options)?;
        if self.dry_run {
            return console.plan(&plan.summary());
        }
        let found = plan.is_done();
        print_normals(&plan.run(context)?, console.found(found));
        Ok(())
    }
}

pub(super) fn normals_plan(
    measurement: &Path,
    model: &Path,
    options: &NormalsOptions,
) -> Result<normals::Plan> {
    normals::plan(&normals::Options {
        measurement: measurement.into(),
        model: model.into(),
        robust: options.robust,
    })
}

pub(super) fn print_normals(report: &normals::Report, console: Console) {
    let [x, y, z] = report.mean;
    let lights = counted(report.lights, "light");
    console.stage(
        "normals",
        &format!(
            "by {lights} of view {}; mean ({x:.3}, {y:.3}, {z:.3}), spread {:.1} degrees",
            report.view, report.spread_deg
        ),
    );
}

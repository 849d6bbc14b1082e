use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::components::{self, MOST_COMPONENTS, USUAL_COMPONENTS};
use btfkit::words::counted;
use clap::Args;

use super::{Console, bytes_text};

/// Find the principal components of a model's tile: they hold its values more sharply than clusters of the same size
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf components wood.zarr wood.model.zarr
  btf components wood.zarr wood.model.zarr --components 128    for a packed model of high quality
A value of a texel is the mean plus the sum of its coefficients times the basis, on the sRGB curve. `btf pack` writes \
them as one small file, and `btf image --values components` shows them.")]
pub(super) struct Components {
    /// The measurement
    measurement: PathBuf,
    /// The model with the tile
    model: PathBuf,
    /// How many components; fewer if the tile has no more
    #[arg(long, value_name = "N", default_value_t = USUAL_COMPONENTS as u32)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=MOST_COMPONENTS as i64))]
    components: u32,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

impl Components {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let plan = components::plan(&components::Options {
            measurement: self.measurement.clone(),
            model: self.model.clone(),
            components: self.components as usize,
        })?;
        if self.dry_run {
            return console.plan(&plan.summary());
        }
        let found = plan.is_done();
        let report = plan.run(context)?;
        let quality = report.psnr_db.map_or("exact".to_owned(), |psnr| format!("PSNR {psnr:.2} dB"));
        console.found(found).stage(
            "components",
            &format!(
                "{}, {quality}, {} of {} in the tile",
                counted(report.components, "component"),
                bytes_text(report.bytes),
                bytes_text(report.tile_bytes)
            ),
        );
        console.notes(report.note().as_slice());
        Ok(())
    }
}

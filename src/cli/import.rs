use std::path::PathBuf;

use btfkit::color::Transfer;
use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::import;
use clap::{Args, ValueEnum};

use super::{Tell, bytes_text};

/// Archive to measurement: a UBO2003 zip, or folders of its images
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf import UBO_WOOD256.zip
  btf import MANYFILES/ wood.zarr --threads 2
Interrupted, the same command goes on with the views that are missing.")]
pub(super) struct Import {
    /// A zip or a folder
    archive: PathBuf,
    /// The measurement to make [default: the archive's name with .zarr, here]
    store: Option<PathBuf>,
    /// Transfer curve of the samples
    #[arg(long, value_enum, default_value = "srgb")]
    transfer: Curve,
    /// Reflectance that counts as L* = 100
    #[arg(long, default_value_t = 1.0, value_parser = parse_white)]
    white: f64,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Curve {
    Srgb,
    Linear,
}

fn parse_white(text: &str) -> std::result::Result<f64, String> {
    let white: Option<f64> = text.parse().ok().filter(|white: &f64| (1e-3..=1e3).contains(white));
    white.ok_or_else(|| format!("expected a reflectance from 0.001 to 1000, got {text:?}"))
}

impl Import {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let store = self.store.clone().unwrap_or_else(|| {
            PathBuf::from(format!("{}.zarr", self.archive.file_stem().unwrap_or_default().to_string_lossy()))
        });
        let transfer = match self.transfer {
            Curve::Srgb => Transfer::Srgb,
            Curve::Linear => Transfer::Linear,
        };
        let options = import::Options {
            archive: self.archive.clone(),
            store: store.clone(),
            transfer,
            white: self.white,
        };
        let plan = import::plan(&options)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        let report = plan.run(context)?;
        let description = plan.description();
        tell.line(format!(
            "{}: {} views x {} lights of {}, {} raw; {} views written, {} found done, {} samples clipped at white",
            store.display(),
            description.views.len(),
            description.lights.len(),
            description.size,
            bytes_text(description.bytes()),
            report.views_written,
            report.views_found,
            report.clipped
        ));
        Ok(())
    }
}

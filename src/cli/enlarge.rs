use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::enlarge;
use clap::Args;

use super::{Tell, bytes_text};

/// Model to enlarged index of any size
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf enlarge wood.model.zarr wood-4k.zarr --size 4096x4096
  btf enlarge wood.model.zarr other.zarr --size 1024x1024 --seed 2 --keep-normals
Interrupted, the same command goes on. The same model, size and seed give the same bytes
whatever the threads, the band and the interruptions.")]
pub(super) struct Enlarge {
    /// The model
    model: PathBuf,
    /// The enlarged index to make
    output: PathBuf,
    /// Its size, WIDTHxHEIGHT
    #[arg(long)]
    size: Size,
    /// Seed of the noise; another seed gives another piece of the same material
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of nearest normals among which (25) chooses, n_k
    #[arg(long, default_value_t = 16)]
    candidates: usize,
    /// Keep the synthesised normals beside the index
    #[arg(long)]
    keep_normals: bool,
    /// Rows treated at a time; changes memory, not the result [default: as many as fit 64 MiB]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    band: Option<u32>,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
}

impl Enlarge {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = enlarge::plan(&enlarge::Options {
            model: self.model.clone(),
            output: self.output.clone(),
            size: self.size,
            seed: self.seed,
            candidates: self.candidates,
            keep_normals: self.keep_normals,
            band_rows: self.band.map(|rows| rows as usize),
        })?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        let report = plan.run(context)?;
        tell.line(format!(
            "{}: {} from seed {}; {} rows of shards written, {} found done",
            self.output.display(),
            self.size,
            self.seed,
            report.shard_rows_written,
            report.shard_rows_found
        ));
        tell.line(format!(
            "size      index + representatives {}: 1:{:.0} of the raw enlarged BTF of {}",
            bytes_text(report.stored_bytes),
            report.raw_bytes as f64 / report.stored_bytes as f64,
            bytes_text(report.raw_bytes)
        ));
        Ok(())
    }
}

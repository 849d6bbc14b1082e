use std::ops::RangeInclusive;
use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::enlarge;
use clap::Args;

use super::{Tell, bytes_text};

/// The most outputs that one command makes.
const MOST_SEEDS: u64 = 1 << 16;

/// Model to enlarged index of any size
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf enlarge wood.model.zarr wood-4k.zarr --size 4096x4096
  btf enlarge wood.model.zarr other.zarr --size 1024x1024 --seed 2 --keep-normals
  btf enlarge wood.model.zarr wood.zarr --size 2048x2048 --seed 1..8     makes wood-1.zarr to wood-8.zarr
  btf enlarge wood.model.zarr tile.zarr --size 1024x1024 --tileable      joins at its own borders
Interrupted, the same command goes on from the last row of shards (512 texels). The same model,
size and seed give the same bytes whatever the memory, the threads, the band and the interruptions.")]
pub(super) struct Enlarge {
    /// The model
    model: PathBuf,
    /// The enlarged index to make; with several seeds each has its number in its name
    output: PathBuf,
    /// Its size, WIDTHxHEIGHT
    #[arg(long)]
    size: Size,
    /// Seed of the noise; another seed gives another piece of the same material. FIRST..LAST makes one of each,
    /// the last too
    #[arg(long, default_value = "1", value_parser = seeds)]
    seed: RangeInclusive<u64>,
    /// Number of nearest normals among which (25) chooses, n_k
    #[arg(long, default_value_t = 16)]
    candidates: usize,
    /// Make an output that joins at its own borders; its sides must then be multiples of a power of two, which
    /// is told if they are not
    #[arg(long)]
    tileable: bool,
    /// Keep the synthesised normals beside the index
    #[arg(long)]
    keep_normals: bool,
    /// Rows treated at a time; changes memory, not the result [default: as many as fit 2 MiB]
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
            seeds: self.seed.clone(),
            candidates: self.candidates,
            tileable: self.tileable,
            keep_normals: self.keep_normals,
            band_rows: self.band.map(|rows| rows as usize),
        })?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        for report in plan.run(context)? {
            tell.line(format!(
                "{}: {} from seed {}; {} rows of shards written, {} found done",
                report.output.display(),
                self.size,
                report.seed,
                report.shard_rows_written,
                report.shard_rows_found
            ));
            tell.line(format!(
                "size      index + representatives {}: 1:{:.0} of the raw enlarged BTF of {}",
                bytes_text(report.stored_bytes),
                report.raw_bytes as f64 / report.stored_bytes as f64,
                bytes_text(report.raw_bytes)
            ));
        }
        Ok(())
    }
}

/// `7`, or `1..8` for eight seeds.
fn seeds(text: &str) -> std::result::Result<RangeInclusive<u64>, String> {
    let expected = || format!("expected a number, or FIRST..LAST such as 1..8, got {text:?}");
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let number = |part: &str| part.trim().trim_start_matches('=').parse::<u64>().map_err(|_| expected());
    let (first, last) = (number(first)?, number(last)?);
    if first > last || last - first >= MOST_SEEDS {
        return Err(format!(
            "{first}..{last}: the first must not be above the last, and at most {MOST_SEEDS} are made"
        ));
    }
    Ok(first..=last)
}

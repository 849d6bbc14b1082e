use std::path::PathBuf;

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::stage::status::{self, Status};
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::each::{Ended, Line, each};
use super::{Console, as_json};

/// Show how much of a store is there: for jobs that share the work, and for people who wait
#[derive(Args)]
#[command(after_help = "\
Only the disk is looked at, and no sample is read: btf verify looks for damage.

Examples:
  btf status wood.zarr
  btf status stores/*.zarr --json       one object per line
  btf status wood-4k.dzi                a Deep Zoom pyramid
The exit code is 0 if everything is there, and 66 if something is missing.")]
pub(super) struct StatusOf {
    /// Measurements, models, enlargements and Deep Zoom pyramids (.dzi); each gets one line
    #[arg(required = true, value_name = "STORE")]
    stores: Vec<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

impl StatusOf {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<Ended> {
        let name = |store: &PathBuf| store.display().to_string();
        let one = |store: &PathBuf| {
            let status = status::of(store)?;
            let line = if self.json { Line::Json(as_json(&status)?) } else { Line::Text(in_short(&status)) };
            let left = (!status.is_complete()).then(|| {
                Error::missing(format!("{}: {}", store.display(), in_short(&status)))
                    .hint("run the command that makes it again: it goes on")
            });
            Ok((line, left))
        };
        match self.stores.as_slice() {
            [store] => {
                let (line, left) = one(store)?;
                match (line, left) {
                    (Line::Json(value), left) => {
                        console.plan(&value)?;
                        left.map_or(Ok(Ended::Done), Err)
                    }
                    (Line::Text(_), Some(left)) => Err(left),
                    (Line::Text(text), None) => {
                        console.line(format!("{}: {text}", store.display()));
                        Ok(Ended::Done)
                    }
                }
            }
            stores => each(stores, name, self.json, context, console, one),
        }
    }
}

fn in_short(status: &Status) -> String {
    let Status { kind, unit, units, done, .. } = status;
    let end = match (done == units, status.finished) {
        (true, false) => ", not declared finished",
        _ => "",
    };
    format!("{kind}, {done} of {}{end}", counted(*units, unit))
}

/// How numbers are written.
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// As the arrays of Slurm are: 3,7-9.
    Array,
    /// One a line.
    Lines,
}

/// Print which of N shards of a store have something left to do, to run just these again
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf missing wood.zarr --shards 100                              such as 3,7-9; nothing if all is there
  sbatch --array=$(btf missing wood.zarr --shards 100) import.sh  these parts again, each with --shard K/100
  btf missing wood-4k.dzi --shards 8                              of a pyramid that btf export makes in parts
  btf missing wood.zarr --shards 100 --format lines | parallel btf import wood.zip wood.zarr --shard {}/100
The exit code is 0 also if something is missing; btf status says 66 then.")]
pub(super) struct Missing {
    /// A measurement, an enlargement or a Deep Zoom pyramid (.dzi)
    store: PathBuf,
    /// Number of shards that the work was divided into, N of --shard K/N
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shards: u32,
    /// How to write them
    #[arg(long, value_enum, default_value = "array")]
    format: Format,
}

impl Missing {
    pub(super) fn run(&self, console: Console) -> Result<()> {
        let status = status::of(&self.store)?;
        if status.unit == "stage" {
            return Err(Error::usage(format!(
                "{}: the stages of a model are no shards of each other",
                self.store.display()
            ))
            .hint("btf status says which are there; btf model runs those that are missing"));
        }
        let left = status.shards_left(self.shards as usize);
        match self.format {
            _ if left.is_empty() => {}
            Format::Array => console.as_it_is(&status::as_array(&left)),
            Format::Lines => left.iter().for_each(|number| console.as_it_is(&number.to_string())),
        }
        Ok(())
    }
}

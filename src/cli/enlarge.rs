use std::ops::RangeInclusive;
use std::path::PathBuf;

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::shape::Size;
use btfkit::stage::enlarge::patches::Pieces;
use btfkit::stage::enlarge::{self, By, Report, Verdict, coherent, paper, patches, quilt};
use btfkit::store::model;
use clap::{Args, ValueEnum};

use super::each::{Ended, Line, each};
use super::given::Given;
use super::outputs::{Naming, Pair};
use super::{Console, bytes_text, number};

/// Tiles of a set, unless their number is given.
const TILES: usize = 4;

/// The most outputs that one command makes.
const MOST_SEEDS: u64 = 1 << 16;

/// Make a surface of any size from a model
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf enlarge wood.model.zarr wood-4k.zarr --size 4096x4096
  btf enlarge wood.model.zarr other.zarr --size 1024x1024 --seed 2
  btf enlarge wood.model.zarr wood.zarr --size 2048x2048 --seed 1..8     makes wood-1.zarr to wood-8.zarr
  btf enlarge wood.model.zarr tile.zarr --size 1024x1024 --tileable      can be repeated without seams
  btf enlarge wood.model.zarr huge.zarr --size 65536x65536 --shard 3/8   one of eight jobs that share the work
  btf enlarge wood.model.zarr paper.zarr --size 1024x1024 --method paper the method of the paper
  btf enlarge wood.model.zarr laid.zarr --size 1024x1024 --method tiles --tiles 2    two tiles that join each other
  btf enlarge wood.model.zarr quilt.zarr --size 1024x1024 --method quilt image quilting
  btf enlarge models/*.model.zarr --into planes --size 2048x2048         many models, wood.enlarged.zarr and so on
The same model, method, size and seed always give the same bytes. Memory, threads, shards and interruptions change
nothing. If it is interrupted, run the same command again: it goes on with what is missing.")]
pub(super) struct Enlarge {
    /// The model, and the enlargement to make [default: the model's name with .enlarged.zarr]; or many models. With
    /// several seeds, each output has its seed in its name
    #[arg(required = true, value_name = "MODEL")]
    paths: Vec<PathBuf>,
    /// Make one enlargement for each model, in this folder [default: beside each model]
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Size of the output in texels, WIDTHxHEIGHT, each from 1 to 16777216
    #[arg(long, allow_hyphen_values = true)]
    size: Size,
    /// How to enlarge
    #[arg(long, value_enum, default_value = "coherent")]
    method: Method,
    /// Seed of all random choices: another seed gives another piece of the same material. FIRST..LAST makes one output
    /// per seed, the last included
    #[arg(long, default_value = "1", value_parser = seeds, allow_hyphen_values = true)]
    seed: RangeInclusive<u64>,
    /// Make a surface that can be repeated without seams (with paper, nearly). Its sides must be multiples of a power of
    /// two (coherent, paper), of the tile's sides (repeat, tiles) or of a part of them (roller, quilt). For any other
    /// size, the error names the nearest sizes that fit
    #[arg(long)]
    tileable: bool,
    /// Make only part K of N, K from 0, so that N jobs share the work, in any order (all but paper, quilt); `env` takes
    /// both from the variables of Slurm or MPI
    #[arg(long, value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// How far pieces are shifted at random, from 0 to 1 (coherent). With more, the surface repeats less; with less, the
    /// pieces fit better [default: 0.5, and 0 for regular materials]
    #[arg(long, value_parser = number::jitter)]
    jitter: Option<u32>,
    /// Do not store the array `source`, which says which texel of the tile each texel was copied from (all but paper)
    #[arg(long)]
    no_source: bool,
    /// Also store a normal map: the tile's normals, or (paper) those drawn from the field
    #[arg(long)]
    keep_normals: bool,
    /// Number of tiles that join each other (tiles) [default: 4]
    #[arg(long, value_name = "N")]
    tiles: Option<usize>,
    /// Number of nearest normals to choose from (paper) [default: 16, or all of a smaller tile]
    #[arg(long)]
    candidates: Option<usize>,
    /// Number of rows computed at a time (paper); changes memory, not the result [default: as many as fit 2 MiB]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    band: Option<u32>,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Continues pieces of the tile so that they fit; keeps structure
    Coherent,
    /// The method of Filip and Haindl 2007: normals from a random field, and the clusters with the nearest normals
    Paper,
    /// Repeats the tile
    Repeat,
    /// Lays several tiles with one common border at random
    Tiles,
    /// Joins patches from random places of the tile on a grid, along minimum-error paths
    Roller,
    /// Image quilting (Efros and Freeman 2001): block after block, each chosen to fit
    Quilt,
}

impl Enlarge {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<Ended> {
        self.refuse_options_of_others(given)?;
        let naming = Naming { reads: model::KIND, ending: Some(".model.zarr"), becomes: ".enlarged.zarr" };
        let pairs = naming.pairs(&self.paths, self.into.as_deref())?;
        if let [pair] = pairs.as_slice() {
            print_reports(&self.one(pair, context, console)?, self.size, console);
            return Ok(Ended::Done);
        }
        let name = |pair: &Pair| pair.input.display().to_string();
        each(&pairs, name, false, context, console, |pair| {
            let reports = self.one(pair, context, console)?;
            let mut told = Vec::new();
            for report in &reports {
                told.push(in_short(report, self.size));
                let warnings = report.verdict.iter().flat_map(|verdict| &verdict.warnings);
                told.extend(warnings.map(|warning| format!("warning: {warning}")));
            }
            Ok((Line::Text(if told.is_empty() { "planned".to_owned() } else { told.join("; ") }), None))
        })
    }

    /// Makes the outputs of one model; none where only the plan was asked for.
    fn one(&self, pair: &Pair, context: &Context<'_>, console: Console) -> Result<Vec<Report>> {
        let plan = enlarge::plan(&enlarge::Options {
            model: pair.input.clone(),
            output: pair.output.clone(),
            size: self.size,
            seeds: self.seed.clone(),
            tileable: self.tileable,
            by: self.by(),
            shard: self.shard,
        })?;
        if self.dry_run {
            console.plan(&plan.summary(context))?;
            return Ok(Vec::new());
        }
        plan.run(context)
    }

    /// Refuses options that the method does not take.
    fn refuse_options_of_others(&self, given: &Given) -> Result<()> {
        use Method::{Coherent, Paper, Quilt, Repeat, Roller, Tiles};
        let options: [(bool, &str, &[Method]); 6] = [
            (given.has("seed"), "--seed", &[Coherent, Paper, Tiles, Roller, Quilt]),
            (self.jitter.is_some(), "--jitter", &[Coherent]),
            (self.no_source, "--no-source", &[Coherent, Repeat, Tiles, Roller, Quilt]),
            (self.tiles.is_some(), "--tiles", &[Tiles]),
            (self.candidates.is_some(), "--candidates", &[Paper]),
            (self.band.is_some(), "--band", &[Paper]),
        ];
        let name = |method: &Method| format!("{method:?}").to_lowercase();
        match options.iter().find(|(given, _, methods)| *given && !methods.contains(&self.method)) {
            None => Ok(()),
            Some((_, option, methods)) => {
                let takers: Vec<String> = methods.iter().map(name).collect();
                let method = name(&self.method);
                Err(Error::usage(format!("got {option}, which --method {method} does not take"))
                    .hint(format!("leave it out, or choose --method {}", takers.join(" or "))))
            }
        }
    }

    fn by(&self) -> By {
        let (keep_source, keep_normals) = (!self.no_source, self.keep_normals);
        match self.method.usual() {
            By::Paper(_) => By::Paper(paper::Options {
                candidates: self.candidates,
                keep_normals,
                band_rows: self.band.map(|rows| rows as usize),
            }),
            By::Coherent(_) => {
                By::Coherent(coherent::Options { jitter: self.jitter, keep_source, keep_normals })
            }
            By::Patches(patches::Options { pieces, .. }) => {
                let pieces = match (pieces, self.tiles) {
                    (Pieces::Tiles(_), Some(count)) => Pieces::Tiles(count),
                    (usual, _) => usual,
                };
                By::Patches(patches::Options { pieces, keep_source, keep_normals })
            }
            By::Quilt(_) => By::Quilt(quilt::Options { keep_source, keep_normals }),
        }
    }
}

impl Method {
    /// The method, with the options that it has unless they are given.
    pub(super) fn usual(self) -> By {
        let (keep_source, keep_normals) = (true, false);
        let pieces = |pieces| By::Patches(patches::Options { pieces, keep_source, keep_normals });
        match self {
            Self::Paper => By::Paper(paper::Options { candidates: None, keep_normals, band_rows: None }),
            Self::Coherent => By::Coherent(coherent::Options { jitter: None, keep_source, keep_normals }),
            Self::Repeat => pieces(Pieces::Repeat),
            Self::Tiles => pieces(Pieces::Tiles(TILES)),
            Self::Roller => pieces(Pieces::Roller),
            Self::Quilt => By::Quilt(quilt::Options { keep_source, keep_normals }),
        }
    }
}

fn print_reports(reports: &[Report], size: Size, console: Console) {
    for report in reports {
        console.line(in_short(report, size));
        console.line(format!(
            "size      index + representatives {}: 1:{:.0} of the raw enlarged BTF of {}",
            bytes_text(report.stored_bytes),
            report.raw_bytes as f64 / report.stored_bytes as f64,
            bytes_text(report.raw_bytes)
        ));
        if let Some(verdict) = &report.verdict {
            print_verdict(verdict, console);
        }
    }
}

/// What was made, in a line.
fn in_short(report: &Report, size: Size) -> String {
    format!(
        "{}: {size} from seed {}; {}: {} written, {} found done",
        report.output.display(),
        report.seed,
        report.unit,
        report.written,
        report.found
    )
}

/// One line on whether an enlargement looks like its tile, and one for each warning.
fn print_verdict(verdict: &Verdict, console: Console) {
    let copy = match verdict.counted.largest_copy {
        Some(copy) => format!(", largest unbroken copy {:.1} % of the middle", 100.0 * copy),
        None => String::new(),
    };
    console.line(format!(
        "likeness  {:.0} % of the clusters' shares as in the tile, repetition {:+.2}{copy}",
        100.0 * verdict.counted.shares,
        verdict.excess_peak
    ));
    for warning in &verdict.warnings {
        console.line(format!("warning   {warning}"));
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

use std::path::Path;

use btfkit::error::Result;
use btfkit::picture::deepzoom::Encoding;
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::stage::deepzoom;
use btfkit::stage::image::Subject;
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::given::Given;
use super::scene::SceneArgs;
use super::{Console, as_json};

/// JPEG quality of tiles, unless one is given.
const QUALITY: u8 = 90;

/// How to write a Deep Zoom pyramid.
#[derive(Args)]
#[command(next_help_heading = "Deep Zoom")]
pub(super) struct Deepzoom {
    /// Write a picture as a pyramid of tiles: NAME.dzi, NAME_files, and a viewer NAME.html
    #[arg(long)]
    deepzoom: bool,
    #[command(flatten)]
    scene: SceneArgs,
    /// Format of the tiles
    #[arg(long, value_enum, default_value = "png")]
    format: TileFormat,
    /// Side of a tile in pixels, without its overlap
    #[arg(long, default_value_t = deepzoom::TILE_SIDE, value_name = "PIXELS")]
    tile_size: usize,
    /// Pixels by which neighbouring tiles overlap
    #[arg(long, default_value_t = deepzoom::OVERLAP, value_name = "PIXELS")]
    overlap: usize,
    /// Encode only the tiles of part K of N of the rows, K from 0, so that N jobs share the work, in any order; `env`
    /// takes both from the variables of Slurm or MPI
    #[arg(long, value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum TileFormat {
    Png,
    Jpeg,
}

impl Deepzoom {
    /// Whether it is meant.
    pub(super) fn is_meant(&self, output: &Path) -> bool {
        self.deepzoom || output.extension().is_some_and(|ending| ending == "dzi")
    }

    /// Refuses options that would change nothing.
    pub(super) fn refuse_idle(&self, given: &Given, source: &Path) -> Result<()> {
        self.scene.refuse_idle(given, source, true)
    }

    /// Whether tiles are JPEGs, which have a quality.
    pub(super) fn is_jpeg(&self) -> bool {
        matches!(self.format, TileFormat::Jpeg)
    }

    pub(super) fn run(
        &self,
        source: &Path,
        output: &Path,
        quality: Option<u8>,
        context: &Context<'_>,
        console: Console,
    ) -> Result<()> {
        let plan = deepzoom::plan(
            &deepzoom::Options {
                picture: self
                    .scene
                    .options(source, Subject::Appearance { view: self.scene.view, light: self.scene.light }),
                exposure: self.scene.exposure,
                output: output.to_owned(),
                encoding: match self.format {
                    TileFormat::Png => Encoding::Png,
                    TileFormat::Jpeg => Encoding::Jpeg(quality.unwrap_or(QUALITY)),
                },
                tile_side: self.tile_size,
                overlap: self.overlap,
                shard: self.shard,
            },
            context,
        )?;
        if self.dry_run {
            return console.plan(&plan.summary(context));
        }
        let report = plan.run(context)?;
        if self.json {
            let value = as_json(&report)?;
            return console.plan(&value);
        }
        let [width, height] = report.size;
        console.line(format!(
            "{}: {width}x{height} in {}; {} written, {} found done",
            output.display(),
            counted(report.levels, "level"),
            counted(report.tiles_written, "tile"),
            report.tiles_found
        ));
        if report.complete {
            console.line(format!("{}: a viewer of it", output.with_extension("html").display()));
        } else {
            console.line("tiles of other parts are missing; the viewer comes with the last of them");
        }
        console.notes(&report.notes);
        Ok(())
    }
}

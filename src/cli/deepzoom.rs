use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::stage::deepzoom::{self, Encoding};
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::Tell;

/// JPEG quality of tiles, unless one is given.
const QUALITY: u8 = 90;

/// How to write a Deep Zoom pyramid.
#[derive(Args)]
#[command(next_help_heading = "Deep Zoom")]
pub(super) struct Deepzoom {
    /// A picture as a pyramid of tiles: NAME.dzi, NAME_files, and a viewer NAME.html
    #[arg(long)]
    deepzoom: bool,
    /// Light: theta,phi in degrees; phi counter-clockwise from the right
    #[arg(long, default_value = "15,0")]
    light: Direction,
    /// View: theta,phi in degrees
    #[arg(long, default_value = "0,0")]
    view: Direction,
    /// Factor on the linear values
    #[arg(long, default_value_t = 1.0)]
    exposure: f64,
    /// The model of an enlarged index [default: beside it, under the name it had]
    #[arg(long)]
    model: Option<PathBuf>,
    /// Format of the tiles
    #[arg(long, value_enum, default_value = "png")]
    format: TileFormat,
    /// Side of a tile without its overlap
    #[arg(long, default_value_t = 254, value_name = "PIXELS")]
    tile_size: usize,
    /// Pixels of its neighbours that a tile holds
    #[arg(long, default_value_t = 1, value_name = "PIXELS")]
    overlap: usize,
    /// Only say what would be done
    #[arg(long)]
    dry_run: bool,
    /// Tell what was done as JSON
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

    pub(super) fn run(
        &self,
        source: &Path,
        output: &Path,
        quality: Option<u8>,
        context: &Context<'_>,
        tell: Tell,
    ) -> Result<()> {
        let plan = deepzoom::plan(&deepzoom::Options {
            source: source.to_owned(),
            model: self.model.clone(),
            view: self.view,
            light: self.light,
            exposure: self.exposure,
            output: output.to_owned(),
            encoding: match self.format {
                TileFormat::Png => Encoding::Png,
                TileFormat::Jpeg => Encoding::Jpeg(quality.unwrap_or(QUALITY)),
            },
            tile_side: self.tile_size,
            overlap: self.overlap,
        })?;
        if self.dry_run {
            return tell.plan(&plan.summary(context));
        }
        let report = plan.run(context)?;
        if self.json {
            let value = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
            return tell.plan(&value);
        }
        let [width, height] = report.size;
        tell.line(format!(
            "{}: {width}x{height} in {} levels; {} tiles written, {} found done",
            output.display(),
            report.levels,
            report.tiles_written,
            report.tiles_found
        ));
        tell.line(format!("{}: a viewer of it", output.with_extension("html").display()));
        Ok(())
    }
}

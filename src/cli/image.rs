use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::shape::Window;
use btfkit::stage::image;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::Tell;

/// Picture of a measurement, a model's tile or an enlarged index
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf image wood.zarr --light 15,0 --view 0,0 --out measured.png
  btf image wood-4k.zarr --light 60,90 --window 0,0,1024,1024 --out corner.exr
  btf image wood.model.zarr --what normals --out normals.png
A measured pair of directions shows the stored samples exactly (sRGB ones as they are); others are mixed in linear light
from the three views and three lights around them.")]
pub(super) struct Image {
    /// A measurement, a model or an enlarged index
    source: PathBuf,
    /// The picture: .png for displays, .exr for linear values
    #[arg(long, short)]
    out: PathBuf,
    /// What to show
    #[arg(long, value_enum, default_value = "appearance")]
    what: What,
    /// Light: theta,phi in degrees; phi counter-clockwise from the right
    #[arg(long, default_value = "15,0")]
    light: Direction,
    /// View: theta,phi in degrees
    #[arg(long, default_value = "0,0")]
    view: Direction,
    /// Part to show: x,y,width,height
    #[arg(long)]
    window: Option<Window>,
    /// Factor on the linear values
    #[arg(long, default_value_t = 1.0)]
    exposure: f64,
    /// The model of an enlarged index [default: beside it, under the name it had]
    #[arg(long)]
    model: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The material under a light
    Appearance,
    /// Cluster numbers in false colours
    Index,
    /// The normal map
    Normals,
}

impl Image {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let subject = match self.what {
            What::Appearance => image::Subject::Appearance { view: self.view, light: self.light },
            What::Index => image::Subject::Index,
            What::Normals => image::Subject::Normals,
        };
        let options = image::Options {
            source: self.source.clone(),
            model: self.model.clone(),
            subject,
            window: self.window,
        };
        let size = image::run(&options, self.exposure, &self.out, context)?;
        tell.line(format!("{}: {size}", self.out.display()));
        Ok(())
    }
}

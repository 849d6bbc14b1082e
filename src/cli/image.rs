use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::image;
use clap::{Args, ValueEnum};

use super::scene::SceneArgs;
use super::{Tell, found};

/// Picture of a measurement, a model's tile or an enlarged index
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf image wood.zarr --light 15,0 --view 0,0 --out measured.png
  btf image wood-4k.zarr --light 60,90 --window 0,0,1024,1024 --out corner.exr
  btf image wood-4k.zarr --values measured --out measured-4k.png        values of the measurement, not of clusters
  btf image wood.model.zarr --what normals --out normals.png
  btf image --plane wood.model.zarr --window -500,12345,512,512 --out piece.png
                                                                        a part of an endless plane that is not stored
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
    #[command(flatten)]
    scene: SceneArgs,
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
            What::Appearance => image::Subject::Appearance { view: self.scene.view, light: self.scene.light },
            What::Index => image::Subject::Index,
            What::Normals => image::Subject::Normals,
        };
        let options = self.scene.options(&self.source, subject);
        let (size, made) = image::run(&options, self.scene.exposure, &self.out, context)?;
        tell.line(format!("{}: {size}{}", self.out.display(), found(made)));
        Ok(())
    }
}

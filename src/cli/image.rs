use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::names::with_ending;
use btfkit::picture::{Bits, Encoding, Ending};
use btfkit::run::Context;
use btfkit::stage::image;
use clap::{Args, ValueEnum};

use super::given::{Given, kind_at};
use super::scene::SceneArgs;
use super::{Console, found};

/// Write a picture of a measurement, a model's tile or an enlargement, under any light and from any view
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf image wood.zarr --light 15,0 --view 0,0 --out measured.png
  btf image wood-4k.zarr --light 60,90 --window 0,0,1024,1024 --out corner.exr
  btf image wood-4k.zarr --values measured --out measured-4k.png        values of the measurement, not of clusters
  btf image wood.model.zarr --what normals --out normals.png
  btf image wood.zarr --out wood.jpg --quality 95
  btf image --plane wood.model.zarr --window -500,12345,512,512 --out piece.png
                                                                      a part of the endless surface of a model
For a measured view and light, the picture shows the stored samples exactly. For others, values are interpolated in
linear light from the three nearest views and the three nearest lights.")]
pub(super) struct Image {
    /// A measurement, a model, an enlargement or a packed model
    source: PathBuf,
    /// The picture: .png, .jpg, .webp or .tif for displays, .exr for linear values. PNG and EXR may have any size.
    /// JPEG has at most 65535 pixels a side, WebP 16383, and TIFF 4 GiB; these three must fit in memory
    #[arg(long, short)]
    out: PathBuf,
    /// Bits of each value; 16 for PNG and TIFF only
    #[arg(long, value_enum, default_value = "8")]
    bits: BitsName,
    /// Quality of a JPEG, 1 to 100 [default: 90]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: Option<u8>,
    /// What to show
    #[arg(long, value_enum, default_value = "appearance")]
    what: What,
    #[command(flatten)]
    scene: SceneArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum BitsName {
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The material under a light
    Appearance,
    /// Clusters in false colours: blue for dark ones, over green to yellow for light ones
    Index,
    /// The normal map
    Normals,
}

impl Image {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<()> {
        let subject = match self.what {
            What::Appearance => image::Subject::Appearance { view: self.scene.view, light: self.scene.light },
            What::Index => image::Subject::Index,
            What::Normals => image::Subject::Normals,
        };
        self.scene.refuse_idle(given, &self.source, matches!(self.what, What::Appearance))?;
        let ending = Ending::of(&self.out, &Ending::ALL).map_err(|error| match kind_at(&self.out) {
            Some(_) => error.hint(format!(
                "--out names the picture, not the store: btf image {} --out {}",
                self.source.display(),
                Path::new(&with_ending(&self.source, &[".zarr"], ".png")).display()
            )),
            None => error,
        })?;
        if ending != Ending::Jpeg {
            given.refuse_these(&["quality"], "in this format: it is that of a JPEG")?;
        }
        if ending == Ending::Exr {
            given.refuse_these(&["bits"], "in an EXR, which holds linear floats")?;
        }
        let options = self.scene.options(&self.source, subject);
        let bits = match self.bits {
            BitsName::Eight => Bits::Eight,
            BitsName::Sixteen => Bits::Sixteen,
        };
        let encoding = Encoding::of(&self.out, &Ending::ALL)?.with(Some(bits), self.quality)?;
        let report = image::run(&options, self.scene.exposure, &self.out, encoding, context)?;
        console.line(format!("{}: {}{}", self.out.display(), report.size, found(report.made)));
        console.notes(&report.notes);
        Ok(())
    }
}

use std::path::PathBuf;

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::sample::{MOST_SIDE, MaterialKind};
use btfkit::shape::Size;
use btfkit::stage::sample;
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::{Console, bytes_text, found, number};

/// Make a synthetic measurement to try things with: a zip of pictures, named as in UBO2003
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf sample leather.zip
  btf sample wood.zip --material wood --size 256x256 --seed 7
  btf sample small.zip --size 64x64 --views 13 --lights 25")]
pub(super) struct Sample {
    /// The zip to write
    archive: PathBuf,
    /// The material
    #[arg(long, value_enum, default_value = "leather")]
    material: Material,
    /// Size of the images, WIDTHxHEIGHT, each from 1 to 65536
    #[arg(long, default_value = "128x128", allow_hyphen_values = true, value_parser = size)]
    size: Size,
    /// Number of views; 81 are the directions of UBO2003
    #[arg(long, default_value_t = 81)]
    views: usize,
    /// Number of lights; 81 are the directions of UBO2003
    #[arg(long, default_value_t = 81)]
    lights: usize,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Size of cells or rings, as a multiple of the default
    #[arg(long, default_value_t = 1.0, value_parser = number::scale)]
    scale: f64,
}

fn size(text: &str) -> std::result::Result<Size, String> {
    Size::up_to(text, MOST_SIDE)
}

/// A material that can be made.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Material {
    Wood,
    Leather,
}

impl From<Material> for MaterialKind {
    fn from(material: Material) -> Self {
        match material {
            Material::Wood => Self::Wood,
            Material::Leather => Self::Leather,
        }
    }
}

impl Sample {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        if self.archive.extension().is_some_and(|ending| ending == "zarr") {
            let archive = self.archive.with_extension("zip");
            let (named, archive) = (self.archive.display(), archive.display());
            return Err(Error::usage(format!("{named}: btf sample writes a zip, which is no store"))
                .hint(format!("btf sample {archive}, then btf import {archive} {named}")));
        }
        let ending = self.archive.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let is_folder = self.archive.is_dir() || self.archive.to_string_lossy().ends_with('/');
        if is_folder || ending.is_some_and(|ending| ending != "zip") {
            let name = match is_folder {
                true => self.archive.join("sample.zip"),
                false => self.archive.with_extension("zip"),
            };
            let what = if is_folder { "a folder" } else { "another ending" };
            return Err(Error::usage(format!(
                "{}: got {what}, expected the name of a zip, which is what btf sample writes",
                self.archive.display()
            ))
            .hint(format!("btf sample {}", name.display())));
        }
        let report = sample::run(
            &sample::Options {
                archive: self.archive.clone(),
                kind: self.material.into(),
                size: self.size,
                views: self.views,
                lights: self.lights,
                seed: self.seed,
                scale: self.scale,
            },
            context,
        )?;
        console.line(format!(
            "{}: {}, {}{}",
            self.archive.display(),
            counted(report.images, "image"),
            bytes_text(report.bytes),
            found(report.made)
        ));
        Ok(())
    }
}

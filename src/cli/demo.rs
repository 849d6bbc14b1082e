use std::path::PathBuf;

use btfkit::demo;
use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::sample::Kind;
use clap::{Args, ValueEnum};

use super::Tell;

/// The whole method on a made material: sample, import, model, enlarge, pictures and a page
#[derive(Args)]
pub(super) struct Demo {
    /// Folder for everything that is made
    #[arg(default_value = "demo")]
    folder: PathBuf,
    /// Which material
    #[arg(long, value_enum, default_value = "leather")]
    material: Material,
}

#[derive(Clone, Copy, ValueEnum)]
enum Material {
    Wood,
    Leather,
}

impl Demo {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let kind = match self.material {
            Material::Wood => Kind::Wood,
            Material::Leather => Kind::Leather,
        };
        let page = demo::run(&demo::Options { folder: self.folder.clone(), kind }, context)?;
        tell.line(format!("open {} in a browser", page.display()));
        Ok(())
    }
}

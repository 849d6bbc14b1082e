use std::path::PathBuf;

use btfkit::demo;
use btfkit::error::Result;
use btfkit::run::Context;
use clap::Args;

use super::Console;
use super::sample::Material;
use super::table::{row, table};

/// Run the whole method on a synthetic material, and make a page of pictures that explains it
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf demo
  btf demo wood-demo --material wood
It takes about a minute and 1 GB of disk. If it is interrupted, run the same command again.")]
pub(super) struct Demo {
    /// Folder for all results
    #[arg(default_value = "demo")]
    folder: PathBuf,
    /// The material
    #[arg(long, value_enum, default_value = "leather")]
    material: Material,
}

impl Demo {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let options = demo::Options { folder: self.folder.clone(), kind: self.material.into() };
        let report = demo::run(&options, context)?;
        let rows: Vec<_> =
            report.steps.iter().map(|step| row![step.name, format!("{:.2} s", step.seconds)]).collect();
        console.text(&table(&rows));
        console.line(format!("open {} in a browser", report.page.display()));
        Ok(())
    }
}

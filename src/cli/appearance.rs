use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::appearance;
use btfkit::store::appearance::AppearanceReport;
use clap::Args;

use super::Tell;

/// Describe how a model's exemplar looks, for `btf enlarge`
#[derive(Args)]
#[command(after_help = "\
Example:
  btf appearance wood.model.zarr
`btf model` does this too. Models of older versions need it once before they can be enlarged by the default method.")]
pub(super) struct Appearance {
    /// The model with the clusters
    model: PathBuf,
    /// Only print what would be done
    #[arg(long)]
    dry_run: bool,
}

impl Appearance {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let plan = appearance_plan(&self.model)?;
        if self.dry_run {
            return tell.plan(&plan.summary());
        }
        tell_appearance(&plan.run(context)?, tell);
        Ok(())
    }
}

pub(super) fn appearance_plan(model: &Path) -> Result<appearance::Plan> {
    appearance::plan(&appearance::Options { model: model.into() })
}

pub(super) fn tell_appearance(report: &AppearanceReport, tell: Tell) {
    let [_, _, height, width] = report.exemplar;
    let coarsest = report.levels.last().map_or(1, |level| level.spacing);
    tell.line(format!(
        "exemplar  {width}x{height}, described at {} levels from 1 to {coarsest} texels apart",
        report.levels.len()
    ));
}

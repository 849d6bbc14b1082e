use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::lattice::{LatticeChoice, WaveCounts};
use btfkit::run::Context;
use btfkit::stage::appearance;
use btfkit::store::model::appearance::AppearanceReport;
use btfkit::words::counted;
use clap::Args;

use super::Console;
use super::tile::steps;

/// Fewer cells than this in a direction, and large pieces of an enlargement are copies.
const FEW_CELLS: u64 = 4;

/// Prepare a model for `btf enlarge`: describe how the surroundings of each texel look
#[derive(Args)]
#[command(after_help = "\
Example:
  btf appearance wood.model.zarr
`btf model` does this too. Models of older versions need it once before they can be enlarged by the default method.")]
pub(super) struct Appearance {
    /// The model with the clusters
    model: PathBuf,
    /// Steps from cell to cell of a regular material, in texels: dy,dx;dy,dx (weaves), dy,dx (ribs), none, or auto
    /// (found in the pictures)
    #[arg(long, default_value = "auto", allow_hyphen_values = true)]
    lattice: LatticeChoice,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

impl Appearance {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let plan = appearance_plan(&self.model, &self.lattice)?;
        if self.dry_run {
            return console.plan(&plan.summary());
        }
        let found = plan.is_done();
        print_appearance(&plan.run(context)?, &self.model, console.found(found));
        Ok(())
    }
}

pub(super) fn appearance_plan(model: &Path, lattice: &LatticeChoice) -> Result<appearance::Plan> {
    appearance::plan(&appearance::Options { model: model.into(), lattice: *lattice })
}

pub(super) fn print_appearance(report: &AppearanceReport, model: &Path, console: Console) {
    let [_, _, height, width] = report.exemplar;
    let coarsest = report.levels.last().map_or(1, |level| level.spacing);
    let levels = counted(report.levels.len(), "level");
    let counts = WaveCounts(report.lattice.clone());
    let cells = counts.cells();
    let steps = report.found.parse().map_or_else(|_| report.found.clone(), |lattice| steps(&lattice));
    let lattice = match (report.found.as_str(), report.lattice.len()) {
        ("none", _) => "no lattice in it".to_owned(),
        (_, 0) => {
            format!(
                "a lattice with steps of {steps}, not used: the exemplar holds no whole number of its cells"
            )
        }
        (_, 1) => format!("{cells} ribs, one each {steps}"),
        (_, _) => format!("{cells} cells of a lattice, whose steps are {steps}"),
    };
    if console.brief {
        console.stage("exemplar", &format!("{width}x{height}; {lattice}"));
    } else {
        let text = format!("{width}x{height}, described at {levels}, 1 to {coarsest} texels apart");
        console.stage("exemplar", &text);
        console.line(format!("          {lattice}"));
    }
    let fewest = counts.fewest_in_a_direction();
    if !report.lattice.is_empty() && fewest < FEW_CELLS {
        console.line(format!(
            "          only {fewest} in a direction: large pieces of an enlargement will be copies; measure a larger part if you \
             can, or let it bend: btf appearance {} --lattice none --force",
            model.display()
        ));
    }
}

use std::path::{Path, PathBuf};

use btfkit::disk::output::{prepare_bytes, publish_all};
use btfkit::error::Result;
use btfkit::method::field;
use btfkit::method::field::marginals::Matching;
use btfkit::names::with_ending;
use btfkit::run::Context;
use btfkit::stage::fit::statistics::{COMPONENTS, Figures};
use btfkit::stage::fit::{self, sheet};
use btfkit::store::model::field::FieldReport;
use btfkit::words::counted;
use clap::{Args, ValueEnum};

use super::Console;
use super::table::{row, table};

/// Fit a random field to a model's normal map; only `btf enlarge --method paper` needs it
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf fit wood.model.zarr
  btf fit wood.model.zarr --mrf 2d --field slopes --report wood-field
  btf fit wood.model.zarr --gains none --marginals none           the paper as it is written
--report NAME draws 512x512 normals from the field and compares them with those of the tile: the distribution of each
component, autocorrelation, and the spread in each band of the pyramid. It writes NAME.txt and NAME.png.")]
pub(super) struct Fit {
    /// The model with the normal map
    model: PathBuf,
    #[command(flatten)]
    options: FitOptions,
    /// Also draw normals from the field, compare them with the tile's, and write NAME.txt and NAME.png
    #[arg(long, value_name = "NAME")]
    report: Option<PathBuf>,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

#[derive(Args)]
pub(super) struct FitOptions {
    /// Kind of random field: all channels together (3d), or one by one after a Karhunen-Loeve transform (2d)
    #[arg(long, value_enum, default_value = "3d")]
    mrf: CarKind,
    /// Number of levels of the pyramid [default: 1 to 5, the one that keeps the autocovariance best]
    #[arg(long)]
    levels: Option<usize>,
    /// What the field describes: the three components of the normals, or two slopes
    #[arg(long, value_enum, default_value = "normals")]
    field: Field,
    /// How to scale the levels: so that their sum varies as much as the tile (matched), or not at all, as in the paper
    /// (none)
    #[arg(long, value_enum, default_value = "matched")]
    gains: Gains,
    /// Which distribution of the tile's normals to keep: the joint one of n_x and n_y (joint), that of each of them
    /// (channel), or none, as in the paper (none)
    #[arg(long, value_enum, default_value = "joint")]
    marginals: Marginals,
}

#[derive(Clone, Copy, ValueEnum)]
enum CarKind {
    #[value(name = "3d")]
    Car3d,
    #[value(name = "2d")]
    Car2d,
}

#[derive(Clone, Copy, ValueEnum)]
enum Field {
    Normals,
    Slopes,
}

#[derive(Clone, Copy, ValueEnum)]
enum Gains {
    Matched,
    None,
}

#[derive(Clone, Copy, ValueEnum)]
enum Marginals {
    Joint,
    Channel,
    None,
}

impl Fit {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let plan = fit_plan(&self.model, &self.options)?;
        if self.dry_run {
            return console.plan(&plan.summary());
        }
        let found = plan.is_done();
        print_field(&plan.run(context)?, console.found(found));
        let Some(name) = &self.report else { return Ok(()) };
        let comparison = fit::compare(&self.model, context)?;
        let text = figures_text(&comparison.figures());
        let file = |ending: &str| name.with_file_name(with_ending(name, &[], ending));
        let title = self.model.file_name().unwrap_or_default().to_string_lossy().into_owned();
        console.text(&text);
        let text = prepare_bytes(&file(".txt"), context.existing, format!("{text}\n").as_bytes())?;
        let sheet = sheet::draw(&comparison, &title).prepare(&file(".png"), context.existing)?;
        publish_all([text, sheet])?;
        Ok(())
    }
}

pub(super) fn fit_plan(model: &Path, options: &FitOptions) -> Result<fit::Plan> {
    fit::plan(&fit::Options {
        model: model.into(),
        kind: match options.mrf {
            CarKind::Car3d => field::CarKind::Car3d,
            CarKind::Car2d => field::CarKind::Car2d,
        },
        levels: options.levels,
        coordinates: match options.field {
            Field::Normals => field::Coordinates::Normals,
            Field::Slopes => field::Coordinates::Slopes,
        },
        gains: match options.gains {
            Gains::Matched => field::Gains::Matched,
            Gains::None => field::Gains::None,
        },
        matching: match options.marginals {
            Marginals::Joint => Some(Matching::Joint),
            Marginals::Channel => Some(Matching::Channel),
            Marginals::None => None,
        },
    })
}

pub(super) fn print_field(report: &FieldReport, console: Console) {
    let levels: Vec<String> = report
        .levels
        .iter()
        .map(|level| {
            let [height, width] = level.size;
            format!("{width}x{height} eta {} radius {:.3} gain {:.2}", level.eta, level.radius, level.gain)
        })
        .collect();
    let error = format!("error of its autocovariance {:.3}", report.autocovariance_error);
    if console.brief {
        let levels = counted(report.levels.len(), "level");
        console.stage("field", &format!("{}, {levels}; {error}", report.mrf));
    } else {
        console.stage("field", &format!("{}; {}", report.mrf, levels.join(", ")));
        console.line(format!("          {error}"));
    }
    for (number, level) in report.levels.iter().enumerate() {
        if let Some(note) = &level.note {
            console.line(format!("          level {number}: {note}"));
        }
    }
}

/// The figures of both normal maps, those of the tile first.
fn figures_text(figures: &Figures) -> String {
    let mut rows = vec![row!["", "mean", "", "spread", "", "skewness", "", "distance"]];
    rows.push(row!["", "tile", "synth.", "tile", "synth.", "tile", "synth.", ""]);
    for (name, component) in COMPONENTS.iter().zip(&figures.components) {
        let [mean, spread, skewness] = [component.mean, component.spread, component.skewness];
        let [m0, m1, s0, s1] = [mean[0], mean[1], spread[0], spread[1]].map(|value| format!("{value:.3}"));
        let [k0, k1] = skewness.map(|value| format!("{value:.2}"));
        rows.push(row![name, m0, m1, s0, s1, k0, k1, format!("{:.4}", component.distance)]);
    }
    let mut bands = vec![row!["spread in band", "n_x", "", "n_y", "", "n_z", ""]];
    for (number, [tile, synthesis]) in figures.bands.iter().enumerate() {
        let mut cells = vec![number.to_string()];
        for axis in 0..3 {
            cells.push(format!("{:.4}", tile[axis]));
            cells.push(format!("{:.4}", synthesis[axis]));
        }
        bands.push(cells);
    }
    let [tile, synthesis] = figures.correlation;
    format!(
        "{}\ncorrelation of n_x and n_y {tile:.3}, synthesised {synthesis:.3}\n\
         error of the autocovariance {:.3}\n{}",
        table(&rows),
        figures.autocovariance_error,
        table(&bands)
    )
}

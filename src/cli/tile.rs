use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::lattice::{Lattice, LatticeChoice, WaveCounts};
use btfkit::run::Context;
use btfkit::stage::tile;
use btfkit::store::{measurement, model};
use clap::Args;

use super::Console;
use super::given::expect_in_order;

/// Share of a tile that is black from everywhere, and is warned of.
const MUCH_BLACK: f64 = 0.25;

/// The steps of a lattice in words: `13.0 rows and 21.3 columns`.
pub(super) fn steps(lattice: &Lattice) -> String {
    let step = |[dy, dx]: [f64; 2]| {
        let [rows, columns] = [dy, dx].map(|length| format!("{:.1}", length.abs()));
        match (rows.as_str(), columns.as_str()) {
            (_, "0.0") => format!("{rows} rows"),
            ("0.0", _) => format!("{columns} columns"),
            // Rows grow downwards.
            _ => {
                let way = if (dy < 0.0) == (dx < 0.0) { "right" } else { "left" };
                format!("{rows} rows down with {columns} columns to the {way}")
            }
        }
    };
    let steps: Vec<String> = lattice.vectors().into_iter().map(step).collect();
    if steps.is_empty() { "none".to_owned() } else { steps.join(" and ") }
}

/// Of a plane of which the tile is less than this, more is worth having.
const LITTLE: f64 = 0.5;

#[derive(Args)]
pub(super) struct TileOptions {
    /// The part of the measurement that becomes the tile
    ///
    /// - auto:         as largest if no side has more than 256 texels, otherwise as cut
    /// - largest:      everything if its borders join, otherwise the largest seamless part
    /// - cut:          the part whose seams show least, at most 256 texels a side
    /// - WIDTHxHEIGHT: a seamless part of that size
    /// - plane:        everything; whether its borders join is measured
    /// - none:         everything, with borders that do not join
    /// - periodic:     everything, with borders that join
    #[arg(long, default_value = "auto", verbatim_doc_comment)]
    tile: tile::Choice,
    /// Steps from cell to cell of a regular material, in texels: dy,dx;dy,dx (weaves), dy,dx (ribs), none, or auto
    /// (found in the pictures)
    #[arg(long, default_value = "auto", allow_hyphen_values = true)]
    pub(super) lattice: LatticeChoice,
}

#[derive(Args)]
pub(super) struct Seed {
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
}

/// Begin a model: choose its tile, which is all of the measurement or a part whose borders join
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf tile wood.zarr wood.model.zarr --tile none
  btf tile cloth.zarr cloth.model.zarr --tile cut --lattice '15.2,0;0,18.4'     whole cells of this weave")]
pub(super) struct Tile {
    /// The measurement
    measurement: PathBuf,
    /// The model to begin
    model: PathBuf,
    #[command(flatten)]
    options: TileOptions,
    #[command(flatten)]
    seed: Seed,
    /// Print what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
}

impl Tile {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        expect_in_order(
            [(&self.measurement, &[measurement::KIND]), (&self.model, &[model::KIND])],
            &format!("btf tile {} {}", self.model.display(), self.measurement.display()),
        )?;
        let plan = tile_plan(&self.measurement, &self.model, &self.options, self.seed.seed)?;
        if self.dry_run {
            return console.plan(&plan.summary());
        }
        let found = plan.is_done();
        print_tile(&plan.run(context)?, console.found(found));
        Ok(())
    }
}

pub(super) fn tile_plan(
    measurement: &Path,
    model: &Path,
    options: &TileOptions,
    seed: u64,
) -> Result<tile::Plan> {
    tile::plan(&tile::Options {
        measurement: measurement.into(),
        model: model.into(),
        choice: options.tile,
        lattice: options.lattice,
        seed,
    })
}

pub(super) fn print_tile(report: &tile::Report, console: Console) {
    let [height, width] = report.size;
    let seams = match &report.patch {
        Some(patch) => format!(
            "from row {}, column {}; step across its seams {:.2} of an ordinary one (uncut {:.2})",
            patch.y, patch.x, report.seam_visibility, report.uncut_visibility
        ),
        None if report.wraps => format!(
            "the whole measurement; step across its borders {:.2} of an ordinary one",
            report.seam_visibility
        ),
        None => "the whole measurement, its borders do not join".to_owned(),
    };
    console.stage("tile", &format!("{width}x{height} {seams}"));
    let lattice = &report.lattice;
    let steps = steps(lattice);
    let cells = WaveCounts(report.cells.clone()).cells();
    match lattice.vectors().len() {
        0 => {}
        _ if cells == 0 => {
            console.line(format!(
                "          holds no whole number of cells of the lattice, whose steps are {steps}"
            ));
        }
        1 => console.line(format!("          holds {cells} ribs, one each {steps}")),
        _ => console.line(format!("          holds {cells} cells of a lattice, whose steps are {steps}")),
    }
    if report.black > MUCH_BLACK {
        console.line(format!(
            "          warning: {:.0} % of it is black from everywhere, a backdrop or a mask: crop the pictures to the material \
             and import them again",
            100.0 * report.black
        ));
    }
    let [texels, all] = [report.size, report.measurement_size].map(|[height, width]| (height * width) as f64);
    if texels < LITTLE * all {
        console.line(format!(
            "          {:.0} % of what was measured: --tile none gives enlargements all of it to draw on, and the clustering {:.1} times the texels",
            100.0 * texels / all,
            all / texels
        ));
    }
}

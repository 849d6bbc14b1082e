use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::likeness::Measure;
use btfkit::picture::Ending;
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::judge::{self, Judged, Normals, Origin, Report, Row};
use btfkit::stage::partial::Shared;
use btfkit::store::{enlarged, measurement, model};
use btfkit::text::escaped;
use btfkit::words::counted;
use clap::Args;

use super::given::expect_in_order;
use super::sharing::SharingArgs;
use super::table::{row, table};
use super::{Console, as_json};

/// Measure how much an enlargement differs from the real material; at 1 it could be another real piece
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf judge wood-4k.zarr --against wood.zarr
  btf judge wood-4k.zarr --against wood.zarr --picture judged.png
  btf judge wood-4k.zarr --against wood.zarr --json > judged.json
  btf judge wood.model.zarr --size 2048x2048 --against wood.zarr     a part of the endless surface of a model
  btf judge wood-4k.zarr --against wood.zarr --pair 0,1 --pair 30,10 view 0 under light 1, view 30 under light 10
Share the work between processes; the figures are those of one:
  btf judge wood-4k.zarr --against wood.zarr --partial parts --shard 0/4     ... 3/4, in any order
  btf judge wood-4k.zarr --against wood.zarr --partial parts --reduce        exit code 66 if a part is missing
J is the largest of five measures of the difference from real crops. At 1, the enlargement differs from them as much as
they differ from each other. docs/how-to/judge.md explains the measures.")]
pub(super) struct Judge {
    /// An enlargement, or a model with --size
    subject: PathBuf,
    /// The measurement that the model was made of
    #[arg(long, value_name = "MEASUREMENT")]
    against: PathBuf,
    /// The model of an enlargement [default: where it was when the enlargement was made; else of that name beside it
    /// or in the current folder]
    #[arg(long)]
    model: Option<PathBuf>,
    /// How much of the endless surface of a model to judge, WIDTHxHEIGHT, each from 1 to 16777216
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    /// Judge under this view and light, by their numbers from 0, which btf info --directions lists; repeat the option for
    /// more [default: five pairs spread over the directions]
    #[arg(long, value_name = "VIEW,LIGHT", value_parser = pair, allow_hyphen_values = true)]
    pair: Vec<[usize; 2]>,
    /// Side of the crops in texels, a multiple of 16 [default: 128, or as large as fit]
    #[arg(long, value_name = "N")]
    crop: Option<usize>,
    /// Also write the pictures that were judged, side by side: .png, .jpg, .webp or .tif
    #[arg(long, alias = "sheet", value_name = "FILE")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    sharing: SharingArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

impl Judge {
    /// Whether the same command goes on where it was stopped.
    pub(super) fn goes_on(&self) -> bool {
        self.sharing.goes_on()
    }

    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        expect_in_order(
            [(&self.subject, &[model::KIND, enlarged::KIND]), (&self.against, &[measurement::KIND])],
            &format!("btf judge {} --against {}", self.against.display(), self.subject.display()),
        )?;
        if let Some(path) = &self.picture {
            Ending::of(path, &Ending::DISPLAY)?;
        }
        let options = judge::Options {
            subject: self.subject.clone(),
            measurement: self.against.clone(),
            model: self.model.clone(),
            size: self.size,
            pairs: self.pair.clone(),
            crop: self.crop,
            sheet: self.picture.is_some(),
        };
        let Judged { report, sheet } = match self.sharing.sharing() {
            None => judge::run(&options, context)?,
            Some(sharing) => {
                let Shared { told, result } = judge::run_shared(&options, &sharing, context)?;
                let Some(judged) = result else {
                    console.line(told);
                    return Ok(());
                };
                judged
            }
        };
        if self.json {
            console.plan(&as_json(&report)?)?;
        } else {
            console.text(&text_of(&report));
        }
        if let (Some(path), Some(sheet)) = (&self.picture, sheet) {
            sheet.write(path, context.existing)?;
        }
        Ok(())
    }
}

fn text_of(report: &Report) -> String {
    let [height, width] = report.size;
    let origin = match report.origin {
        Origin::HeldOut => "parts of the measurement that the tile did not use",
        Origin::Quadrants => "quadrants of the measurement, which the tile may have used",
    };
    let mut lines = vec![
        format!(
            "{}: {}, {} of {} texels a side",
            escaped(&report.subject.display().to_string()),
            Size::new(height, width),
            counted(report.crops.len(), "crop"),
            report.crop
        ),
        format!("by {}: {origin}", counted(report.real_crops.len(), "real crop")),
    ];
    if let Some([height, width]) = report.in_phase_within {
        let cell = Size::new(height, width);
        lines.push(format!(
            "a regular material: crops moved by up to {cell} so that they are in phase with real ones"
        ));
    }
    lines.push(String::new());
    let mut head = vec![String::new()];
    head.extend(Measure::ALL.map(|measure| measure.name().to_owned()));
    head.extend(row!["J", "worst", "excess peak"]);
    let mut rows = vec![head, named("exemplar repeated", &report.mean.own)];
    rows.extend(report.mean.alone.as_ref().map(|alone| named("enlargement alone", alone)));
    rows.push(named("with the model", &report.mean.with_model));
    if let Normals::Judged { x, y, .. } = &report.normals {
        rows.push(named("n_x, exemplar", &x.own));
        rows.push(named("n_x, enlargement", &x.enlarged));
        rows.push(named("n_y, exemplar", &y.own));
        rows.push(named("n_y, enlargement", &y.enlarged));
    }
    lines.push(table(&rows));
    if let Normals::Absent { reason } = &report.normals {
        lines.push(format!("normals not judged: {reason}"));
    }
    lines.push(String::new());
    let mut pairs = vec![row!["J by pair", "exemplar", "alone", "with the model"]];
    for pair in &report.pairs {
        let alone = pair.rows.alone.as_ref().map(|row| row.j);
        pairs.push(row![
            format!("view {} light {}", degrees(pair.view_deg), degrees(pair.light_deg)),
            number(Some(pair.rows.own.j)),
            number(alone),
            number(Some(pair.rows.with_model.j)),
        ]);
    }
    lines.push(table(&pairs));
    lines.push(String::new());
    let mut whole = vec![row!["clusters in common", number(Some(report.verdict.shares))]];
    if let Some(share) = report.verdict.largest_copy {
        whole.push(row!["largest copy", format!("{:.2} %", 100.0 * share)]);
    }
    whole.push(row!["bands in rows, columns", number(report.bands[0]), number(report.bands[1])]);
    whole.push(row!["wavy bands", number(report.wavy_bands[0]), number(report.wavy_bands[1])]);
    if let Some(peak) = report.lattice {
        whole.push(row!["lattice, exemplar's", number(Some(peak.enlarged)), number(Some(peak.own))]);
    }
    lines.push(table(&whole));
    lines.join("\n")
}

fn named(name: &str, judged: &Row) -> Vec<String> {
    let mut cells = vec![name.to_owned()];
    cells.extend(Measure::ALL.map(|measure| number(judged.measures.get(measure.name()).copied())));
    cells.extend([number(Some(judged.j)), judged.worst.clone(), number(Some(judged.excess_peak))]);
    cells
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
}

fn degrees([theta, phi]: [f64; 2]) -> String {
    format!("{theta:.0},{phi:.0}")
}

/// `30,10`: numbers of a view and a light.
fn pair(text: &str) -> std::result::Result<[usize; 2], String> {
    let numbers = text
        .split_once(',')
        .and_then(|(view, light)| Some([view.trim().parse().ok()?, light.trim().parse().ok()?]));
    numbers.ok_or_else(|| format!("expected VIEW,LIGHT such as 30,10, got {text:?}"))
}

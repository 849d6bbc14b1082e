use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::picture::drawing::{CHARACTER, Canvas, text_size};
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::compare::{By, Subject};
use btfkit::stage::ledger::Ledger;
use btfkit::stage::partial::Shared;
use btfkit::stage::{baselines, compare, image, pack};
use btfkit::store::model::Model;
use btfkit::store::{self, model};
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::sharing::SharingArgs;
use super::table::{row, table};
use super::{Console, as_json, bytes_text, part_text};

/// Show what a model has lost of its measurement: errors in lightness and colour over its tile
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf compare wood.zarr wood.model.zarr --picture side.png --light 15,0 --view 0,0
  btf compare wood.zarr wood.btfc --tile-of wood.model.zarr            a packed model
  btf compare wood.zarr wood.model.zarr --baselines --curves curves.png
Share the work between processes; the figures are those of one:
  btf compare wood.zarr wood.model.zarr --partial sums --shard 0/8     ... 7/8, in any order
  btf compare wood.zarr wood.model.zarr --partial sums --reduce        exit code 66 if a part is missing")]
pub(super) struct Compare {
    /// The measurement
    measurement: PathBuf,
    /// The model, or a packed model; the two may also come the other way round
    model: PathBuf,
    /// Also write a picture of the measured tile, the model's tile, and four times their difference: .png, .jpg, .webp
    /// or .tif
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Direction of the light, theta,phi in degrees: theta from the normal, phi counter-clockwise from the right
    #[arg(long, requires = "picture", default_value = "15,0", allow_hyphen_values = true)]
    light: Direction,
    /// Direction of the view, theta,phi in degrees
    #[arg(long, requires = "picture", default_value = "0,0", allow_hyphen_values = true)]
    view: Direction,
    /// Which values of the model to compare [default: clusters, if it has them]
    #[arg(long, value_enum)]
    by: Option<ByName>,
    /// Of a packed model whose tile was cut: the model that it was packed from, which says where the tile lies
    #[arg(long, value_name = "MODEL")]
    tile_of: Option<PathBuf>,
    /// Compare other ways to keep the tile, at their bytes and at those of packed files: clusters with means and medians,
    /// PCA of all and of each view, polynomial texture maps. The model needs components (btf components). Takes minutes
    #[arg(long, conflicts_with_all = ["picture", "by", "tile_of", "partial"])]
    baselines: bool,
    /// With --baselines, also draw the curves of error and bytes: .png, .jpg, .webp or .tif
    #[arg(long, value_name = "FILE", requires = "baselines")]
    curves: Option<PathBuf>,
    #[command(flatten)]
    sharing: SharingArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum ByName {
    /// Its clusters
    Clusters,
    /// Its components
    Components,
}

impl Compare {
    /// Whether the same command goes on where it was stopped.
    pub(super) fn goes_on(&self) -> bool {
        self.sharing.goes_on()
    }

    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        let pictures = self.picture.iter().chain(&self.curves);
        pictures.map(|path| Ending::of(path, &Ending::DISPLAY)).collect::<Result<Vec<_>>>()?;
        // Both are read, so what they are tells which is which.
        let named = [&self.measurement, &self.model];
        let is_model =
            |path: &Path| pack::is_packed(path) || store::kind_of(path).is_ok_and(|kind| kind == model::KIND);
        let [measurement, model] = if is_model(named[0]) { [named[1], named[0]] } else { named };
        let options = compare::Options {
            model: model.clone(),
            measurement: measurement.clone(),
            by: self.by.map(|by| match by {
                ByName::Clusters => By::Clusters,
                ByName::Components => By::Components,
            }),
            tile_of: self.tile_of.clone(),
        };
        if self.baselines {
            return self.run_baselines(measurement, model, context, console);
        }
        let subject = compare::open(&options, context)?;
        let by = subject.values.by();
        console.notes(subject.values.notes());
        let report = match self.sharing.sharing() {
            None => compare::run(&subject, context)?,
            Some(sharing) => {
                let Shared { told, result } = compare::run_shared(&subject, &sharing, context)?;
                let Some(report) = result else {
                    console.line(told);
                    return Ok(());
                };
                report
            }
        };
        if self.json {
            let mut value = as_json(&report)?;
            if let Some(members) = value.as_object_mut() {
                members.insert("ledger".to_owned(), as_json(&subject.ledger)?);
            }
            console.plan(&value)?;
        } else {
            let mut rows = vec![row!["view theta", "views", "mean |dL*|", "PSNR dB", "CIEDE2000", "95 %"]];
            for errors in report.elevations.iter().chain([&report.all]) {
                rows.push(row![
                    errors.view_theta_deg.map_or("all".to_owned(), |theta| format!("{theta}")),
                    errors.views,
                    format!("{:.3}", errors.lightness),
                    errors.psnr_text(),
                    format!("{:.3}", errors.ciede2000),
                    format!("{:.2}", errors.ciede2000_95)
                ]);
            }
            console.text(&table(&rows));
            console.line(format!(
                "CIEDE2000: its mean, and what 95 % stay below, over {}; the other figures are over all texels. All views \
                 count alike here. The figures of btf model and btf info differ: they weight views by the cosine of theta.",
                counted(report.colour_texels, "texel")
            ));
            ledger_lines(&subject.ledger).into_iter().for_each(|line| console.line(line));
            if by == By::Components {
                console.line(match pack::is_packed(model) {
                    true => "by the components of the packed model",
                    false => "by the components of the model",
                });
            } else if report.all.hues_are_lost() {
                console.line(format!(
                    "warning: colours are off by {:.1}, lightness only by {:.1}: clusters are formed by lightness alone, and \
                     texels of several hues share some of them; more clusters help (btf model {} {} --clusters N --force)",
                    report.all.ciede2000,
                    report.all.lightness,
                    measurement.display(),
                    model.display()
                ));
            }
            if report.all.samples_left_out > 0 {
                let count = counted(report.all.samples_left_out, "sample");
                console.line(format!("{count} not finite: PSNR leaves them out, elsewhere they count as 0"));
            }
        }
        let Some(path) = &self.picture else { return Ok(()) };
        self.side_by_side(&subject, context)?.write(path, context.existing)?;
        if !self.json {
            let measured = subject.values.directions();
            console.notes(&image::notes_of_directions(measured, self.view, self.light));
        }
        Ok(())
    }

    fn run_baselines(
        &self,
        measurement: &Path,
        model: &Path,
        context: &Context<'_>,
        console: Console,
    ) -> Result<()> {
        let report =
            baselines::run(&Model::open(model)?, &compare::open_measurement(model, measurement)?, context)?;
        if let Some(path) = &self.curves {
            report.chart(&model.display().to_string()).draw().write(path, context.existing)?;
        }
        if self.json {
            return console.plan(&as_json(&report)?);
        }
        let mut rows = vec![row![
            "method",
            "setting",
            "bytes",
            "of the tile",
            "mean |dL*|",
            "PSNR dB",
            "CIEDE2000",
            "SSIM",
            "sharpness"
        ]];
        for found in &report.rows {
            let figures = &found.figures;
            rows.push(row![
                found.method,
                found.setting,
                found.bytes,
                part_text(found.bytes, report.tile_bytes),
                format!("{:.3}", figures.lightness),
                figures.psnr_db.map_or("equal".to_owned(), |psnr| format!("{psnr:.2}")),
                format!("{:.3}", figures.ciede2000),
                format!("{:.4}", figures.ssim),
                format!("{:.3}", figures.sharpness)
            ]);
        }
        console.text(&table(&rows));
        console.line(format!(
            "of the tile: the {} of its raw samples; bytes count all but the directions, which all need",
            bytes_text(report.tile_bytes)
        ));
        let ahead = report.ahead();
        if ahead.is_empty() {
            console.line("packed files are ahead by PSNR at all of these bytes");
        }
        for row in ahead {
            console.line(format!(
                "{} {} is ahead of packed files by PSNR at its bytes",
                row.method, row.setting
            ));
        }
        console.notes(&report.notes);
        Ok(())
    }

    fn side_by_side(&self, subject: &Subject, context: &Context<'_>) -> Result<Picture> {
        let Subject { measurement, tile, values, .. } = subject;
        let measured = image::of_measured_tile(measurement, tile, self.view, self.light, context)?;
        let modelled = values.picture(self.view, self.light, context)?;
        let difference = false_color::difference(&measured, &modelled, 4.0);
        let factor = (384 / tile.size.height.max(tile.size.width)).max(1);
        let shown = [measured.as_display(), modelled.as_display(), difference]
            .map(|picture| picture.magnified(factor));
        Ok(captioned(&["measured", "model", "difference x 4"], &shown))
    }
}

/// What the values of a tile take, and of what that is a part.
fn ledger_lines(ledger: &Ledger) -> [String; 2] {
    let names: Vec<&str> = ledger.parts.iter().map(|part| part.name).collect();
    let (raw, coded) = (ledger.raw_bytes(), ledger.coded_bytes());
    let of = |bytes, whole| format!("{} of the {}", part_text(bytes, whole), bytes_text(whole));
    let parts = |bytes: u64| {
        format!(
            "{}, {} of the measured tile, {} of the whole measurement",
            bytes_text(bytes),
            of(bytes, ledger.tile_bytes),
            of(bytes, ledger.measurement_bytes)
        )
    };
    [
        format!("size of {} as plain numbers: {}", names.join(" + "), parts(raw)),
        format!("  as stored: {}", parts(coded)),
    ]
}

/// Pictures of one size side by side, each under its caption.
fn captioned(captions: &[&str], pictures: &[Picture]) -> Picture {
    /// Pixels between pictures, and around captions.
    const GAP: usize = 8;
    let widths = captions.iter().map(|caption| text_size(1, caption).width);
    let sizes = pictures.iter().map(|picture| picture.size);
    let column = widths.chain(sizes.clone().map(|size| size.width)).max().unwrap_or(0);
    let below = CHARACTER + 2 * GAP;
    let height = below + sizes.map(|size| size.height).max().unwrap_or(0);
    let mut sheet = Canvas::new(Size::new(height, pictures.len() * (column + GAP)));
    for (number, (caption, picture)) in captions.iter().zip(pictures).enumerate() {
        let left = number * (column + GAP);
        sheet.text(GAP, left, caption);
        sheet.put(below, left, picture);
    }
    sheet.into_picture()
}

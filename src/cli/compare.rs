use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::picture::drawing::{CHARACTER, Canvas, text_size};
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::shape::Size;
use btfkit::stage::compare::{By, Subject};
use btfkit::stage::partial::Sharing;
use btfkit::stage::{compare, image, pack};
use btfkit::store::{self, model};
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::table::{row, table};
use super::{Console, as_json};

/// Show what a model has lost of its measurement: errors in lightness and colour over its tile
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf compare wood.zarr wood.model.zarr --picture side.png --light 15,0 --view 0,0
  btf compare wood.zarr wood.btfc --tile-of wood.model.zarr            a packed model
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
    /// Keep the sums of each view in this folder, so that many jobs share the work and a stopped one goes on
    #[arg(long, value_name = "DIR")]
    partial: Option<PathBuf>,
    /// Compare only part K of N of the views, K from 0, in any order; `env` takes both from the variables of Slurm or MPI
    #[arg(long, requires = "partial", value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Compare nothing, only put the sums in the folder together
    #[arg(long, requires = "partial", conflicts_with = "shard")]
    reduce: bool,
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
        self.partial.is_some()
    }

    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
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
        let subject = compare::open(&options, context)?;
        let by = subject.values.by();
        console.notes(subject.values.notes());
        let report = match &self.partial {
            None => compare::run(&subject, context)?,
            Some(folder) => {
                let shard = (!self.reduce).then_some(self.shard);
                let sharing = Sharing { folder: folder.clone(), shard };
                let shared = compare::run_shared(&subject, &sharing, context)?;
                let Some(report) = shared.report else {
                    let views = counted(shared.views, "view");
                    console.line(format!("{}: {} of {views} compared", shared.folder.display(), shared.done));
                    return Ok(());
                };
                report
            }
        };
        if self.json {
            let value = as_json(&report)?;
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
                 count alike here; btf model and btf info weight them by the cosine of theta",
                counted(report.colour_texels, "texel")
            ));
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

use std::path::PathBuf;

use btfkit::error::Result;
use btfkit::picture::drawing::{CHARACTER, Canvas, text_size};
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::Context;
use btfkit::shape::Size;
use btfkit::stage::compare::By;
use btfkit::stage::{compare, image};
use btfkit::store;
use btfkit::store::measurement::Measurement;
use btfkit::store::model::{self, Model};
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::sharing::SharingArgs;
use super::table::{row, table};
use super::{Console, as_json};

/// Show what a model has lost of its measurement: errors in lightness and colour over its tile
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf compare wood.zarr wood.model.zarr --picture side.png --light 15,0 --view 0,0
Share the work between processes; the figures are those of one:
  btf compare wood.zarr wood.model.zarr --partial sums --shard 0/8     ... 7/8, in any order
  btf compare wood.zarr wood.model.zarr --partial sums --reduce        exit code 66 if a part is missing")]
pub(super) struct Compare {
    /// The measurement
    measurement: PathBuf,
    /// The model; the two may also come the other way round
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
    /// What of the model is compared [default: clusters, if it has them]
    #[arg(long, value_enum)]
    by: Option<ByName>,
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
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
        // Both are read, so what they are tells which is which.
        let named = [&self.measurement, &self.model];
        let swapped = store::kind_of(named[0]).is_ok_and(|kind| kind == model::KIND);
        let [measurement, model] = if swapped { [named[1], named[0]] } else { named };
        let options = compare::Options { model: model.clone(), measurement: measurement.clone() };
        let (model, measurement) = compare::open(&options)?;
        let by = match self.by {
            Some(ByName::Clusters) => By::Clusters,
            Some(ByName::Components) => By::Components,
            None => By::of(&model)?,
        };
        let report = match self.sharing.sharing() {
            None => compare::run(&model, &measurement, by, context)?,
            Some(sharing) => {
                let shared = compare::run_shared(&model, &measurement, by, &sharing, context)?;
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
                "CIEDE2000, its mean and what 95 % stay below, over {}, the other figures over all",
                counted(report.colour_texels, "texel")
            ));
            if by == By::Components {
                console.line("by the components of the model");
            } else if report.all.hues_are_lost() {
                console.line(format!(
                    "warning: colours are off by {:.1}, lightness only by {:.1}: clusters are formed by lightness alone, and \
                     texels of several hues share some of them; more clusters help (btf model {} {} --clusters N --force)",
                    report.all.ciede2000,
                    report.all.lightness,
                    measurement.path().display(),
                    model.path().display()
                ));
            }
            if report.all.samples_left_out > 0 {
                let count = counted(report.all.samples_left_out, "sample");
                console.line(format!("{count} not finite: PSNR leaves them out, elsewhere they count as 0"));
            }
        }
        match &self.picture {
            Some(path) => {
                self.side_by_side(&model, &measurement, by, context)?.write(path, context.existing)?;
                if !self.json {
                    let description = measurement.description();
                    let measured = [&description.views[..], &description.lights];
                    console.notes(&image::notes_of_directions(measured, self.view, self.light));
                }
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn side_by_side(
        &self,
        model: &Model,
        measurement: &Measurement,
        by: By,
        context: &Context<'_>,
    ) -> Result<Picture> {
        let tile = model.tile()?;
        let measured = image::of_measured_tile(measurement, &tile, self.view, self.light, context)?;
        let modelled = match by {
            By::Clusters => {
                let colors = image::cluster_colors(model, self.view, self.light)?;
                image::look_up(tile.size, &model.index()?, &colors)?
            }
            By::Components => image::of_components(model, self.view, self.light, context)?,
        };
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

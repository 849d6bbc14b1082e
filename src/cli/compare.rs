use std::path::PathBuf;

use btfkit::error::{Error, Result};
use btfkit::picture::{Ending, Picture, false_color};
use btfkit::run::Context;
use btfkit::stage::{compare, image};
use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::Args;

use super::Console;
use super::table::{row, table};

/// Compare a model with its measurement over the tile: errors in lightness and colour
#[derive(Args)]
#[command(after_help = "\
Example:
  btf compare wood.model.zarr wood.zarr --picture side.png --light 15,0 --view 0,0")]
pub(super) struct Compare {
    /// The model
    model: PathBuf,
    /// The measurement
    measurement: PathBuf,
    /// Also write a picture of the measured tile, the model's tile, and four times their difference: .png, .jpg, .webp
    /// or .tif
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Light of the picture: theta,phi in degrees
    #[arg(long, default_value = "15,0", allow_hyphen_values = true)]
    light: Direction,
    /// View of the picture
    #[arg(long, default_value = "0,0", allow_hyphen_values = true)]
    view: Direction,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

impl Compare {
    pub(super) fn run(&self, context: &Context<'_>, console: Console) -> Result<()> {
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
        let options = compare::Options { model: self.model.clone(), measurement: self.measurement.clone() };
        let report = compare::run(&options, context)?;
        if self.json {
            let value = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
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
            if report.all.hues_are_lost() {
                console.line(format!(
                    "warning: colours are off by {:.1}, lightness only by {:.1}: clusters are formed by lightness alone, and \
                     texels of several hues share some of them; more clusters help (btf cluster --clusters N --force)",
                    report.all.ciede2000, report.all.lightness
                ));
            }
            if report.all.samples_left_out > 0 {
                let count = counted(report.all.samples_left_out, "sample");
                console.line(format!("{count} not finite: PSNR leaves them out, elsewhere they count as 0"));
            }
        }
        match &self.picture {
            Some(path) => self.side_by_side(context)?.write(path, context.existing).map(|_| ()),
            None => Ok(()),
        }
    }

    fn side_by_side(&self, context: &Context<'_>) -> Result<Picture> {
        let model = Model::open(&self.model)?;
        let measurement = Measurement::open(&self.measurement)?;
        let tile = model.tile()?;
        let measured = image::of_measured_tile(&measurement, &tile, self.view, self.light, context)?;
        let colors = image::cluster_colors(&model, self.view, self.light)?;
        let modelled = image::look_up(tile.size, &model.index()?, &colors)?;
        let difference = false_color::difference(&measured, &modelled, 4.0);
        let factor = (384 / tile.size.height.max(tile.size.width)).max(1);
        let shown = [measured.as_display(), modelled.as_display(), difference]
            .map(|picture| picture.magnified(factor));
        Ok(Picture::side_by_side(&shown, 8))
    }
}

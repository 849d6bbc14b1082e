//! Tile to normal map: photometric stereo over all lights of the view nearest to the normal.

use std::path::PathBuf;

use btfkit_formats::Samples;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::Result;
use crate::method::stereo::Stereo;
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::run::{Context, read_ahead};
use crate::shape::{Size, Window};
use crate::stage::cluster::open_measurement_of;
use crate::store::measurement::Measurement;
use crate::store::model::normals::NormalsRecipe;
pub use crate::store::model::normals::NormalsReport as Report;
use crate::store::model::{Model, Stage};

/// Rows of the measurement read at a time: a row of chunks.
const BAND_ROWS: usize = 16;

/// How to estimate normals.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement that the tile was cut from.
    pub measurement: PathBuf,
    /// The model with the tile.
    pub model: PathBuf,
    /// Leave out the lights that fit worst.
    pub robust: bool,
}

/// An estimation, ready to run.
pub struct Plan {
    measurement: Measurement,
    model: Model,
    robust: bool,
    recipe: Value,
}

/// Checks that the model has a tile of this measurement.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let tile = model.stage_digest(Stage::Tile)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let recipe = NormalsRecipe { tile, robust: options.robust }.to_value()?;
    Ok(Plan { measurement, model, robust: options.robust, recipe })
}

/// Memory of a texel of the normal map: twice its normal, and what is written of it.
const TEXEL_BYTES: u64 = 48;

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "normals", "model": self.model.path().display().to_string(), "recipe": self.recipe})
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Normals, &self.recipe).unwrap_or(false)
    }

    /// Estimates the normal map, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Some(_lock) = self.model.begin(Stage::Normals, &self.recipe, context)? else {
            return self.model.normals_report();
        };
        let description = self.measurement.description();
        let view = frontal_view(&self.measurement);
        let tile = self.model.tile()?;
        let bounds = tile.bounds();
        let band = (BAND_ROWS * bounds.size.width * description.texel_bytes()) as u64;
        let needed = 2 * band + TEXEL_BYTES * bounds.size.texels() as u64;
        context.require(&format!("normals of {}", bounds.size), needed)?;
        context.progress.begin("normals", bounds.size.height as u64, Counted::Items("rows"));
        let plane = of_window(&self.measurement, view, self.robust, bounds, context)?;
        context.progress.end();
        let normals: Vec<[f32; 3]> = tile.offsets_in_bounds().into_iter().map(|at| plane[at]).collect();
        self.model.write_normals(tile.size, &normals)?;
        let (mean, spread_deg) = mean_and_spread(&normals);
        let report = Report { view, lights: description.lights.len(), mean, spread_deg };
        self.model.finish(Stage::Normals, &self.recipe, &report, context)?;
        Ok(report)
    }
}

/// Normals of a window of a measurement under the lights of one view, band by band; `robust` leaves out the lights that
/// fit worst.
pub(crate) fn of_window(
    measurement: &Measurement,
    view: usize,
    robust: bool,
    window: Window,
    context: &Context<'_>,
) -> Result<Vec<[f32; 3]>> {
    let description = measurement.description();
    let stereo = Stereo::new(&description.lights)?;
    let (texel, channels) = (description.texel_samples(), description.n_channels());
    let decoder = description.decoder()?;
    let normal = |samples: &Samples, at: usize| {
        let intensities: Vec<f64> =
            (at..at + texel).step_by(channels).map(|sample| decoder.luminance(samples, sample)).collect();
        if robust { stereo.robust_normal(&intensities) } else { stereo.normal(&intensities) }
    };
    let mut normals = Vec::with_capacity(window.size.texels());
    let band_bytes = (BAND_ROWS * window.size.width * description.texel_bytes()) as u64;
    let in_flight = read_ahead::in_flight(context.work_bytes(), band_bytes);
    let read = |top: usize| {
        let rows = BAND_ROWS.min(window.size.height - top);
        let band = Window { y: window.y + top, x: window.x, size: Size::new(rows, window.size.width) };
        Ok((rows, measurement.read_reflectance(view, band)?))
    };
    let tops = (0..window.size.height).step_by(BAND_ROWS);
    read_ahead::for_each(context, in_flight, tops, read, |(rows, samples)| {
        let texels = 0..samples.len() / texel;
        let band: Vec<[f32; 3]> =
            context.install(|| texels.into_par_iter().map(|t| normal(&samples, t * texel)).collect());
        normals.extend(band);
        context.progress.advance(rows as u64);
        Ok(())
    })?;
    Ok(normals)
}

/// The view nearest to the surface normal, the first of equals.
pub(crate) fn frontal_view(measurement: &Measurement) -> usize {
    let views = &measurement.description().views;
    (0..views.len()).min_by(|&a, &b| views[a].theta_rad.total_cmp(&views[b].theta_rad)).unwrap_or(0)
}

/// Mean of unit normals, and their root mean square angle from it in degrees.
pub(crate) fn mean_and_spread(normals: &[[f32; 3]]) -> ([f64; 3], f64) {
    let count = normals.len().max(1) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|axis| normals.iter().map(|n| f64::from(n[axis])).sum::<f64>() / count);
    let length = mean.iter().map(|m| m * m).sum::<f64>().sqrt();
    let squared = |normal: &[f32; 3]| {
        let cosine: f64 = normal.iter().zip(mean).map(|(&n, m)| f64::from(n) * m / length).sum();
        libm::acos(cosine.clamp(-1.0, 1.0)).to_degrees().powi(2)
    };
    (mean, (normals.iter().map(squared).sum::<f64>() / count).sqrt())
}

//! Planar pictures of a measurement, a tile or an enlarged index under any light and view, (27).

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::picture::{Picture, false_color};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::Store;
use crate::store::enlarged::{self, Enlarged};
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model};
use crate::texel::evaluate::{Appearance, add};
use crate::texel::tile::Tile;
use crate::texel::triangulation::{Interpolator, triangulate};
use btfkit_formats::Direction;

/// Rows of a measurement read at a time: a row of chunks.
const BAND_ROWS: usize = 16;

/// What to show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subject {
    /// The material under a light, seen from a view.
    Appearance {
        /// Where it is seen from.
        view: Direction,
        /// Where it is lit from.
        light: Direction,
    },
    /// Cluster numbers in false colours.
    Index,
    /// The normal map.
    Normals,
}

/// What to picture.
#[derive(Clone, Debug)]
pub struct Options {
    /// A measurement, a model (its tile) or an enlarged index.
    pub source: PathBuf,
    /// The model of an enlarged index; beside it under its recorded name where absent.
    pub model: Option<PathBuf>,
    /// What to show.
    pub subject: Subject,
    /// The part to show; all of it where absent.
    pub window: Option<Window>,
}

/// Makes the picture.
pub fn run(options: &Options, context: &Context<'_>) -> Result<Picture> {
    let store = Store::at(&options.source);
    let attributes = store.attributes()?.ok_or_else(|| {
        Error::missing(format!(
            "{}: no store here, expected a measurement, a model or an enlarged index",
            options.source.display()
        ))
    })?;
    match attributes.get("kind").and_then(Value::as_str) {
        Some(measurement::KIND) => {
            let measurement = Measurement::open(&options.source)?;
            let window = within(options.window, measurement.description().size, context)?;
            match options.subject {
                Subject::Appearance { view, light } => {
                    of_measurement(&measurement, view, light, window, context)
                }
                _ => Err(Error::usage(
                    "a measurement has no index and no normal map yet: picture its model instead",
                )),
            }
        }
        Some(model::KIND) => of_tile(&Model::open(&options.source)?, options, context),
        Some(enlarged::KIND) => of_enlarged(&Enlarged::open(&options.source)?, options, context),
        kind => Err(Error::input(format!(
            "{}: cannot picture a store of kind {kind:?}",
            options.source.display()
        ))),
    }
}

/// The window asked for, or all, checked against the plane and the memory.
fn within(window: Option<Window>, plane: Size, context: &Context<'_>) -> Result<Window> {
    let window = window.unwrap_or(plane.window());
    if !window.fits(plane) {
        return Err(Error::usage(format!("window {window} does not lie within {plane}")));
    }
    // Sums in f64, values, display bytes and the encoded file.
    let bytes = window.size.texels() as u64 * 48;
    if bytes > context.memory_bytes {
        return Err(Error::usage(format!(
            "a picture of {} takes {} MiB of memory",
            window.size,
            bytes >> 20
        ))
        .hint("picture a part of it with --window x,y,width,height, or allow a larger --memory"));
    }
    Ok(window)
}

/// The measurement itself, mixed between measured directions.
pub fn of_measurement(
    measurement: &Measurement,
    view: Direction,
    light: Direction,
    window: Window,
    context: &Context<'_>,
) -> Result<Picture> {
    let description = measurement.description();
    let [views, lights] =
        [&description.views, &description.lights].map(|d| Interpolator::new(d, &triangulate(d)));
    let appearance = Appearance::new(&views, &lights, view, light);
    let (texel, channels) = (description.texel_samples(), description.n_channels());
    let decoder = description.decoder()?;
    let mut pixels = vec![[0.0f64; 3]; window.size.texels()];
    let mut wanted: Vec<usize> = appearance.terms.iter().map(|&(view, ..)| view).collect();
    wanted.dedup();
    for view in wanted {
        for top in (0..window.size.height).step_by(BAND_ROWS) {
            context.check_stop()?;
            let rows = BAND_ROWS.min(window.size.height - top);
            let band = Window { y: window.y + top, x: window.x, size: Size::new(rows, window.size.width) };
            let samples = measurement.read_reflectance(view, band)?;
            let to = &mut pixels[top * window.size.width..];
            for (at, sum) in (0..samples.len()).step_by(texel).zip(to) {
                for &(_, light, weight) in appearance.terms.iter().filter(|(v, ..)| *v == view) {
                    add(sum, weight, decoder.rgb(&samples, at + light * channels));
                }
            }
        }
    }
    Ok(Picture::linear(window.size, pixels.into_iter().map(|p| p.map(|value| value as f32)).collect()))
}

/// Measured values of the texels of a tile.
pub fn of_measured_tile(
    measurement: &Measurement,
    tile: &Tile,
    view: Direction,
    light: Direction,
    context: &Context<'_>,
) -> Result<Picture> {
    let bounds = of_measurement(measurement, view, light, tile.bounds(), context)?;
    let pixels = tile.offsets_in_bounds().into_iter().map(|at| bounds.pixels[at]).collect();
    Ok(Picture::linear(tile.size, pixels))
}

/// Linear RGB of every cluster of a model under a light, seen from a view.
pub fn cluster_colors(model: &Model, view: Direction, light: Direction) -> Result<Vec<[f32; 3]>> {
    let [views, lights] = model.directions()?;
    let [view_triangles, light_triangles] = model.triangles()?;
    let (views, lights) =
        (Interpolator::new(&views, &view_triangles), Interpolator::new(&lights, &light_triangles));
    let representatives = model.representatives()?;
    let appearance = Appearance::new(&views, &lights, view, light);
    let decoder = representatives.decoder()?;
    Ok(appearance.of_brdfs(&representatives.samples, representatives.shape, &decoder))
}

/// Looks up the colour of each texel's cluster.
pub fn look_up(size: Size, index: &[u16], colors: &[[f32; 3]]) -> Result<Picture> {
    let pixels: Option<Vec<[f32; 3]>> =
        index.iter().map(|&cluster| colors.get(usize::from(cluster)).copied()).collect();
    let pixels = pixels.ok_or_else(|| {
        Error::input(format!("the index refers to clusters beyond the {} of the model", colors.len()))
    })?;
    Ok(Picture::linear(size, pixels))
}

fn of_tile(model: &Model, options: &Options, context: &Context<'_>) -> Result<Picture> {
    let tile = model.tile()?;
    let window = within(options.window, tile.size, context)?;
    let picture = match options.subject {
        Subject::Appearance { view, light } => {
            look_up(tile.size, &model.index()?, &cluster_colors(model, view, light)?)?
        }
        Subject::Index => false_color::index(tile.size, &model.index()?),
        Subject::Normals => false_color::normals(tile.size, &model.normals()?),
    };
    Ok(picture.part(window))
}

fn of_enlarged(enlarged: &Enlarged, options: &Options, context: &Context<'_>) -> Result<Picture> {
    let window = within(options.window, enlarged.size(), context)?;
    match options.subject {
        Subject::Appearance { view, light } => {
            let model = model_of(enlarged, options)?;
            look_up(window.size, &enlarged.read(window)?, &cluster_colors(&model, view, light)?)
        }
        Subject::Index => Ok(false_color::index(window.size, &enlarged.read(window)?)),
        Subject::Normals => {
            let normals = enlarged.read_normals(window)?.ok_or_else(|| {
                Error::missing(format!("{} has no normals", options.source.display()))
                    .hint("enlarge with --keep-normals to have them")
            })?;
            Ok(false_color::normals(window.size, &normals))
        }
    }
}

/// The model that an enlarged index refers to.
fn model_of(enlarged: &Enlarged, options: &Options) -> Result<Model> {
    let attributes = enlarged.attributes()?;
    let text = |value: Option<&Value>| value.and_then(Value::as_str).unwrap_or_default().to_owned();
    let path = match &options.model {
        Some(path) => path.clone(),
        None => beside(&options.source, &text(attributes.get("model_name"))),
    };
    let model = Model::open(&path).map_err(|error| error.hint("name the model with --model"))?;
    if text(attributes.get("recipe").and_then(|recipe| recipe.get("model"))) != model.digest()? {
        return Err(Error::recipe(format!(
            "{} was enlarged from another model than {}",
            options.source.display(),
            path.display()
        )));
    }
    Ok(model)
}

fn beside(path: &Path, name: &str) -> PathBuf {
    // A trailing slash would make the store its own parent.
    let path: PathBuf = path.components().collect();
    path.with_file_name(name)
}

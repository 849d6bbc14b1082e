//! Planar pictures of a measurement, a tile or an enlarged index under any light and view, (27).

mod find;
mod open;
pub mod recipe;
mod scene;

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::color::Decoder;
use crate::disk::output::Made;
use crate::error::{Error, Result};
use crate::method::tile::Tile;
use crate::method::value::evaluate::{Appearance, add};
use crate::method::value::evaluator;
use crate::method::value::triangulation::{Interpolator, triangulate};
use crate::picture::{Encoding, Ending, Picture, stream};
use crate::run::progress::Counted;
use crate::run::{Context, read_ahead};
use crate::shape::{Area, Size, Window};
use crate::stage::loss::Beyond;
use crate::store::measurement::Measurement;
use crate::store::model::Model;
use btfkit_formats::{Direction, Samples};
pub(crate) use find::{model_of, of_stage};
pub(crate) use open::without_source;
use scene::MEASUREMENT_ROWS;
pub(crate) use scene::plane_rows;
pub use scene::{Band, Scene};

/// Memory for what does not grow with a picture: the program itself, packers, buffers.
const WRITING_BYTES: u64 = 16 << 20;

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
    /// A measurement, a model (its tile, or an endless plane of it) or an enlarged index.
    pub source: PathBuf,
    /// The model of an enlarged index; beside it under its recorded name where absent.
    pub model: Option<PathBuf>,
    /// What to show.
    pub subject: Subject,
    /// Where the values of texels come from.
    pub values: Values,
    /// Of a model: the endless plane that the coherent rule makes of it, instead of its tile.
    pub plane: Option<PlaneOptions>,
    /// The part to show; all of it where absent. Only a plane has places below 0.
    pub window: Option<Area>,
}

/// Where the values of texels come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Values {
    /// The representatives of the clusters; the components of a model that has no clusters.
    #[default]
    Model,
    /// The components of the model.
    Components,
    /// The measurement itself, through the source of each texel; where it is not named, it lies beside the model.
    Measured(Option<PathBuf>),
}

/// Which of a model's endless planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaneOptions {
    /// Another seed gives another plane.
    pub seed: u32,
    /// See [`crate::method::coherent::Variation`]; by the model where absent.
    pub jitter: Option<u32>,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Report {
    /// Rows and columns.
    pub size: Size,
    /// Whether it was there already.
    pub made: Made,
    /// What the format does not hold, a sentence each.
    pub notes: Vec<String>,
}

/// Writes the picture: PNG and EXR row by row, in memory that grows with its width only.
///
/// # Errors
/// A window that does not lie within the plane, a size that the format or the memory does not hold, and those of
/// reading and writing.
pub fn run(
    options: &Options,
    exposure: f64,
    output: &Path,
    encoding: Encoding,
    context: &Context<'_>,
) -> Result<Report> {
    let fits = |size: Size| {
        encoding.check_size(size)?;
        encoding.check_memory(size, WRITING_BYTES, context.memory())
    };
    options.window.map_or(Ok(()), |window| fits(window.size))?;
    let mut scene = Scene::open(options, context)?;
    scene.expose(exposure);
    let size = scene.size();
    fits(size)?;
    let writing = encoding.memory_bytes(size) + WRITING_BYTES;
    let (in_flight, bands) = scene.bands_in_flight("a picture", writing, context)?;
    context.progress.begin("image", size.height as u64, Counted::Items("rows"));
    let read = |rows: Range<usize>| {
        Ok((rows.len(), scene.read(rows, context).map_err(|error| scene.explain(error))?))
    };
    let made = read_ahead::with(context, in_flight, bands, read, |bands| {
        let mut rows = Rows { bands, band: None };
        stream::prepare(output, encoding, size, scene.meaning(), context.existing, |pixels| {
            rows.next(pixels)?;
            if encoding.ending != Ending::Exr {
                scene.beyond().count_pixels(scene.meaning(), pixels);
            }
            context.progress.advance(1);
            Ok(())
        })?
        .publish()
    })?;
    context.progress.end();
    Ok(Report { size, made, notes: scene.notes() })
}

/// The rows of a picture, out of bands.
struct Rows<'a, 'b> {
    bands: &'a mut dyn Iterator<Item = Result<(usize, Band<'b>)>>,
    /// The band, its rows, and which of them comes next.
    band: Option<(usize, usize, Band<'b>)>,
}

impl Rows<'_, '_> {
    /// Gives the next row.
    fn next(&mut self, pixels: &mut [[f32; 3]]) -> Result<()> {
        let (next, rows, band) = match self.band.take() {
            Some(band) if band.0 < band.1 => band,
            // Dropped first: no more bands are alive than memory was counted for.
            done => {
                drop(done);
                let band = self.bands.next().ok_or_else(|| Error::internal("more rows than there are"))?;
                let (rows, band) = band?;
                (0, rows, band)
            }
        };
        band.row(next, pixels);
        self.band = Some((next + 1, rows, band));
        Ok(())
    }
}

/// The measurement itself, mixed between measured directions.
pub fn of_measurement(
    measurement: &Measurement,
    view: Direction,
    light: Direction,
    window: Window,
    context: &Context<'_>,
) -> Result<Picture> {
    let appearance = measured_appearance(measurement, view, light);
    let decoder = measurement.description().decoder()?;
    let beyond = Beyond::default();
    Ok(Picture::linear(window.size, mixed(measurement, &appearance, &decoder, window, &beyond, context)?))
}

/// What a user should know of a view and a light that nothing was measured at or around, or that look like radians.
pub fn notes_of_directions(measured: [&[Direction]; 2], view: Direction, light: Direction) -> Vec<String> {
    let mut notes = Vec::new();
    for (name, list, wanted) in [("view", measured[0], view), ("light", measured[1], light)] {
        if let Some(shown) = Interpolator::new(list, &triangulate(list)).shown_instead(wanted) {
            let scaled = if name == "light" { ", scaled by the cosine" } else { "" };
            notes.push(format!(
                "the {name} at {wanted} lies beyond the measured ones: this shows the {name} at {shown}{scaled}"
            ));
        }
        if looks_like_radians(wanted) {
            let degrees = btfkit_formats::six_digits(wanted.degrees().0.to_degrees());
            notes.push(format!(
                "angles are degrees: the {name} at {wanted} is taken as it is, theta in radians would be {degrees} degrees"
            ));
        }
    }
    notes
}

/// Whether angles in degrees look like angles in radians: small, with more than one decimal.
fn looks_like_radians(direction: Direction) -> bool {
    let (theta, phi) = direction.degrees();
    let is_fine = |angle: f64| (angle * 10.0 - (angle * 10.0).round()).abs() > 1e-6;
    theta > 0.0 && theta <= 1.6 && (0.0..6.3).contains(&phi) && (is_fine(theta) || is_fine(phi))
}

/// How a measurement is mixed under a light, seen from a view.
fn measured_appearance(measurement: &Measurement, view: Direction, light: Direction) -> Appearance {
    let description = measurement.description();
    let [views, lights] =
        [&description.views, &description.lights].map(|d| Interpolator::new(d, &triangulate(d)));
    Appearance::new(&views, &lights, view, light)
}

fn mixed(
    measurement: &Measurement,
    appearance: &Appearance,
    decoder: &Decoder,
    window: Window,
    beyond: &Beyond,
    context: &Context<'_>,
) -> Result<Vec<[f32; 3]>> {
    let description = measurement.description();
    let (texel, channels) = (description.texel_samples(), description.n_channels());
    let mut pixels = vec![[0.0f64; 3]; window.size.texels()];
    let mut wanted: Vec<usize> = appearance.terms.iter().map(|&(view, ..)| view).collect();
    wanted.dedup();
    for view in wanted {
        for top in (0..window.size.height).step_by(MEASUREMENT_ROWS) {
            context.check_stop()?;
            let rows = MEASUREMENT_ROWS.min(window.size.height - top);
            let band = Window { y: window.y + top, x: window.x, size: Size::new(rows, window.size.width) };
            let samples = measurement.read_reflectance(view, band)?;
            let to = &mut pixels[top * window.size.width..];
            let floats = matches!(samples, Samples::F16(_) | Samples::F32(_));
            let mut not_finite = 0;
            for (at, sum) in (0..samples.len()).step_by(texel).zip(to) {
                for &(_, light, weight) in appearance.terms.iter().filter(|(v, ..)| *v == view) {
                    if floats {
                        let first = at + light * channels;
                        let finite = |channel| samples.value(channel).is_some_and(f64::is_finite);
                        not_finite += (first..first + channels).filter(|&channel| !finite(channel)).count();
                    }
                    add(sum, weight, decoder.rgb(&samples, at + light * channels));
                }
            }
            beyond.count_not_finite(not_finite as u64);
        }
    }
    Ok(pixels.into_iter().map(|p| p.map(|value| value as f32)).collect())
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
    let appearance = appearance_of(model, view, light)?;
    let mut colors = Vec::new();
    for clusters in model.representative_chunks()? {
        let representatives = model.representatives_of(clusters)?;
        let decoder = representatives.decoder()?;
        colors.extend(appearance.of_brdfs(&representatives.samples, representatives.shape, &decoder));
    }
    Ok(colors)
}

/// How the values of a model are mixed under a light, seen from a view.
fn appearance_of(model: &Model, view: Direction, light: Direction) -> Result<Appearance> {
    let [views, lights] = model.directions()?;
    let [view_triangles, light_triangles] = model.triangles()?;
    let (views, lights) =
        (Interpolator::new(&views, &view_triangles), Interpolator::new(&lights, &light_triangles));
    Ok(Appearance::new(&views, &lights, view, light))
}

/// Looks up the colour of each texel's cluster.
pub fn look_up(size: Size, index: &[u16], colors: &[[f32; 3]]) -> Result<Picture> {
    let mut pixels = vec![[0.0; 3]; index.len()];
    evaluator::look_up(index, colors, &mut pixels)?;
    Ok(Picture::linear(size, pixels))
}

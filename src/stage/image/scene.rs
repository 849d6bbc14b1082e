//! What a picture is of, opened, and read band by band so that memory does not grow with its height.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Appearance, Options, Subject, cluster_colors, expect_colors, look_up, mixed};
use crate::color::Decoder;
use crate::error::{Error, Result};
use crate::picture::{Meaning, Picture, false_color};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::Store;
use crate::store::enlarged::{self, Enlarged};
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model, Stage};

/// Rows of a measurement that are decoded together: a row of chunks.
pub(super) const MEASUREMENT_ROWS: usize = 16;

/// A plane of pixels that can be read in parts.
pub struct Scene {
    source: Source,
    size: Size,
    /// Digest of what lies at the source.
    digest: String,
}

enum Source {
    Measurement { measurement: Measurement, appearance: Appearance, decoder: Decoder },
    Tile(Picture),
    Clusters { enlarged: Enlarged, colors: Vec<[f32; 3]> },
    Index(Enlarged),
    Normals(Enlarged),
}

/// Pixels of some rows; those of clusters are looked up row by row, since their numbers take less memory.
pub struct Band<'a> {
    width: usize,
    values: Values<'a>,
}

enum Values<'a> {
    Clusters { index: Vec<u16>, colors: &'a [[f32; 3]] },
    Pixels(Vec<[f32; 3]>),
}

impl Band<'_> {
    /// The pixels of a row of it.
    pub fn row(&self, row: usize, pixels: &mut [[f32; 3]]) {
        let range = row * self.width..(row + 1) * self.width;
        match &self.values {
            Values::Pixels(all) => pixels.copy_from_slice(&all[range]),
            Values::Clusters { index, colors } => {
                for (pixel, &cluster) in pixels.iter_mut().zip(&index[range]) {
                    *pixel = colors[usize::from(cluster)];
                }
            }
        }
    }
}

impl Scene {
    /// Opens what is to be pictured. Of a model only what the light and the view need is kept.
    ///
    /// # Errors
    /// Where there is nothing, or nothing that can be pictured as asked for.
    pub fn open(options: &Options) -> Result<Self> {
        let path = &options.source;
        let attributes = Store::at(path).attributes()?.ok_or_else(|| {
            Error::missing(format!(
                "{}: no store here, expected a measurement, a model or an enlarged index",
                path.display()
            ))
        })?;
        let digest = attributes.get("digest").and_then(Value::as_str).unwrap_or_default().to_owned();
        match attributes.get("kind").and_then(Value::as_str) {
            Some(measurement::KIND) => of_measurement(Measurement::open(path)?, options, digest),
            Some(model::KIND) => of_tile(&Model::open(path)?, options),
            Some(enlarged::KIND) => of_enlarged(Enlarged::open(path)?, options, digest),
            kind => Err(Error::input(format!("{}: cannot picture a store of kind {kind:?}", path.display()))),
        }
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.size
    }

    /// What its values mean.
    pub fn meaning(&self) -> Meaning {
        match &self.source {
            Source::Tile(picture) => picture.meaning,
            Source::Index(_) | Source::Normals(_) => Meaning::Display,
            Source::Measurement { .. } | Source::Clusters { .. } => Meaning::Linear,
        }
    }

    /// What tells its pixels apart from those of another source, for a recipe.
    pub fn recipe(&self) -> Value {
        let kind = match &self.source {
            Source::Measurement { .. } => measurement::KIND,
            Source::Tile(_) => model::KIND,
            Source::Clusters { .. } | Source::Index(_) | Source::Normals(_) => enlarged::KIND,
        };
        json!({"kind": kind, "digest": self.digest, "size": [self.size.height, self.size.width]})
    }

    /// Multiplies what is shown of light.
    pub fn expose(&mut self, exposure: f64) {
        let scale = |pixels: &mut [[f32; 3]]| {
            pixels.as_flattened_mut().iter_mut().for_each(|value| *value *= exposure as f32);
        };
        match &mut self.source {
            Source::Tile(picture) if picture.meaning == Meaning::Linear => scale(&mut picture.pixels),
            Source::Clusters { colors, .. } => scale(colors),
            Source::Measurement { appearance, .. } => {
                appearance.terms.iter_mut().for_each(|(.., weight)| *weight *= exposure);
            }
            Source::Tile(_) | Source::Index(_) | Source::Normals(_) => {}
        }
    }

    /// Reads a window, and of what is stored nothing but the chunks that it touches.
    pub fn read(&self, window: Window, context: &Context<'_>) -> Result<Band<'_>> {
        let values = match &self.source {
            Source::Measurement { measurement, appearance, decoder } => {
                Values::Pixels(mixed(measurement, appearance, decoder, window, context)?)
            }
            Source::Tile(picture) => Values::Pixels(picture.part(window).pixels),
            Source::Clusters { enlarged, colors } => {
                let index = enlarged.read(window)?;
                expect_colors(&index, colors)?;
                Values::Clusters { index, colors }
            }
            Source::Index(enlarged) => {
                Values::Pixels(false_color::index(window.size, &enlarged.read(window)?).pixels)
            }
            Source::Normals(enlarged) => {
                let normals = enlarged.read_normals(window)?.unwrap_or_default();
                Values::Pixels(false_color::normals(window.size, &normals).pixels)
            }
        };
        Ok(Band { width: window.size.width, values })
    }

    /// The bands of whole rows of chunks that a window is read in, or of parts of them where `allowed`
    /// bytes do not hold more.
    ///
    /// # Errors
    /// Where not even a row fits.
    pub fn bands(&self, window: Window, allowed_bytes: u64) -> Result<impl Iterator<Item = Window> + use<>> {
        let row_bytes = (window.size.width * self.texel_bytes()) as u64;
        let fitting = |&rows: &usize| rows as u64 * row_bytes <= allowed_bytes;
        let rows = std::iter::successors(Some(self.chunk_rows()), |&rows| (rows > 1).then_some(rows / 2));
        let rows = rows.into_iter().find(fitting).ok_or_else(|| {
            Error::usage(format!(
                "a row of {} pixels takes {} KiB of memory, {} KiB are left for it",
                window.size.width,
                row_bytes.div_ceil(1024),
                allowed_bytes / 1024
            ))
            .hint("allow a larger --memory, or picture a narrower part")
        })?;
        let end = window.y + window.size.height;
        let next = move |y: usize| (y < end).then(|| (y / rows + 1) * rows);
        let tops = std::iter::successors(Some(window.y), move |&y| next(y).filter(|&y| y < end));
        Ok(tops.map(move |y| {
            let rows = ((y / rows + 1) * rows).min(end) - y;
            Window { y, x: window.x, size: Size::new(rows, window.size.width) }
        }))
    }

    /// Rows that are decoded together.
    fn chunk_rows(&self) -> usize {
        match &self.source {
            Source::Measurement { .. } => MEASUREMENT_ROWS,
            Source::Tile(_) | Source::Clusters { .. } | Source::Index(_) | Source::Normals(_) => {
                enlarged::CHUNK_SIDE
            }
        }
    }

    /// Bytes that a texel of a band takes while it is read.
    fn texel_bytes(&self) -> usize {
        const PIXEL: usize = size_of::<[f32; 3]>();
        match &self.source {
            Source::Measurement { measurement, .. } => {
                measurement.description().texel_bytes() + size_of::<[f64; 3]>() + PIXEL
            }
            Source::Tile(_) => PIXEL,
            Source::Clusters { .. } => size_of::<u8>() + size_of::<u16>(),
            Source::Index(_) => size_of::<u8>() + size_of::<u16>() + PIXEL,
            Source::Normals(_) => 3 * PIXEL,
        }
    }
}

fn of_measurement(measurement: Measurement, options: &Options, digest: String) -> Result<Scene> {
    let Subject::Appearance { view, light } = options.subject else {
        return Err(Error::usage(
            "a measurement has no index and no normal map yet: picture its model instead",
        ));
    };
    let description = measurement.description();
    let (size, decoder) = (description.size, description.decoder()?);
    let appearance = super::measured_appearance(&measurement, view, light);
    Ok(Scene { source: Source::Measurement { measurement, appearance, decoder }, size, digest })
}

fn of_tile(model: &Model, options: &Options) -> Result<Scene> {
    let size = model.tile()?.size;
    let picture = match options.subject {
        Subject::Appearance { view, light } => {
            look_up(size, &model.index()?, &cluster_colors(model, view, light)?)?
        }
        Subject::Index => false_color::index(size, &model.index()?),
        Subject::Normals => false_color::normals(size, &model.normals()?),
    };
    Ok(Scene { source: Source::Tile(picture), size, digest: model.stage_digest(Stage::Cluster)? })
}

fn of_enlarged(enlarged: Enlarged, options: &Options, digest: String) -> Result<Scene> {
    let size = enlarged.size();
    let source = match options.subject {
        Subject::Appearance { view, light } => {
            let colors = cluster_colors(&model_of(&enlarged, options)?, view, light)?;
            Source::Clusters { enlarged, colors }
        }
        Subject::Index => Source::Index(enlarged),
        Subject::Normals if enlarged.has_normals() => Source::Normals(enlarged),
        Subject::Normals => {
            return Err(Error::missing(format!("{} has no normals", options.source.display()))
                .hint("enlarge with --keep-normals to have them"));
        }
    };
    Ok(Scene { source, size, digest })
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
    if text(attributes.get("recipe").and_then(|recipe| recipe.get("model")))
        != model.digest_of(enlarged.method()?.stages())?
    {
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

//! What a picture is of, opened, and read band by band so that memory does not grow with its height.

use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::{
    Appearance, Options, PlaneOptions, Subject, Values, cluster_colors, expect_colors, look_up, mixed,
    notes_of_directions, of_components, of_measured_tile,
};
use crate::color::Decoder;
use crate::error::{Error, ErrorKind, Result};
use crate::kernel::Kernel;
use crate::method::coherent::{Plane, Variation};
use crate::method::value::triangulation::{Interpolator, triangulate};
use crate::picture::{Meaning, Picture, false_color};
use crate::run::{Context, read_ahead};
use crate::shape::{Area, Size};
use crate::stage::cluster::{measurement_name, open_measurement_of};
use crate::stage::loss::Beyond;
use crate::stage::pack;
use crate::store::enlarged::{self, Enlarged};
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model, Stage};
use crate::store::origin;
use crate::words::counted;
use crate::zarr::Store;

/// Rows of a measurement that are decoded together: a row of chunks.
pub(super) const MEASUREMENT_ROWS: usize = 16;

/// Rows and columns of an endless plane that are made at once: what lies around a window is made for nothing.
const PLANE_SIDE: usize = 512;

/// Memory of a texel of a plane while it is made.
const PLANE_TEXEL_BYTES: usize = 24;

/// A plane of pixels that can be read in parts.
pub struct Scene {
    source: Source,
    /// The part that is shown.
    area: Area,
    /// What tells its pixels apart from those of another source.
    recipe: Value,
    beyond: Beyond,
    /// What is shown instead of a view or a light that was not measured.
    directions: Vec<String>,
    /// That the store is not complete yet, though what is shown may be.
    incomplete: Option<String>,
}

enum Source {
    Measurement {
        measurement: Measurement,
        appearance: Appearance,
        decoder: Decoder,
    },
    Tile(Picture),
    /// An enlarged index, by the colours of clusters.
    Clusters {
        enlarged: Enlarged,
        colors: Vec<[f32; 3]>,
    },
    Index(Enlarged),
    Normals(Enlarged),
    /// An enlarged index, by the pixels of the tile's texels.
    Sources {
        enlarged: Enlarged,
        tile: Picture,
    },
    /// An endless plane, by the pixels of the tile's texels.
    Plane {
        plane: Plane,
        variation: Variation,
        tile: Picture,
    },
}

/// What is pictured, as it was opened.
struct Opened {
    source: Source,
    size: Size,
    /// As in a [`Scene`].
    directions: Vec<String>,
    /// Digest of the components, where they were asked for.
    components: Option<String>,
}

/// Pixels of some rows; looked up row by row, since numbers take less memory.
pub struct Band<'a> {
    width: usize,
    pixels: Pixels<'a>,
}

enum Pixels<'a> {
    Clusters { index: Vec<u16>, colors: &'a [[f32; 3]] },
    Texels { source: Vec<u32>, tile: &'a [[f32; 3]] },
    Own(Vec<[f32; 3]>),
}

impl Source {
    /// What a store that is not complete yet lacks: views of a measurement, shards of an enlarged index.
    fn incomplete(&self, path: &Path) -> Option<String> {
        let (done, all, parts) = match self {
            Self::Measurement { measurement, .. } => {
                (measurement.views_done(), measurement.description().views.len(), "views")
            }
            Self::Clusters { enlarged, .. }
            | Self::Index(enlarged)
            | Self::Normals(enlarged)
            | Self::Sources { enlarged, .. } => {
                (enlarged.shards_done(), enlarged.shards().texels(), "shards")
            }
            Self::Tile(_) | Self::Plane { .. } => return None,
        };
        (done < all).then(|| {
            let path = path.display();
            format!(
                "{path} is not complete, {} of {all} {parts} are missing; this shows what is there",
                all - done
            )
        })
    }
}

impl Band<'_> {
    /// The pixels of a row of it.
    pub fn row(&self, row: usize, pixels: &mut [[f32; 3]]) {
        let range = row * self.width..(row + 1) * self.width;
        match &self.pixels {
            Pixels::Own(all) => pixels.copy_from_slice(&all[range]),
            Pixels::Clusters { index, colors } => {
                for (pixel, &cluster) in pixels.iter_mut().zip(&index[range]) {
                    *pixel = colors[usize::from(cluster)];
                }
            }
            Pixels::Texels { source, tile } => {
                for (pixel, &texel) in pixels.iter_mut().zip(&source[range]) {
                    *pixel = tile[texel as usize];
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
    pub fn open(options: &Options, context: &Context<'_>) -> Result<Self> {
        let path = &options.source;
        if pack::is_packed(path) {
            return of_packed(options, context);
        }
        let store = Store::at(path);
        let attributes = store.expect_one_of(&[measurement::KIND, model::KIND, enlarged::KIND])?;
        let digest = attributes.get("digest").and_then(Value::as_str).unwrap_or_default().to_owned();
        let kind = attributes.get("kind").and_then(Value::as_str).unwrap_or("unknown");
        if kind != model::KIND {
            store.see("", &digest);
        }
        if options.plane.is_some() && kind != model::KIND {
            return Err(Error::usage(format!(
                "{}: an endless plane is made of a model, got {}",
                path.display(),
                crate::store::recognise::article(kind)
            )));
        }
        let (Opened { source, size, directions, components }, digest) = match (kind, options.plane) {
            (measurement::KIND, _) => (of_measurement(Measurement::open(path)?, options)?, digest),
            (model::KIND, None) => {
                let model = Model::open(path)?;
                (of_tile(&model, options, context)?, shown_digest(&model, options)?)
            }
            (model::KIND, Some(plane)) => return of_plane(&Model::open(path)?, options, plane, context),
            (enlarged::KIND, _) => (of_enlarged(Enlarged::open(path)?, options, context)?, digest),
            _ => {
                return Err(Error::input(format!(
                    "{}: cannot picture a store of kind {kind}",
                    path.display()
                )));
            }
        };
        store.expect_unchanged()?;
        let whole = Area { y: 0, x: 0, size };
        let area = shown_part(options, size)?;
        let mut recipe = json!({"kind": kind, "digest": digest, "size": [size.height, size.width]});
        if area != whole {
            recipe["window"] = json!([area.x, area.y, area.size.width, area.size.height]);
        }
        match &options.values {
            Values::Model => {}
            Values::Measured(_) => recipe["values"] = json!("measured"),
            Values::Components => recipe["values"] = json!({"components": components}),
        }
        let incomplete = source.incomplete(path);
        Ok(Self { source, area, recipe, beyond: Beyond::default(), directions, incomplete })
    }

    /// What a user should know of the picture: what display values do not hold of it, and what its store lacks.
    pub fn notes(&self) -> Vec<String> {
        let told = self.incomplete.iter().chain(&self.directions).cloned();
        told.chain(self.beyond.notes()).collect()
    }

    /// Says of an error that something is missing how much of the store is.
    pub(crate) fn explain(&self, error: Error) -> Error {
        match &self.incomplete {
            Some(told) if error.kind() == ErrorKind::Missing => {
                let told = told.split("; ").next().unwrap_or_default();
                let hint = error.guidance().unwrap_or_default().to_owned();
                Error::missing(format!("{error}: {told}")).hint(hint)
            }
            _ => error,
        }
    }

    /// That the store of the picture is not complete, where it is not.
    pub(crate) fn incomplete(&self) -> Option<&str> {
        self.incomplete.as_deref()
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.area.size
    }

    /// What of it display values do not hold, as far as it has been read; whoever encodes rows counts them here too.
    pub fn beyond(&self) -> &Beyond {
        &self.beyond
    }

    /// What its values mean.
    pub fn meaning(&self) -> Meaning {
        match &self.source {
            Source::Tile(tile) | Source::Sources { tile, .. } | Source::Plane { tile, .. } => tile.meaning,
            Source::Index(_) | Source::Normals(_) => Meaning::Display,
            Source::Measurement { .. } | Source::Clusters { .. } => Meaning::Linear,
        }
    }

    /// What tells its pixels apart from those of another source, for a recipe.
    pub fn recipe(&self) -> Value {
        self.recipe.clone()
    }

    /// Multiplies what is shown of light.
    pub(crate) fn expose(&mut self, exposure: f64) {
        let scale = |pixels: &mut [[f32; 3]]| {
            pixels.as_flattened_mut().iter_mut().for_each(|value| *value *= exposure as f32);
        };
        match &mut self.source {
            Source::Tile(tile) | Source::Sources { tile, .. } | Source::Plane { tile, .. } => {
                if tile.meaning == Meaning::Linear {
                    scale(&mut tile.pixels);
                }
            }
            Source::Clusters { colors, .. } => scale(colors),
            Source::Measurement { appearance, .. } => {
                appearance.terms.iter_mut().for_each(|(.., weight)| *weight *= exposure);
            }
            Source::Index(_) | Source::Normals(_) => {}
        }
    }

    /// Reads some rows, and of what is stored nothing but the chunks that they touch.
    pub fn read(&self, rows: Range<usize>, context: &Context<'_>) -> Result<Band<'_>> {
        let width = self.area.size.width;
        let area =
            Area { y: self.area.y + rows.start as i64, size: Size::new(rows.len(), width), ..self.area };
        if let Source::Plane { plane, variation, tile } = &self.source {
            let source = context.install(|| plane_rows(plane, variation, area))?;
            return Ok(Band { width, pixels: Pixels::Texels { source, tile: &tile.pixels } });
        }
        let window = area.within_first_quadrant().ok_or_else(|| Error::internal("a window below 0"))?;
        let pixels = match &self.source {
            Source::Measurement { measurement, appearance, decoder } => {
                Pixels::Own(mixed(measurement, appearance, decoder, window, &self.beyond, context)?)
            }
            Source::Tile(picture) => Pixels::Own(picture.part(window).pixels),
            Source::Clusters { enlarged, colors } => {
                let index = enlarged.read(window)?;
                expect_colors(&index, colors)?;
                Pixels::Clusters { index, colors }
            }
            Source::Sources { enlarged, tile } => {
                let source = enlarged.read_source(window)?.unwrap_or_default();
                if let Some(texel) = source.iter().find(|&&texel| texel as usize >= tile.pixels.len()) {
                    return Err(Error::input(format!(
                        "source: got texel {texel}, the tile has {}",
                        tile.pixels.len()
                    )));
                }
                Pixels::Texels { source, tile: &tile.pixels }
            }
            Source::Index(enlarged) => {
                Pixels::Own(false_color::index(window.size, &enlarged.read(window)?).pixels)
            }
            Source::Normals(enlarged) => {
                let normals = enlarged.read_normals(window)?.unwrap_or_default();
                Pixels::Own(false_color::normals(window.size, &normals).pixels)
            }
            Source::Plane { .. } => return Err(Error::internal("a plane is not stored")),
        };
        Ok(Band { width, pixels })
    }

    /// The bands of whole rows of chunks that the picture is read in, or of parts of them where memory does not hold
    /// more beside so many bytes, and how many of them fit at a time. `what` has these rows.
    ///
    /// # Errors
    /// Where not even a row fits.
    pub(crate) fn bands_in_flight(
        &self,
        what: &str,
        beside: u64,
        context: &Context<'_>,
    ) -> Result<(usize, impl Iterator<Item = Range<usize>> + Send + use<>)> {
        let Size { height, width } = self.area.size;
        let row_bytes = (width * self.texel_bytes()) as u64;
        let sizes = std::iter::successors(Some(self.chunk_rows()), |&rows| (rows > 1).then_some(rows / 2));
        let what = format!("{what} {} wide", counted(width, "pixel"));
        context.memory().require(&what, beside + row_bytes, "show a narrower part by --window")?;
        let allowed_bytes = context.memory_bytes.saturating_sub(beside);
        let fitting = sizes.into_iter().find(|&rows| rows as u64 * row_bytes <= allowed_bytes);
        let rows = fitting.ok_or_else(|| Error::internal("memory for no row"))?;
        let in_flight = read_ahead::in_flight(allowed_bytes, rows as u64 * row_bytes);
        // Rows of chunks begin at row 0 of what is stored.
        let before = self.area.y.rem_euclid(rows as i64) as usize;
        let tops = (0..before + height).step_by(rows);
        let bands = tops.map(move |top| top.saturating_sub(before)..(top + rows - before).min(height));
        Ok((in_flight, bands))
    }

    /// Rows that are decoded together.
    fn chunk_rows(&self) -> usize {
        match &self.source {
            Source::Measurement { .. } => MEASUREMENT_ROWS,
            Source::Plane { .. } => PLANE_SIDE,
            _ => enlarged::CHUNK_SIDE,
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
            Source::Sources { .. } => 2 * size_of::<u32>(),
            Source::Plane { .. } => PLANE_TEXEL_BYTES,
        }
    }
}

/// Source texels of some rows of a plane; pieces of them are made on all threads.
pub(crate) fn plane_rows(plane: &Plane, variation: &Variation, area: Area) -> Result<Vec<u32>> {
    let Size { height, width } = area.size;
    let columns: Vec<usize> = (0..width).step_by(PLANE_SIDE).collect();
    let piece = |&left: &usize| {
        let size = Size::new(height, PLANE_SIDE.min(width - left));
        Ok((left, size, plane.window(variation, area.y, area.x + left as i64, size)?))
    };
    let pieces = columns.par_iter().map(piece).collect::<Result<Vec<_>>>()?;
    let mut source = vec![0; height * width];
    for (left, size, piece) in pieces {
        for (row, to) in piece.chunks_exact(size.width).zip(source.chunks_exact_mut(width)) {
            to[left..left + size.width].copy_from_slice(row);
        }
    }
    Ok(source)
}

fn of_measurement(measurement: Measurement, options: &Options) -> Result<Opened> {
    let Subject::Appearance { view, light } = options.subject else {
        return Err(Error::usage(
            "a measurement has no index and no normal map yet: picture its model instead",
        ));
    };
    let description = measurement.description();
    let (size, decoder) = (description.size, description.decoder()?);
    let directions = notes_of_directions([&description.views, &description.lights], view, light);
    let appearance = super::measured_appearance(&measurement, view, light);
    Ok(Opened {
        source: Source::Measurement { measurement, appearance, decoder },
        size,
        directions,
        components: None,
    })
}

/// The part of a plane of this size that is to be shown.
fn shown_part(options: &Options, size: Size) -> Result<Area> {
    let area = options.window.unwrap_or(Area { y: 0, x: 0, size });
    if area.within_first_quadrant().is_none_or(|window| !window.fits(size)) {
        let Area { x, y, size: part } = area;
        return Err(Error::usage(format!(
            "window {x},{y},{},{} does not lie within {size}",
            part.width, part.height
        )));
    }
    Ok(area)
}

/// The tile of a packed model.
fn of_packed(options: &Options, context: &Context<'_>) -> Result<Scene> {
    let refused = |what: &str| {
        Error::usage(format!("{}: a packed model has {what}", options.source.display()))
            .hint("make a model of it for that: btf unpack")
    };
    if options.plane.is_some() {
        return Err(refused("no endless plane, only its tile"));
    }
    if matches!(options.values, Values::Measured(_)) || options.model.is_some() {
        return Err(refused("its own values"));
    }
    let Subject::Appearance { view, light } = options.subject else {
        return Err(refused("no index and no normals"));
    };
    let opened = pack::open(&options.source, context)?;
    let area = shown_part(options, opened.components.size)?;
    let [views, lights] =
        [&opened.views, &opened.lights].map(|list| Interpolator::new(list, &triangulate(list)));
    let appearance = Appearance::new(&views, &lights, view, light);
    let colors = context.install(|| opened.components.colors(&appearance))?;
    let mut directions = notes_of_directions([&opened.views, &opened.lights], view, light);
    directions.extend(opened.notes);
    let window = [area.x, area.y, area.size.width as i64, area.size.height as i64];
    Ok(Scene {
        source: Source::Tile(Picture::linear(opened.components.size, colors)),
        area,
        recipe: json!({"kind": "packed", "digest": opened.digest, "window": window}),
        beyond: Beyond::default(),
        directions,
        incomplete: None,
    })
}

fn of_tile(model: &Model, options: &Options, context: &Context<'_>) -> Result<Opened> {
    let tile = tile_picture(model, options, context)?;
    let size = tile.size;
    let mut directions = of_model(model, options)?;
    let is_lit = matches!(options.subject, Subject::Appearance { .. });
    if options.values == Values::Model && is_lit && by_components(model, &options.values)? {
        directions.push("the model has no clusters: values are those of its components".to_owned());
    }
    Ok(Opened { source: Source::Tile(tile), size, directions, components: components_of(model, options)? })
}

/// Digest of a model's components, where values are theirs by option.
fn components_of(model: &Model, options: &Options) -> Result<Option<String>> {
    let wanted = options.values == Values::Components;
    wanted.then(|| model.stage_digest(Stage::Components)).transpose()
}

/// Digest of the stage of a model that a picture of its tile shows.
fn shown_digest(model: &Model, options: &Options) -> Result<String> {
    let is_lit = matches!(options.subject, Subject::Appearance { .. });
    let stage =
        if is_lit && by_components(model, &options.values)? { Stage::Components } else { Stage::Cluster };
    model.stage_digest(stage)
}

/// Whether values come from the components: where they are asked for, and where there are no clusters.
fn by_components(model: &Model, values: &Values) -> Result<bool> {
    Ok(match values {
        Values::Components => true,
        Values::Model => !model.has(Stage::Cluster)? && model.has(Stage::Components)?,
        Values::Measured(_) => false,
    })
}

/// What is to be said of the directions of a picture of a model.
fn of_model(model: &Model, options: &Options) -> Result<Vec<String>> {
    let Subject::Appearance { view, light } = options.subject else { return Ok(Vec::new()) };
    let [views, lights] = model.directions()?;
    Ok(notes_of_directions([&views, &lights], view, light))
}

/// The tile's texels under the light, by clusters or as measured, or in false colours.
fn tile_picture(model: &Model, options: &Options, context: &Context<'_>) -> Result<Picture> {
    let tile = model.tile()?;
    match (options.subject, &options.values) {
        (Subject::Appearance { view, light }, values) if by_components(model, values)? => {
            of_components(model, view, light, context)
        }
        (Subject::Appearance { view, light }, Values::Model | Values::Components) => {
            let colors = of_stage(model, Stage::Cluster, |model| cluster_colors(model, view, light))?;
            look_up(tile.size, &of_stage(model, Stage::Cluster, Model::index)?, &colors)
        }
        (Subject::Appearance { view, light }, Values::Measured(path)) => {
            let measurement = measurement_of(model, path.as_deref())?;
            of_measured_tile(&measurement, &tile, view, light, context)
        }
        (Subject::Index, _) => {
            Ok(false_color::index(tile.size, &of_stage(model, Stage::Cluster, Model::index)?))
        }
        (Subject::Normals, _) => {
            Ok(false_color::normals(tile.size, &of_stage(model, Stage::Normals, Model::normals)?))
        }
    }
}

/// The measurement that a model was made of; where it is not named, it is looked for where it lay then as seen from the
/// model, beside the model, and in the current folder.
fn measurement_of(model: &Model, named: Option<&Path>) -> Result<Measurement> {
    if let Some(path) = named {
        return open_measurement_of(model, path);
    }
    let name = measurement_name(model.path());
    let places = origin::places(model.path(), origin::MEASUREMENT, name.to_str());
    let error = match found_at(&places, |path| open_measurement_of(model, path)) {
        Ok(measurement) => return Ok(measurement),
        Err(Some(error)) => return Err(error),
        Err(None) => Error::missing(format!(
            "{}: the measurement that it was made of is not there; looked for {}",
            model.path().display(),
            listed(&places)
        )),
    };
    Err(error.hint("name the measurement with --measurement"))
}

/// What is opened at the first of some places that can be; else the first error, if there is anything at any of them.
fn found_at<T>(
    places: &[PathBuf],
    open: impl Fn(&Path) -> Result<T>,
) -> std::result::Result<T, Option<Error>> {
    let mut failed = None;
    for path in places.iter().filter(|path| path.exists()) {
        match open(path) {
            Ok(found) => return Ok(found),
            Err(error) => drop(failed.get_or_insert(error)),
        }
    }
    Err(failed)
}

fn listed(places: &[PathBuf]) -> String {
    places.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ")
}

fn of_plane(model: &Model, options: &Options, which: PlaneOptions, context: &Context<'_>) -> Result<Scene> {
    let area = options.window.ok_or_else(|| {
        Error::usage("an endless plane has no size of its own: say which part with --window x,y,width,height")
    })?;
    let tile = tile_picture(model, options, context)?;
    let appearance = of_stage(model, Stage::Appearance, Model::appearance)?;
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    let plane = context.compute(|| Plane::new(tile.size, &index, &appearance, Kernel::fastest()))?;
    let mut variation = plane.variation(which.seed);
    variation.jitter = which.jitter.unwrap_or(variation.jitter);
    plane.check(&variation)?;
    let mut recipe = json!({
        "kind": "plane",
        "digest": model.digest_of(enlarged::Method::Coherent.stages())?,
        "seed": variation.seed,
        "jitter": variation.jitter,
        "window": [area.x, area.y, area.size.width, area.size.height],
        "values": match options.values {
            Values::Model => "model",
            Values::Components => "components",
            Values::Measured(_) => "measured",
        },
    });
    if let Some(components) = components_of(model, options)? {
        recipe["components"] = json!(components);
    }
    Ok(Scene {
        source: Source::Plane { plane, variation, tile },
        area,
        recipe,
        beyond: Beyond::default(),
        directions: of_model(model, options)?,
        incomplete: None,
    })
}

fn of_enlarged(enlarged: Enlarged, options: &Options, context: &Context<'_>) -> Result<Opened> {
    let size = enlarged.size();
    let (mut directions, mut components) = (Vec::new(), None);
    let source = match options.subject {
        Subject::Appearance { view, light } if options.values == Values::Model => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            let colors = cluster_colors(&model, view, light)?;
            directions = of_model(&model, options)?;
            Source::Clusters { enlarged, colors }
        }
        Subject::Index => Source::Index(enlarged),
        Subject::Normals if enlarged.has_normals() => Source::Normals(enlarged),
        Subject::Appearance { .. } | Subject::Normals if enlarged.has_source() => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            let tile = tile_picture(&model, options, context)?;
            components = components_of(&model, options)?;
            directions = of_model(&model, options)?;
            Source::Sources { enlarged, tile }
        }
        Subject::Normals => {
            return Err(Error::missing(format!("{} has no normals", options.source.display()))
                .hint("enlarge with --keep-normals to have them, under another name or with --force"));
        }
        Subject::Appearance { .. } => {
            return Err(Error::missing(format!(
                "{} does not say which texel of the tile each of its texels is",
                options.source.display()
            ))
            .hint("enlarge by another --method than paper, without --no-source, under another name or with --force"));
        }
    };
    Ok(Opened { source, size, directions, components })
}

/// The model that an enlarged index at a path refers to; where it is not named, it is looked for where it lay when the
/// index was made, as seen from the index, and beside it.
pub(crate) fn model_of(enlarged: &Enlarged, place: &Path, named: Option<&Path>) -> Result<Model> {
    let stages = enlarged.method().stages();
    let open = |path: &Path| {
        let model = Model::open(path)?;
        if enlarged.recipe().model == model.digest_of(stages)? {
            return Ok(model);
        }
        Err(Error::recipe(format!(
            "{} was enlarged from another model than {}",
            place.display(),
            path.display()
        )))
    };
    if let Some(path) = named {
        return open(path).map_err(|error| error.hint("--model names the model that it was enlarged from"));
    }
    let places = origin::places(place, origin::MODEL, enlarged.model_name());
    let error = match found_at(&places, open) {
        Ok(model) => return Ok(model),
        Err(failed) => failed.unwrap_or_else(|| {
            Error::missing(format!(
                "{}: the model that it was enlarged from is not there; looked for {}",
                place.display(),
                listed(&places)
            ))
        }),
    };
    Err(error.hint("name the model with --model"))
}

/// Reads what a stage of a model left; where that is not there, the error says which command makes it.
pub(crate) fn of_stage<T>(model: &Model, stage: Stage, read: impl FnOnce(&Model) -> Result<T>) -> Result<T> {
    model.stage_digest(stage)?;
    read(model).map_err(|error| match error.kind() {
        ErrorKind::Missing => {
            error.hint(format!("run `btf {}` on the model: it makes again what is missing", stage.name()))
        }
        _ => error,
    })
}

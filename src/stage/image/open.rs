//! Opens what is to be pictured: a measurement, a model's tile or its endless plane, an enlarged index.

use std::path::Path;

use btfkit_formats::Direction;

use super::find::{measurement_of, model_of, of_stage};
use super::recipe::{Endless, Packed, SceneRecipe, Stored, ValuesName, window_of};
use super::scene::{Scene, Source};
use super::{
    Options, PlaneOptions, Subject, Values, cluster_colors, look_up, measured_appearance,
    notes_of_directions, of_measured_tile,
};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::Plane;
use crate::picture::{Picture, false_color};
use crate::run::Context;
use crate::shape::{Area, Size};
use crate::stage::pack;
use crate::stage::values::{By, TileValues};
use crate::store::enlarged::{self, Enlarged};
use crate::store::kind_of;
use crate::store::measurement::{self, Measurement};
use crate::store::model::{self, Model, Stage};
use crate::store::recognise::article;

/// What is pictured, as it was opened.
struct Opened {
    source: Source,
    size: Size,
    /// As in a [`Scene`].
    directions: Vec<String>,
    /// Where values come from.
    values: ValuesName,
}

/// The picture of a tile, and what it was made of.
struct Shown {
    picture: Picture,
    /// The stage of the model that is shown.
    stage: Stage,
    values: ValuesName,
    notes: Vec<String>,
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
        let kind = kind_of(path)?;
        if options.plane.is_some() && kind != model::KIND {
            return Err(Error::usage(format!(
                "{}: an endless plane is made of a model, got {}",
                path.display(),
                article(kind)
            )));
        }
        type Of = fn(Stored) -> SceneRecipe;
        let (Opened { source, size, directions, values }, of, digest): (_, Of, _) =
            match (kind, options.plane) {
                (model::KIND, Some(plane)) => return of_plane(&Model::open(path)?, options, plane, context),
                (model::KIND, None) => {
                    let model = Model::open(path)?;
                    let (opened, stage) = of_tile(&model, options, context)?;
                    (opened, SceneRecipe::Model, model.stage_digest(stage)?)
                }
                (measurement::KIND, _) => {
                    let measurement = Measurement::open(path)?;
                    let digest = measurement.digest().to_owned();
                    (of_measurement(measurement, options)?, SceneRecipe::Measurement, digest)
                }
                _ => {
                    let enlarged = Enlarged::open(path)?;
                    let digest = enlarged.digest().to_owned();
                    (of_enlarged(enlarged, options, context)?, SceneRecipe::Enlarged, digest)
                }
            };
        let whole = Area { y: 0, x: 0, size };
        let area = shown_part(options, size)?;
        let recipe = of(Stored {
            digest,
            size: [size.height, size.width],
            window: (area != whole).then(|| window_of(area)),
            values: Some(values).filter(|values| *values != ValuesName::Model),
        });
        let incomplete = source.incomplete(path);
        Ok(Self::new(source, area, recipe, directions, incomplete))
    }
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
    let appearance = measured_appearance(&measurement, view, light);
    Ok(Opened {
        source: Source::Measurement { measurement, appearance, decoder },
        size,
        directions,
        values: ValuesName::Model,
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
    let values = TileValues::of_packed(&options.source, context)?;
    let area = shown_part(options, values.size())?;
    let mut directions = notes_of_directions(values.directions(), view, light);
    directions.extend_from_slice(values.notes());
    let source = Source::Tile(values.picture(view, light, context)?);
    let recipe = SceneRecipe::Packed(Packed { digest: values.digest().to_owned(), window: window_of(area) });
    Ok(Scene::new(source, area, recipe, directions, None))
}

/// The tile of a model, and which of its stages is shown.
fn of_tile(model: &Model, options: &Options, context: &Context<'_>) -> Result<(Opened, Stage)> {
    let Shown { picture, stage, values, notes: directions } = shown_tile(model, options, context)?;
    Ok((Opened { size: picture.size, source: Source::Tile(picture), directions, values }, stage))
}

/// The tile's texels under the light, by the values that were asked for, or in false colours. Of the model nothing else
/// is opened.
fn shown_tile(model: &Model, options: &Options, context: &Context<'_>) -> Result<Shown> {
    let size = model.tile_report()?.size();
    let false_colors = |picture, stage| Shown { picture, stage, values: ValuesName::Model, notes: vec![] };
    let (view, light) = match options.subject {
        Subject::Appearance { view, light } => (view, light),
        Subject::Index => {
            let index = of_stage(model, Stage::Cluster, Model::index)?;
            let pixels = look_up(size, &index, &colors_by_lightness(model)?)?.pixels;
            return Ok(false_colors(Picture::display(size, pixels), Stage::Cluster));
        }
        Subject::Normals => {
            let normals = of_stage(model, Stage::Normals, Model::normals)?;
            return Ok(false_colors(false_color::normals(size, &normals), Stage::Normals));
        }
    };
    let [views, lights] = model.directions()?;
    let mut notes = notes_of_directions([&views, &lights], view, light);
    let (by, values) = match &options.values {
        Values::Measured(path) => {
            let measurement = measurement_of(model, path.as_deref())?;
            let picture = of_measured_tile(&measurement, &model.tile()?, view, light, context)?;
            return Ok(Shown { picture, stage: Stage::Tile, values: ValuesName::Measured, notes });
        }
        Values::Components => {
            let digest = model.stage_digest(Stage::Components)?;
            (By::Components, ValuesName::Components(digest))
        }
        Values::Model => (By::of(model)?, ValuesName::Model),
    };
    if (&options.values, by) == (&Values::Model, By::Components) {
        notes.push("the model has no clusters: values are those of its components".to_owned());
    }
    let picture = TileValues::of_model(model, by, context)?.picture(view, light, context)?;
    Ok(Shown { picture, stage: by.stage(), values, notes })
}

/// False colours of a model's clusters, by how light they are when looked at and lit from above.
fn colors_by_lightness(model: &Model) -> Result<Vec<[f32; 3]>> {
    let above = Direction::from_degrees(0.0, 0.0);
    let colors = of_stage(model, Stage::Cluster, |model| cluster_colors(model, above, above))?;
    Ok(false_color::by_lightness(&colors))
}

fn of_plane(model: &Model, options: &Options, which: PlaneOptions, context: &Context<'_>) -> Result<Scene> {
    let area = options.window.ok_or_else(|| {
        Error::usage("an endless plane has no size of its own: say which part with --window x,y,width,height")
    })?;
    let Shown { picture: tile, values, notes: directions, .. } = shown_tile(model, options, context)?;
    let appearance = of_stage(model, Stage::Appearance, Model::appearance)?;
    let index = of_stage(model, Stage::Cluster, Model::index)?;
    let plane = context.compute(|| Plane::new(tile.size, &index, &appearance, Kernel::fastest()))?;
    let mut variation = plane.variation(which.seed);
    variation.jitter = which.jitter.unwrap_or(variation.jitter);
    plane.check(&variation)?;
    let recipe = SceneRecipe::Plane(Endless {
        digest: model.digest_of(enlarged::Method::Coherent.stages())?,
        seed: variation.seed,
        jitter: variation.jitter,
        window: window_of(area),
        values,
    });
    Ok(Scene::new(Source::Plane { plane, variation, tile }, area, recipe, directions, None))
}

/// That an enlargement does not keep what values of single texels need.
pub(crate) fn without_source(path: &Path) -> Error {
    Error::missing(format!("{} does not say which texel of the tile each of its texels is", path.display()))
        .hint(
            "enlarge by another --method than paper, without --no-source, under another name or with --force",
        )
}

fn of_enlarged(enlarged: Enlarged, options: &Options, context: &Context<'_>) -> Result<Opened> {
    let size = enlarged.size();
    let (mut directions, mut values) = (Vec::new(), ValuesName::Model);
    let source = match options.subject {
        Subject::Appearance { view, light } if options.values == Values::Model => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            let colors = cluster_colors(&model, view, light)?;
            let [views, lights] = model.directions()?;
            directions = notes_of_directions([&views, &lights], view, light);
            Source::Clusters { enlarged, colors }
        }
        Subject::Index => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            Source::Index { colors: colors_by_lightness(&model)?, enlarged }
        }
        Subject::Normals if enlarged.has_normals() => Source::Normals(enlarged),
        Subject::Appearance { .. } | Subject::Normals if enlarged.has_source() => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            let shown = shown_tile(&model, options, context)?;
            (directions, values) = (shown.notes, shown.values);
            Source::Sources { enlarged, tile: shown.picture }
        }
        Subject::Normals => {
            return Err(Error::missing(format!("{} has no normals", options.source.display()))
                .hint("enlarge with --keep-normals to have them, under another name or with --force"));
        }
        Subject::Appearance { .. } => {
            return Err(without_source(&options.source));
        }
    };
    Ok(Opened { source, size, directions, values })
}

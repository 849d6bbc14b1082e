//! Opens what is to be pictured: a measurement, a model's tile or its endless plane, an enlarged index.

use btfkit_formats::Direction;

use super::find::{measurement_of, model_of, of_stage};
use super::recipe::{Endless, Packed, PlaneValues, SceneRecipe, Stored, ValuesName, window_of};
use super::scene::{Scene, Source};
use super::{
    Appearance, Options, PlaneOptions, Subject, Values, cluster_colors, look_up, measured_appearance,
    notes_of_directions, of_components, of_measured_tile,
};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::coherent::Plane;
use crate::method::value::triangulation::{Interpolator, triangulate};
use crate::picture::{Picture, false_color};
use crate::run::Context;
use crate::shape::{Area, Size};
use crate::stage::pack;
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
    /// Digest of the components, where they were asked for.
    components: Option<String>,
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
        let (Opened { source, size, directions, components }, of, digest): (_, Of, _) =
            match (kind, options.plane) {
                (model::KIND, Some(plane)) => return of_plane(&Model::open(path)?, options, plane, context),
                (model::KIND, None) => {
                    let model = Model::open(path)?;
                    let opened = of_tile(&model, options, context)?;
                    (opened, SceneRecipe::Model, shown_digest(&model, options)?)
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
            values: match options.values {
                Values::Model => None,
                Values::Measured(_) => Some(ValuesName::Measured),
                Values::Components => Some(ValuesName::Components(components)),
            },
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
    let source = Source::Tile(Picture::linear(opened.components.size, colors));
    let recipe = SceneRecipe::Packed(Packed { digest: opened.digest, window: window_of(area) });
    Ok(Scene::new(source, area, recipe, directions, None))
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
            let index = of_stage(model, Stage::Cluster, Model::index)?;
            let pixels = look_up(tile.size, &index, &colors_by_lightness(model)?)?.pixels;
            Ok(Picture::display(tile.size, pixels))
        }
        (Subject::Normals, _) => {
            Ok(false_color::normals(tile.size, &of_stage(model, Stage::Normals, Model::normals)?))
        }
    }
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
    let tile = tile_picture(model, options, context)?;
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
        values: match options.values {
            Values::Model => PlaneValues::Model,
            Values::Components => PlaneValues::Components,
            Values::Measured(_) => PlaneValues::Measured,
        },
        components: components_of(model, options)?,
    });
    let directions = of_model(model, options)?;
    Ok(Scene::new(Source::Plane { plane, variation, tile }, area, recipe, directions, None))
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
        Subject::Index => {
            let model = model_of(&enlarged, &options.source, options.model.as_deref())?;
            Source::Index { colors: colors_by_lightness(&model)?, enlarged }
        }
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

//! What a store or a pyramid is, without reading its samples: for people and, as JSON with stable keys, for programs.

use std::path::Path;

use btfkit_formats::Direction;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::error::Result;
use crate::method::coherent::JITTER_ONE;
pub use crate::stage::deepzoom::Pyramidal;
pub use crate::stage::kept::Kept;
use crate::stage::kept::bytes_below;
use crate::stage::verify::is_pyramid;
use crate::stage::{cluster, deepzoom, normals};
use crate::store::enlarged::{self, Enlarged, Method};
use crate::store::measurement::{self, Description, Measurement};
use crate::store::model::appearance::AppearanceReport;
use crate::store::model::components::ComponentsReport;
use crate::store::model::field::FieldReport;
use crate::store::model::tile::TileRecipe;
use crate::store::model::tile::TileReport;
use crate::store::model::{self, Model, Stage};
use crate::zarr::Store;

/// What a store is.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum About {
    /// A measurement.
    Measurement(Box<Measured>),
    /// A model.
    Model(Box<Modelled>),
    /// An enlarged index.
    Enlarged(Box<Grown>),
    /// A Deep Zoom pyramid.
    Deepzoom(Box<Pyramidal>),
}

/// A list of directions.
#[derive(Clone, Debug, Serialize)]
pub struct Directions {
    /// How many.
    pub count: usize,
    /// The least and the largest theta, degrees.
    pub theta_deg: [f64; 2],
    /// Theta and phi of each, degrees, in the order of their numbers.
    pub angles_deg: Vec<[f64; 2]>,
}

impl Directions {
    /// Of a list, which is not empty.
    pub fn of(list: &[Direction]) -> Self {
        let thetas = list.iter().map(|d| d.degrees().0);
        let (low, high) = thetas.fold((f64::MAX, f64::MIN), |(low, high), t| (low.min(t), high.max(t)));
        let angles_deg = list.iter().map(|direction| direction.degrees().into()).collect();
        Self { count: list.len(), theta_deg: [low, high], angles_deg }
    }
}

/// View and light directions.
#[derive(Clone, Debug, Serialize)]
pub struct Both {
    /// View directions.
    pub views: Directions,
    /// Light directions.
    pub lights: Directions,
}

/// What a measurement is, or an archive as a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Samples {
    /// View directions.
    pub views: Directions,
    /// Light directions.
    pub lights: Directions,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Type of the samples.
    pub samples: &'static str,
    /// Transfer curve.
    pub transfer: String,
    /// Bytes of the raw samples.
    pub raw_bytes: u64,
}

impl Samples {
    /// Of what a measurement holds.
    pub fn of(description: &Description) -> Self {
        Self {
            views: Directions::of(&description.views),
            lights: Directions::of(&description.lights),
            width: description.size.width,
            height: description.size.height,
            channels: description.channels.clone(),
            samples: description.sample_type.name(),
            transfer: format!("{:?}", description.transfer).to_lowercase(),
            raw_bytes: description.bytes(),
        }
    }
}

/// What a measurement is.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Of any store.
    #[serde(flatten)]
    pub kept: Kept,
    /// Its samples.
    #[serde(flatten)]
    pub samples: Samples,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
    /// How chunks are packed.
    pub codec: &'static str,
    /// Views that are there.
    pub views_done: usize,
    /// Digest of its recipe.
    pub digest: String,
    /// What its archive was.
    pub archive: Option<String>,
    /// The options by which its archive was read, as `btf import` takes them.
    pub read_with: Vec<String>,
    /// What had to be assumed.
    pub assumptions: Vec<String>,
}

/// A stage of a model.
#[derive(Clone, Debug, Serialize)]
pub struct Done {
    /// Its name.
    pub stage: &'static str,
    /// Whether it is done, and its arrays are there.
    pub done: bool,
    /// Its recipe: what was asked for.
    pub recipe: Option<Value>,
}

/// What a model is.
#[derive(Clone, Debug, Serialize)]
pub struct Modelled {
    /// Of any store.
    #[serde(flatten)]
    pub kept: Kept,
    /// Digest of the measurement that it was made of.
    pub measurement: Option<String>,
    /// Its view and light directions, once it has a tile.
    #[serde(flatten)]
    pub directions: Option<Both>,
    /// Stages in the order of the data flow.
    pub stages: Vec<Done>,
    /// How the tile was cut.
    pub tile: Option<TileReport>,
    /// How its texels were clustered.
    pub cluster: Option<cluster::Report>,
    /// How normals were estimated.
    pub normals: Option<normals::Report>,
    /// What field was fitted.
    pub field: Option<FieldReport>,
    /// How the exemplar is described.
    pub appearance: Option<AppearanceReport>,
    /// Of components, once they are found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<ComponentsReport>,
}

/// What an enlarged index is.
#[derive(Clone, Debug, Serialize)]
pub struct Grown {
    /// Of any store.
    #[serde(flatten)]
    pub kept: Kept,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// By what it was enlarged.
    pub method: Method,
    /// Seed of all that was drawn at random.
    pub seed: u64,
    /// Whether it joins at its borders.
    pub tileable: bool,
    /// The other settings of the method.
    pub options: Map<String, Value>,
    /// Whether the tile's texel of each texel is kept.
    pub source: bool,
    /// Whether normals are kept.
    pub normals: bool,
    /// Number of clusters, where it is known.
    pub clusters: Option<usize>,
    /// Width and height of the tile, where they are known.
    pub tile: Option<[usize; 2]>,
    /// Name of the model that it was enlarged from.
    pub model: Option<String>,
    /// Shards that are there.
    pub shards_done: usize,
    /// Shards in all.
    pub shards: usize,
}

/// Tells what the store or pyramid at a path is.
///
/// # Errors
/// Where there is none, or it is damaged so far that it cannot be told.
pub fn store(path: &Path) -> Result<About> {
    if is_pyramid(path) {
        return deepzoom::about(path).map(|about| About::Deepzoom(Box::new(about)));
    }
    let attributes = Store::at(path).expect_one_of(&[measurement::KIND, model::KIND, enlarged::KIND])?;
    let text = |name: &str| attributes.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let kept = |layout: u64, finished: bool| Kept {
        version: text("version"),
        layout,
        stored_bytes: bytes_below(path),
        finished,
    };
    match attributes.get("kind").and_then(Value::as_str) {
        Some(model::KIND) => {
            let model = Model::open(path)?;
            Ok(About::Model(Box::new(of_model(&model, kept)?)))
        }
        Some(enlarged::KIND) => {
            let enlarged = Enlarged::open(path)?;
            Ok(About::Enlarged(Box::new(of_enlarged(&enlarged, kept))))
        }
        _ => {
            let measurement = Measurement::open(path)?;
            Ok(About::Measurement(Box::new(of_measurement(&measurement, kept))))
        }
    }
}

fn of_measurement(measurement: &Measurement, kept: impl Fn(u64, bool) -> Kept) -> Measured {
    let description = measurement.description();
    let views_done = measurement.views_done();
    let recipe = measurement.recipe();
    Measured {
        kept: kept(measurement.format(), views_done == description.views.len()),
        samples: Samples::of(description),
        white: description.white,
        codec: measurement.codec().name(),
        views_done,
        digest: measurement.digest().to_owned(),
        archive: Some(recipe.format.clone()).filter(|format| !format.is_empty()),
        read_with: recipe.how_read().unwrap_or_default().options(),
        assumptions: recipe.assumptions.clone(),
    }
}

fn of_model(model: &Model, kept: impl Fn(u64, bool) -> Kept) -> Result<Modelled> {
    let mut stages = Vec::new();
    for stage in Stage::ALL.into_iter().chain(Stage::OPTIONAL) {
        let recipe = model.recipe_text(stage)?;
        if recipe.is_none() && Stage::OPTIONAL.contains(&stage) {
            continue;
        }
        let done = recipe.is_some() && model.has_arrays(stage)?;
        stages.push(Done { stage: stage.name(), done, recipe });
    }
    let is_there =
        |stage: Stage| stages.iter().any(|done| done.stage == stage.name() && done.recipe.is_some());
    Ok(Modelled {
        kept: kept(model.format(), stages.iter().all(|done| done.done)),
        measurement: is_there(Stage::Tile)
            .then(|| model.recipe::<TileRecipe>(Stage::Tile))
            .transpose()?
            .map(|recipe| recipe.measurement),
        directions: is_there(Stage::Tile)
            .then(|| model.directions())
            .transpose()?
            .map(|[views, lights]| Both { views: Directions::of(&views), lights: Directions::of(&lights) }),
        tile: is_there(Stage::Tile).then(|| model.tile_report()).transpose()?,
        cluster: is_there(Stage::Cluster).then(|| model.cluster_report()).transpose()?,
        normals: is_there(Stage::Normals).then(|| model.normals_report()).transpose()?,
        field: is_there(Stage::Fit).then(|| model.field_report()).transpose()?,
        appearance: is_there(Stage::Appearance).then(|| model.appearance_report()).transpose()?,
        components: is_there(Stage::Components).then(|| model.report(Stage::Components)).transpose()?,
        stages,
    })
}

fn of_enlarged(enlarged: &Enlarged, kept: impl Fn(u64, bool) -> Kept) -> Grown {
    let recipe = enlarged.recipe();
    let options = [
        ("candidates", recipe.candidates.map(Value::from)),
        // In units of the spacing, as the option has it.
        ("jitter", recipe.jitter.map(|jitter| Value::from(f64::from(jitter) / f64::from(JITTER_ONE)))),
        ("tiles", recipe.tiles.map(Value::from)),
    ];
    let (done, total) = (enlarged.shards_done(), enlarged.shards().texels());
    Grown {
        kept: kept(enlarged.format(), done == total),
        width: enlarged.size().width,
        height: enlarged.size().height,
        method: recipe.rule,
        seed: recipe.seed,
        tileable: recipe.tileable,
        options: options.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect(),
        source: enlarged.has_source(),
        normals: enlarged.has_normals(),
        clusters: (enlarged.format() > 1).then(|| enlarged.clusters()),
        tile: enlarged.tile().map(|tile| [tile.width, tile.height]),
        model: enlarged.model_name().map(str::to_owned),
        shards_done: done,
        shards: total,
    }
}

//! Normal map to random field: pyramid, neighbourhoods by evidence, 3D CAR or 2D CAR.

pub mod sheet;
pub mod statistics;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::error::Result;
use crate::method::field::marginals::Matching;
use crate::method::field::{self, Boundary, Coordinates, Gains, Surface};
use crate::method::tile::Tile;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::store::model::field::FieldReport;
use crate::store::model::field::FitRecipe;
use crate::store::model::{Model, Stage};

/// Memory of a texel of the tile: the pyramids, their moments, and a synthesis for each number of levels (measured).
const TEXEL_BYTES: u64 = 2300;

/// Memory of what does not grow with the tile (measured).
const FIXED_BYTES: u64 = 16 << 20;

/// How to fit.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model with the normal map.
    pub model: PathBuf,
    /// Channels together or one by one.
    pub kind: field::CarKind,
    /// Levels of the pyramid; as many as the data carry where absent.
    pub levels: Option<usize>,
    /// What the channels of the field are.
    pub coordinates: Coordinates,
    /// How loud each level is.
    pub gains: Gains,
    /// What of the tile's distribution is given to a synthesis.
    pub matching: Option<Matching>,
}

impl Options {
    /// As much as is known to help: 3D CAR of the normals, levels chosen, gains and joint distribution matched.
    pub fn of(model: PathBuf) -> Self {
        Self {
            model,
            kind: field::CarKind::Car3d,
            levels: None,
            coordinates: Coordinates::Normals,
            gains: Gains::Matched,
            matching: Some(Matching::Joint),
        }
    }
}

/// A fit, ready to run.
pub struct Plan {
    model: Model,
    options: Options,
    recipe: Value,
}

/// Checks that the model has a normal map.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let recipe = FitRecipe {
        normals: model.stage_digest(Stage::Normals)?,
        mrf: options.kind,
        levels: options.levels,
        field: options.coordinates,
        gains: options.gains,
        marginals: options.matching,
    };
    let recipe = recipe.to_value()?;
    Ok(Plan { model, options: options.clone(), recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "fit", "model": self.model.path().display().to_string(), "recipe": self.recipe})
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Fit, &self.recipe).unwrap_or(false)
    }

    /// Fits the field, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<FieldReport> {
        let Some(_lock) = self.model.begin(Stage::Fit, &self.recipe, context)? else {
            return self.model.field_report();
        };
        context.progress.begin("fit", 1, Counted::Items("field"));
        let tile = self.model.tile()?;
        let needed = memory_bytes(tile.size.texels());
        context.require(&format!("fitting the field of a tile of {}", tile.size), needed)?;
        let normals = self.model.normals()?;
        let Options { kind, levels, coordinates, gains, matching, .. } = self.options;
        let boundary = boundary_of(&tile);
        let options = field::Options { kind, levels, gains, boundary };
        let surface =
            context.compute(|| Surface::fit(tile.size, &normals, coordinates, matching, &options))?;
        self.model.write_surface(&surface)?;
        let report = FieldReport::new(&surface);
        self.model.finish(Stage::Fit, &self.recipe, &report, context)?;
        context.progress.advance(1);
        context.progress.end();
        Ok(report)
    }
}

/// Memory that fitting a tile of so many texels takes.
pub(crate) fn memory_bytes(texels: usize) -> u64 {
    FIXED_BYTES + TEXEL_BYTES * texels as u64
}

/// The statistics of a fitted model's tile and of a synthesis.
///
/// # Errors
/// When the model is not fitted.
pub fn compare(model: &Path, context: &Context<'_>) -> Result<statistics::Comparison> {
    let model = Model::open(model)?;
    let (tile, normals, surface) = (model.tile()?, model.normals()?, model.surface()?);
    context.compute(|| statistics::Comparison::of(&surface, tile.size, normals, boundary_of(&tile)))
}

/// What lies beyond the border of a tile's normal map.
fn boundary_of(tile: &Tile) -> Boundary {
    if tile.wraps { Boundary::Periodic } else { Boundary::Mirrored }
}

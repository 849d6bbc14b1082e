//! Normal map to random field: pyramid, neighbourhoods by evidence, 3D CAR or 2D CAR.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::error::Result;
use crate::mrf::{self, Boundary, Field};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::store::field::FieldReport;
use crate::store::model::{Model, Stage};

/// How to fit.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model with the normal map.
    pub model: PathBuf,
    /// Channels together or one by one.
    pub kind: mrf::Kind,
    /// Levels of the pyramid; as many as the data carry where absent.
    pub levels: Option<usize>,
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
    let normals = model.stage_digest(Stage::Normals)?;
    let kind = match options.kind {
        mrf::Kind::Car3d => "3d",
        mrf::Kind::Car2d => "2d",
    };
    let recipe =
        json!({"stage": "fit", "method": METHOD, "normals": normals, "mrf": kind, "levels": options.levels});
    Ok(Plan { model, options: options.clone(), recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "fit", "model": self.model.path(), "recipe": self.recipe})
    }

    /// Fits the field, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<FieldReport> {
        let Some(_lock) = self.model.begin(Stage::Fit, &self.recipe)? else {
            return self.model.report(Stage::Fit);
        };
        context.progress.begin("fit", 1, Counted::Items("field"));
        let tile = self.model.tile()?;
        let samples = self.model.normals()?.into_iter().flatten().map(f64::from).collect();
        let normals = Field::new(tile.size.height, tile.size.width, 3, samples)?;
        let boundary = if tile.wraps { Boundary::Periodic } else { Boundary::Mirrored };
        let field = mrf::fit(
            &normals,
            &mrf::Options { kind: self.options.kind, levels: self.options.levels, boundary },
        )?;
        self.model.write_field(&field)?;
        let report = FieldReport::new(&field);
        self.model.finish(Stage::Fit, &self.recipe, &report)?;
        context.progress.advance(1);
        context.progress.end();
        Ok(report)
    }
}

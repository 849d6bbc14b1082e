//! The model store: what the analysis of a measurement leaves, everything an evaluator needs.
//!
//! Each stage (`tile`, `cluster`, `normals`, `fit`, `appearance`, `components`) writes its arrays and then, last, its entry in
//! the attributes: arrays without their entry are the remains of a run that was killed. A stage has a file here with
//! its recipe, its report, its arrays, and the checks that reading them needs.

mod advice;
pub mod appearance;
mod arrays;
pub mod clusters;
pub mod components;
mod entries;
pub mod field;
pub mod normals;
mod stages;
pub mod tile;

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::disk::output::expect_outside_stores;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::zarr::Store;
pub(crate) use advice::{UNPACKED, measurement_name};
pub(crate) use clusters::NARROW;
pub use clusters::{Clusters, Representatives, index_bytes};
use entries::STAGES;
pub(crate) use normals::is_unit;
pub use stages::Stage;

/// The attribute `kind` of a model store.
pub const KIND: &str = "model";

/// A model store.
#[derive(Clone)]
pub struct Model {
    store: Store,
}

impl Model {
    /// Opens a model, or begins one where there is none.
    pub fn create(path: &Path, context: &Context<'_>) -> Result<Self> {
        expect_outside_stores(path)?;
        let mut store = Store::at(path);
        let mut attributes = Map::new();
        attributes.insert(STAGES.to_owned(), json!({}));
        store.begin(KIND, attributes, context)?;
        store.sweep()?;
        Ok(Self { store })
    }

    /// Opens a model for reading.
    pub fn open(path: &Path) -> Result<Self> {
        let model = Self { store: Store::open(path, KIND)?.0 };
        // Everything else of a model is read by what its tile says.
        if model.has(Stage::Tile)? {
            model.done(Stage::Tile)?;
        }
        Ok(model)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// Version of its layout.
    pub fn format(&self) -> u64 {
        self.store.format()
    }

    /// Version of the program that began it.
    pub fn version(&self) -> Result<String> {
        let attributes = self.store.expect(KIND)?;
        Ok(attributes.get("version").and_then(Value::as_str).unwrap_or_default().to_owned())
    }

    /// What an array holds that it may not.
    pub(super) fn damaged(&self, array: &str, what: &str) -> Error {
        Error::input(format!("{}: {array}: {what}", self.path().display()))
            .hint("delete this array's folder and run the command that made it again")
    }
}

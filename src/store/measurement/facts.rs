//! What the attributes of a measurement say that its arrays are read by.

use btfkit_formats::{Direction, SampleType};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::Description;
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::run::recipe::Recipe;
use crate::zarr::codec::{Chain, MOST_CHANNELS};
use crate::zarr::metadata::shown;
use crate::zarr::{Store, samples_named};

/// What a measurement depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportRecipe {
    /// The format of the archive.
    pub format: String,
    /// Rows and columns.
    pub size: [usize; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Type of the samples.
    pub samples: String,
    /// Theta and phi of the views in degrees.
    pub views: Vec<[f64; 2]>,
    /// Theta and phi of the lights in degrees.
    pub lights: Vec<[f64; 2]>,
    /// Digest of the images.
    pub images: String,
    /// How the archive was read; not in the oldest recipes.
    #[serde(default)]
    pub reading: Value,
    /// Transfer curve of the samples.
    pub transfer: Transfer,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
    /// How chunks are packed.
    pub codec: String,
    /// What had to be assumed because the archive does not say it.
    pub assumptions: Vec<String>,
}

impl Recipe for ImportRecipe {
    const STAGE: &'static str = "import";
}

impl ImportRecipe {
    /// Of a measurement as it is described; what only the archive says is empty.
    pub fn of(description: &Description, codec: Chain) -> Self {
        let degrees = |list: &[Direction]| list.iter().map(|direction| direction.degrees().into()).collect();
        Self {
            format: String::new(),
            size: [description.size.height, description.size.width],
            channels: description.channels.clone(),
            samples: description.sample_type.name().to_owned(),
            views: degrees(&description.views),
            lights: degrees(&description.lights),
            images: String::new(),
            reading: Value::Null,
            transfer: description.transfer,
            white: description.white,
            codec: codec.name().to_owned(),
            assumptions: Vec::new(),
        }
    }

    /// Compares it with what its measurement is.
    fn check(&self, description: &Description) -> std::result::Result<(), String> {
        // The codec is not looked at: arrays say themselves how they are packed.
        let found = Self::of(description, Chain::Stock);
        let members = [
            ("size", json!(found.size), json!(self.size)),
            ("channels", json!(found.channels), json!(self.channels)),
            ("samples", json!(found.samples), json!(self.samples)),
            ("transfer", json!(found.transfer), json!(self.transfer)),
            ("white", json!(found.white), json!(self.white)),
            ("views", json!(found.views), json!(self.views)),
            ("lights", json!(found.lights), json!(self.lights)),
        ];
        match members.iter().find(|(_, found, expected)| !is_near(found, expected)) {
            None => Ok(()),
            Some((name, found, expected)) => {
                Err(format!("{name}: got {}, the recipe says {}", shown(found), shown(expected)))
            }
        }
    }
}

/// Attributes of the root, as far as they are needed; the seal covers them all.
#[derive(Deserialize)]
pub(super) struct Facts {
    pub(super) recipe: Value,
    pub(super) digest: String,
    pub(super) transfer: Transfer,
    pub(super) white: f64,
    /// Not in the oldest layout.
    channels: Option<Vec<String>>,
    /// Not in the oldest layout.
    samples: Option<String>,
}

impl Facts {
    pub(super) fn read(attributes: &Map<String, Value>) -> std::result::Result<Self, String> {
        let facts: Self = serde_json::from_value(Value::Object(attributes.clone()))
            .map_err(|error| format!("attributes of btfkit: {error}"))?;
        if !(facts.white.is_finite() && facts.white > 0.0) {
            return Err(format!(
                "attribute btfkit.white: got {}, expected a reflectance above 0",
                facts.white
            ));
        }
        Ok(facts)
    }

    /// Names of the channels.
    pub(super) fn channels(&self, store: &Store) -> Result<Vec<String>> {
        let names = match &self.channels {
            Some(names) => names.clone(),
            None => {
                let document = store.array_document("reflectance")?;
                let names = document.get("attributes").and_then(|attributes| attributes.get("channels"));
                serde_json::from_value(names.cloned().unwrap_or_default()).map_err(|error| {
                    Error::input(format!(
                        "{}: reflectance: attribute channels: {error}",
                        store.path().display()
                    ))
                })?
            }
        };
        if (1..=MOST_CHANNELS).contains(&names.len()) {
            return Ok(names);
        }
        Err(Error::input(format!("{}: got {} channels", store.path().display(), names.len())))
    }

    /// Type of the samples.
    pub(super) fn sample_type(&self, store: &Store) -> Result<SampleType> {
        let found = match &self.samples {
            Some(name) => samples_named(name),
            None => {
                let document = store.array_document("reflectance")?;
                samples_named(document.get("data_type").and_then(Value::as_str).unwrap_or_default())
            }
        };
        found.ok_or_else(|| {
            Error::input(format!("{}: reflectance: no type that samples come in", store.path().display()))
        })
    }

    /// The recipe of a measurement, which it must fit.
    pub(super) fn recipe(&self, description: &Description) -> std::result::Result<ImportRecipe, String> {
        let recipe = ImportRecipe::from_value(&self.recipe).map_err(|what| format!("recipe: {what}"))?;
        recipe.check(description)?;
        Ok(recipe)
    }
}

/// Whether two values are equal but for what other versions rounded otherwise.
fn is_near(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_near(a, b))
        }
        (Value::Number(a), Value::Number(b)) => match (a.as_f64(), b.as_f64()) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(1.0),
            _ => false,
        },
        _ => a == b,
    }
}

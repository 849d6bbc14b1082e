//! What the attributes of a measurement say that its arrays are read by.

use btfkit_formats::SampleType;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::Description;
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::zarr::codec::MOST_CHANNELS;
use crate::zarr::metadata::shown;
use crate::zarr::{SAMPLE_TYPES, Store};

/// Attributes of the root, as far as they are needed; the seal covers them all.
#[derive(Deserialize)]
pub(super) struct Facts {
    pub(super) recipe: Map<String, Value>,
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
            Some(name) => SAMPLE_TYPES.into_iter().find(|samples| samples.name() == name),
            None => {
                let document = store.array_document("reflectance")?;
                let name = document.get("data_type").and_then(Value::as_str).unwrap_or_default().to_owned();
                SAMPLE_TYPES.into_iter().find(|samples| samples.name() == name)
            }
        };
        found.ok_or_else(|| {
            Error::input(format!("{}: reflectance: no type that samples come in", store.path().display()))
        })
    }

    /// Compares what is found with what the import was told, as far as its recipe says so.
    pub(super) fn check_recipe(&self, description: &Description) -> std::result::Result<(), String> {
        let degrees = |list: &[btfkit_formats::Direction]| -> Vec<[f64; 2]> {
            list.iter().map(|d| d.degrees()).map(|(theta, phi)| [theta, phi]).collect()
        };
        let size = [description.size.height, description.size.width];
        for (name, found) in [
            ("size", serde_json::json!(size)),
            ("channels", serde_json::json!(description.channels)),
            ("samples", serde_json::json!(description.sample_type.name())),
            ("transfer", serde_json::json!(description.transfer)),
            ("white", serde_json::json!(description.white)),
            ("views", serde_json::json!(degrees(&description.views))),
            ("lights", serde_json::json!(degrees(&description.lights))),
        ] {
            match self.recipe.get(name) {
                Some(expected) if !is_near(&found, expected) => {
                    return Err(format!(
                        "{name}: got {}, the recipe says {}",
                        shown(&found),
                        shown(expected)
                    ));
                }
                _ => {}
            }
        }
        Ok(())
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

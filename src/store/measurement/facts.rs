//! What the attributes of a measurement say that its arrays are read by.

use btfkit_formats::{Direction, SampleType};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::Description;
use super::reading::{Adaptation, Reading};
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::run::recipe::{self, Recipe};
use crate::zarr::codec::{Chain, MOST_CHANNELS};
use crate::zarr::metadata::{OLDEST_FORMAT, shown};
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
        // The codec is compared where the arrays have been looked at.
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
        if let Some((name, found, expected)) =
            members.iter().find(|(_, found, expected)| !is_near(found, expected))
        {
            return Err(format!("{name}: got {}, the recipe says {}", shown(found), shown(expected)));
        }
        self.how_read().map(drop)
    }

    /// How the archive was read; the oldest recipes do not say it.
    ///
    /// # Errors
    /// What no reading says, or what is not of this measurement.
    pub fn how_read(&self) -> std::result::Result<Reading, String> {
        if self.reading.is_null() {
            return Ok(Reading::default());
        }
        let reading = Reading::parse(&self.reading).map_err(|what| format!("recipe: reading: {what}"))?;
        let Adaptation { transfer, samples, .. } = reading.adaptation;
        let said = [
            ("transfer", json!(transfer), json!(self.transfer)),
            ("samples", json!(samples.map(|name| SampleType::from(name).name())), json!(self.samples)),
        ];
        match said.iter().find(|(_, asked, is)| !asked.is_null() && asked != is) {
            None => Ok(reading),
            Some((name, asked, is)) => {
                Err(format!("recipe: reading: {name}: got {asked}, the samples have {is}"))
            }
        }
    }

    /// Compares how chunks are packed with what the arrays say.
    pub(super) fn check_codec(&self, chain: Chain) -> std::result::Result<(), String> {
        match self.codec == chain.name() {
            true => Ok(()),
            false => Err(format!("recipe: codec: got {:?}, the arrays have {:?}", self.codec, chain.name())),
        }
    }
}

/// How samples are meant, beside their transfer curve.
pub(super) const RADIOMETRY: &str = "apparent reflectance, cosine of the light angle included";

/// Attributes of the root; the seal covers them all.
#[derive(Deserialize)]
pub(super) struct Facts {
    format: u64,
    radiometry: Option<String>,
    assumptions: Option<Vec<String>>,
    /// What the archive says of itself: name and text.
    #[serde(default, rename = "remarks")]
    _remarks: Vec<(String, String)>,
    checksums: Option<Checksums>,
    #[serde(deserialize_with = "recipe::stored")]
    pub(super) recipe: ImportRecipe,
    pub(super) digest: String,
    pub(super) transfer: Transfer,
    pub(super) white: f64,
    /// Not in the oldest layout.
    channels: Option<Vec<String>>,
    /// Not in the oldest layout.
    samples: Option<String>,
}

/// Checksums of the shards of each array, of a measurement that is finished.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Checksums {
    reflectance: String,
    luminance: String,
}

impl Facts {
    pub(super) fn read(attributes: &Map<String, Value>) -> std::result::Result<Self, String> {
        let facts: Self = serde_json::from_value(Value::Object(attributes.clone()))
            .map_err(|error| format!("attributes of btfkit: {error}"))?;
        let there = [
            ("channels", facts.channels.is_some()),
            ("samples", facts.samples.is_some()),
            ("radiometry", facts.radiometry.is_some()),
            ("assumptions", facts.assumptions.is_some()),
        ];
        if facts.format > OLDEST_FORMAT
            && let Some((name, _)) = there.iter().find(|(_, there)| !there)
        {
            return Err(format!(
                "attribute btfkit.{name}: got none, expected one in layout format {}",
                facts.format
            ));
        }
        if let Some(found) = facts.radiometry.as_deref().filter(|found| *found != RADIOMETRY) {
            return Err(format!(
                "attribute btfkit.radiometry: got {}, expected \"{RADIOMETRY}\"",
                shown(&json!(found))
            ));
        }
        if let Some(Checksums { reflectance, luminance }) = &facts.checksums
            && reflectance.len() != luminance.len()
        {
            return Err("attribute btfkit.checksums: got lists of two lengths".to_owned());
        }
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
        let recipe = self.recipe.clone();
        recipe.check(description)?;
        if self.assumptions.as_ref().is_some_and(|assumptions| *assumptions != recipe.assumptions) {
            return Err("attribute btfkit.assumptions: other sentences than the recipe's".to_owned());
        }
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

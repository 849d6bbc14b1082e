//! Recipes: everything that a result depends on, as JSON, and its digest.
//!
//! A result in place with the same digest is taken as done or gone on with; one with another
//! digest is refused, never mixed.

use std::path::Path;

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

/// Version of the methods, part of every recipe: raised when a change makes other bytes, so that a newer
/// program does not go on with what an older one left half-made.
pub(crate) const METHOD: u64 = 1;

/// The settings of a result, beside which its recipe holds the stage that made it and the version of the method.
pub trait Recipe: Serialize + DeserializeOwned {
    /// What makes the result.
    const STAGE: &'static str;

    /// Version of its method: raised when a change makes other bytes of this stage alone.
    const METHOD: u64 = METHOD;

    /// The recipe as it is stored.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Internal`] for settings that are no JSON object.
    fn to_value(&self) -> Result<Value> {
        let failed = |what: &str| Error::internal(format!("recipe of {}: {what}", Self::STAGE));
        let mut recipe = serde_json::to_value(self).map_err(|error| failed(&error.to_string()))?;
        let members = recipe.as_object_mut().ok_or_else(|| failed("no object"))?;
        members.insert("stage".to_owned(), json!(Self::STAGE));
        members.insert("method".to_owned(), json!(Self::METHOD));
        Ok(recipe)
    }

    /// The settings in a stored recipe.
    ///
    /// # Errors
    /// Says what does not belong there, or is missing.
    fn from_value(recipe: &Value) -> std::result::Result<Self, String> {
        let mut settings = recipe.as_object().cloned().unwrap_or_default();
        match settings.remove("stage") {
            Some(stage) if stage == Self::STAGE => {}
            found => {
                return Err(format!(
                    "stage: got {}, expected \"{}\"",
                    found.unwrap_or_default(),
                    Self::STAGE
                ));
            }
        }
        match settings.remove("method") {
            Some(method) if method.as_u64().is_some_and(|method| (1..=Self::METHOD).contains(&method)) => {}
            found => {
                let found = found.unwrap_or_default();
                return Err(format!("method: got {found}, expected 1 to {}", Self::METHOD));
            }
        }
        serde_json::from_value(Value::Object(settings)).map_err(|error| error.to_string())
    }
}

/// Reads a stored recipe as a member of typed attributes: `#[serde(deserialize_with = "recipe::stored")]`.
///
/// # Errors
/// As [`Recipe::from_value`].
pub(crate) fn stored<'de, R: Recipe, D: Deserializer<'de>>(from: D) -> std::result::Result<R, D::Error> {
    R::from_value(&Value::deserialize(from)?).map_err(|what| D::Error::custom(format!("recipe: {what}")))
}

/// The digest of a recipe: SHA-256 of its JSON with sorted keys, in hexadecimal.
pub fn digest(recipe: &Value) -> String {
    hexadecimal(&Sha256::digest(canonical(recipe).to_string().as_bytes()))
}

/// SHA-256 of bytes in hexadecimal.
pub fn digest_bytes(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The same value with the keys of every object sorted.
pub(crate) fn canonical(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(key, _)| key.as_str());
            Value::Object(entries.into_iter().map(|(key, value)| (key.clone(), canonical(value))).collect())
        }
        Value::Array(values) => values.iter().map(canonical).collect(),
        other => other.clone(),
    }
}

/// By what a result in place was made.
#[derive(Clone, Copy, Debug)]
pub struct Made<'a> {
    /// Digest of the recipe.
    pub digest: &'a str,
    /// The recipe.
    pub recipe: &'a Value,
}

impl<'a> Made<'a> {
    /// What attributes say of it.
    pub fn of(attributes: &'a Map<String, Value>) -> Self {
        let digest = attributes.get("digest").and_then(Value::as_str).unwrap_or_default();
        Self { digest, recipe: attributes.get("recipe").unwrap_or(&Value::Null) }
    }

    /// Checks that the result, at `path`, was made by this recipe.
    ///
    /// # Errors
    /// Names the first setting that differs.
    pub fn expect(self, path: &Path, recipe: &Value) -> Result<()> {
        if self.digest == digest(recipe) {
            return Ok(());
        }
        let difference =
            first_difference(self.recipe, recipe, "").unwrap_or_else(|| "by another version".to_owned());
        Err(Error::recipe(format!("{} was made by another recipe: {difference}", path.display()))
            .hint("choose another name for the result, or make this one anew by --force"))
    }
}

fn first_difference(old: &Value, new: &Value, place: &str) -> Option<String> {
    if let (Value::Object(old), Value::Object(new)) = (old, new) {
        let mut keys: Vec<&String> = old.keys().chain(new.keys()).collect();
        // What decides about the meaning of the other settings comes first.
        keys.sort_by_key(|key| (!["stage", "rule", "tile", "reading"].contains(&key.as_str()), key.as_str()));
        let entry = |map: &Map<String, Value>, key: &str| map.get(key).cloned().unwrap_or(Value::Null);
        return keys
            .iter()
            .find_map(|key| first_difference(&entry(old, key), &entry(new, key), &format!("{place}{key} ")));
    }
    // Of long lists, of directions say, the first entry that differs.
    if let (Value::Array(old), Value::Array(new)) = (old, new)
        && old.len() == new.len()
        && old.len() > SHORT_LIST
    {
        let mut pairs = old.iter().zip(new).enumerate();
        return pairs.find_map(|(at, (old, new))| first_difference(old, new, &format!("{place}{at} ")));
    }
    let place = place.trim_end();
    (old != new).then(|| match (old.as_str(), new.as_str()) {
        // Of what was made before only the digest is known.
        (Some(old), Some(new)) if is_digest(old) && is_digest(new) => format!(
            "its {place} {} (digest {}, now {})",
            // Such as "images".
            match place.ends_with('s') {
                true => "were made anew since, or are others",
                false => "was made anew since, or is another one",
            },
            shortened(old),
            shortened(new)
        ),
        _ => {
            let (short_old, short_new) = (short(old), short(new));
            let [old, new] = if short_old == short_new { [old, new] } else { [&short_old, &short_new] };
            format!("{place} was {}, now {}", shown(old), shown(new))
        }
    })
}

/// Entries of a list that is told whole.
const SHORT_LIST: usize = 4;

/// The same with fractions of six digits.
fn short(value: &Value) -> Value {
    match value {
        Value::Array(values) => values.iter().map(short).collect(),
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or(Value::Null, |number| btfkit_formats::six_digits(number).into())
        }
        other => other.clone(),
    }
}

/// A setting; one that is null was left to the program.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "not given".to_owned(),
        Value::Array(list) if list.len() > SHORT_LIST => format!("a list of {}", list.len()),
        other => other.to_string(),
    }
}

/// A digest as messages show it.
pub(crate) fn shortened(digest: &str) -> &str {
    digest.get(..12).unwrap_or(digest)
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_digest_does_not_depend_on_the_order_of_keys() {
        assert_eq!(digest(&json!({"a": 1, "b": [2, 3]})), digest(&json!({"b": [2, 3], "a": 1})));
        assert_ne!(digest(&json!({"a": 1})), digest(&json!({"a": 2})));
    }

    #[test]
    fn another_recipe_is_refused_and_the_setting_named() {
        let recipe = json!({"clusters": 256, "seed": 1});
        let attributes = json!({"recipe": {"clusters": 64, "seed": 1}, "digest": digest(&json!({"clusters": 64, "seed": 1}))});
        let error = Made::of(attributes.as_object().unwrap()).expect(Path::new("m"), &recipe).unwrap_err();
        assert!(error.to_string().contains("clusters was 64, now 256"), "{error}");
    }

    #[test]
    fn differences_are_told_by_the_entry_and_without_noise() {
        let views =
            |last: f64| json!({"views": [[0.0, 0.0], [15.0, 0.0], [15.0, 9.0], [30.0, 0.0], [last, 0.5]]});
        let told = |old: &Value, new: &Value| first_difference(old, new, "").unwrap();
        assert_eq!(told(&views(14.999999999999998), &views(30.1)), "views 4 was [15.0,0.5], now [30.1,0.5]");
        assert_eq!(
            told(&views(14.999999999999998), &views(15.0)),
            "views 4 was [14.999999999999998,0.5], now [15.0,0.5]"
        );
        let few = json!({"views": [[0.0, 0.0]]});
        assert_eq!(told(&few, &views(1.0)), "views was [[0.0,0.0]], now a list of 5");
    }
}

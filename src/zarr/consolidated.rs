//! The metadata of all arrays and groups in one place, the root's `zarr.json`, as zarr-python writes it: so that other
//! programs open a finished store by one read. Written when a store or a stage is finished, and never read here.

use serde_json::{Map, Value, json};

use super::Store;
use super::metadata::read_object;
use crate::error::{Error, Result};

/// The member of the root's document.
pub(super) const MEMBER: &str = "consolidated_metadata";

/// The arrays that are coordinates of others, by which xarray selects.
const COORDINATES: [&str; 4] = ["view_theta", "view_phi", "light_theta", "light_phi"];

impl Store {
    /// Writes the root with the metadata of these arrays, and of the groups that they lie in.
    ///
    /// # Errors
    /// Where one of them is missing.
    pub(crate) fn write_finished(&self, ours: Map<String, Value>, arrays: &[String]) -> Result<()> {
        let mut members = Map::new();
        members.insert(MEMBER.to_owned(), self.consolidated(arrays)?);
        self.write_group_with("", ours, members)
    }

    /// The metadata of these arrays and of the groups that they lie in, from their files.
    pub(crate) fn consolidated(&self, arrays: &[String]) -> Result<Value> {
        let mut nodes: Vec<&str> = arrays.iter().map(String::as_str).collect();
        let groups = |name: &'_ str| {
            let ends = name.match_indices('/').map(|(at, _)| at).collect::<Vec<_>>();
            ends.into_iter()
        };
        for name in arrays {
            nodes.extend(groups(name).map(|end| &name[..end]));
        }
        nodes.sort_unstable();
        nodes.dedup();
        let mut found = Map::new();
        for name in nodes {
            let document = read_object(&self.metadata_path(name))?
                .ok_or_else(|| Error::missing(format!("{}: {name}: no zarr.json", self.path().display())))?;
            found.insert(name.to_owned(), Value::Object(document));
        }
        Ok(json!({"kind": "inline", "must_understand": false, "metadata": found}))
    }

    /// Whether the root holds the metadata of these arrays as their files do; no where it holds none.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn is_consolidated(&self, arrays: &[String]) -> Result<bool> {
        let document = read_object(&self.metadata_path(""))?.unwrap_or_default();
        Ok(document.get(MEMBER) == Some(&self.consolidated(arrays)?))
    }
}

/// Says which arrays are coordinates, as CF has it.
pub(super) fn name_coordinates(members: &Map<String, Value>, attributes: &mut Map<String, Value>) {
    let all = members.get(MEMBER).and_then(|member| member.get("metadata"));
    let is_there = |name: &&&str| all.is_some_and(|all| all.get(**name).is_some());
    let names: Vec<&str> = COORDINATES.iter().filter(is_there).copied().collect();
    if !names.is_empty() {
        attributes.insert("coordinates".to_owned(), json!(names.join(" ")));
    }
}

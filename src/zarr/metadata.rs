//! Files of metadata: read by one function that trusts none of them, and sealed so that a changed attribute is found.
//!
//! The member `btfkit` of a group's attributes decides about results. Its `seal` is the digest of all the rest of it;
//! what an array's `zarr.json` must say follows from it ([`super::array`]). Attributes beside `btfkit` are free.

use std::io::Read;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::disk::mapped::open;
use crate::disk::temporary::write_file;
use crate::error::{Error, Result};
use crate::run::recipe;

/// Version of the layout on disk, attribute `btfkit.format`, that is written.
pub const FORMAT: u64 = 2;

/// The oldest version that is read: without seals, checksums and angle coordinates.
pub(crate) const OLDEST_FORMAT: u64 = 1;

/// The file of metadata of a group or an array.
pub(crate) const FILE: &str = "zarr.json";

/// Largest file of metadata that is read.
const LIMIT_BYTES: u64 = 16 << 20;

/// Most characters of a value in a message.
const SHOWN: usize = 120;

/// The bytes of a file of metadata; `None` where there is none.
///
/// # Errors
/// [`crate::ErrorKind::Input`] for what is no file, or one of more than 16 MiB; [`crate::ErrorKind::Io`] where it
/// cannot be read.
pub(crate) fn read_file(path: &Path) -> Result<Option<Vec<u8>>> {
    let failed = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::InvalidInput => Error::input(format!("{}: {error}", path.display())),
        _ => Error::io("read", path, error),
    };
    let file = match open(path) {
        Ok(file) => file,
        Err(error) if is_absent(&error) => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    let mut bytes = Vec::new();
    file.take(LIMIT_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > LIMIT_BYTES {
        return Err(Error::input(format!(
            "{}: got more than {} MiB of metadata",
            path.display(),
            LIMIT_BYTES >> 20
        )));
    }
    Ok(Some(bytes))
}

/// Whether an error says that there is no such file, be it for want of a folder.
pub(crate) fn is_absent(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory)
}

/// The JSON object in a file of metadata; `None` where there is none.
///
/// # Errors
/// As [`read_file`], and where it holds anything else.
pub(crate) fn read_object(path: &Path) -> Result<Option<Map<String, Value>>> {
    let Some(bytes) = read_file(path)? else { return Ok(None) };
    match serde_json::from_slice(&bytes) {
        Ok(Value::Object(object)) => Ok(Some(object)),
        Ok(other) => {
            Err(Error::input(format!("{}: got {}, expected a JSON object", path.display(), shown(&other))))
        }
        Err(error) => Err(Error::input(format!("{}: {error}", path.display()))),
    }
}

/// Writes a JSON object as a file of metadata, unless the file holds just that already.
///
/// # Errors
/// Those of reading and writing.
pub(crate) fn write_object(path: &Path, object: Map<String, Value>) -> Result<()> {
    // In the order of the names: that of the writing would tell whether a run was interrupted.
    let text = serde_json::to_vec_pretty(&recipe::canonical(&Value::Object(object)))
        .map_err(|error| Error::internal(error.to_string()))?;
    if read_file(path)?.as_deref() == Some(text.as_slice()) {
        return Ok(());
    }
    write_file(path, &text)
}

/// A value in a message: not longer than a line.
pub(crate) fn shown(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() <= SHOWN {
        return text;
    }
    let head: String = text.chars().take(SHOWN).collect();
    format!("{head}...")
}

/// The digest of attributes without their seal, which it is the value of.
pub fn seal(attributes: &Map<String, Value>) -> String {
    let mut rest = attributes.clone();
    rest.remove("seal");
    recipe::digest(&Value::Object(rest))
}

/// Checks our attributes of a group: the version of the layout where it is a root, the seal, and that `digest` is that
/// of `recipe`.
///
/// # Errors
/// Says what was found and expected.
pub(crate) fn check_ours(ours: &Map<String, Value>, is_root: bool) -> std::result::Result<(), String> {
    let mut needs_seal = false;
    if is_root {
        match ours.get("format").and_then(Value::as_u64) {
            Some(format) if (OLDEST_FORMAT..=FORMAT).contains(&format) => needs_seal = format > 1,
            _ => {
                let format = ours.get("format").map_or("none".to_owned(), shown);
                return Err(format!("got layout format {format}, expected {OLDEST_FORMAT} or {FORMAT}"));
            }
        }
    }
    if is_root {
        expect_format(ours, needs_seal)?;
    }
    match ours.get("seal") {
        None if !needs_seal => {}
        found if found.and_then(Value::as_str) == Some(seal(ours).as_str()) => {}
        found => {
            return Err(format!(
                "attribute btfkit.seal: got {}, expected {}: the attributes are not those that were written",
                found.map_or("none".to_owned(), shown),
                seal(ours)
            ));
        }
    }
    check_digest(ours)
}

/// Checks that a root has what its layout has: the version of the program, and in the oldest layout none of what came
/// later, by which a changed store could claim to be older than its checksums.
fn expect_format(ours: &Map<String, Value>, is_new: bool) -> std::result::Result<(), String> {
    match ours.get("version") {
        Some(Value::String(_)) => {}
        None if !is_new => {}
        found => {
            let found = found.map_or("none".to_owned(), shown);
            return Err(format!("attribute btfkit.version: got {found}, expected that of a program"));
        }
    }
    let stages = ours.get("stages").and_then(Value::as_object);
    let mut entries = stages.into_iter().flatten().filter_map(|(_, entry)| entry.as_object());
    let later = if ours.contains_key("seal") {
        "a seal"
    } else if ours.contains_key("checksums") || entries.any(|entry| entry.contains_key("checksums")) {
        "checksums"
    } else {
        return Ok(());
    };
    if is_new {
        return Ok(());
    }
    Err(format!(
        "attribute btfkit.format: got {OLDEST_FORMAT} beside {later}, expected {FORMAT}, whose stores have it"
    ))
}

/// Checks that `digest` is that of `recipe`, where there is one.
pub(crate) fn check_digest(entry: &Map<String, Value>) -> std::result::Result<(), String> {
    let Some(recipe) = entry.get("recipe") else {
        return if entry.contains_key("digest") {
            Err("a digest without a recipe".to_owned())
        } else {
            Ok(())
        };
    };
    let expected = recipe::digest(recipe);
    match entry.get("digest") {
        Some(Value::String(found)) if *found == expected => Ok(()),
        found => Err(format!(
            "digest: got {}, expected {expected}, that of the recipe",
            found.map_or("none".to_owned(), shown)
        )),
    }
}

/// Reads a document of a group: its attributes, and our part of them.
///
/// # Errors
/// Where it is not one of Zarr v3, or has members that must be understood and are not.
pub(super) fn group_attributes(
    document: &Map<String, Value>,
) -> std::result::Result<Map<String, Value>, String> {
    if document.get("zarr_format") != Some(&json!(3)) || document.get("node_type") != Some(&json!("group")) {
        return Err("expected zarr_format 3 and node_type group".to_owned());
    }
    for (name, value) in document {
        let known = ["zarr_format", "node_type", "attributes"].contains(&name.as_str());
        if !known && !may_be_ignored(value) {
            return Err(format!("member {}, which must be understood", json!(name)));
        }
    }
    match document.get("attributes") {
        None => Ok(Map::new()),
        Some(Value::Object(attributes)) => Ok(attributes.clone()),
        Some(other) => Err(format!("attributes: got {}, expected an object", shown(other))),
    }
}

/// Whether a member that is not known may be left alone, as Zarr v3 has it.
pub(super) fn may_be_ignored(value: &Value) -> bool {
    value.is_null() || value.get("must_understand") == Some(&json!(false))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs::File;

    use super::*;

    #[test]
    fn any_change_of_an_attribute_breaks_the_seal() {
        let recipe = json!({"size": [3, 4], "white": 0.1, "theta": 14.999999999999998});
        let ours = json!({
            "kind": "model", "format": FORMAT, "version": "0", "recipe": recipe, "digest": recipe::digest(&recipe), "list": [1, 2.5],
        });
        let mut ours = ours.as_object().unwrap().clone();
        ours.insert("seal".to_owned(), json!(seal(&ours)));
        // As it comes back from a file.
        let ours: Map<String, Value> = serde_json::from_str(&Value::Object(ours).to_string()).unwrap();
        check_ours(&ours, true).unwrap();
        for name in ours.keys() {
            for value in [None, Some(json!(0)), Some(json!("x"))] {
                let mut changed = ours.clone();
                match value {
                    Some(value) => drop(changed.insert(name.clone(), value)),
                    None => drop(changed.remove(name)),
                }
                assert!(check_ours(&changed, true).is_err(), "{name}");
            }
        }
        let mut more = ours.clone();
        more.insert("more".to_owned(), json!(1));
        assert!(check_ours(&more, true).is_err());
    }

    #[test]
    fn files_of_metadata_are_files_of_a_bounded_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zarr.json");
        assert!(read_file(&path).unwrap().is_none());
        std::fs::create_dir(&path).unwrap();
        assert!(read_file(&path).unwrap_err().to_string().contains("a folder"));
        assert!(read_file(&path.join("zarr.json")).unwrap().is_none());
        std::fs::remove_dir(&path).unwrap();
        std::process::Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(read_file(&path).unwrap_err().to_string().contains("a pipe"));
        std::fs::remove_file(&path).unwrap();
        File::create(&path).unwrap().set_len(LIMIT_BYTES + 1).unwrap();
        assert!(read_file(&path).unwrap_err().to_string().contains("MiB of metadata"));
        std::fs::write(&path, "[".repeat(100_000)).unwrap();
        assert!(read_object(&path).is_err());
    }

    #[test]
    fn a_digest_is_that_of_the_recipe_beside_it() {
        let entry = |value: Value| check_digest(value.as_object().unwrap());
        let recipe = json!({"size": [3, 4]});
        entry(json!({"other": 1})).unwrap();
        entry(json!({"recipe": recipe, "digest": recipe::digest(&recipe)})).unwrap();
        assert!(entry(json!({"digest": recipe::digest(&recipe)})).unwrap_err().contains("without a recipe"));
        for digest in [json!("0"), json!(0), json!(null)] {
            let error = entry(json!({"recipe": recipe, "digest": digest})).unwrap_err();
            assert!(error.contains("that of the recipe"), "{error}");
        }
        assert!(entry(json!({"recipe": recipe})).unwrap_err().contains("got none"));
    }

    #[test]
    fn groups_are_of_zarr_3_and_have_no_member_that_must_be_understood() {
        let group = |value: Value| group_attributes(value.as_object().unwrap());
        let found = group(json!({"zarr_format": 3, "node_type": "group", "attributes": {"a": 1}})).unwrap();
        assert_eq!(Value::Object(found), json!({"a": 1}));
        assert!(group(json!({"zarr_format": 3, "node_type": "group", "more": null})).unwrap().is_empty());
        group(json!({"zarr_format": 3, "node_type": "group", "more": {"must_understand": false}})).unwrap();
        for (document, words) in [
            (json!({"zarr_format": 2, "node_type": "group"}), "zarr_format 3"),
            (json!({"zarr_format": 3, "node_type": "array"}), "node_type group"),
            (json!({"zarr_format": 3, "node_type": "group", "more": {}}), "\"more\""),
            (json!({"zarr_format": 3, "node_type": "group", "more": {"must_understand": true}}), "\"more\""),
            (json!({"zarr_format": 3, "node_type": "group", "attributes": []}), "expected an object"),
        ] {
            let error = group(document).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn what_is_written_does_not_depend_on_the_order_and_what_is_there_is_left() {
        use std::os::unix::fs::MetadataExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zarr.json");
        let object = |text: &str| serde_json::from_str::<Map<String, Value>>(text).unwrap();
        write_object(&path, object(r#"{"b": {"d": 1, "c": 2}, "a": 3}"#)).unwrap();
        let (bytes, file) = (std::fs::read(&path).unwrap(), std::fs::metadata(&path).unwrap().ino());
        write_object(&path, object(r#"{"a": 3, "b": {"c": 2, "d": 1}}"#)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        assert_eq!(std::fs::metadata(&path).unwrap().ino(), file, "it was written anew");
        assert_eq!(String::from_utf8(bytes).unwrap().find("\"a\""), Some(4));
    }
}

//! What lies at a path where a store is expected: so that whoever gave something else is told what it is, and what to
//! do with it.

use std::io::Read;
use std::path::Path;

use btfkit_formats::{big, bonn, mif, mlvq};
use serde_json::{Value, json};

use super::mapped::{is_temporary, open, special};
use super::metadata::read_object;
use super::{enlarged, is_lock, measurement, model};
use crate::error::{Error, Result};

/// Bytes that tell one file from another.
const HEAD_BYTES: u64 = 4096;

/// Files by which stores of Zarr version 2 are known.
pub const VERSION_2: [&str; 4] = [".zgroup", ".zarray", ".zmetadata", ".zattrs"];

/// Entries of a folder that are looked at.
const MOST_ENTRIES: usize = 10_000;

/// The file that says what a Deep Zoom pyramid holds, in the folder of its tiles.
pub const PYRAMID_STATE: &str = "btfkit.json";

/// The ending of the folder of a pyramid's tiles, in place of `.dzi`.
pub const PYRAMID_FOLDER: &str = "_files";

/// What is no store of ours.
pub(super) struct Other {
    /// What it is, with its article.
    what: String,
    /// What can be done with it.
    use_it: Use,
}

enum Use {
    /// A store of an older Zarr, which stores here never were.
    OldZarr,
    /// It can be imported.
    Import,
    /// Nothing that this program knows.
    Nothing,
    /// A sentence.
    Advice(&'static str),
}

/// What lies at a path that has no `zarr.json` of ours; `None` for nothing, or an empty folder.
///
/// # Errors
/// Those of listing a folder.
pub(super) fn other(path: &Path) -> Result<Option<Other>> {
    let data = match std::fs::metadata(path) {
        Ok(data) => data,
        Err(error) if super::metadata::is_absent(&error) => return Ok(None),
        Err(error) => return Err(Error::io("read", path, error)),
    };
    if data.is_dir() {
        return of_folder(path);
    }
    if let Some(special) = special(&data) {
        return Ok(Some(Other { what: special.to_owned(), use_it: Use::Nothing }));
    }
    let mut head = Vec::new();
    let read = open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.map_err(|error| Error::io("read", path, error))?;
    Ok(Some(of_file(&head)))
}

fn of_file(head: &[u8]) -> Other {
    let starts = |magic: &[u8]| head.starts_with(magic);
    let known = match head {
        _ if starts(b"PK\x03\x04") || starts(b"PK\x05\x06") => Some("a zip archive"),
        _ if bonn::recognise(head).is_some() => Some("a Bonn BTF archive"),
        _ if mlvq::recognise(head) => Some("an MLVQ database"),
        _ if big::recognise(head) => Some("a UTIA BIG archive"),
        _ if mif::recognise(head) => Some("a MIF archive"),
        _ if starts(b"\x93NUMPY") => Some("a numpy array"),
        _ if starts(b"\x89HDF\r\n\x1a\n") => Some("an HDF5 file"),
        _ => None,
    };
    if let Some(what) = known {
        return Other { what: format!("an archive ({what})"), use_it: Use::Import };
    }
    let text = String::from_utf8_lossy(head);
    let (what, use_it) = match head {
        _ if starts(b"\x89PNG") || starts(b"\xff\xd8\xff") || starts(b"II*\0") || starts(b"MM\0*") => {
            ("a picture", Use::Advice("a folder of pictures can be imported: btf import FOLDER NAME.zarr"))
        }
        _ if starts(b"\x76\x2f\x31\x01") => {
            ("a picture", Use::Advice("a folder of pictures can be imported: btf import FOLDER NAME.zarr"))
        }
        _ if text.contains("schemas.microsoft.com/deepzoom") => {
            ("a Deep Zoom pyramid", Use::Advice("name the store that the pyramid was made of"))
        }
        _ => ("a file", Use::Import),
    };
    Other { what: what.to_owned(), use_it }
}

fn of_folder(path: &Path) -> Result<Option<Other>> {
    if let Some(file) = VERSION_2.into_iter().find(|file| path.join(file).exists()) {
        let what = format!("a Zarr store of version 2 ({file})");
        return Ok(Some(Other { what, use_it: Use::OldZarr }));
    }
    if path.join(PYRAMID_STATE).exists() {
        let what = "the tiles of a Deep Zoom pyramid".to_owned();
        return Ok(Some(Other { what, use_it: Use::Advice("name the store that the pyramid was made of") }));
    }
    let entries = std::fs::read_dir(path).map_err(|error| Error::io("list", path, error))?;
    let mut is_empty = true;
    for entry in entries.take(MOST_ENTRIES) {
        let entry = entry.map_err(|error| Error::io("list", path, error))?.path();
        // What a killed writer left of its first file is nothing.
        if is_temporary(&entry) || is_lock(&entry) {
            continue;
        }
        is_empty = false;
        let ending = entry.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if ["jpg", "jpeg", "png", "tif", "tiff", "exr", "hdr"].contains(&ending.as_str()) {
            return Ok(Some(Other { what: "a folder of pictures".to_owned(), use_it: Use::Import }));
        }
    }
    let folder = || Other { what: "a folder without a zarr.json".to_owned(), use_it: Use::Import };
    Ok((!is_empty).then(folder))
}

/// What a `zarr.json` without our attributes is of.
pub(super) fn foreign(path: &Path) -> Result<Other> {
    let document = read_object(&path.join("zarr.json"))?.unwrap_or_default();
    let is_array = document.get("node_type") == Some(&json!("array"));
    let inside = path.parent().is_some_and(|folder| folder.join("zarr.json").exists());
    Ok(match (is_array, inside) {
        (true, true) => Other {
            what: "an array within a store".to_owned(),
            use_it: Use::Advice("name the store, the folder above it"),
        },
        (true, false) => Other { what: "a Zarr array".to_owned(), use_it: Use::Nothing },
        (false, _) => Other {
            what: "a Zarr group without the attribute btfkit, not a store of this program".to_owned(),
            use_it: Use::Nothing,
        },
    })
}

impl Other {
    /// The error where one of some kinds of stores was expected.
    pub(super) fn unexpected(&self, path: &Path, kinds: &[&str]) -> Error {
        let error =
            Error::input(format!("{}: got {}, expected {}", path.display(), self.what, one_of(kinds)));
        match self.use_it {
            Use::Import => {
                let name = path.with_extension("zarr");
                let name = name
                    .file_name()
                    .map_or_else(|| "NAME.zarr".to_owned(), |n| n.to_string_lossy().into_owned());
                error.hint(format!(
                    "if it is an archive, import it first: btf import {} {name}",
                    path.display()
                ))
            }
            Use::OldZarr => error.hint("make the store with this program, from the archive"),
            Use::Advice(advice) => error.hint(advice),
            Use::Nothing => error,
        }
    }
}

/// The error where a store of another kind lies at a path.
pub(super) fn another_kind(path: &Path, found: &Value, kinds: &[&str]) -> Error {
    let name = found.as_str().unwrap_or("unknown");
    let error =
        Error::input(format!("{}: got {}, expected {}", path.display(), article(name), one_of(kinds)));
    let place = path.display();
    match (name, kinds) {
        (measurement::KIND, [model::KIND, ..]) => {
            error.hint(format!("make a model of it first: btf model {place} NAME.model.zarr"))
        }
        (model::KIND, [measurement::KIND, ..]) => error.hint("name the measurement that it was made of"),
        (model::KIND, [enlarged::KIND, ..]) => {
            error.hint(format!("enlarge it first: btf enlarge {place} NAME.zarr --size WIDTHxHEIGHT"))
        }
        (enlarged::KIND, [model::KIND, ..]) => error.hint("name the model that it was enlarged from"),
        _ => error,
    }
}

/// A kind of store as a sentence names it.
fn article(kind: &str) -> String {
    match kind {
        enlarged::KIND => "an enlarged index".to_owned(),
        measurement::KIND | model::KIND => format!("a {kind}"),
        other => format!("a store of kind {}", json!(other)),
    }
}

pub(super) fn one_of(kinds: &[&str]) -> String {
    let names: Vec<String> = kinds.iter().map(|kind| article(kind)).collect();
    match names.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => names.concat(),
    }
}

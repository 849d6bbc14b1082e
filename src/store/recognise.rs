//! What lies at a path where a store is expected: so that whoever gave something else is told what it is, and what to
//! do with it.

use std::io::Read;
use std::path::Path;

use btfkit_formats::ContainerKind;
use serde_json::{Value, json};

use super::{enlarged, measurement, model};
use crate::disk::lock::is_lock;
use crate::disk::mapped::{open, special};
use crate::disk::temporary::is_temporary;
use crate::error::{Error, Result, is_loop};
use crate::zarr::metadata::read_object;

/// Bytes that tell one file from another.
const HEAD_BYTES: u64 = 4096;

/// Files by which stores of Zarr version 2 are known.
pub const VERSION_2: [&str; 4] = [".zgroup", ".zarray", ".zmetadata", ".zattrs"];

/// Entries of a folder that are looked at.
const MOST_ENTRIES: usize = 10_000;

/// The file that says what a Deep Zoom pyramid holds, in the folder of its tiles.
pub(crate) const PYRAMID_STATE: &str = "btfkit.json";

/// The ending of the folder of a pyramid's tiles, in place of `.dzi`.
pub(crate) const PYRAMID_FOLDER: &str = "_files";

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

/// Checks that a path is no link that leads nowhere, and no pipe, socket or device: nothing can be there to be read.
///
/// # Errors
/// [`crate::ErrorKind::Missing`], with what it is, or leads to.
pub fn expect_readable(path: &Path) -> Result<()> {
    // With a slash behind it, a link would be followed.
    let path: std::path::PathBuf = path.components().collect();
    let error = match std::fs::metadata(&path) {
        Ok(data) => {
            return match special(&data).filter(|_| !data.is_dir()) {
                Some(what) => {
                    Err(Error::missing(format!("{} is {what}, expected a file or a folder", path.display()))
                        .hint("copy its contents into a file, and name that"))
                }
                None => Ok(()),
            };
        }
        Err(error) => error,
    };
    let Ok(to) = path.read_link() else { return Ok(()) };
    let what = match error.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => "where nothing is".to_owned(),
        _ if is_loop(&error) => "and leads back to itself".to_owned(),
        _ => format!("where nothing can be read: {error}"),
    };
    Err(Error::missing(format!("{} is a link to {}, {what}", path.display(), to.display()))
        .hint("mend the link, or name what it was to lead to"))
}

/// What lies at a path that has no `zarr.json` of ours; `None` for nothing, or an empty folder.
///
/// # Errors
/// Those of listing a folder.
pub(super) fn other(path: &Path) -> Result<Option<Other>> {
    let data = match std::fs::metadata(path) {
        Ok(data) => data,
        Err(error) if crate::zarr::metadata::is_absent(&error) => return Ok(None),
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
    let zip = (starts(b"PK\x03\x04") || starts(b"PK\x05\x06")).then_some("a zip archive");
    let known = zip.or_else(|| ContainerKind::recognise(head).map(ContainerKind::name));
    if let Some(what) = known {
        return Other { what: format!("an archive ({what})"), use_it: Use::Import };
    }
    let text = String::from_utf8_lossy(head);
    let (what, use_it) = match head {
        _ if starts(b"\x89PNG") || starts(b"\xff\xd8\xff") || starts(b"II*\0") || starts(b"MM\0*") => {
            ("a picture", Use::Advice("a folder of pictures can be imported: btf import FOLDER NAME.zarr"))
        }
        _ if starts(&btfkit_packed::MAGIC) => (
            "a packed model",
            Use::Advice(
                "make a measurement of it, and of that what you need: btf import FILE NAME.zarr, btf model NAME.zarr; or a \
                 model with components alone: btf unpack FILE NAME.model.zarr",
            ),
        ),
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
    let mut has_arrays = false;
    for entry in entries.take(MOST_ENTRIES) {
        let entry = entry.map_err(|error| Error::io("list", path, error))?.path();
        // What a killed writer left of its first file is nothing.
        if is_temporary(&entry) || is_lock(&entry) {
            continue;
        }
        is_empty = false;
        has_arrays |= entry.join("zarr.json").is_file();
        let ending = entry.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if ["jpg", "jpeg", "png", "tif", "tiff", "exr", "hdr"].contains(&ending.as_str()) {
            return Ok(Some(Other { what: "a folder of pictures".to_owned(), use_it: Use::Import }));
        }
    }
    if has_arrays {
        let what = "a store that has lost its zarr.json".to_owned();
        return Ok(Some(Other { what, use_it: Use::Advice("make it again under another name") }));
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
        (enlarged::KIND, [measurement::KIND, ..]) => error.hint(format!(
            "name the measurement that its model was made of; btf image, and btf export {place} NAME.dzi, make pictures \
             of an enlarged index"
        )),
        _ => error,
    }
}

/// A kind of store as a sentence names it.
pub fn article(kind: &str) -> String {
    match kind {
        enlarged::KIND => "an enlarged index".to_owned(),
        measurement::KIND | model::KIND => format!("a {kind}"),
        other => format!("a store of kind {}", json!(other)),
    }
}

/// What to do where nothing lies and a store of one of these kinds was expected.
pub(super) fn how_made(kinds: &[&str]) -> String {
    let command = match kinds {
        [measurement::KIND, ..] => "btf import ARCHIVE NAME.zarr makes a measurement",
        [enlarged::KIND, ..] => "btf enlarge MODEL NAME.zarr --size WIDTHxHEIGHT makes an enlarged index",
        _ => "btf model MEASUREMENT NAME.model.zarr makes a model",
    };
    format!("look at the name and at the folder that it is in; {command}")
}

pub(super) fn one_of(kinds: &[&str]) -> String {
    let names: Vec<String> = kinds.iter().map(|kind| article(kind)).collect();
    match names.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => names.concat(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;

    /// The error of a path that is no store, with its advice.
    fn told(path: &Path) -> String {
        let error = other(path).unwrap().unwrap().unexpected(path, &[measurement::KIND]);
        format!("{error}; {}", error.guidance().unwrap_or_default())
    }

    #[test]
    fn files_are_called_what_they_are_and_archives_are_to_be_imported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("given.bin");
        let (import, pictures) = ("import it first: btf import", "a folder of pictures can be imported");
        for (head, what, advice) in [
            (&b"PK\x03\x04rest"[..], "an archive (a zip archive)", import),
            (b"PK\x05\x06rest", "an archive (a zip archive)", import),
            (b"!PVF06FCrest", "an archive (a Bonn BTF archive)", import),
            (b"4627\n1\n", "an archive (an MLVQ database)", import),
            (b"BIG\0\0\0\0\0rest", "an archive (a UTIA BIG archive)", import),
            (b"MIF FILErest", "an archive (a MIF archive)", import),
            (b"\x93NUMPYrest", "an archive (a numpy array)", import),
            (b"\x89HDF\r\n\x1a\nrest", "an archive (an HDF5 file)", import),
            (b"\x89PNG\r\n", "a picture", pictures),
            (b"\xff\xd8\xff\xe0", "a picture", pictures),
            (b"II*\0", "a picture", pictures),
            (b"MM\0*", "a picture", pictures),
            (b"\x76\x2f\x31\x01", "a picture", pictures),
            (
                b"<Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\"",
                "a Deep Zoom pyramid",
                "name the store",
            ),
            (b"BTFC\x01rest", "a packed model", "btf import FILE NAME.zarr"),
            (b"anything else", "a file", import),
            (b"", "a file", import),
        ] {
            fs::write(&path, head).unwrap();
            let told = told(&path);
            assert!(
                told.contains(&format!("given.bin: got {what}, expected a measurement")),
                "{head:?}: {told}"
            );
            assert!(told.contains(advice), "{head:?}: {told}");
        }
    }

    #[test]
    fn folders_are_called_what_they_are_and_what_is_left_of_a_killed_writer_is_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for (files, what) in [
            (&[".zgroup"][..], "a Zarr store of version 2 (.zgroup)"),
            (&[".zattrs", "a.jpg"], "a Zarr store of version 2 (.zattrs)"),
            (&[PYRAMID_STATE], "the tiles of a Deep Zoom pyramid"),
            (&["notes.txt", "a.JPG"], "a folder of pictures"),
            (&["a.exr"], "a folder of pictures"),
            (&["index/zarr.json"], "a store that has lost its zarr.json"),
            (&["notes.txt"], "a folder without a zarr.json"),
            (&["sub/a.jpg"], "a folder without a zarr.json"),
        ] {
            let path = folder.path().join("given");
            for file in files.iter().map(|file| path.join(file)) {
                fs::create_dir_all(file.parent().unwrap()).unwrap();
                fs::write(file, b"").unwrap();
            }
            let told = told(&path);
            assert!(
                told.contains(&format!("given: got {what}, expected a measurement")),
                "{files:?}: {told}"
            );
            fs::remove_dir_all(path).unwrap();
        }
        let empty = folder.path().join("empty");
        assert!(other(&empty).unwrap().is_none());
        fs::create_dir(&empty).unwrap();
        fs::write(empty.join(".zarr.json.tmp-host-1-1"), b"").unwrap();
        fs::write(empty.join(".lock"), b"").unwrap();
        assert!(other(&empty).unwrap().is_none());
    }

    #[test]
    fn what_is_zarr_and_not_ours_is_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let group = folder.path().join("store");
        fs::create_dir_all(group.join("array")).unwrap();
        let named = |path: &Path| foreign(path).unwrap().unexpected(path, &[model::KIND]).to_string();
        fs::write(group.join("array/zarr.json"), r#"{"node_type": "array"}"#).unwrap();
        assert!(named(&group.join("array")).contains("got a Zarr array, expected a model"));
        fs::write(group.join("zarr.json"), r#"{"node_type": "group"}"#).unwrap();
        assert!(named(&group.join("array")).contains("got an array within a store"));
        assert!(named(&group).contains("got a Zarr group without the attribute btfkit"));
    }
}

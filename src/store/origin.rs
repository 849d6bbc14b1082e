//! Where the store lies that another one was made of (the model of an enlarged index, the measurement of a model):
//! beside it under the name that is expected, or where a file in it says.
//!
//! The file holds the way from the folder of the store to its origin, so that both can be moved together. It is no part
//! of what is made: the same store in another place has the same bytes in all other files.

use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use crate::disk::mapped::open;
use crate::disk::temporary::write_file;
use crate::error::{Error, Result};

/// The file with the way from an enlarged index to its model.
pub(crate) const MODEL: &str = "model-path";

/// The file with the way from a model to its measurement.
pub(crate) const MEASUREMENT: &str = "measurement-path";

/// The longest way that is read.
const MOST_BYTES: u64 = 4096;

/// Notes in a file of a store where its origin lies; nothing where that lies beside it under the name that is
/// `expected`, or where there is no such way. A store that cannot be written to keeps what it says.
///
/// # Errors
/// Those of writing.
pub(crate) fn note(store: &Path, file: &str, origin: &Path, expected: Option<&str>) -> Result<()> {
    let at = store.join(file);
    let noted = match way(store, origin, expected) {
        Some(way) if read(store, file).as_deref() == Some(way.as_str()) => Ok(()),
        Some(way) => write_file(&at, way.as_bytes()),
        None if at.exists() => fs::remove_file(&at).map_err(|error| Error::io("remove", &at, error)),
        None => Ok(()),
    };
    match noted {
        Err(error) if error.is_denied() => Ok(()),
        noted => noted,
    }
}

/// Where the origin of a store may lie, the likeliest first; `name` is the one that is expected.
pub(crate) fn places(store: &Path, file: &str, name: Option<&str>) -> Vec<PathBuf> {
    // Through links to the store itself: the way leads from where it lies.
    let real = store.canonicalize().unwrap_or_else(|_| store.to_owned());
    let mut places = Vec::new();
    if let (Some(way), Some(folder)) = (read(store, file), real.parent()) {
        places.push(folder.join(way));
    }
    let name = name.filter(|name| Path::new(name).file_name().is_some_and(|file| file == *name));
    // At last in the current folder.
    for of in [store, &real, Path::new("")] {
        if let Some(beside) = name.map(|name| of.with_file_name(name))
            && !places.contains(&beside)
        {
            places.push(beside);
        }
    }
    places
}

/// The way that a store notes. Nothing but a way from the store is believed, and nothing is said of one that is none:
/// what it leads to is held against the store anyway.
fn read(store: &Path, file: &str) -> Option<String> {
    let path = store.join(file);
    if !path.symlink_metadata().ok()?.is_file() {
        return None;
    }
    let mut text = String::new();
    open(&path).ok()?.take(MOST_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
        .filter(|way| !way.is_empty() && !way.contains(char::is_control) && Path::new(way).is_relative())
}

/// The way from the folder of a store to its origin, with `/` between its parts; none to one beside it of the name that
/// is expected.
fn way(store: &Path, origin: &Path, expected: Option<&str>) -> Option<String> {
    let folder = |path: &Path| {
        let path: PathBuf = path.components().collect();
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some((parent, path.file_name()?.to_str()?.to_owned()))
    };
    let ((from, _), (to, name)) = (folder(store)?, folder(origin)?);
    if from == to && expected.is_none_or(|expected| expected == name) {
        return None;
    }
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Some(".."));
    let down = to.components().skip(shared).map(|part: Component<'_>| part.as_os_str().to_str());
    let parts: Vec<&str> = up.chain(down).chain([Some(name.as_str())]).collect::<Option<_>>()?;
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_model_is_found_where_it_lay_as_seen_from_the_index_and_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let [index, model, beside] =
            ["out/deep/big.zarr", "models/a.model.zarr", "out/deep/a.model.zarr"].map(|name| root.join(name));
        for path in [&index, &model, &beside] {
            fs::create_dir_all(path).unwrap();
        }
        note(&index, MODEL, &model, None).unwrap();
        assert_eq!(fs::read_to_string(index.join(MODEL)).unwrap(), "../../models/a.model.zarr");
        let found = places(&index, MODEL, Some("a.model.zarr"));
        assert_eq!(found[0].canonicalize().unwrap(), model);
        assert_eq!(found[1..], [beside.clone(), PathBuf::from("a.model.zarr")]);
        let slashed = PathBuf::from(format!("{}/", index.display()));
        assert_eq!(places(&slashed, MODEL, Some("a.model.zarr")), found);
        // Through a link the way leads from where the index lies.
        let link = root.join("link.zarr");
        std::os::unix::fs::symlink(&index, &link).unwrap();
        let found = places(&link, MODEL, Some("a.model.zarr"));
        assert_eq!(found[0].canonicalize().unwrap(), model);
        assert_eq!(found[1..3], [root.join("a.model.zarr"), beside.clone()]);
        // Noted again from beside it, nothing is left to note.
        note(&index, MODEL, &beside, None).unwrap();
        assert!(!index.join(MODEL).exists());
        assert_eq!(places(&index, MODEL, Some("a.model.zarr"))[0], beside);
        // Of another name than expected it is noted beside it too.
        note(&index, MODEL, &beside, Some("b.model.zarr")).unwrap();
        assert_eq!(places(&index, MODEL, Some("b.model.zarr"))[0].canonicalize().unwrap(), beside);
    }

    #[test]
    fn what_is_no_way_from_the_index_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let index = folder.path().join("big.zarr");
        fs::create_dir(&index).unwrap();
        for text in ["", "/etc", "\u{0}\u{ff}"] {
            fs::write(index.join(MODEL), text).unwrap();
            assert!(places(&index, MODEL, None).iter().all(|place| !place.starts_with("/etc")), "{text:?}");
        }
        assert_eq!(places(&index, MODEL, Some("../up")), [] as [PathBuf; 0]);
        fs::remove_file(index.join(MODEL)).unwrap();
        fs::create_dir(index.join(MODEL)).unwrap();
        assert_eq!(places(&index, MODEL, None), [] as [PathBuf; 0]);
        fs::remove_dir(index.join(MODEL)).unwrap();
        // Reading a pipe would wait for a writer.
        assert!(std::process::Command::new("mkfifo").arg(index.join(MODEL)).status().unwrap().success());
        assert_eq!(places(&index, MODEL, None), [] as [PathBuf; 0]);
    }
}

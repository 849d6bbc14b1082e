//! Where the model of an enlarged index lies: beside it, or where the file `model-path` in it says.
//!
//! The file holds the way from the folder of the index to the model, so that both can be moved together. It is no part
//! of what is made: the same index in another place has the same bytes in all other files.

use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::mapped::{open, write_file};
use crate::error::{Error, Result};

/// The file.
const FILE: &str = "model-path";

/// The longest way that is read.
const MOST_BYTES: u64 = 4096;

/// Notes where the model of an index lies; nothing for one that lies beside it, or that has no such way.
///
/// # Errors
/// Those of writing.
pub(crate) fn note(index: &Path, model: &Path) -> Result<()> {
    let file = index.join(FILE);
    match way(index, model) {
        Some(way) if read(index).as_deref() == Some(way.as_str()) => Ok(()),
        Some(way) => write_file(&file, way.as_bytes()),
        None if file.exists() => fs::remove_file(&file).map_err(|error| Error::io("remove", &file, error)),
        None => Ok(()),
    }
}

/// Where the model of an index may lie, the likeliest first; `name` is the one it had.
pub(crate) fn places(index: &Path, name: Option<&str>) -> Vec<PathBuf> {
    // Through links to the index itself: the way leads from where it lies.
    let real = index.canonicalize().unwrap_or_else(|_| index.to_owned());
    let mut places = Vec::new();
    if let (Some(way), Some(folder)) = (read(index), real.parent()) {
        places.push(folder.join(way));
    }
    let name = name.filter(|name| Path::new(name).file_name().is_some_and(|file| file == *name));
    for index in [index, &real] {
        if let Some(beside) = name.map(|name| index.with_file_name(name))
            && !places.contains(&beside)
        {
            places.push(beside);
        }
    }
    places
}

/// The way that an index notes. Nothing but a way from the index is believed, and nothing is said of one that is none:
/// what it leads to is held against the index anyway.
fn read(index: &Path) -> Option<String> {
    let path = index.join(FILE);
    if !path.symlink_metadata().ok()?.is_file() {
        return None;
    }
    let mut text = String::new();
    open(&path).ok()?.take(MOST_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
        .filter(|way| !way.is_empty() && !way.contains(char::is_control) && Path::new(way).is_relative())
}

/// The way from the folder of an index to a model, with `/` between its parts; none to one beside it.
fn way(index: &Path, model: &Path) -> Option<String> {
    let folder = |path: &Path| {
        let path: PathBuf = path.components().collect();
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some((parent, path.file_name()?.to_str()?.to_owned()))
    };
    let ((from, _), (to, name)) = (folder(index)?, folder(model)?);
    if from == to {
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
        note(&index, &model).unwrap();
        assert_eq!(fs::read_to_string(index.join(FILE)).unwrap(), "../../models/a.model.zarr");
        let found = places(&index, Some("a.model.zarr"));
        assert_eq!(found[0].canonicalize().unwrap(), model);
        assert_eq!(found[1..], std::slice::from_ref(&beside)[..]);
        let slashed = PathBuf::from(format!("{}/", index.display()));
        assert_eq!(places(&slashed, Some("a.model.zarr")), found);
        // Through a link the way leads from where the index lies.
        let link = root.join("link.zarr");
        std::os::unix::fs::symlink(&index, &link).unwrap();
        let found = places(&link, Some("a.model.zarr"));
        assert_eq!(found[0].canonicalize().unwrap(), model);
        assert_eq!(found[1..], [root.join("a.model.zarr"), beside.clone()]);
        // Noted again from beside it, nothing is left to note.
        note(&index, &beside).unwrap();
        assert!(!index.join(FILE).exists());
        assert_eq!(places(&index, Some("a.model.zarr")), [beside]);
    }

    #[test]
    fn what_is_no_way_from_the_index_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let index = folder.path().join("big.zarr");
        fs::create_dir(&index).unwrap();
        for text in ["", "/etc", "\u{0}\u{ff}"] {
            fs::write(index.join(FILE), text).unwrap();
            assert!(places(&index, None).iter().all(|place| !place.starts_with("/etc")), "{text:?}");
        }
        assert_eq!(places(&index, Some("../up")), [] as [PathBuf; 0]);
        fs::remove_file(index.join(FILE)).unwrap();
        fs::create_dir(index.join(FILE)).unwrap();
        assert_eq!(places(&index, None), [] as [PathBuf; 0]);
        fs::remove_dir(index.join(FILE)).unwrap();
        // Reading a pipe would wait for a writer.
        assert!(std::process::Command::new("mkfifo").arg(index.join(FILE)).status().unwrap().success());
        assert_eq!(places(&index, None), [] as [PathBuf; 0]);
    }
}

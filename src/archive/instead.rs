//! What was meant where something else than an archive is named: a store, the folder of a container, a file beside one.

use std::path::{Path, PathBuf};

use btfkit_formats::ContainerKind;

use super::files;
use crate::error::{Error, Result};

/// Files that are looked at for what they are.
const SNIFFED: usize = 64;

/// Containers that an error names.
const NAMED: usize = 4;

/// Refuses stores, which are what archives become.
///
/// # Errors
/// Says what to name.
pub(super) fn expect_no_store(paths: &[PathBuf]) -> Result<()> {
    match paths.iter().find(|path| path.join("zarr.json").is_file()) {
        Some(store) => Err(Error::input(format!("{}: got a store, expected an archive", store.display()))
            .hint(
                "a store has been imported already; in btf import the archive comes first and the store last",
            )),
        None => Ok(()),
    }
}

/// What to say where no pictures were found, but containers lie in the folder that is named or beside the file.
pub(super) fn of_containers(paths: &[PathBuf]) -> Option<Error> {
    let [path] = paths else { return None };
    let (files, place) = if path.is_dir() {
        (files::list_folder(path).ok()?.0, "in it")
    } else {
        (direct_files(path.parent()?)?, "beside it")
    };
    let is_set = |file: &PathBuf| {
        let name = file.to_string_lossy();
        files::is_picture(&name) || files::has_extension(&name, "zip") || files::has_extension(&name, "lp")
    };
    // A set of pictures has faults of its own, whatever else lies there.
    if is_set(path) || path.is_dir() && files.iter().any(is_set) {
        return None;
    }
    let found: Vec<(PathBuf, &str)> = files.into_iter().take(SNIFFED).filter_map(container).collect();
    let (first, _) = found.first()?;
    let shown: Vec<String> =
        found.iter().take(NAMED).map(|(file, what)| format!("{} ({what})", file.display())).collect();
    let more = found.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    Some(
        Error::input(format!(
            "{}: no pictures, and no archive in one file; {place} there is {}{more}",
            path.display(),
            shown.join(", ")
        ))
        .hint(format!("name the file: {}", first.display())),
    )
}

/// A file that is a container, and which.
fn container(file: PathBuf) -> Option<(PathBuf, &'static str)> {
    let name = file.to_string_lossy();
    let is_list = [".views.npy", ".lights.npy"].iter().any(|ending| name.ends_with(ending));
    let head = files::read_head(&file, super::HEAD_BYTES).ok()?;
    let kind = ContainerKind::recognise(&head).filter(|_| !is_list)?;
    Some((file, kind.name()))
}

fn direct_files(folder: &Path) -> Option<Vec<PathBuf>> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<PathBuf> = entries.filter(|path| path.is_file()).take(SNIFFED).collect();
    files.sort();
    Some(files)
}

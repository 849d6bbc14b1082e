//! Where a pyramid lies: `NAME.dzi`, `NAME.html`, and the tiles in `NAME_files`.
//!
//! `NAME_files/btfkit.json` holds the recipe and is written first; `NAME.dzi` is written last, so that it is there
//! only once all tiles are. Every file appears whole or not at all: a tile that is there is done.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::recipe::State;
use crate::disk::lock::is_lock;
use crate::disk::output::{expect_outside_stores, holds, put_in_place};
use crate::disk::temporary::{self, Temporary};
use crate::error::{Error, Result};
use crate::picture::deepzoom::Encoding;
use crate::run::{Context, Existing, recipe};
use crate::store::recognise::{PYRAMID_FOLDER as FOLDER_ENDING, PYRAMID_STATE as STATE_FILE};
use crate::zarr::storage::MappedStorage;
use crate::zarr::{FORMAT, Store, metadata};

/// The files of a pyramid.
pub(super) struct PyramidFiles {
    /// The description, `NAME.dzi`.
    pub(super) description: PathBuf,
    /// The viewer, `NAME.html`.
    pub(super) page: PathBuf,
    /// `NAME`, as the files bear it.
    pub(super) name: String,
    folder: PathBuf,
    ending: &'static str,
}

impl PyramidFiles {
    /// The place of a pyramid whose description is called `output`.
    pub(super) fn new(output: &Path, encoding: Encoding) -> Result<Self> {
        let ends = output.extension().is_some_and(|ending| ending == "dzi");
        let name = output.file_stem().filter(|_| ends).ok_or_else(|| {
            Error::usage(format!("{}: expected a name that ends in .dzi", output.display()))
        })?;
        // Its page and its viewers name the folder of the tiles.
        let name = name.to_str().ok_or_else(|| {
            Error::usage(format!("{}: the name of a pyramid has to be valid UTF-8", output.display()))
                .hint("choose another name")
        })?;
        Ok(Self {
            description: output.to_owned(),
            page: output.with_extension("html"),
            name: name.to_owned(),
            folder: output.with_file_name(format!("{name}{FOLDER_ENDING}")),
            ending: encoding.ending(),
        })
    }

    /// The folder of the tiles.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a tile.
    pub(super) fn tile(&self, level: u32, row: usize, column: usize) -> PathBuf {
        self.folder.join(level.to_string()).join(format!("{column}_{row}.{}", self.ending))
    }

    /// Row and column of each tile of a level that is there; none where the level has no folder yet.
    ///
    /// # Errors
    /// Those of listing.
    pub(super) fn tiles_found(&self, level: u32) -> Result<Vec<[usize; 2]>> {
        let folder = self.folder.join(level.to_string());
        let failed = |error| Error::io("list", &folder, error);
        let entries = match std::fs::read_dir(&folder) {
            Err(error) if metadata::is_absent(&error) => return Ok(Vec::new()),
            entries => entries.map_err(failed)?,
        };
        let mut found = Vec::new();
        for entry in entries {
            let path = entry.map_err(failed)?.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            let place = stem.and_then(|stem| stem.split_once('_'));
            let numbers = place.and_then(|(column, row)| Some([row.parse().ok()?, column.parse().ok()?]));
            // What bears just the name of a tile, with no zeros before it.
            if let Some([row, column]) = numbers
                && path == self.tile(level, row, column)
                && path.is_file()
            {
                found.push([row, column]);
            }
        }
        Ok(found)
    }

    /// Checks that nothing lies there, or what the same recipe began, or what may be replaced.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] for another recipe's pyramid, [`crate::ErrorKind::Input`] for other files.
    pub(super) fn check(&self, recipe: &Value, existing: Existing) -> Result<()> {
        expect_outside_stores(&self.description)?;
        match self.compare(recipe) {
            Err(error) if existing == Existing::Replace && error.kind() == crate::ErrorKind::Recipe => Ok(()),
            other => other,
        }
    }

    fn compare(&self, recipe: &Value) -> Result<()> {
        // A damaged one is another one: it can be replaced on request.
        let state = self.state().map_err(|error| match error.kind() {
            crate::ErrorKind::Input => {
                Error::recipe(error.to_string()).hint("choose another name, or use --force")
            }
            _ => error,
        })?;
        if let Some(found) = state {
            return found.made().expect(&self.description, recipe);
        }
        let is_ours = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.is_ok_and(|entry| temporary::is_temporary(&entry.path()) || is_lock(&entry.path()))
        };
        let strange = std::fs::read_dir(&self.folder).is_ok_and(|mut entries| !entries.all(is_ours));
        let occupied = [(&self.folder, strange || self.folder.is_file())]
            .into_iter()
            .chain([&self.description, &self.page].map(|path| (path, path.exists())))
            .find(|(_, occupied)| *occupied);
        match occupied {
            Some((path, _)) => {
                Err(Error::input(format!("{} exists and is not of a pyramid begun here", path.display()))
                    .hint("choose another name for the result"))
            }
            None => Ok(()),
        }
    }

    /// Writes the recipe, unless it is there, and removes what killed writers left.
    pub(super) fn begin(&self, recipe: &Value, context: &Context<'_>) -> Result<()> {
        if context.existing == Existing::Replace {
            self.remove_another(recipe)?;
        }
        // Looked at before the lock, which leaves a file: none in a folder that is not ours.
        self.compare(recipe)?;
        let _lock = Store::at(&self.folder).lock("", context)?;
        self.compare(recipe)?;
        MappedStorage::new(&self.folder).sweep()?;
        if self.folder.join(STATE_FILE).exists() {
            return Ok(());
        }
        self.write_state(&State::new(recipe, recipe::digest(recipe), FORMAT))
    }

    /// What the file with the recipe holds; `None` where there is none.
    ///
    /// # Errors
    /// Where it is damaged, or was changed.
    pub(super) fn state(&self) -> Result<Option<State>> {
        let path = self.folder.join(STATE_FILE);
        let Some(state) = metadata::read_object(&path)? else { return Ok(None) };
        // The oldest had neither version nor seal.
        let checked = if state.contains_key("format") || state.contains_key("seal") {
            metadata::check_ours(&state, true)
        } else {
            metadata::check_digest(&state)
        };
        let damaged = |what: String| {
            Error::input(format!("{}: {what}", path.display()))
                .hint("make the pyramid anew: under another name, or with --force")
        };
        checked.map_err(damaged)?;
        serde_json::from_value(Value::Object(state)).map(Some).map_err(|error| damaged(error.to_string()))
    }

    /// Writes it, sealed, unless it is the same.
    pub(super) fn write_state(&self, state: &State) -> Result<()> {
        let Ok(Value::Object(mut state)) = serde_json::to_value(state) else {
            return Err(Error::internal("the state of a pyramid is no JSON object"));
        };
        let seal = metadata::seal(&state);
        state.insert("seal".to_owned(), json!(seal));
        metadata::write_object(&self.folder.join(STATE_FILE), state)
    }

    /// Removes another recipe's pyramid.
    fn remove_another(&self, recipe: &Value) -> Result<()> {
        let is_another = self.compare(recipe).is_err_and(|error| error.kind() == crate::ErrorKind::Recipe);
        if !is_another || !self.folder.join(STATE_FILE).is_file() {
            return Ok(());
        }
        Temporary::sweep_beside(&self.folder);
        // The description first: without it there is no pyramid.
        for path in [&self.description, &self.page] {
            match std::fs::remove_file(path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::io("remove", path, error));
                }
                _ => {}
            }
        }
        temporary::remove_folder(&self.folder, |path| is_tile(path) || path == Path::new(STATE_FILE))
    }

    /// Refuses a page or a description that lies there and is another's, before any work.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`]; where it may be replaced, only for what is no file.
    pub(super) fn expect_texts(&self, texts: &[(&Path, String)], existing: Existing) -> Result<()> {
        for (path, text) in texts {
            if path.symlink_metadata().is_err() || holds(path, text.as_bytes())? {
                continue;
            }
            existing.expect_free(path).map_err(|_| {
                let found = format!("{} exists and is not what this pyramid has there", path.display());
                let todo = "move it away, or replace it by --force if it is a file";
                Error::recipe(found).hint(todo)
            })?;
        }
        Ok(())
    }

    /// Writes a file beside the tiles' folder; its temporary one lies in the folder, where it is swept.
    /// One that says so already is left alone.
    pub(super) fn write_beside(&self, path: &Path, text: &str, existing: Existing) -> Result<()> {
        if holds(path, text.as_bytes())? {
            return Ok(());
        }
        let name = path.file_name().unwrap_or_default();
        let written = || {
            let temporary = Temporary::file(&self.folder.join(name))?;
            temporary.handle()?.write_all(text.as_bytes())?;
            Ok(temporary)
        };
        let temporary = written().map_err(|error| Error::io("write", path, error))?;
        put_in_place(temporary.path(), path, existing).map(drop)
    }
}

/// Whether a file is called as a tile is, `level/column_row.png`, by its way from the folder.
fn is_tile(path: &Path) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let parts: Option<Vec<&str>> = path.iter().map(|part| part.to_str()).collect();
    let Some([level, file]) = parts.as_deref() else { return false };
    let stem = file.strip_suffix(".png").or_else(|| file.strip_suffix(".jpg"));
    let place = stem.and_then(|stem| stem.split_once('_'));
    is_number(level) && place.is_some_and(|(column, row)| is_number(column) && is_number(row))
}

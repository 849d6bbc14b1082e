//! Advisory locks that keep two processes from mixing their recipes in one store.
//!
//! No result depends on them: shards are deterministic and appear whole. Where a file system has no
//! locks the work goes on without.

use std::fs::File;
use std::path::Path;

use crate::error::{Error, Result};

/// How lock files begin; they are empty and stay.
const PREFIX: &str = ".lock";

/// A lock, held while it lives.
pub struct Lock {
    _file: File,
}

impl Lock {
    /// Waits for the lock `name` of the store at `path`.
    pub(super) fn wait(path: &Path, name: &str) -> Result<Self> {
        std::fs::create_dir_all(path).map_err(|error| Error::io("create", path, error))?;
        let file = path.join(format!("{PREFIX}{name}"));
        let opened = File::options().create(true).append(true).open(&file);
        let opened = opened.map_err(|error| Error::io("write", &file, error))?;
        let _ = opened.lock();
        Ok(Self { _file: opened })
    }
}

/// Whether a file is one of these.
pub(crate) fn is_lock(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX))
}

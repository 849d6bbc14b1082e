//! What all stores have, whatever they hold.

use std::path::Path;

use serde::Serialize;

use crate::disk::lock::is_lock;
use crate::disk::temporary;

/// What all stores have.
#[derive(Clone, Debug, Serialize)]
pub struct Kept {
    /// Version of the program that began it.
    pub version: String,
    /// Version of its layout.
    pub layout: u64,
    /// Bytes of all its files.
    pub stored_bytes: u64,
    /// Whether nothing is left to be done.
    pub finished: bool,
}

/// Bytes of all files below a folder, but for those of writers at work. Links are not followed.
pub(crate) fn bytes_below(folder: &Path) -> u64 {
    let (mut bytes, mut folders) = (0u64, vec![folder.to_owned()]);
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).into_iter().flatten().flatten() {
            let path = entry.path();
            match entry.metadata() {
                Ok(data) if data.is_dir() => folders.push(path),
                Ok(data) if data.is_file() && !temporary::is_temporary(&path) && !is_lock(&path) => {
                    bytes = bytes.saturating_add(data.len());
                }
                _ => {}
            }
        }
    }
    bytes
}

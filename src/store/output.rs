//! Files and folders outside a store that appear whole or not at all.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use super::mapped::temporary_name;
use crate::error::{Error, Result};

/// Buffer of a file that is written front to back.
const BUFFER_BYTES: usize = 1 << 20;

/// Writes a file front to back by `write`; it gets its name when that is done.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    let failed = |error| Error::io("write", path, error);
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    let temporary = temporary_name(path);
    let written = File::create_new(&temporary).map_err(failed).and_then(|file| {
        let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
        write(&mut output)?;
        output.flush().map_err(failed)?;
        output.get_ref().sync_all().map_err(failed)
    });
    written.and_then(|()| fs::rename(&temporary, path).map_err(failed)).inspect_err(|_| {
        let _ = fs::remove_file(&temporary);
    })
}

/// Fills a folder by `write`; it gets its name when that is done.
pub fn write_whole_folder(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let failed = |error| Error::io("write", path, error);
    let temporary = temporary_name(path);
    let written = fs::create_dir_all(&temporary).map_err(failed).and_then(|()| write(&temporary));
    written.and_then(|()| fs::rename(&temporary, path).map_err(failed)).inspect_err(|_| {
        let _ = fs::remove_dir_all(&temporary);
    })
}

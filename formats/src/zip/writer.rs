//! Writing stored entries.

use std::collections::HashSet;
use std::io::Write;

use rawzip::{CompressionMethod, DataDescriptorOutput, ZipArchiveWriter};

use super::{crc32, name, translate};
use crate::{Error, ErrorKind, Result};

/// Read and write for the owner, read for the others.
const UNIX_PERMISSIONS: u32 = 0o644;

/// Writes a zip of stored entries, as the published UBO2003 zips are, to any [`Write`], front to back.
///
/// The bytes depend on the names, the data and their order only: every entry carries the same time stamp
/// (1980-01-01). Zip64 records are added when the archive needs them. Sizes follow each entry in a data
/// descriptor, so the archive has to be read through its directory, not as a stream.
///
/// ```
/// use btfkit_formats::{Limits, zip};
///
/// # fn main() -> Result<(), btfkit_formats::Error> {
/// let mut writer = zip::ZipWriter::new(Vec::new());
/// writer.write_entry("folder/a.txt", b"abc")?;
/// let archive = writer.finish()?;
/// let index = zip::ZipIndex::open(&archive, &Limits::default())?;
/// assert_eq!(index.entries()[0].name(), "folder/a.txt");
/// assert_eq!(*index.read(&archive, 0)?, *b"abc");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct ZipWriter<W: Write> {
    archive: ZipArchiveWriter<W>,
    names: HashSet<String>,
}

impl<W: Write> ZipWriter<W> {
    /// Starts an archive at the present position of `output`. Many small writes follow: buffer a file.
    pub fn new(output: W) -> Self {
        ZipWriter { archive: ZipArchiveWriter::new(output), names: HashSet::new() }
    }

    /// Appends one file. `name` is a relative path with `/` between its parts.
    ///
    /// # Errors
    ///
    /// - [`ErrorKind::Argument`]: a name that [`ZipIndex::open`](super::ZipIndex::open) would refuse or another
    ///   reader would change, or one already written. Nothing has been written then.
    /// - [`ErrorKind::Io`]: the output failed; the archive cannot be continued.
    pub fn write_entry(&mut self, name: &str, data: &[u8]) -> Result<()> {
        if let Some(reason) = name::unwritable_reason(name) {
            return Err(Error::new(ErrorKind::Argument, reason, "a plain relative name").in_entry(name));
        }
        if !self.names.insert(name.to_owned()) {
            return Err(Error::new(ErrorKind::Argument, "a second entry of this name", "one").in_entry(name));
        }
        self.append(name, data).map_err(|e| e.in_entry(name))
    }

    fn append(&mut self, name: &str, data: &[u8]) -> Result<()> {
        let builder = self.archive.new_file(name).compression_method(CompressionMethod::STORE);
        let started = builder.unix_permissions(UNIX_PERMISSIONS).start();
        let (mut entry, _) = started.map_err(|e| translate(e, "an entry that a zip can hold"))?;
        entry.write_all(data).map_err(|e| Error::io("writing the archive", e))?;
        let size = u64::try_from(data.len()).unwrap_or(u64::MAX);
        let finished = entry.finish(DataDescriptorOutput::new(crc32(data), size));
        finished.map_err(|e| translate(e, "an entry that a zip can hold"))?;
        Ok(())
    }

    /// Writes the central directory, flushes, and returns the output. An archive that is dropped without
    /// this call is not a zip.
    ///
    /// # Errors
    ///
    /// [`ErrorKind::Io`]: the output failed.
    pub fn finish(self) -> Result<W> {
        self.archive.finish().map_err(|e| translate(e, "an archive that a zip can hold"))
    }
}

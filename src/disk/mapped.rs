//! Files that are read: as a memory map whose pages can be given back, and never a pipe, which would be waited for.
#![allow(clippy::disallowed_methods)] // they are wrapped here

use std::fs::{self, File};
use std::io;
use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Bytes that the system maps at most around a page that is touched: a whole large folio of the page cache, which Linux
/// aligns in the file (`mm/filemap.c`; from 6.18 on one touch maps all of it).
const TOUCHED_TOGETHER: usize = 2 << 20;

/// Whether an open file is the one that lies at a path.
pub(crate) fn same_file(file: &File, path: &Path) -> bool {
    let place = |data: &fs::Metadata| (data.dev(), data.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(a), Ok(b)) => place(&a) == place(&b),
        _ => false,
    }
}

/// What lies there where it is no file: a folder, a link, a pipe, a device or a socket.
pub(crate) fn special(data: &fs::Metadata) -> Option<&'static str> {
    use std::os::unix::fs::FileTypeExt;
    let kind = data.file_type();
    match kind {
        _ if kind.is_file() => None,
        _ if kind.is_dir() => Some("a folder"),
        _ if kind.is_symlink() => Some("a link"),
        _ if kind.is_fifo() => Some("a pipe"),
        _ if kind.is_socket() => Some("a socket"),
        _ => Some("a device"),
    }
}

/// Opens a file to be read. A pipe would be waited for, and a device has no end.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] for what is no file; those of the system.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    match special(&fs::metadata(path)?) {
        None => File::open(path),
        Some(what) => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, format!("got {what}, expected a file")))
        }
    }
}

/// A file mapped for reading.
pub struct MappedFile {
    /// None for an empty file, which cannot be mapped.
    map: Option<memmap2::Mmap>,
}

impl MappedFile {
    /// Maps a file.
    ///
    /// # Errors
    /// Those of opening and mapping.
    #[allow(unsafe_code)]
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = open(path)?;
        if file.metadata()?.len() == 0 {
            return Ok(Self { map: None });
        }
        // SAFETY: the map is only read. Where another process truncates the file meanwhile, or its disk fails, the
        // process gets SIGBUS; the program then ends with a message and exit code 74 (src/cli/mod.rs). Stores are
        // replaced by rename and never truncated. Whoever reads an archive looks afterwards whether it is still the
        // same, since behind the new end a page may hold zeros.
        let map = unsafe { memmap2::Mmap::map(&file)? };
        Ok(Self { map: Some(map) })
    }

    /// Calls the result with one range after another, in any order, to give back what was touched before: what is
    /// resident stays within some [`TOUCHED_TOGETHER`], and a walk over many small ranges does not map each anew.
    pub(crate) fn walk(&self) -> impl FnMut(Range<usize>) {
        let mut last: Option<Range<usize>> = None;
        move |range| {
            let reach = range.start / TOUCHED_TOGETHER..range.end.div_ceil(TOUCHED_TOGETHER);
            if let Some(passed) = last.replace(reach.clone()).filter(|last| *last != reach) {
                self.release(passed.start * TOUCHED_TOGETHER..passed.end.saturating_mul(TOUCHED_TOGETHER));
            }
        }
    }

    /// Gives the pages of a range back to the system, so that they no longer count as resident; they
    /// are read anew when touched again.
    #[allow(unsafe_code)]
    pub fn release(&self, range: Range<usize>) {
        let Some(map) = &self.map else { return };
        let start = range.start / TOUCHED_TOGETHER * TOUCHED_TOGETHER;
        let end = range.end.next_multiple_of(TOUCHED_TOGETHER).min(map.len());
        if start < end {
            // SAFETY: of a shared mapping that is only read, pages that are dropped come back from the
            // file with the same bytes, also under another thread that is reading them.
            let _ =
                unsafe { map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, start, end - start) };
        }
    }
}

impl AsRef<[u8]> for MappedFile {
    fn as_ref(&self) -> &[u8] {
        self.map.as_deref().unwrap_or_default()
    }
}

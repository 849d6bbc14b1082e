//! Named files of an archive: in folders, in zips, or in several of both. Bytes come from memory maps.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use btfkit_formats::Limits;
use btfkit_formats::zip::ZipIndex;

use crate::error::{Error, Result};
use crate::store::mapped::MappedFile;

/// Folders below the archive's own that are looked into.
const FOLDER_DEPTH: usize = 8;

/// Files by name.
pub(super) struct Files {
    zips: Vec<Zip>,
    entries: Vec<Entry>,
}

struct Zip {
    path: PathBuf,
    file: MappedFile,
    index: ZipIndex,
}

struct Entry {
    name: String,
    place: Place,
}

enum Place {
    Zipped { zip: usize, entry: usize },
    Plain(PathBuf),
}

impl Files {
    /// Lists folders, zips and plain files, in the order given. Zips in a folder are looked into.
    ///
    /// # Errors
    /// Says where a zip is damaged.
    pub(super) fn list(paths: &[PathBuf], limits: &Limits) -> Result<Self> {
        let mut files = Self { zips: Vec::new(), entries: Vec::new() };
        for path in paths {
            // A light list stands for the pictures beside it.
            let list = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("lp")) && path.is_file();
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let path = if list { folder.unwrap_or(Path::new(".")) } else { path };
            let data = fs::metadata(path).map_err(|error| Error::io("read", path, error))?;
            if data.is_dir() {
                for file in list_folder(path)? {
                    files.add(file, limits)?;
                }
            } else {
                files.add(path.to_owned(), limits)?;
            }
        }
        Ok(files)
    }

    fn add(&mut self, path: PathBuf, limits: &Limits) -> Result<()> {
        if !is_zip(&path)? {
            let name = path.to_string_lossy().into_owned();
            self.entries.push(Entry { name, place: Place::Plain(path) });
            return Ok(());
        }
        let file = MappedFile::open(&path).map_err(|error| Error::io("read", &path, error))?;
        let index = ZipIndex::open_mapped(file.as_ref(), limits, &mut |range| file.release(range))
            .map_err(|error| Error::from(error).context(path.display()))?;
        // The directory at the end.
        file.release(0..file.as_ref().len());
        let zip = self.zips.len();
        for (entry, listed) in index.entries().iter().enumerate() {
            let place = Place::Zipped { zip, entry };
            self.entries.push(Entry { name: listed.name().to_owned(), place });
        }
        self.zips.push(Zip { path, file, index });
        Ok(())
    }

    /// Names of all files: as in their zip, or their paths.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// Number of files.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Name of a file.
    pub(super) fn name(&self, number: usize) -> &str {
        self.entries.get(number).map_or("", |entry| &entry.name)
    }

    /// The bytes of a file.
    pub(super) fn bytes(&self, number: usize) -> Result<Cow<'_, [u8]>> {
        match &self.entries[number].place {
            Place::Plain(path) => {
                fs::read(path).map(Cow::Owned).map_err(|error| Error::io("read", path, error))
            }
            &Place::Zipped { zip, entry } => {
                let Zip { path, file, index } = &self.zips[zip];
                let bytes = index.read(file.as_ref(), entry);
                bytes.map_err(|error| Error::from(error).context(path.display()))
            }
        }
    }

    /// Gives back the memory of a file that has been used: pages of a mapped archive count as resident.
    pub(super) fn release(&self, number: usize) {
        if let Place::Zipped { zip, entry } = self.entries[number].place
            && let Some(listed) = self.zips[zip].index.entries().get(entry)
        {
            self.zips[zip].file.release(listed.compressed_range());
        }
    }

    /// CRC-32 of a file whose bytes these are: the same in a zip, which has it listed, and in a folder.
    pub(super) fn checksum(&self, number: usize, bytes: &[u8]) -> u32 {
        match self.entries[number].place {
            Place::Zipped { zip, entry } => self.zips[zip].index.entries()[entry].crc32(),
            Place::Plain(_) => crc32fast::hash(bytes),
        }
    }
}

/// Whether a file is a zip by its first bytes (an empty zip begins with its end record).
fn is_zip(path: &Path) -> Result<bool> {
    let head = read_head(path, 4)?;
    Ok(head == *b"PK\x03\x04" || head == *b"PK\x05\x06")
}

/// The first bytes of a file, fewer where it is shorter.
pub(super) fn read_head(path: &Path, most: u64) -> Result<Vec<u8>> {
    use std::io::Read;
    let mut head = Vec::new();
    let file = fs::File::open(path).map_err(|error| Error::io("read", path, error))?;
    file.take(most).read_to_end(&mut head).map_err(|error| Error::io("read", path, error))?;
    Ok(head)
}

/// Files below a folder, sorted by path. Links to files are followed, links to folders are not.
fn list_folder(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![(root.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| Error::io("list", &folder, error))?;
        for entry in entries {
            let entry = entry.map_err(|error| Error::io("list", &folder, error))?;
            let path = entry.path();
            let linked = entry.file_type().is_ok_and(|kind| kind.is_symlink());
            // A link that leads nowhere is no image; the hole that it leaves is reported as such.
            let Ok(data) = fs::metadata(&path) else { continue };
            if data.is_file() {
                files.push(path);
            } else if data.is_dir() && !linked && depth < FOLDER_DEPTH {
                folders.push((path, depth + 1));
            }
        }
    }
    files.sort();
    Ok(files)
}

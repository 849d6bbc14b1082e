//! Named files of an archive: in folders, in zips, or in several of both. Bytes come from memory maps.

use std::borrow::Cow;
use std::fs;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use btfkit_formats::Limits;
use btfkit_formats::picture;
use btfkit_formats::zip::{Method, ZipIndex};

use crate::disk::mapped::{self, MappedFile};
use crate::error::{Error, Result};

/// Folders below the archive's own that are looked into.
const FOLDER_DEPTH: usize = 8;

/// Names of what systems and programs leave beside pictures; so is whatever begins with a point.
const LEFT_BEHIND: [&str; 7] = [
    "__MACOSX",
    "Thumbs.db",
    "ehthumbs.db",
    "desktop.ini",
    "@eaDir",
    "$RECYCLE.BIN",
    "System Volume Information",
];

/// Bytes that tell what a file is.
const HEAD_BYTES: u64 = 512;

/// How the record at the end of a zip begins, and the most bytes that it takes with its comment.
const END_OF_ZIP: &[u8; 4] = b"PK\x05\x06";
const LONGEST_END: u64 = 22 + 65535;

/// Files that are looked at for what they are, where no picture is found.
const SNIFFED: usize = 64;

/// Files by name.
pub(super) struct Files {
    zips: Vec<Zip>,
    entries: Vec<Entry>,
    /// The light list that was named, and the folder or zip of its pictures left for it to be found in.
    list: Option<usize>,
    /// Hidden files and folders that were not looked at.
    hidden: usize,
}

struct Zip {
    path: PathBuf,
    file: MappedFile,
    index: ZipIndex,
}

struct Entry {
    name: String,
    place: Location,
}

enum Location {
    Zipped { zip: usize, entry: usize },
    Plain(PathBuf),
}

impl Files {
    /// Lists folders, zips and plain files, in the order given. Zips in a folder are looked into, what is hidden is
    /// not. A light list stands for the pictures beside it or, if there are none, in the folder above (a project has
    /// its lists in a folder of their own).
    ///
    /// # Errors
    /// Says where a zip is damaged, and what is no file. A file that stands alone and is of a known format that is not
    /// read is called by its name.
    pub(super) fn list(paths: &[PathBuf], limits: &Limits) -> Result<Self> {
        let mut files = Self { zips: Vec::new(), entries: Vec::new(), list: None, hidden: 0 };
        for path in paths {
            let data = fs::metadata(path).map_err(|error| Error::io("read", path, error))?;
            if data.is_dir() {
                files.add_folder(path, limits)?;
            } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("lp")) {
                regular(path)?;
                files.add_beside(path, limits)?;
            } else {
                files.add(path.to_owned(), limits)?;
                files.expect_known(path)?;
            }
        }
        Ok(files)
    }

    /// Adds the files of a folder.
    fn add_folder(&mut self, folder: &Path, limits: &Limits) -> Result<()> {
        let (files, hidden) = list_folder(folder)?;
        self.hidden += hidden;
        files.into_iter().try_for_each(|file| self.add(file, limits))
    }

    /// Adds the files that a light list is about, and notes that it is the one that was named.
    fn add_beside(&mut self, list: &Path, limits: &Limits) -> Result<()> {
        let (before, hidden) = (self.entries.len(), self.hidden);
        let folder = list.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        self.add_folder(folder, limits)?;
        if !self.entries.iter().skip(before).any(|entry| is_picture(&entry.name)) {
            self.entries.truncate(before);
            self.hidden = hidden;
            self.add_folder(&folder.join(".."), limits)?;
        }
        let named = fs::canonicalize(list).map_err(|error| Error::io("read", list, error))?;
        let is_named = |entry: &Entry| match &entry.place {
            Location::Plain(path) => {
                path.file_name() == list.file_name() && fs::canonicalize(path).is_ok_and(|path| path == named)
            }
            Location::Zipped { .. } => false,
        };
        self.list = self.entries.iter().position(is_named);
        if self.list.is_none() {
            // In a hidden folder, or too deep below the one above.
            self.list = Some(self.entries.len());
            let name = list.to_string_lossy().into_owned();
            self.entries.push(Entry { name, place: Location::Plain(list.to_owned()) });
        }
        Ok(())
    }

    /// Refuses a single file of a known format that is not read.
    fn expect_known(&self, path: &Path) -> Result<()> {
        let foreign = |entry: &Entry| matches!(&entry.place, Location::Plain(plain) if plain == path);
        let alone = self.entries.last().is_some_and(foreign);
        match picture::foreign(&path.to_string_lossy(), &read_head(path, HEAD_BYTES)?).filter(|_| alone) {
            Some((what, way_out)) => {
                Err(Error::input(format!("{}: this is {what}, which is not read", path.display()))
                    .hint(way_out))
            }
            None => Ok(()),
        }
    }

    /// What the first files are that are of a known format that is not read, and what to do about it.
    pub(super) fn foreign(&self) -> Option<String> {
        let told = |number: usize| {
            let head = match &self.entries.get(number)?.place {
                Location::Plain(path) => Cow::Owned(read_head(path, HEAD_BYTES).ok()?),
                Location::Zipped { .. } => self.bytes(number).ok()?,
            };
            let name = self.name(number);
            let told = match picture::foreign(name, &head) {
                Some((what, way_out)) => Some(format!("{what}, which is not read: {way_out}")),
                None => picture::recognise(&head).filter(|_| !is_picture(name)).map(misnamed),
            };
            self.release(number);
            Some(format!("{} is {}", self.shown(number), told?))
        };
        (0..self.len().min(SNIFFED)).find_map(told)
    }

    /// The light list that was named.
    pub(super) fn named_list(&self) -> Option<usize> {
        self.list
    }

    /// How many hidden files and folders were not looked at.
    pub(super) fn hidden(&self) -> usize {
        self.hidden
    }

    fn add(&mut self, path: PathBuf, limits: &Limits) -> Result<()> {
        if !is_zip(&path)? {
            let name = path.to_string_lossy().into_owned();
            self.entries.push(Entry { name, place: Location::Plain(path) });
            return Ok(());
        }
        let file = MappedFile::open(&path).map_err(|error| Error::io("read", &path, error))?;
        let index = ZipIndex::open_mapped(file.as_ref(), limits, &mut file.walk())
            .map_err(|error| Error::from(error).context(path.display()))?;
        // The directory at the end.
        file.release(0..file.as_ref().len());
        let zip = self.zips.len();
        for (entry, listed) in index.entries().iter().enumerate() {
            if listed.name().split(['/', '\\']).any(is_hidden) {
                self.hidden += 1;
                continue;
            }
            let place = Location::Zipped { zip, entry };
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

    /// Name of a file for messages: with its zip, where there are several.
    pub(super) fn shown(&self, number: usize) -> String {
        match self.entries.get(number).map(|entry| &entry.place) {
            Some(&Location::Zipped { zip, .. }) if self.zips.len() > 1 => {
                format!("{}: {}", self.zips[zip].path.display(), self.name(number))
            }
            _ => self.name(number).to_owned(),
        }
    }

    /// Whether a file lies in a zip.
    pub(super) fn is_zipped(&self, number: usize) -> bool {
        self.entries.get(number).is_some_and(|entry| matches!(entry.place, Location::Zipped { .. }))
    }

    /// The bytes of a file.
    pub(super) fn bytes(&self, number: usize) -> Result<Cow<'_, [u8]>> {
        match &self.entries[number].place {
            Location::Plain(path) => {
                let mut bytes = Vec::new();
                let read = regular(path)?.read_to_end(&mut bytes);
                read.map(|_| Cow::Owned(bytes)).map_err(|error| Error::io("read", path, error))
            }
            &Location::Zipped { zip, entry } => {
                let Zip { path, file, index } = &self.zips[zip];
                let bytes = index.read(file.as_ref(), entry);
                bytes.map_err(|error| Error::from(error).context(path.display()))
            }
        }
    }

    /// Bytes that are in memory while a file is decoded: its own, compressed and not, and those of a copy that a
    /// decoder may make.
    pub(super) fn bytes_in_use(&self, number: usize) -> u64 {
        match &self.entries[number].place {
            Location::Plain(path) => fs::metadata(path).map_or(0, |data| data.len().saturating_mul(2)),
            &Location::Zipped { zip, entry } => {
                self.zips[zip].index.entries().get(entry).map_or(0, |listed| {
                    let compressed = listed.compressed_range().len() as u64;
                    let copies = if listed.method() == Method::Stored { 1 } else { 2 };
                    listed.uncompressed_bytes().saturating_mul(copies).saturating_add(compressed)
                })
            }
        }
    }

    /// Gives back the memory of a file that has been used: pages of a mapped archive count as resident.
    pub(super) fn release(&self, number: usize) {
        if let Location::Zipped { zip, entry } = self.entries[number].place
            && let Some(listed) = self.zips[zip].index.entries().get(entry)
        {
            self.zips[zip].file.release(listed.compressed_range());
        }
    }

    /// CRC-32 of a file whose bytes these are: the same in a zip, which has it listed, and in a folder.
    pub(super) fn checksum(&self, number: usize, bytes: &[u8]) -> u32 {
        match self.entries[number].place {
            Location::Zipped { zip, entry } => self.zips[zip].index.entries()[entry].crc32(),
            Location::Plain(_) => crc32fast::hash(bytes),
        }
    }
}

/// Whether a name is of something that is left beside pictures and is none of them.
fn is_hidden(name: &str) -> bool {
    let left = LEFT_BEHIND.iter().any(|left| left.eq_ignore_ascii_case(name));
    left || (name.starts_with('.') && name != "." && name != "..")
}

/// Opens a file that is one. A pipe would be waited for, and a device has no end.
///
/// # Errors
/// Says that it is none.
pub(super) fn regular(path: &Path) -> Result<fs::File> {
    mapped::open(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidInput => {
            Error::input(format!("{}: {error}", path.display())).hint("copy its contents into a file")
        }
        _ => Error::io("read", path, error),
    })
}

/// Whether a file is a zip by its first bytes (an empty zip begins with its end record), or by its last ones where its
/// name says that it may be one that unpacks itself.
fn is_zip(path: &Path) -> Result<bool> {
    let head = read_head(path, 4)?;
    if head == *b"PK\x03\x04" || head == *END_OF_ZIP {
        return Ok(true);
    }
    let may_be =
        ["zip", "exe"].iter().any(|ending| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)));
    if !may_be {
        return Ok(false);
    }
    let failed = |error| Error::io("read", path, error);
    let mut file = regular(path)?;
    let length = file.metadata().map_err(failed)?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LONGEST_END))).map_err(failed)?;
    let mut tail = Vec::new();
    file.take(LONGEST_END).read_to_end(&mut tail).map_err(failed)?;
    Ok(tail.windows(END_OF_ZIP.len()).any(|part| part == END_OF_ZIP))
}

/// The first bytes of a file, fewer where it is shorter.
pub(super) fn read_head(path: &Path, most: u64) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    regular(path)?.take(most).read_to_end(&mut head).map_err(|error| Error::io("read", path, error))?;
    Ok(head)
}

/// Files below a folder, sorted by path, and how many hidden ones were left out. Links to files are followed, links to
/// folders are not.
pub(super) fn list_folder(root: &Path) -> Result<(Vec<PathBuf>, usize)> {
    let mut hidden = 0;
    let mut files = Vec::new();
    let mut folders = vec![(root.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| Error::io("list", &folder, error))?;
        for entry in entries {
            let entry = entry.map_err(|error| Error::io("list", &folder, error))?;
            let path = entry.path();
            if is_hidden(&entry.file_name().to_string_lossy()) {
                hidden += 1;
                continue;
            }
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
    Ok((files, hidden))
}

/// Whether a name is that of a picture.
pub(super) fn is_picture(name: &str) -> bool {
    ["jpg", "jpeg", "png", "tif", "tiff", "hdr", "exr"].iter().any(|e| has_extension(name, e))
}

/// Whether a name ends in an extension, in whatever case.
pub(super) fn has_extension(name: &str, extension: &str) -> bool {
    Path::new(name).extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// What to do with a picture whose name does not say that it is one.
fn misnamed(format: picture::Format) -> String {
    use picture::Format::{Exr, Hdr, Jpeg, Png, Tiff};
    let (what, ending) = match format {
        Jpeg => ("a JPEG", "jpg"),
        Png => ("a PNG", "png"),
        Tiff => ("a TIFF", "tif"),
        Hdr => ("a Radiance picture", "hdr"),
        Exr => ("an OpenEXR picture", "exr"),
    };
    format!("{what} by its content, which its name does not say: let it end in .{ending}")
}

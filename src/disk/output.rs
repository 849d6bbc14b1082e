//! Files and folders outside a store that appear whole or not at all, and that never replace what is there unasked.
//!
//! What exists already is compared while it is made again, byte by byte: the same is found done, anything else is
//! refused at the first byte that differs. Only on request ([`Existing::Replace`]) a new one takes its place.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::mapped::{self, MappedFile, open};
use super::temporary::{self, Temporary, folder_of, write_file};
use crate::error::{Error, ErrorKind, Result};
use crate::run::Existing;

/// The file by which a folder is known as a Zarr store.
const STORE_FILE: &str = "zarr.json";

/// Buffer of a file that is written front to back.
const BUFFER_BYTES: usize = 1 << 20;

impl Existing {
    /// Refuses a name that is taken, before any work: for results that are not compared.
    ///
    /// # Errors
    /// [`ErrorKind::Recipe`].
    pub(crate) fn expect_free(self, path: &Path) -> Result<()> {
        match self {
            Self::Keep if is_there(path) => Err(taken(path, "exists")),
            _ => match special(path) {
                Some(kind) => Err(Error::recipe(format!("{} is {kind}, expected a file", path.display()))
                    .hint("choose another name for the result")),
                None => Ok(()),
            },
        }
    }
}

/// How a result came to be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Made {
    /// Written by this run.
    Written,
    /// It was there already, the same to the byte.
    Found,
}

/// Whether anything has this name, a link that leads nowhere too.
fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// What has this name, if it is anything but a file; a link is not followed, since a rename would put a file in its
/// place.
fn special(path: &Path) -> Option<&'static str> {
    mapped::special(&path.symlink_metadata().ok()?)
}

fn taken(path: &Path, how: &str) -> Error {
    Error::recipe(format!("{} {how}", path.display())).hint("choose another name, or replace it by --force")
}

/// A file that is written from front to back, or compared with the one that is there.
pub struct Output {
    to: To,
}

enum To {
    File(BufWriter<File>),
    Compare(BufReader<File>),
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            To::File(file) => file.write(bytes),
            To::Compare(file) => {
                let mut found = [0; 4096];
                let part = &bytes[..bytes.len().min(found.len())];
                let found = &mut found[..part.len()];
                match file.read_exact(found) {
                    Ok(()) if found == part => Ok(part.len()),
                    Ok(()) => Err(io::Error::new(io::ErrorKind::AlreadyExists, Different)),
                    Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                        Err(io::Error::new(io::ErrorKind::AlreadyExists, Different))
                    }
                    Err(error) => Err(error),
                }
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::File(file) => file.flush(),
            To::Compare(_) => Ok(()),
        }
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.to {
            To::File(file) => file.seek(to),
            To::Compare(file) => file.seek(to),
        }
    }
}

#[derive(Debug)]
struct Different;

impl std::fmt::Display for Different {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("exists and holds something else")
    }
}

impl std::error::Error for Different {}

/// A file that is written or found done, and gets its name by [`Ready::publish`]: of several that belong together none
/// is published before all are ready.
#[must_use]
pub struct Ready {
    path: PathBuf,
    existing: Existing,
    /// None where it was found done.
    temporary: Option<Temporary>,
}

impl Ready {
    /// Gives the file its name.
    ///
    /// # Errors
    /// [`ErrorKind::Recipe`] where another process has made another file of this name meanwhile.
    pub fn publish(self) -> Result<Made> {
        match self.temporary {
            None => Ok(Made::Found),
            Some(temporary) => put_in_place(temporary.path(), &self.path, self.existing),
        }
    }
}

/// Writes a file by `write` beside the place that it is to have, or compares it with the one that is there.
///
/// # Errors
/// Those of `write`, and [`ErrorKind::Recipe`] where another file has the name.
pub fn prepare(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut Output) -> Result<()>,
) -> Result<Ready> {
    let ready = |temporary| Ready { path: path.to_owned(), existing, temporary };
    if existing == Existing::Keep && is_there(path) {
        return compare(path, write).map(|()| ready(None));
    }
    existing.expect_free(path)?;
    written(path, write).map(|temporary| ready(Some(temporary)))
}

/// As [`prepare`], for a `write` that goes back and changes what it wrote, so that only the end can be compared: the
/// file is written under another name first.
///
/// # Errors
/// As [`prepare`].
pub(crate) fn prepare_seeking(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut Output) -> Result<()>,
) -> Result<Ready> {
    let found = existing == Existing::Keep && is_there(path);
    if !found {
        existing.expect_free(path)?;
    }
    let temporary = written(path, write)?;
    if found {
        compare_files(temporary.path(), path)?;
    }
    Ok(Ready { path: path.to_owned(), existing, temporary: (!found).then_some(temporary) })
}

/// Publishes files of one folder that belong together; written, if one of them was. Of two processes that publish at
/// the same time the second begins when the first has done, so that what lies there at the end is of one of them.
///
/// # Errors
/// As [`Ready::publish`].
pub fn publish_all(files: impl IntoIterator<Item = Ready>) -> Result<Made> {
    let mut files = files.into_iter().peekable();
    // A folder can be locked without a file that would stay. Where a file system has no locks the work goes on without.
    let _folder = files.peek().and_then(|file| temporary::lock_folder(folder_of(&file.path)));
    files.try_fold(Made::Found, |made, file| {
        let published = file.publish()?;
        Ok(if made == Made::Written { made } else { published })
    })
}

/// Writes a file by `write`; it gets its name when that is done.
///
/// # Errors
/// As [`prepare`] and [`Ready::publish`].
pub(crate) fn write_whole(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut Output) -> Result<()>,
) -> Result<Made> {
    prepare(path, existing, write)?.publish()
}

/// Refuses a place inside of a store, which a result would damage.
///
/// # Errors
/// [`ErrorKind::Usage`], with the store.
pub fn expect_outside_stores(path: &Path) -> Result<()> {
    let folder = folder_of(path);
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    match real.ancestors().find(|folder| folder.join(STORE_FILE).is_file()) {
        None => Ok(()),
        Some(store) => {
            Err(Error::usage(format!("{} would lie inside of the store {}", path.display(), store.display()))
                .hint("choose a place outside of it"))
        }
    }
}

/// A file beside `path` that `write` has filled.
fn written(path: &Path, write: impl FnOnce(&mut Output) -> Result<()>) -> Result<Temporary> {
    expect_outside_stores(path)?;
    let failed = |error| Error::io("write", path, error);
    fs::create_dir_all(folder_of(path)).map_err(failed)?;
    Temporary::sweep_beside(path);
    let temporary = Temporary::file(path).map_err(failed)?;
    let file = temporary.handle().map_err(failed)?;
    let mut output = Output { to: To::File(BufWriter::with_capacity(BUFFER_BYTES, file)) };
    write(&mut output).map_err(|error| error.at(path))?;
    output.flush().map_err(failed)?;
    Ok(temporary)
}

/// Compares a file that is there with what `write` writes.
fn compare(path: &Path, write: impl FnOnce(&mut Output) -> Result<()>) -> Result<()> {
    let failed = |error| Error::io("read", path, error);
    if !path.is_file() {
        return Err(taken(path, "exists and is no file").hint("choose another name for the result"));
    }
    let length = fs::metadata(path).map_err(failed)?.len();
    let file = BufReader::with_capacity(BUFFER_BYTES, open(path).map_err(failed)?);
    let mut output = Output { to: To::Compare(file) };
    let written = write(&mut output);
    let different =
        |error: &Error| error.kind() == ErrorKind::Io && error.to_string().contains(&Different.to_string());
    match written {
        Err(error) if different(&error) => return Err(taken(path, &Different.to_string())),
        other => other?,
    }
    // What was written last need not be the end: some formats go back to their head.
    let end = output.seek(SeekFrom::End(0)).map_err(failed)?;
    if end == length { Ok(()) } else { Err(taken(path, &Different.to_string())) }
}

/// Compares a file that was made with the one that is there.
fn compare_files(made: &Path, path: &Path) -> Result<()> {
    let failed = |error| Error::io("read", path, error);
    let mut made = BufReader::with_capacity(BUFFER_BYTES, open(made).map_err(failed)?);
    compare(path, |output| io::copy(&mut made, output).map(|_| ()).map_err(failed))
}

/// Whether a file holds just these bytes; what is no file, or not there, does not.
pub(crate) fn holds(path: &Path, bytes: &[u8]) -> Result<bool> {
    match MappedFile::open(path) {
        Ok(found) => Ok(found.as_ref() == bytes),
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::InvalidInput) => {
            Ok(false)
        }
        Err(error) => Err(Error::io("read", path, error)),
    }
}

/// A folder that is filled, or compared with the one that is there.
pub struct Folder {
    root: PathBuf,
    compared: bool,
    names: Mutex<BTreeSet<PathBuf>>,
}

impl Folder {
    /// Puts a file into it; `name` is relative.
    pub fn put(&self, name: &Path, bytes: &[u8]) -> Result<()> {
        self.names.lock().unwrap_or_else(std::sync::PoisonError::into_inner).insert(name.to_owned());
        let path = self.root.join(name);
        if !self.compared {
            return write_file(&path, bytes);
        }
        if holds(&path, bytes)? { Ok(()) } else { Err(different_folder(&self.root)) }
    }

    /// Whether every file that was put into this one lies in a folder too, the same to the byte.
    fn is_in(&self, folder: &Path) -> Result<bool> {
        let names = self.names.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        for name in names.iter() {
            let ours = self.root.join(name);
            let made = MappedFile::open(&ours).map_err(|error| Error::io("read", &ours, error))?;
            if !holds(&folder.join(name), made.as_ref())? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether a folder holds no file but those that were put into this one.
    fn holds_all_of(&self, folder: &Path) -> Result<bool> {
        let names = self.names.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut folders = vec![folder.to_owned()];
        while let Some(at) = folders.pop() {
            let entries = match fs::read_dir(&at) {
                // Another process has moved it away, and will make it anew.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                entries => entries.map_err(|error| Error::io("list", &at, error))?,
            };
            for entry in entries {
                let entry = entry.map_err(|error| Error::io("list", &at, error))?;
                if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                    folders.push(entry.path());
                } else if !entry.path().strip_prefix(folder).is_ok_and(|name| names.contains(name)) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

fn different_folder(path: &Path) -> Error {
    taken(path, "exists and holds something else")
}

/// Fills a folder by `write`; it gets its name when that is done.
///
/// # Errors
/// Those of `write`, and [`ErrorKind::Recipe`] where there is another folder. Only one that holds nothing but files
/// that the new one has too is ever replaced.
pub(crate) fn write_whole_folder(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&Folder) -> Result<()>,
) -> Result<Made> {
    let failed = |error| Error::io("write", path, error);
    let occupied = is_there(path);
    let folder = |root: &Path, compared| Folder { root: root.to_owned(), compared, names: Mutex::default() };
    if occupied && special(path) != Some("a folder") {
        return Err(taken(path, "exists and is no folder").hint("choose another name for the result"));
    }
    if occupied && existing == Existing::Keep {
        let found = folder(path, true);
        write(&found)?;
        return if found.holds_all_of(path)? { Ok(Made::Found) } else { Err(different_folder(path)) };
    }
    expect_outside_stores(path)?;
    Temporary::sweep_beside(path);
    let mut temporary = Temporary::folder(path).map_err(failed)?;
    let filled = folder(temporary.path(), false);
    write(&filled).map_err(|error| error.at(path))?;
    let mut published = temporary.publish_folder(path);
    loop {
        match published {
            Ok(()) => return Ok(Made::Written),
            Err(error) if !is_taken(&error) => return Err(failed(error)),
            Err(_) => {}
        }
        let alone = filled.holds_all_of(path)?;
        if existing == Existing::Keep {
            // Another process was faster.
            return if alone && filled.is_in(path)? { Ok(Made::Found) } else { Err(meanwhile(path)) };
        }
        if !alone {
            return Err(Error::recipe(format!(
                "{} holds other files too, so it is not replaced",
                path.display()
            ))
            .hint("choose another name for the result"));
        }
        published = temporary.replace_folder(path);
    }
}

/// [`prepare`] for the bytes of a small file.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_bytes(path: &Path, existing: Existing, bytes: &[u8]) -> Result<Ready> {
    prepare(path, existing, |output| output.write_all(bytes).map_err(|error| Error::io("write", path, error)))
}

/// Gives a file that is written its name, under the rule of [`write_whole`]. Of two processes that make the same file
/// the second finds it done.
///
/// # Errors
/// [`ErrorKind::Recipe`] where another file has the name.
pub(crate) fn put_in_place(temporary: &Path, path: &Path, existing: Existing) -> Result<Made> {
    let failed = |error| Error::io("write", path, error);
    if existing == Existing::Replace {
        existing.expect_free(path)?;
        return temporary::publish(temporary, path).map(|()| Made::Written).map_err(failed);
    }
    match temporary::publish_new(temporary, path) {
        Ok(()) => Ok(Made::Written),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            compare_files(temporary, path).map(|()| Made::Found).map_err(|error| match error.kind() {
                ErrorKind::Recipe => meanwhile(path),
                _ => error,
            })
        }
        Err(error) => Err(failed(error)),
    }
}

/// The error of a name that was free when the work began.
fn meanwhile(path: &Path) -> Error {
    taken(path, "was made by another process meanwhile, and holds something else")
}

/// What a system says of a folder that would take the place of one that holds something.
fn is_taken(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::AlreadyExists | io::ErrorKind::DirectoryNotEmpty)
}

//! Files that are written: to a temporary name, synced, and given their own name when they are whole.
//!
//! A kill leaves a temporary file, which the next run sweeps, and never a torn one that a later run would take for
//! done.
#![allow(clippy::disallowed_methods)] // they are wrapped here

use std::collections::hash_map::RandomState;
use std::fs::{self, File, TryLockError};
use std::hash::BuildHasher;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::host;
use super::lock::is_lock;
use super::mapped::same_file;
use crate::error::{Error, Result};

/// Marks a temporary file: `.NAME.tmp-HOST-PID-RANDOM`. Its writer holds an advisory lock on it: one that can be locked
/// is abandoned, whatever became of the process and wherever it ran. (Process ids tell nothing: containers share a
/// host's name and have lists of processes of their own.)
const TEMPORARY: &str = ".tmp-";

/// Age after which a temporary file counts as abandoned on a file system that has no locks.
const ABANDONED_AFTER: Duration = Duration::from_secs(24 * 3600);

/// Writes `bytes` to `path` so that it appears whole or not at all, also after a power failure.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = folder_of(path);
    // A folder that is made now has to reach the disk as an entry of its parent.
    let made: Vec<&Path> = folder.ancestors().take_while(|folder| !folder.exists()).collect();
    fs::create_dir_all(folder)?;
    let temporary = Temporary::file(path)?;
    (&temporary.held).write_all(bytes)?;
    temporary.publish(path)?;
    made.iter().filter_map(|folder| folder.parent()).try_for_each(|parent| {
        File::open(if parent.as_os_str().is_empty() { Path::new(".") } else { parent })?.sync_all()
    })
}

/// Gives a file that is written its final name, beside it, so that it is there whole after a power failure.
pub(crate) fn publish(temporary: &Path, path: &Path) -> io::Result<()> {
    File::open(temporary)?.sync_all()?;
    fs::rename(temporary, path)?;
    File::open(folder_of(path))?.sync_all()
}

/// As [`publish`], but never in place of another file: no process can come between the look and the deed. The temporary
/// name may stay.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] where the name is taken.
pub(crate) fn publish_new(temporary: &Path, path: &Path) -> io::Result<()> {
    File::open(temporary)?.sync_all()?;
    match fs::hard_link(temporary, path) {
        // Some file systems have no second names: FAT, exFAT, some of FUSE.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => rename_new(temporary, path)?,
        linked => linked?,
    }
    File::open(folder_of(path))?.sync_all()
}

/// Gives a file its name without a second one. The name is taken by an empty file first, which only one process can
/// make, and which nobody but that one replaces.
fn rename_new(temporary: &Path, path: &Path) -> io::Result<()> {
    File::create_new(path)?;
    fs::rename(temporary, path).inspect_err(|_| drop(fs::remove_file(path)))
}

/// A file or folder that is being made beside the place that it is to have. It holds a lock while it lives; dropped
/// before it is published, it leaves nothing.
#[derive(Debug)]
pub(crate) struct Temporary {
    path: PathBuf,
    held: File,
    is_folder: bool,
    published: bool,
}

impl Temporary {
    /// An empty file.
    pub(crate) fn file(path: &Path) -> io::Result<Self> {
        loop {
            let temporary = temporary_name(path);
            let held = File::options().create_new(true).read(true).write(true).open(&temporary)?;
            // A sweep may have come between: it holds the lock while it removes the file.
            let _ = held.lock();
            if same_file(&held, &temporary) {
                return Ok(Self { path: temporary, held, is_folder: false, published: false });
            }
        }
    }

    /// An empty folder; the one that it lies in is made too.
    pub(crate) fn folder(path: &Path) -> io::Result<Self> {
        loop {
            let temporary = temporary_name(path);
            fs::create_dir_all(&temporary)?;
            // A sweep may have come between.
            let held = match File::open(&temporary) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                opened => opened?,
            };
            let _ = held.lock();
            if same_file(&held, &temporary) {
                return Ok(Self { path: temporary, held, is_folder: true, published: false });
            }
        }
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The file, to write to.
    pub(crate) fn handle(&self) -> io::Result<File> {
        self.held.try_clone()
    }

    /// Gives it its name, so that it is there whole after a power failure.
    pub(crate) fn publish(mut self, path: &Path) -> io::Result<()> {
        self.held.sync_all()?;
        fs::rename(&self.path, path)?;
        self.published = true;
        File::open(folder_of(path))?.sync_all()
    }

    /// Gives a folder its name, unless there is something of that name (an empty folder is nothing).
    pub(crate) fn publish_folder(&mut self, path: &Path) -> io::Result<()> {
        self.held.sync_all()?;
        fs::rename(&self.path, path)?;
        self.published = true;
        File::open(folder_of(path))?.sync_all()
    }

    /// Puts a folder in the place of another one. Where a process that does the same was faster, the name is taken
    /// again.
    pub(crate) fn replace_folder(&mut self, path: &Path) -> io::Result<()> {
        let old = temporary_name(path);
        let gone = |result: io::Result<()>| match result {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other,
        };
        gone(fs::rename(path, &old))?;
        let published = self.publish_folder(path);
        gone(fs::remove_dir_all(&old))?;
        published
    }

    /// Removes what killed writers of the same output left beside it.
    pub(crate) fn sweep_beside(path: &Path) {
        let begin = format!(".{}{TEMPORARY}", path.file_name().unwrap_or_default().to_string_lossy());
        for entry in fs::read_dir(folder_of(path)).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&begin) {
                remove_abandoned(&entry.path());
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.published {
            let _ = if self.is_folder { fs::remove_dir_all(&self.path) } else { fs::remove_file(&self.path) };
        }
    }
}

/// Waits for a folder that another process has locked, and holds it; none where the file system has no locks.
pub(crate) fn lock_folder(path: &Path) -> Option<File> {
    let folder = File::open(path).ok()?;
    folder.lock().ok().map(|()| folder)
}

/// The folder that a file lies in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// [`write_atomically`] with an error that names the file.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, bytes).map_err(|error| Error::io("write", path, error))
}

/// Removes a folder that holds nothing but what `is_own` says of paths in it (and temporary files and locks), moved
/// away first: at no time does a part of it look like something unfinished.
///
/// # Errors
/// As [`expect_own`].
pub(crate) fn remove_folder(path: &Path, is_own: impl Fn(&Path) -> bool) -> Result<()> {
    expect_own(path, is_own)?;
    let old = temporary_name(path);
    let removed = fs::rename(path, &old).and_then(|()| fs::remove_dir_all(&old));
    removed.map_err(|error| Error::io("remove", path, error))
}

/// Checks that a folder holds nothing but what `is_own` says of paths in it, and temporary files and locks.
///
/// # Errors
/// [`crate::ErrorKind::Recipe`] where it holds a file of another's.
pub(crate) fn expect_own(path: &Path, is_own: impl Fn(&Path) -> bool) -> Result<()> {
    let mut folders = vec![path.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(|error| Error::io("list", &folder, error))? {
            let entry = entry.map_err(|error| Error::io("list", &folder, error))?;
            let at = entry.path();
            if is_temporary(&at) || is_lock(&at) {
                continue;
            }
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(at);
            } else if !at.strip_prefix(path).is_ok_and(&is_own) {
                return Err(Error::recipe(format!(
                    "{} is no part of {}, which is not replaced therefore",
                    at.display(),
                    path.display()
                ))
                .hint("move that file away, or choose another name for the result"));
            }
        }
    }
    Ok(())
}

/// The temporary name beside `path`: process ids repeat across hosts, so it bears host, pid and random bits.
pub(crate) fn temporary_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let random = RandomState::new().hash_one(std::thread::current().id()) as u32;
    path.with_file_name(format!(".{name}{TEMPORARY}{}-{}-{random:08x}", host(), std::process::id()))
}

/// Whether a file is a temporary one of a writer, dead or alive, by its whole name (see [`temporary_name`]).
pub(crate) fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy());
    let writer =
        name.as_deref().filter(|name| name.starts_with('.')).and_then(|name| name.rsplit_once(TEMPORARY));
    writer.is_some_and(|(_, writer)| {
        let all = |text: &str, is: fn(&u8) -> bool| !text.is_empty() && text.bytes().all(|byte| is(&byte));
        let mut parts = writer.rsplitn(3, '-');
        parts.next().is_some_and(|random| random.len() <= 8 && all(random, u8::is_ascii_hexdigit))
            && parts.next().is_some_and(|pid| all(pid, u8::is_ascii_digit))
            && parts.next().is_some()
    })
}

/// Removes a temporary file or folder that nobody holds.
fn remove_abandoned(path: &Path) {
    if !is_temporary(path) {
        return;
    }
    let Ok(data) = fs::symlink_metadata(path) else { return };
    if !data.is_file() && !data.is_dir() {
        return;
    }
    let opened = File::options().read(true).write(data.is_file()).open(path);
    let abandoned = match opened.as_ref().map(File::try_lock) {
        Ok(Ok(())) => true,
        Ok(Err(TryLockError::WouldBlock)) | Err(_) => false,
        Ok(Err(TryLockError::Error(_))) => data
            .modified()
            .is_ok_and(|time| SystemTime::now().duration_since(time).is_ok_and(|age| age > ABANDONED_AFTER)),
    };
    if abandoned {
        // Another process may sweep the same at the same time. The lock is held until it is gone.
        let _ = if data.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    drop(opened);
}

/// Removes what killed writers left behind in a tree of folders: temporary files that nobody holds.
pub(crate) fn sweep(root: &Path) -> Result<()> {
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(Error::io("list", &folder, error)),
        };
        for entry in entries {
            let entry = entry.map_err(|error| Error::io("list", &folder, error))?;
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) && !is_temporary(&path) {
                folders.push(path);
            } else {
                remove_abandoned(&path);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// As on a file system without hard links.
    #[test]
    fn a_name_is_taken_by_one_only_where_files_have_no_second_names_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result");
        let taken = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for number in 0..8 {
                let (path, taken) = (&path, &taken);
                scope.spawn(move || {
                    let temporary = path.with_file_name(format!("temporary-{number}"));
                    fs::write(&temporary, format!("of {number}")).unwrap();
                    match rename_new(&temporary, path) {
                        Ok(()) => drop(taken.fetch_add(1, std::sync::atomic::Ordering::SeqCst)),
                        Err(error) => assert_eq!(error.kind(), io::ErrorKind::AlreadyExists),
                    }
                });
            }
        });
        assert_eq!(taken.into_inner(), 1);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("of "), "{text}");
        // What is another's stays, a link that leads nowhere too; and what cannot be renamed leaves no empty file.
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(folder.path().join("nowhere"), &link).unwrap();
        let temporary = folder.path().join("temporary");
        fs::write(&temporary, b"new").unwrap();
        assert!(rename_new(&temporary, &path).is_err() && rename_new(&temporary, &link).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        assert!(link.is_symlink() && temporary.exists());
        assert!(rename_new(&folder.path().join("none"), &folder.path().join("free")).is_err());
        assert!(!folder.path().join("free").exists());
    }

    #[test]
    fn the_sweep_takes_what_nobody_holds_and_spares_what_is_held_wherever_its_owner_runs() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("zarr.json");
        // As of a process of another host, or of another container of this one.
        let dead = folder.path().join(format!(".zarr.json{TEMPORARY}elsewhere-1-0a"));
        let dead_folder = folder.path().join(format!(".zarr.json{TEMPORARY}{}-1-0b", host()));
        let other = folder.path().join(format!(".other{TEMPORARY}{}-1-0c", host()));
        let elsewhere = folder.path().join(format!(".zarr.json{TEMPORARY}elsewhere-999999999-0d"));
        for path in [&dead, &other, &elsewhere] {
            fs::write(path, b"").unwrap();
        }
        fs::create_dir(&dead_folder).unwrap();
        fs::write(dead_folder.join("a"), b"").unwrap();
        let living = File::open(&elsewhere).unwrap();
        living.lock().unwrap();
        let [mine, mine_too] = [Temporary::file(&output).unwrap(), Temporary::folder(&output).unwrap()];
        Temporary::sweep_beside(&output);
        assert!(!dead.exists() && !dead_folder.exists(), "what nobody holds is swept");
        assert!(other.exists(), "that of another output is not");
        assert!(
            elsewhere.exists() && mine.path().exists() && mine_too.path().exists(),
            "what is held is spared"
        );
        sweep(folder.path()).unwrap();
        assert!(!other.exists() && elsewhere.exists() && mine.path().exists() && mine_too.path().exists());
        drop((mine, mine_too, living));
        sweep(folder.path()).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

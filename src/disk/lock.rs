//! Advisory locks that keep two processes from mixing their recipes in one store.
//!
//! A lock is a file beside what it guards, locked by `flock` and gone when it is released; in it stands who holds it.
//! No result depends on them: shards are deterministic and appear whole. Where a file system has no locks the work goes
//! on without.

use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::host;
use super::mapped::same_file;
use crate::error::{Error, Result, is_denied};
use crate::run::Context;

/// How lock files begin.
const PREFIX: &str = ".lock";

/// Time between two tries.
const INTERVAL: Duration = Duration::from_millis(50);

/// Whoever waits longer than this says so.
const PATIENCE: Duration = Duration::from_millis(500);

/// Bytes of a lock file that are shown.
const SHOWN_BYTES: u64 = 256;

/// A lock, held while it lives.
#[derive(Debug)]
pub struct Lock {
    held: Option<(PathBuf, File)>,
}

impl Lock {
    /// Waits for the lock `name` of the store at `path`; says so where that takes long, and gives up on a stop.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Stopped`] on a stop, [`crate::ErrorKind::Io`] where there can be no lock file.
    pub(crate) fn wait(path: &Path, name: &str, context: &Context<'_>) -> Result<Self> {
        Self::take(path, name, false, context)
    }

    /// The same for a lock that many hold together, and that keeps those out who [wait](Self::wait) for it alone.
    pub(crate) fn share(path: &Path, name: &str, context: &Context<'_>) -> Result<Self> {
        Self::take(path, name, true, context)
    }

    fn take(path: &Path, name: &str, shared: bool, context: &Context<'_>) -> Result<Self> {
        std::fs::create_dir_all(path).map_err(|error| Error::io("create", path, error))?;
        let place = path.join(format!("{PREFIX}{name}"));
        let began = Instant::now();
        let mut told = false;
        loop {
            let mut file = match open(&place) {
                Ok(file) => file,
                // Whoever cannot write there has nothing to keep others from; what is left to do fails where it writes.
                Err(error) if is_denied(&error) && path.is_dir() => return Ok(Self { held: None }),
                Err(error) => return Err(Error::io("write", &place, error)),
            };
            match if shared { file.try_lock_shared() } else { file.try_lock() } {
                // Another may have released it, and removed the file, between opening and locking.
                Ok(()) if !same_file(&file, &place) => continue,
                Ok(()) => {
                    let text = format!("process {} on {}", std::process::id(), host());
                    // Who cannot read who holds it only waits without knowing for whom.
                    let _ = file.set_len(0).and_then(|()| file.write_all(text.as_bytes()));
                    return Ok(Self { held: Some((place, file)) });
                }
                Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(_)) => {
                    let _ = std::fs::remove_file(&place);
                    return Ok(Self { held: None });
                }
            }
            context.check_stop()?;
            if !told && began.elapsed() > PATIENCE {
                told = true;
                context.progress.notice(&format!("waiting for {}", holder(path, &place, &mut file)));
            }
            std::thread::sleep(INTERVAL);
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Removed while it is still held: whoever opened it before finds that it is not there any more, and tries
        // again.
        if let Some((place, file)) = &self.held {
            // Of a lock that is shared the last one removes the file.
            let alone = file.try_lock().is_ok();
            if alone && same_file(file, place) {
                let _ = std::fs::remove_file(place);
            }
        }
    }
}

fn open(place: &Path) -> std::io::Result<File> {
    loop {
        match File::options().create(true).read(true).append(true).open(place) {
            // The store may be moved away between the making of its folder and that of the file.
            Err(error)
                if error.kind() == std::io::ErrorKind::NotFound
                    && place.parent().is_some_and(|f| !f.exists()) =>
            {
                std::fs::create_dir_all(place.parent().unwrap_or(Path::new(".")))?;
            }
            other => return other,
        }
    }
}

/// Who holds a lock, on what, and since when.
fn holder(store: &Path, place: &Path, file: &mut File) -> String {
    let mut text = String::new();
    let _ = file.take(SHOWN_BYTES).read_to_string(&mut text);
    let since =
        std::fs::metadata(place).and_then(|data| data.modified()).ok().and_then(|time| time.elapsed().ok());
    let since = since.map_or(String::new(), |since| format!(" for {} s", since.as_secs()));
    let whom = if text.is_empty() { "another process".to_owned() } else { text };
    let what = place.file_name().unwrap_or_default().to_string_lossy();
    let what = match what.trim_start_matches(PREFIX).trim_start_matches('-') {
        "" => String::new(),
        stage => format!(" (stage {stage})"),
    };
    format!("{}{what}: {whom} has been working on it{since}", store.display())
}

/// What locks are of: stages of a model, and the writing of a store by its recipe.
const NAMES: [&str; 6] = ["-writing", "-tile", "-cluster", "-normals", "-fit", "-appearance"];

/// Whether a file is one of these, by its whole name.
pub(crate) fn is_lock(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let what = name.and_then(|name| name.strip_prefix(PREFIX));
    what.is_some_and(|what| what.is_empty() || NAMES.contains(&what))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    use super::*;
    use crate::error::ErrorKind;
    use crate::run::progress::{Counted, Progress, Silent};

    /// Stops the work when it is told to wait.
    struct Impatient<'a>(&'a AtomicBool, Mutex<String>);

    impl Progress for Impatient<'_> {
        fn begin(&self, _: &str, _: u64, _: Counted) {}
        fn advance(&self, _: u64) {}
        fn remark(&self, _: &str) {}
        fn end(&self) {}
        fn notice(&self, text: &str) {
            self.1.lock().unwrap().push_str(text);
            self.0.store(true, Ordering::Relaxed);
        }
    }

    #[test]
    fn who_waits_says_for_whom_and_obeys_a_stop() {
        let folder = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let quiet = Context::new(&Silent, &stop, 1, 1 << 20).unwrap();
        let _held = Lock::wait(folder.path(), "-fit", &quiet).unwrap();
        let impatient = Impatient(&stop, Mutex::default());
        let context = Context::new(&impatient, &stop, 1, 1 << 20).unwrap();
        assert_eq!(Lock::wait(folder.path(), "-fit", &context).unwrap_err().kind(), ErrorKind::Stopped);
        let told = impatient.1.into_inner().unwrap();
        let process = format!("process {} on {}", std::process::id(), host());
        assert!(told.contains(&process) && told.contains("(stage fit)"), "{told}");
    }

    #[test]
    fn many_take_turns_and_leave_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let inside = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    let context = Context::new(&Silent, &stop, 1, 1 << 20).unwrap();
                    for _ in 0..50 {
                        let lock = Lock::wait(folder.path(), "", &context).unwrap();
                        assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0, "two hold it");
                        inside.fetch_sub(1, Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn many_share_a_lock_that_keeps_others_out_until_the_last_has_gone() {
        let folder = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let impatient = Impatient(&stop, Mutex::default());
        let context = Context::new(&impatient, &stop, 1, 1 << 20).unwrap();
        let share = || Lock::share(folder.path(), "", &context);
        let (first, second) = (share().unwrap(), share().unwrap());
        for lock in [first, second] {
            stop.store(false, Ordering::Relaxed);
            let kind = Lock::wait(folder.path(), "", &context).unwrap_err().kind();
            assert_eq!(kind, ErrorKind::Stopped);
            assert!(folder.path().join(".lock").exists());
            drop(lock);
        }
        stop.store(false, Ordering::Relaxed);
        assert!(!folder.path().join(".lock").exists());
        Lock::wait(folder.path(), "", &context).unwrap();
    }

    #[test]
    fn what_the_dead_left_is_not_told_and_a_folder_that_went_is_made_again() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(".lock"), "process 1 on nowhere".repeat(3)).unwrap();
        let stop = AtomicBool::new(false);
        let impatient = Impatient(&stop, Mutex::default());
        let context = Context::new(&impatient, &stop, 1, 1 << 20).unwrap();
        let _held = Lock::wait(folder.path(), "", &context).unwrap();
        assert!(Lock::wait(folder.path(), "", &context).is_err());
        let told = impatient.1.into_inner().unwrap();
        assert!(told.contains("process ") && !told.contains("nowhere"), "{told}");
        assert!(open(&folder.path().join("moved/away/.lock")).is_ok());
    }
}

//! The library's one error: what went wrong, whose fault it is, what to do.

use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;

use crate::text::escaped;

/// Whose fault an [`Error`] is. The program turns it into its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// A request that cannot be meant: options that contradict each other or the data.
    Usage,
    /// The input is damaged, incomplete or not what it says it is.
    Input,
    /// The target already holds the result of another recipe.
    Recipe,
    /// An earlier stage has not produced what this one reads.
    Missing,
    /// The operating system refused: permissions, a full disk, a vanished file.
    Io,
    /// Stopped on request before the end; the same command goes on later.
    Stopped,
    /// None of the above: a limit of this program, or a bug.
    Internal,
}

/// Result with the library's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// An error with a message (what was found, what was expected, where) and,
/// where there is one, a hint that says what to do.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    hint: Option<String>,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

impl Error {
    /// An error of the given kind. The message is one line: what would end it, or lead a terminal astray, is escaped.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: escaped(&message.into()).into_owned(), hint: None, source: None }
    }

    /// An error whose message has several lines.
    pub fn list<S: AsRef<str>>(kind: ErrorKind, lines: impl IntoIterator<Item = S>) -> Self {
        let lines: Vec<String> = lines.into_iter().map(|line| escaped(line.as_ref()).into_owned()).collect();
        Self { message: lines.join("\n"), ..Self::new(kind, "") }
    }

    /// [`ErrorKind::Usage`].
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, message)
    }

    /// [`ErrorKind::Input`].
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, message)
    }

    /// [`ErrorKind::Recipe`].
    pub fn recipe(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Recipe, message)
    }

    /// [`ErrorKind::Missing`].
    pub fn missing(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Missing, message)
    }

    /// [`ErrorKind::Internal`].
    pub fn internal(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Internal, message)
    }

    /// [`ErrorKind::Stopped`].
    pub fn stopped() -> Self {
        Self::new(ErrorKind::Stopped, "stopped on request").hint("run the same command again to go on")
    }

    /// The operating system refused `action` on `path`: [`ErrorKind::Io`], or [`ErrorKind::Missing`] where there is
    /// nothing to read.
    pub fn io(action: &str, path: &Path, source: std::io::Error) -> Self {
        let reading = matches!(action, "read" | "list" | "open");
        let kind = match source.kind() {
            io::ErrorKind::NotFound if reading => ErrorKind::Missing,
            _ if reading && is_loop(&source) => ErrorKind::Missing,
            _ => ErrorKind::Io,
        };
        Self {
            hint: advice(&source, reading).map(str::to_owned),
            ..Self::new(kind, format!("cannot {action} {}: {source}", path.display()))
        }
        .caused_by(source)
    }

    /// [`ErrorKind::Io`]: the operating system refused `action` on a file that the caller [names](Self::at).
    pub fn refused(action: &str, source: std::io::Error) -> Self {
        Self {
            hint: advice(&source, false).map(str::to_owned),
            ..Self::new(ErrorKind::Io, format!("cannot {action}: {source}"))
        }
        .caused_by(source)
    }

    fn caused_by(mut self, source: impl std::error::Error + Send + Sync + 'static) -> Self {
        self.source = Some(Box::new(source));
        self
    }

    /// Names the file of an input or output error that does not name it yet.
    #[must_use]
    pub fn at(self, path: &Path) -> Self {
        let name = escaped(&path.display().to_string()).into_owned();
        if self.kind == ErrorKind::Io && !self.message.contains(&name) { self.context(name) } else { self }
    }

    /// Adds what the user can do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Puts `context` (usually a path) in front of the message.
    #[must_use]
    pub fn context(mut self, context: impl fmt::Display) -> Self {
        self.message = format!("{}: {}", escaped(&context.to_string()), self.message);
        self
    }

    /// Whether the operating system denied it, as by [`is_denied`].
    pub(crate) fn is_denied(&self) -> bool {
        let source = self.source.as_deref().and_then(|source| source.downcast_ref::<std::io::Error>());
        source.is_some_and(is_denied)
    }

    /// Whose fault it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// What to do about it, if that is known.
    pub fn guidance(&self) -> Option<&str> {
        self.hint.as_deref()
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_deref().map(|source| source as _)
    }
}

impl From<btfkit_formats::Error> for Error {
    fn from(error: btfkit_formats::Error) -> Self {
        let source = std::error::Error::source(&error);
        let shared =
            source.and_then(|source| source.downcast_ref::<Arc<std::io::Error>>()).map(AsRef::as_ref);
        match shared.or_else(|| source?.downcast_ref::<std::io::Error>()) {
            Some(source) => {
                let hint = advice(source, false).map(str::to_owned);
                Self { hint, ..Self::new(ErrorKind::Io, format!("cannot write: {source}")) }
            }
            None => Self::list(ErrorKind::Input, error.to_string().lines()),
        }
        .caused_by(error)
    }
}

/// Whether the operating system lets nobody, or not this user, do it: a file system that is read-only, or no
/// permission.
pub(crate) fn is_denied(error: &std::io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::PermissionDenied)
}

/// Whether links lead back to themselves.
pub(crate) fn is_loop(error: &std::io::Error) -> bool {
    /// `ELOOP`, which has no stable name in the standard library.
    const LOOP: i32 = if cfg!(target_os = "linux") { 40 } else { 62 };
    error.raw_os_error() == Some(LOOP)
}

/// What to do where the system starts no more threads.
pub(crate) const NO_THREADS: &str =
    "choose fewer by --threads, or raise the limits of processes and memory (ulimit -u, ulimit -v)";

/// What to do where an input was changed while it was read.
pub(crate) const BEGIN_AGAIN: &str = "begin again when nobody writes it any more, with --force: what has been made of it \
                                      as it was before is another recipe's, and is replaced";

/// Whether an operating system's error has this number; the numbers of Linux and of the systems after BSD are the same.
fn is_number(error: &std::io::Error, numbers: &[i32]) -> bool {
    error.raw_os_error().is_some_and(|number| numbers.contains(&number))
}

/// What to do about what the operating system refused.
pub(crate) fn advice(error: &std::io::Error, reading: bool) -> Option<&'static str> {
    /// `ENFILE` and `EMFILE`: the system or this process has too many files open.
    const TOO_MANY_FILES: [i32; 2] = [23, 24];
    /// `EAGAIN`, of Linux and of BSD: no more threads or locks.
    const TOO_MANY_THREADS: [i32; 1] = [if cfg!(target_os = "linux") { 11 } else { 35 }];
    if is_number(error, &TOO_MANY_FILES) {
        return Some("too many files are open: raise the limit (ulimit -n 1024), or choose fewer --threads");
    }
    if is_number(error, &TOO_MANY_THREADS) {
        return Some(NO_THREADS);
    }
    match error.kind() {
        io::ErrorKind::StorageFull => Some("free some space and run the same command again"),
        io::ErrorKind::QuotaExceeded => {
            Some("your quota of this disk is used up: free some of it and run the same command again")
        }
        io::ErrorKind::FileTooLarge => {
            Some("files may not be that large here: raise the limit (ulimit -f), or choose another place")
        }
        io::ErrorKind::ReadOnlyFilesystem => Some("choose a place that can be written to"),
        io::ErrorKind::PermissionDenied if reading => Some("ask for the right to read it"),
        io::ErrorKind::PermissionDenied => Some("choose a place that you may write to"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_the_system_refuses_keeps_its_kind_and_its_cause_through_the_formats_crate() {
        struct Full;
        impl std::io::Write for Full {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::Error::from(io::ErrorKind::StorageFull))
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let mut zip = btfkit_formats::zip::ZipWriter::new(Full);
        let error = Error::from(zip.write_entry("a", b"b").unwrap_err()).at(Path::new("o.zip"));
        assert_eq!(error.kind(), ErrorKind::Io);
        assert!(error.to_string().starts_with("o.zip: "), "{error}");
        assert!(error.guidance().unwrap().contains("space") && std::error::Error::source(&error).is_some());
    }

    #[test]
    fn a_message_is_one_line_whatever_it_names() {
        let name = Path::new("a\nbtf: all is well\u{1b}[2J");
        for error in [
            Error::input(name.display().to_string()),
            Error::input("x").context(name.display()),
            Error::io("read", name, std::io::Error::from(io::ErrorKind::NotFound)),
        ] {
            assert!(!error.to_string().contains(['\n', '\u{1b}']), "{error}");
        }
        assert_eq!(Error::list(ErrorKind::Input, ["a\u{7}", "b"]).to_string(), "a\\u{7}\nb");
    }

    #[test]
    fn what_can_be_done_is_said_of_each_refusal_and_no_name_twice() {
        for (kind, reading, words) in [
            (io::ErrorKind::StorageFull, false, "free some space"),
            (io::ErrorKind::QuotaExceeded, false, "quota"),
            (io::ErrorKind::FileTooLarge, false, "ulimit -f"),
            (io::ErrorKind::ReadOnlyFilesystem, false, "a place that can be written to"),
            (io::ErrorKind::PermissionDenied, false, "a place that you may write to"),
            (io::ErrorKind::PermissionDenied, true, "the right to read it"),
        ] {
            let (action, path) = (if reading { "read" } else { "write" }, Path::new("a.png"));
            let error = Error::io(action, path, std::io::Error::from(kind)).at(path);
            assert_eq!(error.kind(), ErrorKind::Io);
            assert_eq!(error.to_string().matches("a.png").count(), 1, "{error}");
            assert!(error.guidance().unwrap().contains(words), "{kind}: {:?}", error.guidance());
        }
    }
}

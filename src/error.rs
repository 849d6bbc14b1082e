//! The library's one error: what went wrong, whose fault it is, what to do.

use std::fmt;
use std::path::Path;

/// Whose fault an [`Error`] is. The program turns it into its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
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
    kind: Kind,
    message: String,
    hint: Option<String>,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

impl Error {
    /// An error of the given kind.
    pub fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), hint: None, source: None }
    }

    /// [`Kind::Usage`].
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Kind::Usage, message)
    }

    /// [`Kind::Input`].
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// [`Kind::Recipe`].
    pub fn recipe(message: impl Into<String>) -> Self {
        Self::new(Kind::Recipe, message)
    }

    /// [`Kind::Missing`].
    pub fn missing(message: impl Into<String>) -> Self {
        Self::new(Kind::Missing, message)
    }

    /// [`Kind::Internal`].
    pub fn internal(message: impl Into<String>) -> Self {
        Self::new(Kind::Internal, message)
    }

    /// [`Kind::Stopped`].
    pub fn stopped() -> Self {
        Self::new(Kind::Stopped, "stopped on request").hint("run the same command again to go on")
    }

    /// [`Kind::Io`]: the operating system refused `action` on `path`.
    pub fn io(action: &str, path: &Path, source: std::io::Error) -> Self {
        let hint = match source.kind() {
            std::io::ErrorKind::StorageFull => Some("free some space and run the same command again"),
            std::io::ErrorKind::PermissionDenied => Some("choose a place that you may write to"),
            _ => None,
        };
        let mut error = Self::new(Kind::Io, format!("cannot {action} {}: {source}", path.display()));
        error.hint = hint.map(str::to_owned);
        error.source = Some(Box::new(source));
        error
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
        self.message = format!("{context}: {}", self.message);
        self
    }

    /// Whose fault it is.
    pub fn kind(&self) -> Kind {
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
        Self::input(error.to_string())
    }
}

//! The error of every reader and writer of this crate, but for the catalogue's own report.

use std::borrow::Cow;
use std::sync::Arc;

/// Shorthand for this crate's results.
pub type Result<T> = std::result::Result<T, Error>;

/// Whose fault an [`Error`] is, and so what can be done about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The bytes break their format: damaged, cut short, or lying about themselves.
    Malformed,
    /// The bytes may be valid but ask for more than [`Limits`](crate::Limits) allows.
    Limit,
    /// Valid, but a variant that this crate does not read.
    Unsupported,
    /// The caller passed something that cannot be done.
    Argument,
    /// The writer that the caller supplied failed.
    Io,
}

/// What was found, what was expected, and where.
///
/// Cheap to clone, so that one failure can be reported from several workers.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{}found {found}, expected {expected}", place(.entry.as_deref(), *.offset))]
pub struct Error {
    kind: ErrorKind,
    entry: Option<Box<str>>,
    offset: Option<u64>,
    found: Box<str>,
    expected: Cow<'static, str>,
    #[source]
    source: Option<Arc<std::io::Error>>,
}

fn place(entry: Option<&str>, offset: Option<u64>) -> String {
    match (entry, offset) {
        (Some(name), Some(at)) => format!("{name:?}, byte {at}: "),
        (Some(name), None) => format!("{name:?}: "),
        (None, Some(at)) => format!("byte {at}: "),
        (None, None) => String::new(),
    }
}

impl Error {
    pub(crate) fn new(
        kind: ErrorKind,
        found: impl Into<Box<str>>,
        expected: impl Into<Cow<'static, str>>,
    ) -> Self {
        Error {
            kind,
            entry: None,
            offset: None,
            found: found.into(),
            expected: expected.into(),
            source: None,
        }
    }

    pub(crate) fn malformed(found: impl Into<Box<str>>, expected: impl Into<Cow<'static, str>>) -> Self {
        Self::new(ErrorKind::Malformed, found, expected)
    }

    pub(crate) fn io(doing: &str, source: std::io::Error) -> Self {
        let mut error = Self::new(ErrorKind::Io, source.to_string(), format!("{doing} to succeed"));
        error.source = Some(Arc::new(source));
        error
    }

    pub(crate) fn at(mut self, offset: impl TryInto<u64>) -> Self {
        self.offset = offset.try_into().ok();
        self
    }

    /// Names the entry or file that the error is about; the innermost name given wins.
    #[must_use]
    pub fn in_entry(mut self, name: &str) -> Self {
        if self.entry.is_none() {
            self.entry = Some(name.into());
        }
        self
    }

    /// Whose fault it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The entry or file, where known.
    pub fn entry(&self) -> Option<&str> {
        self.entry.as_deref()
    }

    /// Bytes from the start of the slice that was being read (the zip, or the one image), where known.
    pub fn offset(&self) -> Option<u64> {
        self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_says_where_what_and_what_instead() {
        let error = Error::malformed("2 bytes", "4 bytes").at(17usize).in_entry("a.jpg").in_entry("b.zip");
        assert_eq!(error.to_string(), "\"a.jpg\", byte 17: found 2 bytes, expected 4 bytes");
        assert_eq!(error.kind(), ErrorKind::Malformed);
        assert_eq!((error.entry(), error.offset()), (Some("a.jpg"), Some(17)));
    }

    #[test]
    fn io_error_keeps_its_source() {
        let error = Error::io("writing", std::io::Error::other("disk full"));
        assert_eq!(std::error::Error::source(&error).unwrap().to_string(), "disk full");
        assert!(error.to_string().contains("disk full"));
    }
}

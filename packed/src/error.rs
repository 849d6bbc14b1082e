//! What went wrong.

/// What was found, what was expected, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}found {found}, expected {expected}", .offset.map(|at| format!("byte {at}: ")).unwrap_or_default())]
pub struct Error {
    /// What was found.
    pub found: String,
    /// What was expected.
    pub expected: String,
    /// Byte of the file where it was found.
    pub offset: Option<usize>,
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn new(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { found: found.into(), expected: expected.into(), offset: None }
    }

    pub(crate) fn at(self, offset: usize) -> Self {
        Self { offset: Some(offset), ..self }
    }
}

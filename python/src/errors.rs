//! Errors of the library as exceptions of their kinds.

use btfkit::{Error, ErrorKind};
use pyo3::prelude::*;

/// The exception of an error: the class of its kind in `btfkit._errors`, with the message, and the advice as an
/// attribute.
pub(crate) fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error.kind() {
        ErrorKind::Usage => "UsageError",
        ErrorKind::Input => "InputError",
        ErrorKind::Recipe => "RecipeError",
        ErrorKind::Missing => "MissingError",
        ErrorKind::Io => "IoError",
        ErrorKind::Stopped => "StoppedError",
        _ => "InternalError",
    };
    let made = py
        .import("btfkit._errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call1((error.to_string(), error.guidance())));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// The value of a result, or the exception of its error.
pub(crate) fn or_raise<T>(py: Python<'_>, result: btfkit::Result<T>) -> PyResult<T> {
    result.map_err(|error| raised(py, &error))
}

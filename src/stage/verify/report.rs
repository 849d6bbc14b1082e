//! What was found of a store that is read as a whole.

use std::path::Path;

use serde::Serialize;

use crate::error::{ErrorKind, Result};

/// Findings that are kept one by one.
pub(super) const MOST_FINDINGS: usize = 1000;

/// What the oldest layout leaves open.
pub(super) const OLDEST_NOTE: &str = "made by an older version: without seals and checksums, changed attributes and exchanged chunks cannot be told";

/// What is not as it should be.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// The part of the store: an array, an attribute, a stage.
    pub part: String,
    /// What was found, with the file.
    pub what: String,
    /// What to do.
    pub todo: Option<String>,
    /// Whether it is only not there yet.
    pub missing: bool,
}

/// What was found of a model, an enlarged index or a pyramid.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// What was looked at: measurement, model, enlarged or deepzoom.
    pub kind: &'static str,
    /// What was looked at, and how much of it there is.
    pub checked: Vec<(String, String)>,
    /// What is not as it should be.
    pub findings: Vec<Finding>,
    /// What could not be told.
    pub notes: Vec<String>,
}

impl Report {
    /// Nothing looked at yet.
    pub(crate) fn new(kind: &'static str) -> Self {
        Self { kind, ..Self::default() }
    }

    pub(crate) fn checked(&mut self, name: &str, what: impl Into<String>) {
        self.checked.push((name.to_owned(), what.into()));
    }

    /// Keeps an error as a finding, but for those of the operating system and a stop.
    ///
    /// # Errors
    /// Those.
    pub(crate) fn keep<T>(&mut self, part: &str, result: Result<T>) -> Result<Option<T>> {
        kept(result, part, &mut self.findings)
    }

    pub(crate) fn find(&mut self, part: &str, what: String, todo: &str) {
        let finding = Finding { part: part.to_owned(), what, todo: Some(todo.to_owned()), missing: false };
        push(&mut self.findings, finding);
    }
}

fn push(findings: &mut Vec<Finding>, finding: Finding) {
    if findings.len() < MOST_FINDINGS {
        findings.push(finding);
    }
}

/// Keeps an error as a finding, but for those of the operating system and a stop.
pub(super) fn kept<T>(result: Result<T>, part: &str, findings: &mut Vec<Finding>) -> Result<Option<T>> {
    let error = match result {
        Ok(value) => return Ok(Some(value)),
        Err(error) => error,
    };
    match error.kind() {
        ErrorKind::Input | ErrorKind::Missing | ErrorKind::Recipe => {
            let missing = error.kind() == ErrorKind::Missing;
            let todo = error.guidance().map(str::to_owned);
            push(findings, Finding { part: part.to_owned(), what: error.to_string(), todo, missing });
            Ok(None)
        }
        _ => Err(error),
    }
}

/// A store that is whole, but was not declared finished.
pub(super) fn unfinished(path: &Path) -> Finding {
    Finding {
        part: "zarr.json".to_owned(),
        what: format!("{}: everything is there, but it was not declared finished", path.display()),
        todo: Some("run the command that makes this store again; it only ends it".to_owned()),
        missing: true,
    }
}

/// Looks at the copy of all metadata in the root, which other programs read.
pub(super) fn consolidated(path: &Path, holds: Result<bool>, findings: &mut Vec<Finding>) -> Result<()> {
    if kept(holds, "consolidated metadata", findings)? == Some(false) {
        let what = format!(
            "{}: the copy of all metadata for other programs (consolidated_metadata) is not what the arrays say",
            path.join("zarr.json").display()
        );
        let todo = "run the command that makes this store again: it writes the copy anew";
        let part = "consolidated metadata".to_owned();
        push(findings, Finding { part, what, todo: Some(todo.to_owned()), missing: false });
    }
    Ok(())
}

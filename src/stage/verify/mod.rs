//! Is a store, or a Deep Zoom pyramid, whole and undamaged? Everything of it is read: metadata against what the store
//! says of itself, every chunk, every number against its range and against what it follows from.

mod enlarged;
pub mod measurement;
mod model;

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use crate::archive::Source;
use crate::error::{Error, ErrorKind, Result};
use crate::run::Context;
use crate::stage::deepzoom;
use crate::store::measurement::Measurement;
use crate::store::model::Model;
use crate::store::{enlarged as index, measurement as measured, model as modelled, recognise};
use crate::zarr::Store;

/// What the oldest layout leaves open.
pub(super) const OLDEST_NOTE: &str = "made by an older version: without seals and checksums, changed attributes and exchanged chunks cannot be told";

/// Findings that are kept one by one.
const MOST_FINDINGS: usize = 1000;

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

/// What was found of anything that can be verified.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Found {
    /// Of a measurement.
    Measurement {
        /// Number of views that it should have.
        views: usize,
        /// What was found.
        #[serde(flatten)]
        report: Box<measurement::Report>,
    },
    /// Of anything else.
    Other(Report),
}

/// What else may be compared with.
#[derive(Default)]
pub struct Beside<'a> {
    /// The archive of a measurement.
    pub source: Option<&'a dyn Source>,
    /// The model of an enlarged index; beside it where absent.
    pub model: Option<PathBuf>,
}

/// Reads all of what lies at a path.
///
/// # Errors
/// Where nothing that can be verified lies there, or its attributes are damaged so far that nothing can be looked at;
/// and those of the operating system. What else is damaged is reported.
pub fn run(path: &Path, beside: &Beside<'_>, context: &Context<'_>) -> Result<Found> {
    recognise::expect_readable(path)?;
    let kind = if is_pyramid(path) {
        None
    } else {
        let kinds = [measured::KIND, modelled::KIND, index::KIND];
        let attributes = Store::at(path).expect_one_of(&kinds)?;
        attributes.get("kind").and_then(Value::as_str).map(str::to_owned)
    };
    let kind = kind.as_deref();
    let refused = |what: &str| Error::usage(format!("{}: {what}", path.display()));
    if beside.source.is_some() && kind != Some(measured::KIND) {
        return Err(refused("only a measurement can be compared with an archive"));
    }
    if beside.model.is_some() && kind != Some(index::KIND) {
        return Err(refused("only an enlargement is compared with its model").hint("leave out --model"));
    }
    Ok(match kind {
        None => Found::Other(deepzoom::verify(path, context)?),
        Some(modelled::KIND) => Found::Other(model::run(&Model::open(path)?, context)?),
        Some(index::KIND) => Found::Other(enlarged::run(path, beside.model.as_deref(), context)?),
        Some(_) => {
            let measurement = Measurement::open(path)?;
            let report = Box::new(measurement::run(&measurement, beside.source, context)?);
            Found::Measurement { views: measurement.description().views.len(), report }
        }
    })
}

/// Whether a path names a pyramid: its description or the folder of its tiles.
pub fn is_pyramid(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "dzi") || path.join(recognise::PYRAMID_STATE).exists()
}

impl Report {
    fn new(kind: &'static str) -> Self {
        Self { kind, ..Self::default() }
    }

    /// The report of a kind that another stage looks at.
    pub(crate) fn of(kind: &'static str) -> Self {
        Self::new(kind)
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
fn kept<T>(result: Result<T>, part: &str, findings: &mut Vec<Finding>) -> Result<Option<T>> {
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
fn unfinished(path: &Path) -> Finding {
    Finding {
        part: "zarr.json".to_owned(),
        what: format!("{}: everything is there, but it was not declared finished", path.display()),
        todo: Some("run the command that makes this store again; it only ends it".to_owned()),
        missing: true,
    }
}

/// Looks at the copy of all metadata in the root, which other programs read.
fn consolidated(path: &Path, holds: Result<bool>, findings: &mut Vec<Finding>) -> Result<()> {
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

//! Is a store, or a Deep Zoom pyramid, whole and undamaged? Everything of it is read: metadata against what the store
//! says of itself, every chunk, every number against its range and against what it follows from.

mod enlarged;
pub mod measurement;
mod model;
pub(crate) mod report;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::archive::Source;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::shard::Shard;
use crate::stage::deepzoom;
use crate::store::kind_of;
use crate::store::measurement::Measurement;
use crate::store::model::Model;
use crate::store::{enlarged as index, measurement as measured, model as modelled, recognise};
pub use report::{Finding, Report};

/// What was found of anything that can be verified.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Found {
    /// Of a measurement.
    Measurement {
        /// Number of views that it should have, or this part of it.
        views: usize,
        /// What was found.
        #[serde(flatten)]
        report: Box<measurement::Report>,
    },
    /// Of anything else.
    Other(Report),
}

/// What else may be compared with, and how much is looked at.
#[derive(Default)]
pub struct Beside<'a> {
    /// The archive of a measurement.
    pub source: Option<&'a dyn Source>,
    /// The model of an enlarged index; beside it where absent.
    pub model: Option<PathBuf>,
    /// The part of the views, or of the rows of shards or tiles, that is looked at.
    pub shard: Shard,
}

/// Reads all of what lies at a path.
///
/// # Errors
/// Where nothing that can be verified lies there, or its attributes are damaged so far that nothing can be looked at;
/// and those of the operating system. What else is damaged is reported.
pub fn run(path: &Path, beside: &Beside<'_>, context: &Context<'_>) -> Result<Found> {
    recognise::expect_readable(path)?;
    let kind = if is_pyramid(path) { None } else { Some(kind_of(path)?) };
    let refused = |what: &str| Error::usage(format!("{}: {what}", path.display()));
    if beside.source.is_some() && kind != Some(measured::KIND) {
        return Err(refused("only a measurement can be compared with an archive"));
    }
    if beside.model.is_some() && kind != Some(index::KIND) {
        return Err(refused("only an enlargement is compared with its model").hint("leave out --model"));
    }
    if beside.shard != Shard::WHOLE && kind == Some(modelled::KIND) {
        let what = "a model is verified as a whole";
        return Err(refused(what).hint("leave out --shard"));
    }
    Ok(match kind {
        None => Found::Other(deepzoom::verify(path, beside.shard, context)?),
        Some(modelled::KIND) => Found::Other(model::run(&Model::open(path)?, context)?),
        Some(index::KIND) => {
            Found::Other(enlarged::run(path, beside.model.as_deref(), beside.shard, context)?)
        }
        Some(_) => {
            let measurement = Measurement::open(path)?;
            let report = measurement::run(&measurement, beside.source, beside.shard, context)?;
            Found::Measurement {
                views: report.views_found + report.views_missing.len(),
                report: Box::new(report),
            }
        }
    })
}

/// Whether a path names a pyramid: its description or the folder of its tiles.
pub fn is_pyramid(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "dzi") || path.join(recognise::PYRAMID_STATE).exists()
}

//! The stages, from an archive to an enlargement.

use std::path::PathBuf;

use btfkit::archive;
use btfkit::method::cluster::choice::Amount;
use btfkit::run::Context;
use btfkit::run::progress::Stage;
use btfkit::shape::Size;
use btfkit::stage::{appearance, cluster, fit, import, normals, tile};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::Serialize;

use crate::work::{self, Terms};

/// The dictionary of a report.
fn dictionary<'py>(py: Python<'py>, report: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(report).map_err(|error| PyValueError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Import an archive into a measurement.
#[pyfunction]
#[pyo3(signature = (
    archives, measurement, *, pattern=None, table=None, order=None, white=1.0, progress=None,
    threads=None, memory=None, force=false
))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn import_<'py>(
    py: Python<'py>,
    archives: Vec<PathBuf>,
    measurement: PathBuf,
    pattern: Option<String>,
    table: Option<PathBuf>,
    order: Option<String>,
    white: f64,
    progress: Option<Py<PyAny>>,
    threads: Option<usize>,
    memory: Option<u64>,
    force: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let terms = Terms { progress, threads, memory, force };
    let reading = archive::Options { pattern, table, order, ..archive::Options::default() };
    let (report, assumed) = work::run(py, &terms, |context| {
        let source = archive::open(&archives, &reading)?;
        let options = import::Options { white, ..import::Options::new(&measurement) };
        let report = import::plan(source.as_ref(), options, context)?.run(context)?;
        Ok((report, source.contents().assumptions.clone()))
    })?;
    for assumption in assumed {
        work::warn(py, &format!("assumed: {assumption}"))?;
    }
    dictionary(py, &report)
}

/// Make a model of a measurement.
#[pyfunction]
#[pyo3(signature = (
    measurement, model, *, clusters=None, tile=None, seed=1, progress=None, threads=None, memory=None,
    force=false
))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn model<'py>(
    py: Python<'py>,
    measurement: PathBuf,
    model: PathBuf,
    clusters: Option<usize>,
    tile: Option<(usize, usize)>,
    seed: u64,
    progress: Option<Py<PyAny>>,
    threads: Option<usize>,
    memory: Option<u64>,
    force: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let terms = Terms { progress, threads, memory, force };
    let choice =
        tile.map_or(tile::Choice::Auto, |(height, width)| tile::Choice::Sized(Size::new(height, width)));
    let report = work::run(py, &terms, |context| {
        let tiling = tile::Options { choice, seed, ..tile::Options::new(&measurement, &model) };
        let clustering = cluster::Options {
            amount: clusters.map_or(Amount::Usual, Amount::Clusters),
            seed,
            ..cluster::Options::new(&measurement, &model)
        };
        begin(context, 1, "tile");
        tile::plan(&tiling)?.run(context)?;
        begin(context, 2, "cluster");
        let report = cluster::plan(&clustering)?.run(context)?;
        begin(context, 3, "normals");
        let of = normals::Options { measurement: measurement.clone(), model: model.clone(), robust: false };
        normals::plan(&of)?.run(context)?;
        begin(context, 4, "fit");
        fit::plan(&fit::Options::of(model.clone()))?.run(context)?;
        begin(context, 5, "appearance");
        appearance::plan(&appearance::Options::new(&model))?.run(context)?;
        Ok(report)
    })?;
    dictionary(py, &report)
}

/// Says which stage of a model begins.
fn begin(context: &Context<'_>, number: usize, name: &'static str) {
    context.progress.stage(Some(Stage { number, of: 5, name }));
}

/// Enlarge a model into an index of any size.
#[pyfunction]
#[pyo3(signature = (
    model, enlargement, width, height, *, seed=1, tileable=false, progress=None, threads=None,
    memory=None, force=false
))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn enlarge<'py>(
    py: Python<'py>,
    model: PathBuf,
    enlargement: PathBuf,
    width: usize,
    height: usize,
    seed: u64,
    tileable: bool,
    progress: Option<Py<PyAny>>,
    threads: Option<usize>,
    memory: Option<u64>,
    force: bool,
) -> PyResult<Bound<'py, PyAny>> {
    use btfkit::stage::enlarge;

    let terms = Terms { progress, threads, memory, force };
    let options = enlarge::Options::new(&model, &enlargement, Size::new(height, width));
    let options = enlarge::Options { seeds: seed..=seed, tileable, ..options };
    let reports = work::run(py, &terms, |context| enlarge::plan(&options)?.run(context))?;
    match reports.first() {
        Some(report) => dictionary(py, report),
        None => Ok(py.None().into_bound(py)),
    }
}

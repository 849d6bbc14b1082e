//! Measurements.

use std::path::PathBuf;

use btfkit::store::measurement;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use crate::arrays::{Part, degrees, samples, within};
use crate::errors::or_raise;
use crate::look::{Look, opened};

/// A measurement: one material photographed under every pair of a view and a light.
#[pyclass(frozen, module = "btfkit")]
pub(crate) struct Measurement {
    store: measurement::Measurement,
    look: Look,
}

#[pymethods]
impl Measurement {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let store = opened(py, || measurement::Measurement::open(&path))?;
        Ok(Self { store, look: Look::new(path, None, None) })
    }

    /// Views, rows, columns, lights, channels.
    #[getter]
    fn shape(&self) -> [usize; 5] {
        self.store.description().shape()
    }

    /// Names of the channels.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.store.description().channels.clone()
    }

    /// View directions, [view, (theta, phi)] in degrees.
    #[getter]
    fn views<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        degrees(py, &self.store.description().views)
    }

    /// Light directions, [light, (theta, phi)] in degrees.
    #[getter]
    fn lights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        degrees(py, &self.store.description().lights)
    }

    /// Views that have been imported; as many as there are once an import has ended.
    #[getter]
    fn views_done(&self) -> usize {
        self.store.views_done()
    }

    /// Samples of a view as they were measured, [y, x, light, channel]; `window` is x, y, width, height.
    #[pyo3(signature = (view, window=None))]
    fn samples<'py>(
        &self,
        py: Python<'py>,
        view: usize,
        window: Option<Part>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let description = self.store.description();
        if view >= description.views.len() {
            return Err(PyIndexError::new_err(format!(
                "view {view}: the measurement has the views 0 to {}",
                description.views.len() - 1
            )));
        }
        let window = match window {
            None => description.size.window(),
            Some(part) => within(part, description.size)?,
        };
        let read = py.detach(|| self.store.read_reflectance(view, window));
        let [_, _, _, lights, channels] = description.shape();
        samples(py, or_raise(py, read)?, &[window.size.height, window.size.width, lights, channels])
    }

    /// Linear RGB under a light, seen from a view, both (theta, phi) in degrees, mixed between the measured ones:
    /// [y, x, 3]; `window` is x, y, width, height.
    #[pyo3(signature = (light, view=(0.0, 0.0), window=None))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        light: (f64, f64),
        view: (f64, f64),
        window: Option<Part>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.look.image(py, light, view, window)
    }

    fn __repr__(&self) -> String {
        let [views, height, width, lights, channels] = self.shape();
        format!(
            "<btfkit.Measurement: {views} views x {lights} lights of {width}x{height}, {channels} channels>"
        )
    }
}

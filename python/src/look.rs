//! Pictures and values of any store: what measurements, models, planes and enlargements have in common.

use std::path::PathBuf;
use std::sync::OnceLock;

use btfkit::render::texture::Reader;
use btfkit::run::budget::Room;
use btfkit::shape::Size;
use btfkit::stage::image::{Options, PlaneOptions, Scene, Subject, Values};
use btfkit::stage::render::material::{self, Material};
use btfkit::{Error, Result};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Part, Vectors, area, colors, direction};
use crate::errors::or_raise;
use crate::work::{self, Terms};

/// Rows that are read together.
const ROWS: usize = 64;

/// Points that one thread evaluates before it takes the next.
const POINTS: usize = 4096;

/// What is looked at.
pub(crate) struct Look {
    path: PathBuf,
    model: Option<PathBuf>,
    plane: Option<PlaneOptions>,
    /// Opened when values are asked for first.
    material: OnceLock<Material>,
}

impl Look {
    pub(crate) fn new(path: PathBuf, model: Option<PathBuf>, plane: Option<PlaneOptions>) -> Self {
        Self { path, model, plane, material: OnceLock::new() }
    }

    /// Linear RGB under a light, seen from a view, [y, x, 3].
    pub(crate) fn image<'py>(
        &self,
        py: Python<'py>,
        light: (f64, f64),
        view: (f64, f64),
        window: Option<Part>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let subject =
            Subject::Appearance { view: direction("view", view)?, light: direction("light", light)? };
        let options = Options {
            source: self.path.clone(),
            model: self.model.clone(),
            subject,
            values: Values::Model,
            plane: self.plane,
            window: window.map(area).transpose()?,
        };
        let (size, pixels, notes) = work::run(py, &Terms::default(), |context| {
            let scene = Scene::open(&options, context)?;
            let size = scene.size();
            let mut pixels = vec![[0.0f32; 3]; size.texels()];
            for (first, rows) in (0..).step_by(ROWS).zip(pixels.chunks_mut(ROWS * size.width)) {
                context.check_stop()?;
                let count = rows.len() / size.width;
                let band = scene.read(first..first + count, context)?;
                for (row, pixels) in rows.chunks_exact_mut(size.width).enumerate() {
                    band.row(row, pixels);
                }
            }
            Ok((size, pixels, scene.notes()))
        })?;
        notes.iter().try_for_each(|note| work::warn(py, note))?;
        colors(py, pixels, &[size.height, size.width])
    }

    /// Linear RGB at points of the texture, [n, 3].
    pub(crate) fn value<'py>(
        &self,
        py: Python<'py>,
        points: &PyReadonlyArrayDyn<'py, f64>,
        views: &PyReadonlyArrayDyn<'py, f64>,
        lights: &PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let &[count, 2] = points.shape() else {
            return Err(PyValueError::new_err(format!(
                "points: got the shape {:?}, expected [n, 2] (column and row, in texels)",
                points.shape()
            )));
        };
        let places: Vec<f64> = points.as_array().iter().copied().collect();
        let (places, _) = places.as_chunks::<2>();
        if let Some(row) = places.iter().position(|place| !place.iter().all(|at| at.abs() < 2e9)) {
            return Err(PyValueError::new_err(format!(
                "points, row {row}: got {:?}, expected texels from -2e9 to 2e9",
                places[row]
            )));
        }
        let (views, lights) = (Vectors::new("views", views, count)?, Vectors::new("lights", lights, count)?);
        let values = work::run(py, &Terms::default(), |context| {
            if self.material.get().is_none() {
                let mut options = btfkit::stage::render::Options::new(&self.path);
                options.model.clone_from(&self.model);
                options.plane = self.plane;
                // Of two threads that open it at once, one's is kept.
                let mut room = Room::new(context.memory());
                let _ = self.material.set(material::open(&options, &mut room, context)?);
            }
            let material = self.material.get().ok_or_else(|| Error::internal("no material"))?;
            let mut values = vec![[0.0f32; 3]; count];
            context.install(|| {
                values.par_chunks_mut(POINTS).enumerate().try_for_each(|(part, values)| {
                    context.check_stop()?;
                    let mut reader = material.texture.reader();
                    for (point, value) in (part * POINTS..).zip(values) {
                        *value = at(material, &mut reader, places[point], views.at(point), lights.at(point))?;
                    }
                    Ok::<(), Error>(())
                })
            })?;
            Ok(values)
        })?;
        colors(py, values, &[count])
    }
}

/// Linear RGB at a point.
fn at(
    material: &Material,
    reader: &mut Reader<'_>,
    place: [f64; 2],
    view: [f32; 3],
    light: [f32; 3],
) -> Result<[f32; 3]> {
    material.evaluator.value(reader, place, view, light)
}

/// Height and width, as numpy has them.
pub(crate) fn shape(size: Size) -> (usize, usize) {
    (size.height, size.width)
}

/// Opens a store, without Python's lock.
pub(crate) fn opened<T: Send>(py: Python<'_>, open: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    let opened = py.detach(open);
    or_raise(py, opened)
}

//! Models, the endless planes that are made of them, and stored enlargements.

use std::path::PathBuf;

use btfkit::kernel::Kernel;
use btfkit::method::coherent;
use btfkit::stage::image::PlaneOptions;
use btfkit::store::{enlarged, model};
use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Part, area, array, degrees, within};
use crate::look::{Look, opened, shape};
use crate::work::{self, Terms};

/// A model: a tile of a material, its clusters, and what enlarging has to know.
#[pyclass(frozen, module = "btfkit")]
pub(crate) struct Model {
    store: model::Model,
    path: PathBuf,
    shape: (usize, usize),
    clusters: usize,
    look: Look,
}

#[pymethods]
impl Model {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (store, shape, clusters) = opened(py, || {
            let store = model::Model::open(&path)?;
            let (size, clusters) = (store.tile()?.size, store.clusters()?);
            Ok((store, shape(size), clusters))
        })?;
        Ok(Self { store, shape, clusters, look: Look::new(path.clone(), None, None), path })
    }

    /// Rows and columns of the tile.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        self.shape
    }

    /// How many clusters there are.
    #[getter]
    fn clusters(&self) -> usize {
        self.clusters
    }

    /// View directions, [view, (theta, phi)] in degrees.
    #[getter]
    fn views<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [views, _] = opened(py, || self.store.directions())?;
        degrees(py, &views)
    }

    /// Light directions, [light, (theta, phi)] in degrees.
    #[getter]
    fn lights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let [_, lights] = opened(py, || self.store.directions())?;
        degrees(py, &lights)
    }

    /// The cluster of each texel of the tile, [y, x].
    fn index<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let index = opened(py, || self.store.index())?;
        array(py, index, &[self.shape.0, self.shape.1])
    }

    /// Linear RGB of the tile under a light, seen from a view, both (theta, phi) in degrees: [y, x, 3]; `window` is
    /// x, y, width, height.
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

    /// Linear RGB at points of the tile, [n, 3]; see the package for the arguments.
    fn value<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArrayDyn<'py, f64>,
        views: PyReadonlyArrayDyn<'py, f64>,
        lights: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.look.value(py, &points, &views, &lights)
    }

    /// An endless plane of the material: another seed gives another one.
    #[pyo3(signature = (seed=1, jitter=None))]
    fn plane(&self, py: Python<'_>, seed: u32, jitter: Option<f64>) -> PyResult<Plane> {
        let jitter = match jitter {
            None => None,
            Some(jitter) if (0.0..=1.0).contains(&jitter) => Some((jitter * 256.0).round() as u32),
            Some(jitter) => {
                return Err(PyValueError::new_err(format!("got the jitter {jitter}, expected 0 to 1")));
            }
        };
        let (plane, variation) = work::run(py, &Terms::default(), |_| {
            let (tile, index) = (self.store.tile()?, self.store.index()?);
            let appearance = self.store.appearance()?;
            let plane = coherent::Plane::new(tile.size, &index, &appearance, Kernel::fastest())?;
            let mut variation = plane.variation(seed);
            variation.jitter = jitter.unwrap_or(variation.jitter);
            Ok((plane, variation))
        })?;
        let look = Look::new(self.path.clone(), None, Some(PlaneOptions { seed, jitter }));
        Ok(Plane { plane, variation, look })
    }

    fn __repr__(&self) -> String {
        let (height, width) = self.shape;
        format!("<btfkit.Model: {} clusters, a tile of {width}x{height}>", self.clusters)
    }
}

/// An endless plane of a material, of which any window can be made at once.
#[pyclass(frozen, module = "btfkit")]
pub(crate) struct Plane {
    plane: coherent::Plane,
    variation: coherent::Variation,
    look: Look,
}

#[pymethods]
impl Plane {
    /// Which texel of the tile each texel of a window is, `row * width + column`, [height, width]. Any `x` and `y` from
    /// -2^31 on.
    fn window<'py>(
        &self,
        py: Python<'py>,
        x: i64,
        y: i64,
        width: usize,
        height: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let area = area((x, y, width, height))?;
        let source = work::run(py, &Terms::default(), |context| {
            context.install(|| self.plane.window(&self.variation, area.y, area.x, area.size))
        })?;
        array(py, source, &[height, width])
    }

    /// Linear RGB of a window (x, y, width, height) under a light, seen from a view, both (theta, phi) in degrees:
    /// [height, width, 3].
    #[pyo3(signature = (window, light, view=(0.0, 0.0)))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        window: Part,
        light: (f64, f64),
        view: (f64, f64),
    ) -> PyResult<Bound<'py, PyAny>> {
        self.look.image(py, light, view, Some(window))
    }

    /// Linear RGB at points of the plane, [n, 3]; see the package for the arguments.
    fn value<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArrayDyn<'py, f64>,
        views: PyReadonlyArrayDyn<'py, f64>,
        lights: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.look.value(py, &points, &views, &lights)
    }
}

/// A stored enlargement: the number of the cluster of each texel, of any size.
#[pyclass(frozen, module = "btfkit")]
pub(crate) struct Enlargement {
    store: enlarged::Enlarged,
    look: Look,
}

#[pymethods]
impl Enlargement {
    /// `model` is needed where it does not lie beside the enlargement.
    #[new]
    #[pyo3(signature = (path, model=None))]
    fn new(py: Python<'_>, path: PathBuf, model: Option<PathBuf>) -> PyResult<Self> {
        let store = opened(py, || enlarged::Enlarged::open(&path))?;
        Ok(Self { store, look: Look::new(path, model, None) })
    }

    /// Rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        shape(self.store.size())
    }

    /// The cluster of each texel of a window, [height, width].
    fn window<'py>(
        &self,
        py: Python<'py>,
        x: i64,
        y: i64,
        width: usize,
        height: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let window = within((x, y, width, height), self.store.size())?;
        let index = opened(py, || self.store.read(window))?;
        array(py, index, &[height, width])
    }

    /// Which texel of the tile each texel of a window is, `row * width + column`, [height, width]; None where the
    /// enlargement does not say it.
    fn source<'py>(
        &self,
        py: Python<'py>,
        x: i64,
        y: i64,
        width: usize,
        height: usize,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let window = within((x, y, width, height), self.store.size())?;
        let source = opened(py, || self.store.read_source(window))?;
        source.map(|source| array(py, source, &[height, width])).transpose()
    }

    /// Linear RGB under a light, seen from a view, both (theta, phi) in degrees: [y, x, 3]; `window` is x, y, width,
    /// height.
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

    /// Linear RGB at points, [n, 3]; see the package for the arguments.
    fn value<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArrayDyn<'py, f64>,
        views: PyReadonlyArrayDyn<'py, f64>,
        lights: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.look.value(py, &points, &views, &lights)
    }

    fn __repr__(&self) -> String {
        format!("<btfkit.Enlargement of {}>", self.store.size())
    }
}

//! Numbers of the library as numpy arrays, and those of callers as the library takes them.

use btfkit::Direction;
use btfkit::shape::{Area, Size, Window};
use btfkit_formats::Samples;
use numpy::{Element, IntoPyArray, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyAny;

/// An array of this shape that takes the list over, without a copy.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    list: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(list.into_pyarray(py).reshape(shape.to_vec())?.into_any())
}

/// Samples as they are stored, of the numpy type of theirs.
pub(crate) fn samples<'py>(
    py: Python<'py>,
    samples: Samples,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    match samples {
        Samples::U8(list) => array(py, list, shape),
        Samples::U16(list) => array(py, list, shape),
        Samples::F16(list) => array(py, list, shape),
        Samples::F32(list) => array(py, list, shape),
    }
}

/// Colours, [n, 3] by this shape without its last axis.
pub(crate) fn colors<'py>(
    py: Python<'py>,
    colors: Vec<[f32; 3]>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    array(py, colors.into_flattened(), &[shape, &[3]].concat())
}

/// Directions as degrees, [n, (theta, phi)].
pub(crate) fn degrees<'py>(py: Python<'py>, directions: &[Direction]) -> PyResult<Bound<'py, PyAny>> {
    let list = directions.iter().flat_map(|direction| <[f64; 2]>::from(direction.degrees())).collect();
    array(py, list, &[directions.len(), 2])
}

/// A direction by its angles in degrees.
pub(crate) fn direction(name: &str, (theta, phi): (f64, f64)) -> PyResult<Direction> {
    if !(0.0..=90.0).contains(&theta) || !phi.is_finite() {
        return Err(PyValueError::new_err(format!(
            "{name}: got theta {theta}, phi {phi}, expected degrees with theta from 0 (above) to 90"
        )));
    }
    Ok(Direction::from_degrees(theta, phi))
}

/// Part of a plane: the column and the row of its first texel, its width, and its height.
pub(crate) type Part = (i64, i64, usize, usize);

/// An area by them.
pub(crate) fn area((x, y, width, height): Part) -> PyResult<Area> {
    if width == 0 || height == 0 {
        return Err(PyValueError::new_err(format!(
            "got a window of {width}x{height}, expected a texel at least"
        )));
    }
    Ok(Area { y, x, size: Size::new(height, width) })
}

/// A window that lies within a plane.
pub(crate) fn within(part: Part, plane: Size) -> PyResult<Window> {
    let Area { x, y, size } = area(part)?;
    let window = usize::try_from(y).ok().zip(usize::try_from(x).ok()).map(|(y, x)| Window { y, x, size });
    window.filter(|window| window.fits(plane)).ok_or_else(|| {
        PyValueError::new_err(format!(
            "the window (x, y, width, height) {part:?} does not lie within {plane}"
        ))
    })
}

/// Unit vectors of directions that are given as angles in degrees, [n, 2], or as vectors, [n, 3]; or one for all.
pub(crate) struct Vectors(Vec<[f32; 3]>);

impl Vectors {
    /// Checks them.
    pub(crate) fn new(name: &str, given: &PyReadonlyArrayDyn<'_, f64>, points: usize) -> PyResult<Self> {
        let shape = given.shape();
        let (rows, columns) = match *shape {
            [columns] => (1, columns),
            [rows, columns] => (rows, columns),
            _ => (0, 0),
        };
        if !matches!(columns, 2 | 3) || (rows != points && rows != 1) {
            return Err(PyValueError::new_err(format!(
                "{name}: got the shape {shape:?}, expected [{points}, 2] (theta and phi in degrees), [{points}, 3] \
                 (vectors), or one of them for all points"
            )));
        }
        let numbers: Vec<f64> = given.as_array().iter().copied().collect();
        let vectors = numbers.chunks_exact(columns).enumerate().map(|(row, numbers)| match *numbers {
            [theta, phi] => direction(&format!("{name}, row {row}"), (theta, phi)).map(Direction::vector),
            [x, y, z] => unit(name, row, [x, y, z]),
            _ => Ok([0.0; 3]),
        });
        let vectors: PyResult<Vec<[f64; 3]>> = vectors.collect();
        Ok(Self(vectors?.into_iter().map(|vector| vector.map(|number| number as f32)).collect()))
    }

    /// That of a point.
    pub(crate) fn at(&self, point: usize) -> [f32; 3] {
        self.0[if self.0.len() == 1 { 0 } else { point }]
    }
}

/// A vector at length 1; it may not point below the surface.
fn unit(name: &str, row: usize, vector: [f64; 3]) -> PyResult<[f64; 3]> {
    let length = vector.iter().map(|number| number * number).sum::<f64>().sqrt();
    if !length.is_finite() || length == 0.0 || vector[2] < 0.0 {
        return Err(PyValueError::new_err(format!(
            "{name}, row {row}: got {vector:?}, expected a vector (right, up, out of the \
             surface) that does not point below the surface"
        )));
    }
    Ok(vector.map(|number| number / length))
}

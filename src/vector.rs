//! Vectors of three numbers.

/// A place or a direction in the world.
pub type Vector = [f64; 3];

/// `a + scale b`.
#[inline]
pub(crate) fn along(a: Vector, scale: f64, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] + scale * b[axis])
}

/// `a - b`.
#[inline]
pub(crate) fn minus(a: Vector, b: Vector) -> Vector {
    along(a, -1.0, b)
}

/// Their scalar product.
#[inline]
pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Their vector product.
#[inline]
pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Its length.
#[inline]
pub(crate) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// The same direction of length 1; none of a vector that has none.
#[inline]
pub(crate) fn unit(a: Vector) -> Option<Vector> {
    let length = length(a);
    (length > 0.0 && length.is_finite()).then(|| a.map(|value| value / length))
}

/// Turned by an angle about the vertical axis, counter-clockwise seen from above.
#[inline]
pub(crate) fn turned([x, y, z]: Vector, radians: f64) -> Vector {
    let (sin, cos) = (libm::sin(radians), libm::cos(radians));
    [cos * x + sin * z, y, cos * z - sin * x]
}

//! What a scene is lit by.

use btfkit_formats::Direction;

use crate::vector::{Vector, length, minus, unit};

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is.
    pub place: Place,
    /// Linear red, green and blue: how bright a perfect diffuser is that it lights frontally.
    pub color: [f64; 3],
}

/// Where a light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Far away, in this direction (a unit vector).
    Far(Vector),
    /// At a point. Its light falls with the square of the distance, and its colour is that at the origin.
    At(Vector),
}

impl Light {
    /// A white light far away: theta from the axis to the default camera, phi counter-clockwise from the right.
    pub fn far(direction: Direction) -> Self {
        Self { place: Place::Far(direction.vector()), color: [1.0; 3] }
    }

    /// A white light at a point.
    pub fn at(point: Vector) -> Self {
        Self { place: Place::At(point), color: [1.0; 3] }
    }

    /// The direction from a point to the light, the distance, and the factor on its colour there.
    #[inline]
    pub(super) fn seen_from(&self, point: Vector) -> Option<(Vector, f64, f64)> {
        match self.place {
            Place::Far(direction) => Some((direction, f64::INFINITY, 1.0)),
            Place::At(light) => {
                let way = minus(light, point);
                let (distance, from_origin) = (length(way), length(light));
                Some((unit(way)?, distance, (from_origin / distance).powi(2)))
            }
        }
    }
}

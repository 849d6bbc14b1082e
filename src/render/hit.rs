//! Where a ray meets a surface, and the frame of the texture there.

use super::camera::Ray;
use crate::vector::{Vector, along, cross, dot, unit};

/// Nearer than this, a ray meets what it left.
pub(super) const NEAR: f64 = 1e-7;

/// Directions along the texture, and out of the surface; each of length 1, at right angles. Where the texture is
/// mirrored they are left-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Where columns grow.
    pub right: Vector,
    /// Where rows fall.
    pub up: Vector,
    /// Out of the surface.
    pub out: Vector,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// From the ray's origin.
    pub distance: f64,
    /// In the world.
    pub point: Vector,
    /// Normal of the surface itself, on the side of the ray's origin.
    pub normal: Vector,
    /// Along the texture.
    pub frame: Frame,
    /// Place in the texture, to the right and up; lengths.
    pub place: [f64; 2],
}

impl Frame {
    /// The frame of a normal and the direction in which columns grow; `mirrored` where rows fall the other way.
    pub(super) fn new(out: Vector, right: Vector, mirrored: bool) -> Option<Self> {
        let right = unit(along(right, -dot(right, out), out))?;
        let up = cross(out, right);
        Some(Self { right, up: if mirrored { up.map(|value| -value) } else { up }, out })
    }

    /// A direction of the world in this frame.
    #[inline]
    pub(super) fn local(&self, direction: Vector) -> Vector {
        [dot(direction, self.right), dot(direction, self.up), dot(direction, self.out)]
    }
}

impl Hit {
    /// Turns a surface that is seen from behind towards the ray: what is seen there is the same material.
    pub(super) fn facing(mut self, ray: &Ray) -> Self {
        if dot(self.normal, ray.direction) > 0.0 {
            self.normal = self.normal.map(|value| -value);
        }
        if dot(self.frame.out, self.normal) < 0.0 {
            self.frame.out = self.frame.out.map(|value| -value);
        }
        self
    }
}

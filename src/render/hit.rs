//! Where a ray meets a surface, and the frame of the texture there.

use super::camera::Ray;
use crate::vector::{Vector, along, cross, dot, unit};

/// Hits nearer than this are ignored: the ray has just left that surface.
pub(super) const NEAR: f64 = 1e-7;

/// Three unit vectors at right angles to each other: two along the texture, and one out of the surface. They are
/// right-handed, but left-handed where the texture is mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The direction in which columns increase.
    pub right: Vector,
    /// The direction in which rows decrease: up in the texture.
    pub up: Vector,
    /// Out of the surface.
    pub out: Vector,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance from the ray's origin.
    pub distance: f64,
    /// The point, in world coordinates.
    pub point: Vector,
    /// Geometric normal of the surface, on the side from which the ray comes.
    pub normal: Vector,
    /// The frame of the texture there.
    pub frame: Frame,
    /// Texture coordinates there, to the right and up, in world lengths.
    pub place: [f64; 2],
}

impl Frame {
    /// The frame of a normal and of the direction in which columns increase; `mirrored` if rows decrease the other way.
    pub(super) fn new(out: Vector, right: Vector, mirrored: bool) -> Option<Self> {
        let right = unit(along(right, -dot(right, out), out))?;
        let up = cross(out, right);
        Some(Self { right, up: if mirrored { up.map(|value| -value) } else { up }, out })
    }

    /// A direction, given in world coordinates, in this frame.
    #[inline]
    pub(super) fn local(&self, direction: Vector) -> Vector {
        [dot(direction, self.right), dot(direction, self.up), dot(direction, self.out)]
    }
}

impl Hit {
    /// Turns the frame towards the ray if the surface is seen from behind: both sides show the same material.
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

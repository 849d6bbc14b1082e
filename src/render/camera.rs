//! Where a picture is taken from.

use crate::error::{Error, Result};
use crate::shape::Size;
use crate::vector::{Vector, along, cross, minus, unit};

/// Position, direction and field of view of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Its position.
    pub eye: Vector,
    /// The point in the middle of the picture.
    pub target: Vector,
    /// The direction that points up in the picture.
    pub up: Vector,
    /// Angle that the shorter side of the picture covers, degrees.
    pub fov_deg: f64,
    /// Whether rays are parallel; the shorter side then covers the same length as it would at the target.
    pub orthographic: bool,
}

/// A ray of view.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it begins.
    pub origin: Vector,
    /// Where it leads, of length 1.
    pub direction: Vector,
}

/// A camera for pictures of one size.
pub struct Camera {
    view: View,
    right: Vector,
    up: Vector,
    forward: Vector,
    /// Distance between pixels: at distance 1 from the eye or, if rays are parallel, in world lengths.
    step: f64,
    size: Size,
}

impl Camera {
    /// A camera for pictures of a size.
    ///
    /// # Errors
    /// A view that has no direction, or no upright one.
    pub fn new(view: View, size: Size) -> Result<Self> {
        let forward = unit(minus(view.target, view.eye)).ok_or_else(|| {
            Error::usage("--eye and --target are the same place: there is no direction to look in")
        })?;
        let right = unit(cross(forward, view.up)).ok_or_else(|| {
            Error::usage("--up points along the view")
                .hint("choose another --up, such as 0,0,-1 to look down")
        })?;
        if !(view.fov_deg > 0.0 && view.fov_deg < 180.0) {
            return Err(Error::usage(format!(
                "got a field of view of {} degrees, expected more than 0 and less than 180",
                view.fov_deg
            )));
        }
        let half = libm::tan(view.fov_deg.to_radians() / 2.0);
        let distance =
            if view.orthographic { crate::vector::length(minus(view.target, view.eye)) } else { 1.0 };
        let step = 2.0 * half * distance / size.height.min(size.width) as f64;
        Ok(Self { view, right, up: cross(right, forward), forward, step, size })
    }

    /// The ray through a place of the picture: pixels to the right and down from its top left corner.
    #[inline]
    pub fn ray(&self, [x, y]: [f64; 2]) -> Ray {
        let beside = (x - self.size.width as f64 / 2.0) * self.step;
        let above = (self.size.height as f64 / 2.0 - y) * self.step;
        let place = |from: Vector| along(along(from, beside, self.right), above, self.up);
        if self.view.orthographic {
            return Ray { origin: place(self.view.eye), direction: self.forward };
        }
        let direction = unit(place(self.forward)).unwrap_or(self.forward);
        Ray { origin: self.view.eye, direction }
    }
}

//! Objects that a material is shown on, and where rays meet them.

use super::camera::Ray;
use super::hit::{Frame, Hit, NEAR};
use super::mesh::Mesh;
use crate::vector::{Vector, along, dot, unit};

/// Half the height of the cylinder; it fits into the sphere of radius 1.
const CYLINDER_HEIGHT: f64 = 0.8;

/// Radius of the cylinder.
const CYLINDER_RADIUS: f64 = 0.6;

/// An object.
pub enum Surface {
    /// All of the plane z = 0.
    Endless,
    /// A square of side 2 in the plane z = 0.
    Plane,
    /// The sphere of radius 1. The texture runs along its equator, and is narrower towards its poles.
    Sphere,
    /// An upright cylinder with lids.
    Cylinder,
    /// Triangles.
    Mesh(Mesh),
}

impl Surface {
    /// Where a ray meets it first.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        let hit = match self {
            Self::Endless => level(ray, 0.0, |_| true),
            Self::Plane => level(ray, 0.0, |point| point[0].abs().max(point[1].abs()) <= 1.0),
            Self::Sphere => sphere(ray),
            Self::Cylinder => cylinder(ray),
            Self::Mesh(mesh) => mesh.hit(ray),
        };
        hit.map(|hit| hit.facing(ray))
    }

    /// Whether something of it lies on a ray nearer than this.
    pub fn blocks(&self, ray: &Ray, distance: f64) -> bool {
        match self {
            Self::Endless | Self::Plane => false,
            Self::Mesh(mesh) => mesh.blocks(ray, distance),
            // No light that a convex surface faces is hidden by it.
            Self::Sphere | Self::Cylinder => false,
        }
    }
}

impl Surface {
    /// Whether a place is known to lie within it, or on it, where no light shines out of. Of triangles it is not known.
    pub fn holds(&self, place: Vector) -> bool {
        let [x, y, z] = place;
        match self {
            Self::Endless => z == 0.0,
            Self::Plane => z == 0.0 && x.abs().max(y.abs()) <= 1.0,
            Self::Sphere => dot(place, place) <= 1.0,
            Self::Cylinder => {
                x * x + z * z <= CYLINDER_RADIUS * CYLINDER_RADIUS && y.abs() <= CYLINDER_HEIGHT
            }
            Self::Mesh(_) => false,
        }
    }
}

/// Where a ray meets a level plane at a z.
fn level(ray: &Ray, z: f64, within: impl Fn(Vector) -> bool) -> Option<Hit> {
    let distance = (z - ray.origin[2]) / ray.direction[2];
    let point = along(ray.origin, distance, ray.direction);
    if !(distance > NEAR && distance.is_finite() && within(point)) {
        return None;
    }
    let frame = Frame { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], out: [0.0, 0.0, 1.0] };
    Some(Hit { distance, point, normal: frame.out, frame, place: [point[0], point[1]] })
}

/// The two distances at which a ray passes through a circle or a sphere; `a` t^2 + 2 `b` t + `c` = 0.
fn passages(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let root = b * b - a * c;
    (root >= 0.0 && a > 0.0).then(|| [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a])
}

fn sphere(ray: &Ray) -> Option<Hit> {
    let c = dot(ray.origin, ray.origin) - 1.0;
    let passages = passages(1.0, dot(ray.origin, ray.direction), c)?;
    let distance = passages.into_iter().find(|&distance| distance > NEAR)?;
    let point = along(ray.origin, distance, ray.direction);
    let out = unit(point)?;
    // At the poles any direction is along the equator.
    let right = unit([out[2], 0.0, -out[0]]).unwrap_or([1.0, 0.0, 0.0]);
    let place = [libm::atan2(out[0], out[2]), libm::asin(out[1].clamp(-1.0, 1.0))];
    Some(Hit { distance, point, normal: out, frame: Frame::new(out, right, false)?, place })
}

fn cylinder(ray: &Ray) -> Option<Hit> {
    let [x, _, z] = ray.origin;
    let [dx, dy, dz] = ray.direction;
    let side =
        passages(dx * dx + dz * dz, x * dx + z * dz, x * x + z * z - CYLINDER_RADIUS * CYLINDER_RADIUS);
    let side = side.into_iter().flatten().filter_map(|distance| {
        let point = along(ray.origin, distance, ray.direction);
        if distance <= NEAR || point[1].abs() > CYLINDER_HEIGHT {
            return None;
        }
        let out = unit([point[0], 0.0, point[2]])?;
        let place = [CYLINDER_RADIUS * libm::atan2(out[0], out[2]), point[1]];
        let frame = Frame::new(out, [out[2], 0.0, -out[0]], false)?;
        Some(Hit { distance, point, normal: out, frame, place })
    });
    let lid = |y: f64| {
        let distance = (y - ray.origin[1]) / dy;
        let point = along(ray.origin, distance, ray.direction);
        let within = point[0] * point[0] + point[2] * point[2] <= CYLINDER_RADIUS * CYLINDER_RADIUS;
        if !(distance > NEAR && distance.is_finite() && within) {
            return None;
        }
        let out = [0.0, y.signum(), 0.0];
        let frame = Frame::new(out, [1.0, 0.0, 0.0], false)?;
        Some(Hit { distance, point, normal: out, frame, place: [point[0], -y.signum() * point[2]] })
    };
    let lids = [CYLINDER_HEIGHT, -CYLINDER_HEIGHT].into_iter().filter_map(lid);
    side.chain(lids).min_by(|a, b| a.distance.total_cmp(&b.distance))
}

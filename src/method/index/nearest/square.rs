//! Which normals can be among the nearest of any query in a square of (x, y): a small superset of them.
//!
//! Queries are unit vectors with z > 0, so the square stands for a patch of the sphere. Over the square z is a
//! concave function of (x, y): it lies above what its values at the corners span and below the plane that touches it
//! in the middle. So the patch lies in the hull of eight *vertices*, two over each corner. A distance to a point is
//! a convex function, greatest over the hull at a vertex; and whether a query is nearer to one point than to another
//! is a linear one (the bisecting plane), true in the hull when it is true at each vertex.

use super::tree::nearest_of_box;
use crate::kernel::Kernel;
use crate::kernel::compiled_for_each_kernel;

/// How far queries may lie off the patch in x, y and z.
pub(super) const SLACK: f32 = 1.0 / (1 << 18) as f32;

/// Relative surplus that covers the rounding of distances in f32, five times 2^-24 on each side.
const SURPLUS: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// Least 1 - x^2 - y^2 of a corner: where the sphere is steeper, patches are not bounded well.
const LEAST_Z_SQUARED: f64 = 1.0 / 64.0;

const VERTICES: usize = 8;

/// Most points that others are compared with, and how many at a time.
pub(super) const RIVALS: usize = 96;
pub(super) const STEP: usize = 32;

/// A point and its number.
pub(super) type Point = ([f32; 3], u32);

/// A square of (x, y): by halvings of the one around the unit circle, and by column and row among its like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    pub level: u32,
    pub column: u32,
    pub row: u32,
}

impl Square {
    /// The one around the unit circle.
    pub(super) const WHOLE: Self = Self { level: 0, column: 0, row: 0 };

    /// The parts at the lower left, lower right, upper left and upper right, by x and y.
    pub(super) fn quarters(self) -> [Self; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, up)| Self {
            level: self.level + 1,
            column: 2 * self.column + right,
            row: 2 * self.row + up,
        })
    }

    fn side(self) -> f64 {
        2.0 / f64::from(1 << self.level)
    }

    /// Least x and y.
    fn corner(self) -> [f64; 2] {
        [self.column, self.row].map(|place| f64::from(place) * self.side() - 1.0)
    }

    /// Whether no unit vector with z >= 0 lies over the square.
    pub(super) fn is_outside(self) -> bool {
        let slack = f64::from(SLACK);
        let nearest = self.corner().map(|from| 0.0f64.clamp(from - slack, from + self.side() + slack));
        nearest[0] * nearest[0] + nearest[1] * nearest[1] > 1.0
    }

    /// The patch over the square, unless a corner is too near the rim of the sphere.
    pub(super) fn patch(self) -> Option<Patch> {
        let middle = self.corner().map(|from| from + self.side() / 2.0);
        let height = (1.0 - middle[0] * middle[0] - middle[1] * middle[1]).sqrt();
        let half = self.side() / 2.0 + f64::from(SLACK);
        let mut vertices = [[0.0; 3]; VERTICES];
        let corners = [(-half, -half), (half, -half), (-half, half), (half, half)];
        for (corner, (dx, dy)) in corners.into_iter().enumerate() {
            let (x, y) = (middle[0] + dx, middle[1] + dy);
            let z_squared = 1.0 - x * x - y * y;
            if z_squared < LEAST_Z_SQUARED {
                return None;
            }
            let low = z_squared.sqrt() - f64::from(SLACK);
            let high = height - (middle[0] * dx + middle[1] * dy) / height + f64::from(SLACK);
            vertices[2 * corner] = [x, y, low].map(|v| v as f32);
            vertices[2 * corner + 1] = [x, y, high].map(|v| v as f32);
        }
        let middle = [middle[0], middle[1], height].map(|v| v as f32);
        let radius =
            vertices.iter().map(|&vertex| squared_distance(vertex, middle)).fold(0.0, f32::max).sqrt();
        Some(Patch { middle, radius, vertices })
    }
}

/// What queries over a square can be.
pub(super) struct Patch {
    pub middle: [f32; 3],
    /// Greatest distance of a query from the middle.
    pub radius: f32,
    vertices: [[f32; 3]; VERTICES],
}

impl Patch {
    /// Points to compare others with: those near the middle rule out most, the first of them the most. What exceeds
    /// [`RIVALS`] is not looked at.
    pub(super) fn rivals(&self, nearest: impl Iterator<Item = [f32; 3]>) -> Rivals {
        let mut distances = [[[f32::INFINITY; STEP]; VERTICES]; RIVALS / STEP];
        for (place, rival) in nearest.take(RIVALS).enumerate() {
            for (distances, &vertex) in distances[place / STEP].iter_mut().zip(&self.vertices) {
                distances[place % STEP] = SURPLUS * squared_distance(vertex, rival);
            }
        }
        Rivals { vertices: self.vertices, distances }
    }
}

/// Points that may precede others for every query of a patch.
pub(super) struct Rivals {
    vertices: [[f32; 3]; VERTICES],
    /// Squared distances from the vertices, rounded up.
    distances: [[[f32; STEP]; VERTICES]; RIVALS / STEP],
}

impl Rivals {
    /// Whether at least `count` of them precede all points of a box, for every query.
    #[inline]
    pub(super) fn precede(&self, kernel: Kernel, low: [f32; 3], high: [f32; 3], count: usize) -> bool {
        let own = self.vertices.map(|vertex| squared_distance(vertex, nearest_of_box(vertex, low, high)));
        precede(kernel, &self.distances, &own, count as u32)
    }
}

/// Squared distance in f32.
#[inline]
fn squared_distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    x * x + y * y + z * z
}

compiled_for_each_kernel! {
    /// Whether at least `count` of the rivals are nearer to every vertex than it is to its `own`.
    fn precede(distances: &[[[f32; STEP]; VERTICES]], own: &[f32; VERTICES], count: u32) -> bool = precede_body
}

#[inline(always)]
fn precede_body(distances: &[[[f32; STEP]; VERTICES]], own: &[f32; VERTICES], count: u32) -> bool {
    let mut found = 0;
    for distances in distances {
        let mut surplus = [f32::NEG_INFINITY; STEP];
        for (distances, own) in distances.iter().zip(own) {
            for (surplus, distance) in surplus.iter_mut().zip(distances) {
                let here = distance - own;
                *surplus = if here > *surplus { here } else { *surplus };
            }
        }
        found += surplus.iter().map(|&surplus| surplus.to_bits() >> 31).sum::<u32>(); // counts minus signs
        if found >= count {
            return true;
        }
    }
    false
}

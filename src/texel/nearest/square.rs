//! Which normals can be among the nearest of any query in a square of (x, y): a small superset of them.
//!
//! Queries are unit vectors with z > 0, so the square stands for a patch of the sphere. Over the square z is a
//! concave function of (x, y): it lies above what its values at the corners span and below the plane that touches it
//! in the middle. So the patch lies in the hull of eight *vertices*, two over each corner. A distance to a point is
//! a convex function, greatest over the hull at a vertex; and whether a query is nearer to one point than to another
//! is a linear one (the bisecting plane), true in the hull when it is true at each vertex.

use super::tree::{Neighbour, Tree, squared_distance};
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
const OTHERS: usize = 96;
const STEP: usize = 32;

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
            vertices.iter().map(|&vertex| squared_distance(vertex, middle).sqrt()).fold(0.0, f64::max);
        Some(Patch { middle, radius, vertices })
    }
}

/// What queries over a square can be.
pub(super) struct Patch {
    middle: [f32; 3],
    /// Greatest distance of a query from the middle.
    pub radius: f64,
    vertices: [[f32; 3]; VERTICES],
}

impl Patch {
    /// Squared distance from the middle within which the `count` nearest of all queries lie, when the last of those
    /// of the middle is this far: a query lies at most a radius off, so it has as many neighbours no farther than
    /// that and a radius, and those lie no farther from the middle than a radius more.
    fn reach(&self, squared: f64) -> f64 {
        (squared.sqrt() + 2.0 * self.radius).powi(2) * f64::from(SURPLUS)
    }

    /// All normals that a query can have among its `count` nearest, and some more, with the distance of the last
    /// neighbour of the middle; none if there are not enough.
    pub(super) fn of_tree(&self, tree: &Tree, count: usize) -> Option<(Vec<Point>, f64)> {
        let mut nearest = vec![Neighbour::NONE; count];
        tree.find(self.middle, &mut nearest);
        let last = nearest.last()?.distance;
        let mut points = Vec::new();
        tree.within(self.middle, self.reach(last), &mut points);
        last.is_finite().then_some((points, last.sqrt()))
    }

    /// The same of points among which they are known to be; there must be as many as are wanted.
    pub(super) fn of_points(&self, points: &[Point], count: usize) -> Option<(Vec<Point>, f64)> {
        let distances: Vec<f64> = points.iter().map(|&(at, _)| squared_distance(at, self.middle)).collect();
        let mut sorted = distances.clone();
        let last = *sorted.select_nth_unstable_by(count - 1, f64::total_cmp).1;
        let reach = self.reach(last);
        let near = points.iter().zip(distances).filter(|(_, distance)| *distance <= reach);
        Some((near.map(|(&point, _)| point).collect(), last.sqrt()))
    }

    /// Drops points that at least `count` others precede for every query. Only those nearest to the middle are looked
    /// at for others.
    pub(super) fn drop_preceded(&self, points: &mut Vec<Point>, count: usize, kernel: Kernel) {
        let mut others: Vec<Point> = points.clone();
        let distance = |&(at, _): &Point| squared_distance(at, self.middle);
        for nearest in [OTHERS, STEP] {
            if others.len() > nearest {
                others.select_nth_unstable_by(nearest, |a, b| distance(a).total_cmp(&distance(b)));
                others.truncate(OTHERS);
            }
        }
        let mut distances = [[[f32::INFINITY; STEP]; VERTICES]; OTHERS / STEP];
        for (distances, others) in distances.iter_mut().zip(others.chunks(STEP)) {
            for (distances, &vertex) in distances.iter_mut().zip(&self.vertices) {
                for (distance, &(at, _)) in distances.iter_mut().zip(others) {
                    *distance = SURPLUS * short_distance(vertex, at);
                }
            }
        }
        keep_unpreceded(kernel, &self.vertices, &distances, count as u32, points);
    }
}

/// Squared distance in f32.
#[inline]
fn short_distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    x * x + y * y + z * z
}

compiled_for_each_kernel! {
    /// Keeps the points for which fewer than `count` of the others are nearer to every vertex.
    fn keep_unpreceded(
        vertices: &[[f32; 3]; VERTICES],
        distances: &[[[f32; STEP]; VERTICES]],
        count: u32,
        points: &mut Vec<Point>,
    ) = keep_unpreceded_body
}

#[inline(always)]
fn keep_unpreceded_body(
    vertices: &[[f32; 3]; VERTICES],
    distances: &[[[f32; STEP]; VERTICES]],
    count: u32,
    points: &mut Vec<Point>,
) {
    let mut kept = 0;
    // Loops, since closures handed to a library would be compiled for the target alone.
    for place in 0..points.len() {
        let (at, _) = points[place];
        let own = vertices.map(|vertex| short_distance(vertex, at));
        let mut found = 0;
        for distances in distances {
            let mut precedes = [1; STEP];
            for (distances, own) in distances.iter().zip(own) {
                for (precedes, &distance) in precedes.iter_mut().zip(distances) {
                    *precedes &= u32::from(distance < own);
                }
            }
            found += precedes.iter().sum::<u32>();
            if found >= count {
                break;
            }
        }
        if found < count {
            points[kept] = points[place];
            kept += 1;
        }
    }
    points.truncate(kept);
}

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

/// A point and its number.
pub(super) type Point = ([f32; 3], u32);

/// A square of (x, y).
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    pub x: f32,
    pub y: f32,
    pub side: f32,
}

impl Square {
    pub(super) fn quarters(self) -> [Self; 4] {
        let side = self.side / 2.0;
        [(0.0, 0.0), (side, 0.0), (0.0, side), (side, side)].map(|(x, y)| Self {
            x: self.x + x,
            y: self.y + y,
            side,
        })
    }

    /// Whether no unit vector with z >= 0 lies over the square.
    pub(super) fn is_outside(self) -> bool {
        let nearest = |from: f32| f64::from(0.0f32.clamp(from - SLACK, from + self.side + SLACK));
        nearest(self.x).powi(2) + nearest(self.y).powi(2) > 1.0
    }

    /// The patch over the square, unless a corner is too near the rim of the sphere.
    pub(super) fn patch(self) -> Option<Patch> {
        let middle = [self.x, self.y].map(|from| f64::from(from) + f64::from(self.side) / 2.0);
        let height = (1.0 - middle[0] * middle[0] - middle[1] * middle[1]).sqrt();
        let half = f64::from(self.side) / 2.0 + f64::from(SLACK);
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

    /// All normals that a query can have among its `count` nearest, and some more, by number, with the distance of
    /// the last neighbour of the middle; none if there are not enough.
    pub(super) fn of_tree(&self, tree: &Tree, count: usize) -> Option<(Vec<Point>, f64)> {
        let mut nearest = vec![Neighbour::NONE; count];
        tree.find(self.middle, &mut nearest);
        let last = nearest.last()?.distance;
        let mut points = Vec::new();
        tree.within(self.middle, self.reach(last), &mut points);
        points.sort_unstable_by_key(|&(_, number)| number);
        last.is_finite().then_some((points, last.sqrt()))
    }

    /// The same of points, in the order of their numbers, among which they are known to be.
    pub(super) fn of_points(&self, points: &[Point], count: usize) -> Option<(Vec<Point>, f64)> {
        let distances: Vec<f64> = points.iter().map(|&(at, _)| squared_distance(at, self.middle)).collect();
        let mut sorted = distances.clone();
        let last = *sorted.select_nth_unstable_by(count - 1, f64::total_cmp).1;
        let reach = self.reach(last);
        let near = points.iter().zip(distances).filter(|(_, distance)| *distance <= reach);
        Some((near.map(|(&point, _)| point).collect(), last.sqrt()))
    }

    /// Leaves out points that at least `count` others precede for every query.
    pub(super) fn without_preceded(&self, points: &mut Vec<Point>, count: usize, kernel: Kernel) {
        let distances: Vec<Vec<f32>> = self
            .vertices
            .iter()
            .map(|vertex| {
                let to = |&(at, _): &Point| {
                    let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - vertex[axis]);
                    x * x + y * y + z * z
                };
                points.iter().map(to).collect()
            })
            .collect();
        let mut place = 0;
        points.retain(|_| {
            let own: [f32; VERTICES] = std::array::from_fn(|vertex| distances[vertex][place] / SURPLUS);
            place += 1;
            let all: [&[f32]; VERTICES] = std::array::from_fn(|vertex| &distances[vertex][..]);
            (count_preceding(kernel, &all, &own) as usize) < count
        });
    }
}

compiled_for_each_kernel! {
    /// How many points are nearer than `own` to every vertex; `distances` are those of each vertex to all points.
    fn count_preceding(distances: &[&[f32]; VERTICES], own: &[f32; VERTICES]) -> u32 = count_preceding_body
}

#[inline(always)]
fn count_preceding_body(distances: &[&[f32]; VERTICES], own: &[f32; VERTICES]) -> u32 {
    let count = distances[0].len();
    let distances = distances.map(|distances| &distances[..count]);
    let nearer =
        |point: usize| (0..VERTICES).fold(true, |all, vertex| all & (distances[vertex][point] < own[vertex]));
    (0..count).map(|point| u32::from(nearer(point))).sum()
}

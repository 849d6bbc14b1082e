//! Prediction from directions nearby: whatever is smooth in angle is nearly linear across a few neighbours.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::statistics::{deviation, median};
use btfkit_formats::Direction;

/// Neighbours that a prediction rests on.
const NEIGHBOURS: usize = 8;

/// Weight of the wish for small slopes: keeps predictions at the border of the hemisphere tame.
const RIDGE: f64 = 0.02;

/// Images of like geometry that an image is compared with.
const ALIKE: usize = 16;

/// Angle between two directions, radians.
pub(super) fn angle(a: Direction, b: Direction) -> f64 {
    let (a, b) = (Vector3::from(a.vector()), Vector3::from(b.vector()));
    a.cross(&b).norm().atan2(a.dot(&b))
}

/// For each direction of a list, which others predict it and by which weights.
pub(super) struct Neighbourhood {
    weights: Vec<Vec<(usize, f64)>>,
    /// Median angle from a direction to its neighbours, radians.
    pub(super) spacing_rad: f64,
}

impl Neighbourhood {
    /// Weights of a locally linear fit, by the angle, over the nearest directions.
    pub(super) fn new(directions: &[Direction]) -> Self {
        let mut spacings = Vec::with_capacity(directions.len());
        let weights = (0..directions.len())
            .map(|of| {
                let mut near = nearest(directions, directions[of], NEIGHBOURS + 1);
                near.retain(|&(other, _)| other != of);
                near.truncate(NEIGHBOURS);
                spacings.push(median(near.iter().map(|&(_, angle)| angle)));
                local_fit(directions, directions[of], &near)
            })
            .collect();
        Self { weights, spacing_rad: median(spacings) }
    }

    /// The nearest directions of one, nearest first.
    pub(super) fn of(&self, direction: usize) -> impl Iterator<Item = usize> + '_ {
        self.weights[direction].iter().map(|&(other, _)| other)
    }

    /// The neighbours that predict a direction and their weights.
    pub(super) fn weighted(&self, direction: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.weights[direction].iter().copied()
    }

    /// What the neighbours of a direction promise.
    pub(super) fn predict(&self, direction: usize, value: impl Fn(usize) -> f64) -> f64 {
        self.weights[direction].iter().map(|&(other, weight)| weight * value(other)).sum()
    }
}

/// Weights by which values at the directions of a list give the value at any direction: that of the list's own if one
/// is nearer than `same_rad`, else a locally linear fit. None where the list has nothing within `reach_rad`.
pub(super) fn interpolation(
    directions: &[Direction],
    at: Direction,
    same_rad: f64,
    reach_rad: f64,
) -> Option<Vec<(usize, f64)>> {
    let near = nearest(directions, at, NEIGHBOURS);
    let &(first, angle) = near.first()?;
    match angle {
        _ if angle < same_rad => Some(vec![(first, 1.0)]),
        _ if angle < reach_rad => Some(local_fit(directions, at, &near)),
        _ => None,
    }
}

/// The directions nearest to one and their angles, nearest first.
fn nearest(directions: &[Direction], to: Direction, count: usize) -> Vec<(usize, f64)> {
    let mut all: Vec<(usize, f64)> =
        directions.iter().enumerate().map(|(number, &other)| (number, angle(to, other))).collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    all.truncate(count);
    all
}

fn local_fit(directions: &[Direction], at: Direction, near: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let spacing = median(near.iter().map(|&(_, angle)| angle));
    let centre = Vector3::from(at.vector());
    let (sin_phi, cos_phi) = at.phi_rad.sin_cos();
    let tangent = Vector3::new(-sin_phi, cos_phi, 0.0);
    let bitangent = centre.cross(&tangent);
    let rows: Vec<(Vector3<f64>, f64)> = near
        .iter()
        .map(|&(other, angle)| {
            let other = Vector3::from(directions[other].vector());
            let weight = (-(angle / spacing.max(1e-6)).powi(2)).exp();
            (Vector3::new(1.0, other.dot(&tangent), other.dot(&bitangent)), weight)
        })
        .collect();
    let total: f64 = rows.iter().map(|(_, weight)| weight).sum();
    let ridge = RIDGE * spacing * spacing * total;
    let moment: Matrix3<f64> =
        rows.iter().map(|(row, weight)| row * row.transpose() * *weight).sum::<Matrix3<f64>>()
            + Matrix3::from_diagonal(&Vector3::new(0.0, ridge, ridge));
    // Coinciding directions leave no slope to fit: their mean is the prediction.
    let first = moment.try_inverse().map(|inverse| inverse.row(0).transpose());
    near.iter()
        .zip(&rows)
        .map(|(&(other, _), (row, weight))| {
            (other, weight * first.map_or(1.0 / total.max(1e-300), |first| first.dot(row)))
        })
        .collect()
}

/// For each image of views x lights, others of like geometry: near in both elevations and in the azimuth between
/// light and view. On a material without a grain they look alike on the whole; a highlight of one is a highlight
/// of all.
pub(super) struct Alike {
    groups: Vec<Vec<u32>>,
}

impl Alike {
    /// Finds them.
    pub(super) fn new(views: &[Direction], lights: &[Direction]) -> Self {
        let places: Vec<[f64; 4]> =
            views.iter().flat_map(|view| lights.iter().map(move |light| place(*view, *light))).collect();
        // Sorted by one coordinate, candidates are those within reach of it.
        let mut order: Vec<u32> = (0..places.len() as u32).collect();
        let key = |at: u32| places[at as usize][0];
        order.sort_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let mut groups = vec![Vec::new(); places.len()];
        for (rank, &of) in order.iter().enumerate() {
            groups[of as usize] = nearest_places(&places, &order, rank);
        }
        Self { groups }
    }

    /// How far values differ from the median of their like, and the deviation among those.
    pub(super) fn contrast(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let of = |(value, group): (&f64, &Vec<u32>)| {
            let others: Vec<f64> = group.iter().map(|&other| values[other as usize]).collect();
            (value - median(others.iter().copied()), deviation(&others))
        };
        values.iter().zip(&self.groups).map(of).collect()
    }
}

/// Geometry of a pair of directions as a place whose distances are about angles.
fn place(view: Direction, light: Direction) -> [f64; 4] {
    let between = (light.phi_rad - view.phi_rad).rem_euclid(2.0 * PI);
    let reach = (view.theta_rad.sin() * light.theta_rad.sin()).max(0.0).sqrt();
    [view.theta_rad, light.theta_rad, reach * between.cos(), reach * between.sin().abs()]
}

fn nearest_places(places: &[[f64; 4]], order: &[u32], rank: usize) -> Vec<u32> {
    let here = places[order[rank] as usize];
    let mut found: Vec<(f64, u32)> = Vec::with_capacity(ALIKE + 1);
    let mut consider = |at: u32| {
        let there = places[at as usize];
        let distance: f64 = here.iter().zip(there).map(|(a, b)| (a - b).powi(2)).sum();
        let full = found.len() == ALIKE;
        if !full || distance < found[ALIKE - 1].0 {
            let to = found.partition_point(|&(other, number)| (other, number) < (distance, at));
            found.insert(to, (distance, at));
            found.truncate(ALIKE);
        }
        // Whoever lies farther along the order lies at least this far away.
        found.len() < ALIKE || (here[0] - there[0]).powi(2) <= found[ALIKE - 1].0
    };
    for &at in &order[rank + 1..] {
        if !consider(at) {
            break;
        }
    }
    for &at in order[..rank].iter().rev() {
        if !consider(at) {
            break;
        }
    }
    found.into_iter().map(|(_, at)| at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rings() -> Vec<Direction> {
        let mut directions = vec![Direction::from_degrees(0.0, 0.0)];
        for (theta, count) in [(20.0, 6), (40.0, 12), (60.0, 18)] {
            directions.extend(
                (0..count).map(|k| Direction::from_degrees(theta, 360.0 * f64::from(k) / f64::from(count))),
            );
        }
        directions
    }

    #[test]
    fn what_is_smooth_is_predicted_and_what_jumps_is_not() {
        let directions = rings();
        let near = Neighbourhood::new(&directions);
        let smooth = |at: usize| {
            let [x, y, z] = directions[at].vector();
            0.3 * x - 0.2 * y + 0.1 * z
        };
        let jumped = |at: usize| smooth(at) + if at == 9 { 0.4 } else { 0.0 };
        for at in 0..directions.len() {
            assert!((near.predict(at, smooth) - smooth(at)).abs() < 0.06, "{at}");
        }
        let residual = |at: usize| jumped(at) - near.predict(at, jumped);
        assert!(residual(9) > 0.35);
        assert!((0..directions.len()).filter(|&at| at != 9).all(|at| residual(at).abs() < 0.2));
    }

    #[test]
    fn images_alike_have_the_same_elevations_and_azimuth_between() {
        let directions = rings();
        let alike = Alike::new(&directions, &directions);
        let n = directions.len();
        // View 19 is the first of the outer ring of 18, light 28 is opposite: 17 others of the ring have such a light.
        let group = &alike.groups[19 * n + 28];
        assert_eq!(group.len(), ALIKE);
        for &at in group {
            let (view, light) = (at as usize / n, at as usize % n);
            assert_eq!(
                (view >= 19, (light as i64 - view as i64).rem_euclid(18)),
                (true, 9),
                "{view} {light}"
            );
        }
    }
}

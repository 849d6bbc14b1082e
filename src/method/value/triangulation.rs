//! Spherical Delaunay triangles of measured directions, and barycentric mixes within them.

use delaunator::{Point, triangulate as planar_delaunay};

use btfkit_formats::Direction;

use crate::vector::{cross, dot};

/// Two directions closer than this (chord length) are the same.
const SAME_DIRECTION: f64 = 1e-7;

/// Barycentric weights below this are rounding.
const NEGLIGIBLE_WEIGHT: f64 = 1e-9;

/// Spherical Delaunay triangles of directions above the plane: numbers of three directions each.
///
/// Stereographic projection from the nadir maps circles to circles, so the planar Delaunay
/// triangulation of the projections is the spherical one. Fewer than three directions, or
/// directions on one arc, have none.
pub fn triangulate(directions: &[Direction]) -> Vec<[u16; 3]> {
    let points: Vec<Point> = directions
        .iter()
        .map(|direction| {
            let [x, y, z] = direction.vector();
            Point { x: x / (1.0 + z), y: y / (1.0 + z) }
        })
        .collect();
    let corners = planar_delaunay(&points).triangles;
    corners.chunks_exact(3).map(|c| [c[0] as u16, c[1] as u16, c[2] as u16]).collect()
}

/// A weighted sum of measured directions that stands for another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mix {
    /// Numbers of directions and their weights, which are positive and sum to 1.
    pub terms: Vec<(usize, f64)>,
    /// cos(theta) / cos(theta of the mix) where the direction lies beyond the outer ring, else 1.
    /// A light's values are to be scaled by it.
    pub cosine_ratio: f64,
}

/// Finds the [`Mix`] of any direction.
pub(crate) struct Interpolator {
    vectors: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
    border: Vec<[usize; 2]>,
}

impl Interpolator {
    /// For directions and their triangles (as stored with a model).
    pub(crate) fn new(directions: &[Direction], triangles: &[[u16; 3]]) -> Self {
        let vectors: Vec<_> = directions.iter().map(|direction| direction.vector()).collect();
        let triangles: Vec<[usize; 3]> = triangles
            .iter()
            .map(|corners| corners.map(usize::from))
            .filter(|corners| corners.iter().all(|&corner| corner < vectors.len()))
            .collect();
        let border = border_edges(&triangles);
        Self { vectors, triangles, border }
    }

    /// The mix that stands for `direction`: barycentric within a triangle, at the border for its
    /// azimuth beyond the outer ring, else (no triangles, or none on that side) the nearest direction.
    pub(crate) fn mix(&self, direction: Direction) -> Mix {
        self.mix_of(direction.vector())
    }

    /// The same of a unit vector.
    pub(super) fn mix_of(&self, target: [f64; 3]) -> Mix {
        let nearest = self.nearest(target);
        let exact = |number| Mix { terms: vec![(number, 1.0)], cosine_ratio: 1.0 };
        let offset: [f64; 3] = std::array::from_fn(|axis| self.vectors[nearest][axis] - target[axis]);
        if dot(offset, offset).sqrt() < SAME_DIRECTION {
            return exact(nearest);
        }
        let within = self
            .triangles
            .iter()
            .filter_map(|corners| Some((corners, self.barycentric(*corners, target)?)))
            .max_by(|(_, a), (_, b)| least(a).total_cmp(&least(b)));
        match within {
            Some((corners, weights)) if least(&weights) > -NEGLIGIBLE_WEIGHT => {
                Mix { terms: shares(corners.iter().copied().zip(weights)), cosine_ratio: 1.0 }
            }
            _ => self.at_border(target).unwrap_or_else(|| Mix {
                terms: vec![(nearest, 1.0)],
                cosine_ratio: (target[2] / self.vectors[nearest][2].max(1e-9)).clamp(0.0, 1.0),
            }),
        }
    }

    /// The direction that is shown instead of one that lies outside of all triangles; none where that one is mixed of
    /// what was measured around it.
    pub(crate) fn shown_instead(&self, direction: Direction) -> Option<Direction> {
        /// Nearer than this, cosine of half a degree, it is the same for the eye.
        const NEAR: f64 = 0.999_962;
        let mut shown = [0.0; 3];
        for (number, weight) in self.mix(direction).terms {
            shown = std::array::from_fn(|axis| shown[axis] + weight * self.vectors[number][axis]);
        }
        let cosine = dot(shown, direction.vector()) / dot(shown, shown).sqrt();
        if cosine > NEAR { None } else { Direction::from_vector(shown) }
    }

    fn nearest(&self, target: [f64; 3]) -> usize {
        let mut best = 0;
        for number in 1..self.vectors.len() {
            if dot(self.vectors[number], target) > dot(self.vectors[best], target) {
                best = number;
            }
        }
        best
    }

    /// Weights w with w0 a + w1 b + w2 c = target, or none where the corners lie in one plane.
    pub(super) fn barycentric(&self, [a, b, c]: [usize; 3], target: [f64; 3]) -> Option<[f64; 3]> {
        let [a, b, c] = [self.vectors[a], self.vectors[b], self.vectors[c]];
        let volume = dot(a, cross(b, c));
        (volume.abs() > 1e-12).then(|| {
            [
                dot(target, cross(b, c)) / volume,
                dot(target, cross(c, a)) / volume,
                dot(target, cross(a, b)) / volume,
            ]
        })
    }

    /// Mix of the two ends of the border edge that the meridian of `target` crosses: its elevation is clamped.
    fn at_border(&self, target: [f64; 3]) -> Option<Mix> {
        let (terms, cosine_ratio) = self.crossing(target, self.border.iter().copied())?;
        Some(Mix { terms: shares(terms), cosine_ratio })
    }

    /// Where the meridian of `target` crosses some border edges: the two ends of the one that it crosses nearest to the
    /// target with their weights, and the cosine ratio of a [`Mix`].
    #[inline]
    pub(super) fn crossing(
        &self,
        target: [f64; 3],
        edges: impl Iterator<Item = [usize; 2]>,
    ) -> Option<([(usize, f64); 2], f64)> {
        let across_meridian = [-target[1], target[0], 0.0];
        let crossing = |[i, j]: [usize; 2]| {
            let (at_i, at_j) = (dot(across_meridian, self.vectors[i]), dot(across_meridian, self.vectors[j]));
            if at_i * at_j > 0.0 || at_i == at_j {
                return None;
            }
            let (wi, wj) = (at_j.abs() / (at_i.abs() + at_j.abs()), at_i.abs() / (at_i.abs() + at_j.abs()));
            let point: [f64; 3] =
                std::array::from_fn(|axis| wi * self.vectors[i][axis] + wj * self.vectors[j][axis]);
            let ahead = point[0] * target[0] + point[1] * target[1] > 0.0;
            ahead.then(|| (dot(point, target) / dot(point, point).sqrt(), point, [(i, wi), (j, wj)]))
        };
        let (_, point, terms) = edges.filter_map(crossing).max_by(|a, b| a.0.total_cmp(&b.0))?;
        let cosine = point[2] / dot(point, point).sqrt();
        Some((terms, (target[2] / cosine).clamp(0.0, 1.0)))
    }

    /// The directions as unit vectors.
    pub(super) fn vectors(&self) -> &[[f64; 3]] {
        &self.vectors
    }

    /// Triangles of directions, without those whose corners lie in one plane with the centre.
    pub(super) fn facets(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let solid = |corners: &[usize; 3]| self.barycentric(*corners, [0.0, 0.0, 1.0]).is_some();
        self.triangles.iter().copied().filter(solid)
    }

    /// Edges that belong to one triangle only.
    pub(super) fn border(&self) -> &[[usize; 2]] {
        &self.border
    }
}

/// Weights that sum to 1; what rounding left of a corner that does not count is dropped.
fn shares(weights: impl IntoIterator<Item = (usize, f64)>) -> Vec<(usize, f64)> {
    let mut terms: Vec<(usize, f64)> =
        weights.into_iter().filter(|(_, weight)| *weight > NEGLIGIBLE_WEIGHT).collect();
    let sum: f64 = terms.iter().map(|(_, weight)| weight).sum();
    terms.iter_mut().for_each(|(_, weight)| *weight /= sum);
    terms
}

/// Edges that belong to one triangle only.
fn border_edges(triangles: &[[usize; 3]]) -> Vec<[usize; 2]> {
    let mut edges: Vec<[usize; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[i, j]| [i.min(j), i.max(j)])
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

fn least(weights: &[f64; 3]) -> f64 {
    weights.iter().copied().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bonn() -> Vec<Direction> {
        btfkit_formats::ubo2003::directions_81()
            .iter()
            .map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg()))
            .collect()
    }

    #[test]
    fn no_direction_lies_within_the_circle_of_a_triangle() {
        let directions = bonn();
        let vectors: Vec<_> = directions.iter().map(|d| d.vector()).collect();
        let triangles = triangulate(&directions);
        // Euler: 2 n - 2 - h triangles for n points of which h are on the hull.
        assert_eq!(triangles.len(), 2 * 81 - 2 - 24);
        for corners in &triangles {
            let [a, b, c] = corners.map(|corner| vectors[usize::from(corner)]);
            let sub = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
            let mut normal = cross(sub(b, a), sub(c, a));
            if normal[2] < 0.0 {
                normal = normal.map(|n| -n);
            }
            assert!(vectors.iter().all(|&v| dot(normal, sub(v, a)) < 1e-9), "{corners:?}");
        }
    }

    #[test]
    fn a_measured_direction_is_its_own_mix() {
        let directions = bonn();
        let interpolator = Interpolator::new(&directions, &triangulate(&directions));
        for (number, &direction) in directions.iter().enumerate() {
            assert_eq!(interpolator.mix(direction), Mix { terms: vec![(number, 1.0)], cosine_ratio: 1.0 });
        }
    }

    #[test]
    fn a_mix_points_where_it_should_and_its_weights_sum_to_one() {
        let directions = bonn();
        let interpolator = Interpolator::new(&directions, &triangulate(&directions));
        for step in 0..500 {
            let wanted = Direction::from_degrees(74.0 * f64::from(step % 37) / 37.0, 7.3 * f64::from(step));
            let mix = interpolator.mix(wanted);
            assert!((mix.terms.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-12);
            let mut sum = [0.0; 3];
            for &(number, weight) in &mix.terms {
                let vector = directions[number].vector();
                sum = std::array::from_fn(|axis| sum[axis] + weight * vector[axis]);
            }
            let cosine = dot(sum, wanted.vector()) / dot(sum, sum).sqrt();
            assert!(cosine > 1.0 - 1e-4, "{wanted}: {cosine}");
        }
    }

    #[test]
    fn beyond_the_outer_ring_the_elevation_is_clamped_and_the_cosine_scales() {
        let directions = bonn();
        let interpolator = Interpolator::new(&directions, &triangulate(&directions));
        let mix = interpolator.mix(Direction::from_degrees(85.0, 15.0));
        assert_eq!(mix.terms.len(), 1);
        assert_eq!(directions[mix.terms[0].0].degrees().1.round(), 15.0);
        let expected = 85f64.to_radians().cos() / 75f64.to_radians().cos();
        assert!((mix.cosine_ratio - expected).abs() < 1e-9);
        let between = interpolator.mix(Direction::from_degrees(80.0, 22.5));
        assert!(between.terms.len() == 2 && between.terms.iter().all(|(_, w)| (w - 0.5).abs() < 1e-9));
    }

    #[test]
    fn what_is_shown_instead_is_told_only_outside_of_what_was_measured() {
        let directions = bonn();
        let interpolator = Interpolator::new(&directions, &triangulate(&directions));
        for (theta, phi) in [(0.0, 0.0), (33.0, 100.0), (75.0, 15.0), (74.0, 200.0)] {
            assert_eq!(
                interpolator.shown_instead(Direction::from_degrees(theta, phi)),
                None,
                "{theta} {phi}"
            );
        }
        let shown = |interpolator: &Interpolator, theta, phi| {
            let shown = interpolator.shown_instead(Direction::from_degrees(theta, phi));
            shown.map(|shown| (shown.degrees().0.round(), shown.degrees().1.round()))
        };
        assert_eq!(shown(&interpolator, 85.0, 15.0), Some((75.0, 15.0)));
        let one = [Direction::from_degrees(30.0, 0.0)];
        let alone = Interpolator::new(&one, &triangulate(&one));
        assert_eq!(shown(&alone, 60.0, 180.0), Some((30.0, 0.0)));
        assert_eq!(shown(&alone, 30.0, 360.0), None);
    }

    #[test]
    fn one_direction_alone_stands_for_all() {
        let one = [Direction::from_degrees(0.0, 0.0)];
        let interpolator = Interpolator::new(&one, &triangulate(&one));
        let mix = interpolator.mix(Direction::from_degrees(40.0, 10.0));
        assert_eq!(mix.terms, [(0, 1.0)]);
        assert!((mix.cosine_ratio - 40f64.to_radians().cos()).abs() < 1e-12);
    }

    #[test]
    fn a_grazing_light_on_a_side_without_lights_stays_grazing() {
        let half: Vec<Direction> = (0..7)
            .flat_map(|k| [30.0, 60.0].map(|theta| Direction::from_degrees(theta, 30.0 * f64::from(k))))
            .chain([Direction::from_degrees(0.0, 0.0)])
            .collect();
        let interpolator = Interpolator::new(&half, &triangulate(&half));
        assert!(interpolator.mix(Direction::from_degrees(89.0, 270.0)).cosine_ratio < 0.03);
    }
}

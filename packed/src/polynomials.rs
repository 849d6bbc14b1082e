//! Orthonormal polynomials over a list of directions.
//!
//! Zernike's polynomials of (r, phi), r = sqrt(2) sin(theta / 2), by degree, made orthonormal over the directions that
//! there are by Gram-Schmidt, twice. One that depends on those before it is left out. So any list of n directions has
//! n polynomials, smooth ones first, and nothing of them need be stored.

use crate::model::Direction;

/// Degrees that are tried; then unit vectors fill up.
const MOST_DEGREES: usize = 64;

/// Of a polynomial of length 1, what must be left beside those before it.
const INDEPENDENT: f64 = 1e-6;

/// Polynomials over directions: `n` rows of `n` values.
pub(crate) struct Polynomials {
    rows: Vec<Vec<f64>>,
    degrees: Vec<usize>,
}

impl Polynomials {
    /// Those of a list of directions.
    pub(crate) fn new(directions: &[Direction]) -> Self {
        let count = directions.len();
        let mut found = Self { rows: Vec::with_capacity(count), degrees: Vec::with_capacity(count) };
        let points: Vec<(f64, f64)> = directions
            .iter()
            .map(|direction| {
                let half = direction.theta_deg.to_radians() / 2.0;
                (core::f64::consts::SQRT_2 * libm::sin(half), direction.phi_deg.to_radians())
            })
            .collect();
        // Radial parts of the degree and the two before, by order.
        let mut radial: [Vec<Vec<f64>>; 2] = [vec![], vec![]];
        for degree in 0..MOST_DEGREES {
            let next = next_radial(&points, degree, &radial);
            for order in (degree % 2..=degree).step_by(2) {
                for turn in [libm::cos as fn(f64) -> f64, libm::sin] {
                    let part = next[order].iter().zip(&points);
                    found.add(part.map(|(r, (_, phi))| r * turn(order as f64 * phi)).collect(), degree);
                    if found.rows.len() == count {
                        return found;
                    }
                }
            }
            let [_, last] = radial;
            radial = [last, next];
        }
        for one in 0..count {
            let unit = (0..count).map(|place| if place == one { 1.0 } else { 0.0 });
            found.add(unit.collect(), MOST_DEGREES);
        }
        found
    }

    /// Adds what of a row is orthogonal to those that there are, unless nearly nothing is.
    fn add(&mut self, mut row: Vec<f64>, degree: usize) {
        let before = norm(&row);
        if self.rows.len() == row.len() || before <= f64::MIN_POSITIVE {
            return;
        }
        for _ in 0..2 {
            for known in &self.rows {
                let along = dot(known, &row);
                row.iter_mut().zip(known).for_each(|(value, known)| *value -= along * known);
            }
        }
        let left = norm(&row);
        if left > INDEPENDENT * before {
            row.iter_mut().for_each(|value| *value /= left);
            self.rows.push(row);
            self.degrees.push(degree);
        }
    }

    /// Values [polynomial][direction].
    pub(crate) fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// Degree of each, ascending.
    pub(crate) fn degrees(&self) -> &[usize] {
        &self.degrees
    }
}

/// Radial parts of a degree, by order, by the recurrence of Shakibaei and Paramesran (2013):
/// R(n, m) = r (R(n - 1, |m - 1|) + R(n - 1, m + 1)) - R(n - 2, m).
fn next_radial(points: &[(f64, f64)], degree: usize, before: &[Vec<Vec<f64>>; 2]) -> Vec<Vec<f64>> {
    let of = |list: &[Vec<f64>], order: usize, at: usize| list.get(order).map_or(0.0, |row| row[at]);
    let value = |order: usize, at: usize| {
        let [second, last] = before;
        match degree {
            0 => 1.0,
            _ if !(degree - order).is_multiple_of(2) => 0.0,
            _ => {
                let sides = of(last, order.abs_diff(1), at) + of(last, order + 1, at);
                points[at].0 * sides - of(second, order, at)
            }
        }
    };
    (0..=degree).map(|order| (0..points.len()).map(|at| value(order, at)).collect()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(row: &[f64]) -> f64 {
    dot(row, row).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(theta_deg: f64, count: usize) -> impl Iterator<Item = Direction> {
        (0..count).map(move |k| Direction { theta_deg, phi_deg: 360.0 * k as f64 / count as f64 })
    }

    fn expect_orthonormal(directions: &[Direction]) -> Polynomials {
        let found = Polynomials::new(directions);
        assert_eq!(found.rows().len(), directions.len());
        for (i, a) in found.rows().iter().enumerate() {
            for (j, b) in found.rows().iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((dot(a, b) - expected).abs() < 1e-11, "{i} {j}: {}", dot(a, b));
            }
        }
        found
    }

    #[test]
    fn any_directions_have_as_many_orthonormal_polynomials() {
        let rings: Vec<Direction> = ring(0.0, 1)
            .chain(ring(15.0, 6))
            .chain(ring(30.0, 12))
            .chain(ring(45.0, 18))
            .chain(ring(60.0, 20))
            .chain(ring(75.0, 24))
            .collect();
        let found = expect_orthonormal(&rings);
        assert!(found.degrees().is_sorted() && found.degrees()[80] < MOST_DEGREES);
        expect_orthonormal(&rings[..1]);
        expect_orthonormal(&ring(75.0, 12).collect::<Vec<_>>());
        // Spread without rings, a dense pencil, and all the same.
        let spread = |n: usize| Direction {
            theta_deg: (n as f64 * 37.77) % 80.0,
            phi_deg: (n as f64 * 137.507_764) % 360.0,
        };
        expect_orthonormal(&(0..151).map(spread).collect::<Vec<_>>());
        expect_orthonormal(&(0..400).map(spread).collect::<Vec<_>>());
        expect_orthonormal(
            &(0..40).map(|n| Direction { theta_deg: 1e-3 * f64::from(n), phi_deg: 10.0 }).collect::<Vec<_>>(),
        );
        expect_orthonormal(&[rings[5]; 7]);
    }
}

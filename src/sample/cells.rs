//! Cells of irregular size that cover the plane without a period: the power
//! diagram of hashed, relaxed points (Aurenhammer 1987).

use super::noise::{DOMAIN, place};
use crate::random::Hash;

/// A site of the diagram, in lattice units.
#[derive(Clone, Copy, Debug)]
struct Site {
    x: f64,
    y: f64,
    /// Squared radius of the power distance.
    power: f64,
    /// A number of its own, 0 to 1.
    mark: f64,
}

/// The sites near one rectangle of the plane.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    sites: Vec<Site>,
    left: i64,
    top: i64,
    columns: usize,
}

/// Where a place lies in the diagram.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Distance to the border of its cell, rounded off where borders meet, lattice units.
    pub(super) border: f64,
    /// The number of its cell, 0 to 1.
    pub(super) mark: f64,
    /// Direction of the normal of the nearest border, (cos, sin) of the double angle.
    pub(super) orientation: [f64; 2],
}

/// Reach in lattice cells within which points repel each other and are searched.
const REACH: i64 = 2;
/// Lattice cells across the neighbourhood that is searched.
const NEAR: usize = 2 * REACH as usize + 1;
const RELAXATIONS: i64 = 3;

impl Cells {
    /// One cell per unit square in the mean, over x, y in `from..to` (lattice units).
    /// `spread` (0 to 0.4) is how much the sizes of the cells differ.
    pub(super) fn new(seed: u64, domain: u32, from: [f64; 2], to: [f64; 2], spread: f64) -> Self {
        let hash = Hash::new(seed, DOMAIN + domain);
        let margin = REACH * (RELAXATIONS + 1) + 1;
        let (left, top) = (from[0].floor() as i64 - margin, from[1].floor() as i64 - margin);
        let columns = (to[0].floor() as i64 + margin + 1 - left) as usize;
        let rows = (to[1].floor() as i64 + margin + 1 - top) as usize;
        let sites = (0..rows * columns).map(|n| {
            let (column, row) = (left + (n % columns) as i64, top + (n / columns) as i64);
            let [u, v, size, mark] = hash.uniforms(place(column as f64), place(row as f64), 0);
            let power = spread * (size - 0.5);
            Site { x: column as f64 + u, y: row as f64 + v, power, mark }
        });
        let mut cells = Self { sites: sites.collect(), left, top, columns };
        for _ in 0..RELAXATIONS {
            cells.relax();
        }
        cells
    }

    /// Moves every site away from those that crowd it. The outermost sites see too few others;
    /// the margin keeps them out of use.
    fn relax(&mut self) {
        const DISTANCE: f64 = 1.05;
        let rows = self.sites.len() / self.columns;
        let moved = (0..self.sites.len()).map(|n| {
            let site = self.sites[n];
            let (column, row) = ((n % self.columns) as i64, (n / self.columns) as i64);
            let (mut dx, mut dy) = (0.0, 0.0);
            for r in (row - REACH).max(0)..=(row + REACH).min(rows as i64 - 1) {
                for c in (column - REACH).max(0)..=(column + REACH).min(self.columns as i64 - 1) {
                    let other = self.sites[r as usize * self.columns + c as usize];
                    let (ex, ey) = (site.x - other.x, site.y - other.y);
                    let distance = (ex * ex + ey * ey).sqrt();
                    if distance > 0.0 && distance < DISTANCE {
                        let push = 0.3 * (DISTANCE - distance) / distance;
                        (dx, dy) = (dx + push * ex, dy + push * ey);
                    }
                }
            }
            // Held short, so that a site stays within reach of its own lattice cell.
            Site { x: site.x + dx.clamp(-0.3, 0.3), y: site.y + dy.clamp(-0.3, 0.3), ..site }
        });
        self.sites = moved.collect();
    }

    /// The cell at (x, y), which must lie in the rectangle that the cells were made for.
    /// `round` is the distance over which borders that meet blend into each other.
    pub(super) fn at(&self, x: f64, y: f64, round: f64) -> Spot {
        let near = self.near(x, y);
        let power = near.map(|s| (x - s.x) * (x - s.x) + (y - s.y) * (y - s.y) - s.power);
        let own = (1..near.len()).fold(0, |best, n| if power[n] < power[best] { n } else { best });
        let (mut border, mut nearest, mut orientation) = (f64::INFINITY, f64::INFINITY, [1.0, 0.0]);
        for (n, site) in near.iter().enumerate().filter(|&(n, _)| n != own) {
            let (ex, ey) = (site.x - near[own].x, site.y - near[own].y);
            let square = ex * ex + ey * ey;
            let distance = (power[n] - power[own]) / (2.0 * square.sqrt());
            if distance < nearest {
                nearest = distance;
                orientation = [(ex * ex - ey * ey) / square, 2.0 * ex * ey / square];
            }
            border = smooth_minimum(border, distance, round);
        }
        Spot { border, mark: near[own].mark, orientation }
    }

    /// Distance to the nearest site and the site's own number, 0 to 1; the place as for [`Self::at`].
    pub(super) fn site(&self, x: f64, y: f64) -> (f64, f64) {
        let near = self.near(x, y);
        let square = near.map(|s| (x - s.x) * (x - s.x) + (y - s.y) * (y - s.y));
        let own = (1..near.len()).fold(0, |best, n| if square[n] < square[best] { n } else { best });
        (square[own].sqrt(), near[own].mark)
    }

    /// The sites of the lattice cells around (x, y).
    fn near(&self, x: f64, y: f64) -> [Site; NEAR * NEAR] {
        let (column, row) = (x.floor() as i64 - self.left - REACH, y.floor() as i64 - self.top - REACH);
        std::array::from_fn(|n| {
            let (r, c) = (row as usize + n / NEAR, column as usize + n % NEAR);
            self.sites[r * self.columns + c]
        })
    }
}

/// Minimum of two distances whose corner is rounded over `round`; never above the minimum.
fn smooth_minimum(a: f64, b: f64, round: f64) -> f64 {
    if !a.is_finite() {
        return b;
    }
    let overlap = ((round - (a - b).abs()) / round).max(0.0);
    a.min(b) - overlap * overlap * round * 0.25
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_keeps_its_cell_whatever_the_rectangle() {
        let small = Cells::new(5, 0, [0.0, 0.0], [4.0, 4.0], 0.3);
        let large = Cells::new(5, 0, [-30.0, -7.0], [40.0, 9.0], 0.3);
        for n in 0..400 {
            let (x, y) = (f64::from(n % 20) * 0.2, f64::from(n / 20) * 0.2);
            let (a, b) = (small.at(x, y, 0.1), large.at(x, y, 0.1));
            assert_eq!((a.border, a.mark, a.orientation), (b.border, b.mark, b.orientation));
        }
    }

    #[test]
    fn cells_number_one_per_unit_square_and_borders_are_where_cells_change() {
        let cells = Cells::new(9, 0, [0.0, 0.0], [12.0, 12.0], 0.3);
        let mut marks: Vec<u64> = Vec::new();
        for n in 0..120 * 120 {
            let (x, y) = (f64::from(n % 120) * 0.1, f64::from(n / 120) * 0.1);
            let here = cells.at(x, y, 1e-9);
            marks.push(here.mark.to_bits());
            let next = cells.at(x + 0.01, y, 1e-9);
            assert!(here.border >= 0.0);
            if here.mark != next.mark {
                assert!(here.border < 0.011 && next.border < 0.011, "{} {}", here.border, next.border);
            }
        }
        marks.sort_unstable();
        marks.dedup();
        assert!((120..230).contains(&marks.len()), "{}", marks.len());
    }
}

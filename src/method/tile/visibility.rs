//! Whether borders join: how far neighbours across them differ, beside neighbours elsewhere.

use super::{Features, Tile};
use crate::shape::Size;

/// Most that the step across a border may be, relative to the mean of ordinary ones, for the border to join.
///
/// Planes that were made to join have 0.6 to 1.2 (blended borders are smoother than the rest), of others the step is one
/// between strangers: 1.9 and more for the sample's wood and leather. Where it is less, neighbours are strangers
/// everywhere, and the border does no harm.
const JOINS: f64 = 1.2;

/// How far neighbours differ across the seams, relative to neighbours elsewhere (1: no more than usual).
///
/// Root mean square differences of adjacent tile texels, wrap-around included, over the features.
pub fn seam_visibility(features: &Features, tile: &Tile) -> f64 {
    let Size { height, width } = tile.size;
    let at = |y: usize, x: usize| tile.source[(y % height) * width + x % width].map(|n| n as usize);
    let (mut seam, mut ordinary) = ((0u64, 0u64), (0u64, 0u64));
    for y in 0..height {
        for x in 0..width {
            let here = at(y, x);
            for (neighbour, step) in [(at(y, x + 1), [0, 1]), (at(y + 1, x), [1, 0])] {
                let natural = [here[0] + step[0], here[1] + step[1]] == neighbour;
                let sum = if natural { &mut ordinary } else { &mut seam };
                sum.0 += features.difference(here, neighbour);
                sum.1 += 1;
            }
        }
    }
    relative(seam, ordinary)
}

/// Whether the plane's borders join as they are: the step across them, from top to bottom and from left to right, is
/// about an ordinary one.
pub fn borders_join(features: &Features) -> bool {
    border_visibility(features).into_iter().all(|visibility| visibility <= JOINS)
}

/// The step from the last row to the first and that from the last column to the first, each relative to ordinary
/// steps the same way.
fn border_visibility(features: &Features) -> [f64; 2] {
    let Size { height, width } = features.size;
    [0, 1].map(|axis| {
        let (mut border, mut ordinary) = ((0u64, 0u64), (0u64, 0u64));
        for y in 0..height {
            for x in 0..width {
                let (next, crosses) = match axis {
                    0 => ([(y + 1) % height, x], y + 1 == height),
                    _ => ([y, (x + 1) % width], x + 1 == width),
                };
                let sum = if crosses { &mut border } else { &mut ordinary };
                sum.0 += features.difference([y, x], next);
                sum.1 += 1;
            }
        }
        relative(border, ordinary)
    })
}

/// Root of the ratio of two means (sum, count); 1 where it cannot be told.
fn relative(seam: (u64, u64), ordinary: (u64, u64)) -> f64 {
    let mean = |(total, count): (u64, u64)| total as f64 / count.max(1) as f64;
    if seam.1 == 0 || ordinary.0 == 0 { 1.0 } else { (mean(seam) / mean(ordinary)).sqrt() }
}

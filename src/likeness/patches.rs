//! The distribution of small patches: their sliced Wasserstein distance (J. Rabin, G. Peyré, J. Delon and M. Bernot,
//! "Wasserstein barycenter and its application to texture mixing", 2011).

use super::Lightness;
use super::draws::Draws;
use crate::shape::Size;

/// Texels of a side of a patch.
const SIDE: usize = 7;

/// Scales at which patches are taken: squares of so many texels become one.
const SCALES: [usize; 3] = [1, 2, 4];

/// Patches of a scale.
const PATCHES: usize = 4000;

/// Directions that they are projected on.
const DIRECTIONS: usize = 32;

/// For each scale, the projections of the same random patches on the same random directions: [direction, patch], each
/// direction's in ascending order.
pub(crate) fn projections(picture: &Lightness) -> Vec<Vec<f64>> {
    let mut draws = Draws::of_seed_0();
    SCALES.iter().map(|&scale| projected(&picture.reduced(scale), &mut draws)).collect()
}

fn projected(picture: &Lightness, draws: &mut Draws) -> Vec<f64> {
    let Size { height, width } = picture.size;
    let across = width - SIDE + 1;
    let corners = ((height - SIDE + 1) * across) as u32;
    let places: Vec<usize> = (0..PATCHES).map(|_| draws.below(corners) as usize).collect();
    // [texel of the patch, direction]
    let mut directions: Vec<f64> = (0..SIDE * SIDE * DIRECTIONS).map(|_| draws.normal()).collect();
    for number in 0..DIRECTIONS {
        let length = directions.iter().skip(number).step_by(DIRECTIONS).map(|n| n * n).sum::<f64>().sqrt();
        directions.iter_mut().skip(number).step_by(DIRECTIONS).for_each(|n| *n /= length);
    }
    let mut projections = vec![0.0; DIRECTIONS * PATCHES];
    for (patch, place) in places.into_iter().enumerate() {
        let (y, x) = (place / across, place % across);
        let mut sums = [0.0; DIRECTIONS];
        for (texel, weights) in directions.chunks_exact(DIRECTIONS).enumerate() {
            let value = picture.values[(y + texel / SIDE) * width + x + texel % SIDE];
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += value * weight);
        }
        for (direction, sum) in sums.into_iter().enumerate() {
            projections[direction * PATCHES + patch] = sum;
        }
    }
    for direction in projections.chunks_exact_mut(PATCHES) {
        direction.sort_unstable_by(f64::total_cmp);
    }
    projections
}

/// Mean distance that a patch must be moved, over scales and directions, in units of the values.
pub fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let scale = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len().max(1) as f64
    };
    a.iter().zip(b).map(scale).sum::<f64>() / a.len().max(1) as f64
}

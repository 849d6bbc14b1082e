//! Which grey levels neighbour each other: co-occurrence (Haralick, Shanmugam and Dinstein, "Textural features for image
//! classification", 1973) of levels that hold equally many texels of a real crop.

use super::Lightness;
use crate::shape::Size;

/// Number of grey levels.
pub(crate) const LEVELS: usize = 16;

/// Pairs of texels (rows down, columns right) whose levels are counted.
const OFFSETS: [[isize; 2]; 12] =
    [[0, 1], [1, 0], [1, 1], [-1, 1], [0, 2], [2, 0], [0, 4], [4, 0], [3, 3], [-3, 3], [0, 8], [8, 0]];

/// Borders between levels.
pub(crate) type Edges = [f64; LEVELS - 1];

/// The values that cut a picture's texels into equal parts, interpolated between the two nearest.
pub(crate) fn edges(picture: &Lightness) -> Edges {
    let mut sorted = picture.values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    std::array::from_fn(|n| {
        let place = (n + 1) as f64 / LEVELS as f64 * (sorted.len() - 1) as f64;
        let below = place.floor() as usize;
        let above = (below + 1).min(sorted.len() - 1);
        sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
    })
}

/// Shares of pairs of levels, [offset, level, level], either texel of a pair first.
pub(crate) fn co_occurrence(picture: &Lightness, edges: &Edges) -> Vec<f64> {
    let Size { height, width } = picture.size;
    let levels: Vec<usize> =
        picture.values.iter().map(|value| edges.partition_point(|edge| edge < value)).collect();
    let mut shares = Vec::with_capacity(OFFSETS.len() * LEVELS * LEVELS);
    for [down, right] in OFFSETS {
        let mut counts = [0u64; LEVELS * LEVELS];
        let rows = height.saturating_sub(down.unsigned_abs());
        let (above, below) = ((-down).max(0) as usize, down.max(0) as usize);
        let right = right as usize;
        for row in 0..rows {
            let from = &levels[(row + above) * width..][..width];
            let to = &levels[(row + below) * width..][..width];
            for (a, b) in from.iter().zip(&to[right.min(width)..]) {
                counts[a * LEVELS + b] += 1;
            }
        }
        let total = (rows * width.saturating_sub(right)).max(1) as f64;
        let share = |n: usize| (counts[n] + counts[n % LEVELS * LEVELS + n / LEVELS]) as f64 / (2.0 * total);
        shares.extend((0..LEVELS * LEVELS).map(share));
    }
    shares
}

/// The share of pairs that would have to change, mean over offsets: 0 to 1.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / (2.0 * OFFSETS.len() as f64)
}

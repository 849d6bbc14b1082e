//! First centres by k-means++ on the distance of (1) (Arthur and Vassilvitskii 2007; for the L1
//! objective a texel is drawn in proportion to its distance, not its square).

use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::absolute_difference::Kernel;
use crate::random::Hash;
use crate::run::Context;
use crate::texel::cluster::points::Points;

/// Texels whose distances are computed in one go.
const BLOCK: usize = 64;

/// Draws `count` texels as first centres; fewer where the tile has fewer distinct BRDFs.
pub fn draw(
    points: &Points,
    count: usize,
    seed: u64,
    kernel: Kernel,
    context: &Context<'_>,
) -> Result<Vec<usize>> {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"seed"));
    let mut chosen = vec![hash.below(points.len() as u64, 0, 0, 0) as usize];
    let mut nearest = vec![u64::MAX; points.len()];
    while chosen.len() < count {
        context.check_stop()?;
        let latest = points.vector(chosen[chosen.len() - 1]);
        lower(points, latest, kernel, &mut nearest);
        let total: u64 = nearest.iter().sum();
        if total == 0 {
            break;
        }
        let mut left = hash.below(total, chosen.len() as u32, 0, 0);
        let drawn = nearest.iter().position(|&distance| {
            let hit = left < distance;
            left = left.wrapping_sub(if hit { 0 } else { distance });
            hit
        });
        chosen.extend(drawn);
        context.progress.advance(1);
    }
    Ok(chosen)
}

/// Lowers each texel's distance to that to a new centre.
fn lower(points: &Points, centre: &[u8], kernel: Kernel, nearest: &mut [u64]) {
    let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
    let blocks = points.vectors.par_chunks(BLOCK * stride).zip(nearest.par_chunks_mut(BLOCK));
    blocks.for_each(|(vectors, nearest)| {
        let mut distances = [0; BLOCK];
        let distances = &mut distances[..nearest.len()];
        kernel.distances(vectors, centre, stride, groups, distances);
        for (nearest, &distance) in nearest.iter_mut().zip(distances.iter()) {
            *nearest = distance.min(*nearest);
        }
    });
}

//! First centres by k-means++ on the distance of (1) (Arthur and Vassilvitskii 2007; for the L1
//! objective a texel is drawn in proportion to its distance, not its square).
//!
//! A distance that the triangle inequality rules out is not computed (Raff 2021); the draw is the same.

use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::random::Hash;
use crate::run::Context;
use crate::texel::cluster::points::Points;

/// Texels that a thread takes at a time.
const BLOCK: usize = 256;

/// A texel's nearest centre so far.
#[derive(Clone, Copy)]
struct Own {
    distance: u64,
    centre: u32,
}

/// Draws `count` texels as first centres; fewer where there are fewer distinct BRDFs. The first of them are those
/// that a smaller `count` gives. Each `attempt` is another draw.
pub fn draw(
    points: &Points,
    count: usize,
    seed: u64,
    attempt: u32,
    kernel: Kernel,
    context: &Context<'_>,
) -> Result<Vec<u32>> {
    let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
    let hash = Hash::new(seed, u32::from_be_bytes(*b"seed"));
    let mut chosen = vec![hash.below(points.len() as u64, 0, attempt, 0) as u32];
    let mut vectors = points.vector(chosen[0] as usize).to_vec();
    let mut own = vec![Own { distance: u64::MAX, centre: 0 }; points.len()];
    let mut between = vec![0];
    while chosen.len() < count {
        context.check_stop()?;
        lower(points, &vectors, &between, kernel, &mut own);
        let total: u64 = own.par_iter().map(|own| own.distance).sum();
        if total == 0 {
            break;
        }
        let mut left = hash.below(total, chosen.len() as u32, attempt, 0);
        let drawn = own.iter().position(|own| {
            let hit = left < own.distance;
            left = left.wrapping_sub(if hit { 0 } else { own.distance });
            hit
        });
        let Some(texel) = drawn else { break };
        let latest = points.vector(texel);
        between = vec![0; chosen.len()];
        kernel.distances(latest, &vectors, stride, groups, &mut between);
        between.push(0);
        vectors.extend_from_slice(latest);
        chosen.push(texel as u32);
        context.progress.advance(1);
    }
    Ok(chosen)
}

/// Lowers each texel's distance to that to the latest centre; `between` are that centre's distances to all centres.
fn lower(points: &Points, centres: &[u8], between: &[u64], kernel: Kernel, own: &mut [Own]) {
    let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
    let latest = between.len() - 1;
    let centre = &centres[latest * stride..];
    points.vectors.par_chunks(BLOCK * stride).zip(own.par_chunks_mut(BLOCK)).for_each(|(vectors, own)| {
        // The distance to the latest centre is at least the way between the centres less that to the own one.
        let near = |own: &Own| own.distance == u64::MAX || between[own.centre as usize] < 2 * own.distance;
        let near: Vec<usize> = (0..own.len()).filter(|&texel| near(&own[texel])).collect();
        for four in near.chunks(4) {
            let texels = std::array::from_fn(|n| {
                let texel = four[n.min(four.len() - 1)];
                &vectors[texel * stride..(texel + 1) * stride]
            });
            let distances: [u64; 4] = kernel.row_distances(centre, texels, groups);
            for (&texel, distance) in four.iter().zip(distances) {
                if distance < own[texel].distance {
                    own[texel] = Own { distance, centre: latest as u32 };
                }
            }
        }
    });
}

//! First centres by greedy k-means++ on the distance of (1): each is the best of a few texels drawn in proportion to
//! their distance from the centres before it (Arthur and Vassilvitskii 2007; for the L1 objective not its square).
//!
//! A distance that the triangle inequality rules out is not computed (Raff 2021); the result is the same.

use rayon::prelude::*;

use super::points::Points;
use crate::error::Result;
use crate::kernel::Kernel;
use crate::random::Hash;
use crate::run::Context;

/// Texels drawn for each centre.
const CANDIDATES: u32 = 8;

/// Texels that they are drawn from, or so many for each centre: of more, a subset without preference.
const TEXELS: usize = 16384;
const TEXELS_OF_A_CENTRE: usize = 8;

/// Texels that a thread takes at a time.
const BLOCK: usize = 256;

/// A texel's nearest centre so far.
#[derive(Clone, Copy)]
struct Own {
    texel: u32,
    distance: u64,
    centre: u32,
}

/// What a texel would gain, were it a centre.
struct Candidate {
    texel: u32,
    /// Texels, by their place among those drawn from, that it would lie nearer to than their own centres, and how near.
    nearer: Vec<(u32, u64)>,
    /// By how much it would lower the objective.
    gain: u64,
}

/// How many texels `count` first centres are drawn from.
pub(crate) fn drawn_from(count: usize) -> usize {
    TEXELS.max(TEXELS_OF_A_CENTRE * count)
}

/// Draws `count` texels as first centres; fewer where there are fewer distinct BRDFs. The first of them are those
/// that a smaller `count` gives, as long as both are drawn from as many texels. Each `attempt` is another draw.
pub fn draw(
    points: &Points,
    count: usize,
    seed: u64,
    attempt: u32,
    kernel: Kernel,
    context: &Context<'_>,
) -> Result<Vec<u32>> {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"seed"));
    let texels = subset(points.len(), drawn_from(count), seed, attempt);
    let first = hash.below(texels.len() as u64, 0, attempt, 0) as usize;
    let (mut chosen, mut vectors) = (Vec::new(), Vec::new());
    let mut own: Vec<Own> =
        texels.into_iter().map(|texel| Own { texel, distance: u64::MAX, centre: 0 }).collect();
    let mut best = Candidate::all(points, &[own[first].texel], &vectors, kernel, &own);
    loop {
        // The first of the best, so that the order of candidates decides between equals.
        let Some(candidate) = best.into_iter().rev().max_by_key(|candidate| candidate.gain) else {
            return Ok(chosen);
        };
        for &(place, distance) in &candidate.nearer {
            let own = &mut own[place as usize];
            (own.distance, own.centre) = (distance, chosen.len() as u32);
        }
        vectors.extend_from_slice(points.vector(candidate.texel as usize));
        chosen.push(candidate.texel);
        context.progress.advance(1);
        context.check_stop()?;
        let sums: Vec<u64> =
            own.par_chunks(BLOCK).map(|own| own.iter().map(|own| own.distance).sum()).collect();
        let total: u64 = sums.iter().sum();
        if chosen.len() >= count || total == 0 {
            return Ok(chosen);
        }
        let place = |candidate| hash.below(total, chosen.len() as u32, attempt, candidate);
        let drawn: Vec<u32> =
            (0..CANDIDATES).map(|candidate| texel_at(&own, &sums, place(candidate))).collect();
        best = Candidate::all(points, &drawn, &vectors, kernel, &own);
    }
}

/// The texel in whose distance `place` lies, all distances laid end to end; `sums` are those of blocks.
fn texel_at(own: &[Own], sums: &[u64], mut place: u64) -> u32 {
    let mut passes = |length: u64| {
        let beyond = place >= length;
        place -= if beyond { length } else { 0 };
        beyond
    };
    let block = sums.iter().take_while(|&&sum| passes(sum)).count();
    let within = own[block * BLOCK..].iter().take_while(|own| passes(own.distance)).count();
    own[block * BLOCK + within].texel
}

/// `count` of `all` texels without preference, in ascending order; all where there are no more.
pub(super) fn subset(all: usize, count: usize, seed: u64, attempt: u32) -> Vec<u32> {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"smpl"));
    let mut drawn: Vec<(u32, u32)> =
        (0..all as u32).map(|texel| (hash.words(texel, attempt, 0)[0], texel)).collect();
    if count < drawn.len() {
        drawn.select_nth_unstable(count);
        drawn.truncate(count);
    }
    let mut texels: Vec<u32> = drawn.into_iter().map(|(_, texel)| texel).collect();
    texels.sort_unstable();
    texels
}

impl Candidate {
    /// What each of these texels would gain. They are looked at together, so that each vector is fetched once.
    fn all(points: &Points, drawn: &[u32], centres: &[u8], kernel: Kernel, own: &[Own]) -> Vec<Self> {
        let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
        let count = centres.len() / stride;
        let vectors = points.vectors_of(drawn);
        let mut between = vec![0; drawn.len() * count];
        if count > 0 {
            kernel.distances(&vectors, centres, stride, groups, &mut between);
        }
        let none = || vec![Vec::new(); drawn.len()];
        let nearer: Vec<Vec<(u32, u64)>> = own
            .par_chunks(BLOCK)
            .enumerate()
            .fold(none, |mut nearer, (block, own)| {
                for (own, place) in own.iter().zip(block * BLOCK..) {
                    let point = points.vector(own.texel as usize);
                    for (candidate, nearer) in nearer.iter_mut().enumerate() {
                        // The distance to the candidate is at least the way between the centres less that to the
                        // own one.
                        let way = between.get(candidate * count + own.centre as usize);
                        if way.is_none_or(|&way| way < 2 * own.distance) {
                            let vector = &vectors[candidate * stride..(candidate + 1) * stride];
                            let below = kernel.distance_below(point, vector, groups, own.distance);
                            nearer.extend(below.map(|distance| (place as u32, distance)));
                        }
                    }
                }
                nearer
            })
            .reduce(none, |mut first, second| {
                first.iter_mut().zip(second).for_each(|(first, second)| first.extend(second));
                first
            });
        let gain = |nearer: &[(u32, u64)]| {
            // Before there is a centre the distances are without end, and there is one candidate.
            nearer.iter().fold(0u64, |gain, &(place, distance)| {
                gain.wrapping_add(own[place as usize].distance - distance)
            })
        };
        let candidates = drawn.iter().zip(nearer);
        candidates.map(|(&texel, nearer)| Self { texel, gain: gain(&nearer), nearer }).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::cluster::points::Arrangement;
    use crate::run::progress::Silent;
    use btfkit_formats::Direction;
    use std::sync::atomic::AtomicBool;

    fn points(texels: u32) -> Points {
        let views: Vec<_> = (0..3).map(|v| Direction::from_degrees(30.0 * f64::from(v), 0.0)).collect();
        let arrangement = Arrangement::new(&views, 5);
        let hash = Hash::new(8, 0);
        let mut vectors = vec![0; texels as usize * arrangement.stride()];
        for view in 0..3 {
            let code = |n: u32| {
                (hash.words(n / 5 % 40, view, n % 5)[0] % 200 + hash.words(n, view, 9)[0] % 20) as u8
            };
            arrangement.insert_view(
                &mut vectors,
                view as usize,
                &(0..texels * 5).map(code).collect::<Vec<u8>>(),
            );
        }
        Points { arrangement, vectors }
    }

    #[test]
    fn what_is_ruled_out_changes_no_draw() {
        let points = points(700);
        let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
        let distances = |texel: u32| {
            let mut distances = vec![0; points.len()];
            let vector = points.vector(texel as usize);
            Kernel::Plain.distances(&points.vectors, vector, stride, groups, &mut distances);
            distances
        };
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, 2, 1 << 30).unwrap();
        let drawn = draw(&points, 30, 5, 2, Kernel::fastest(), &context).unwrap();
        assert_eq!(drawn[..12], draw(&points, 12, 5, 2, Kernel::Plain, &context).unwrap());
        assert_ne!(drawn, draw(&points, 30, 5, 3, Kernel::Plain, &context).unwrap());
        // The same by all distances.
        let hash = Hash::new(5, u32::from_be_bytes(*b"seed"));
        let mut own = distances(drawn[0]);
        for (number, &found) in drawn.iter().enumerate().skip(1) {
            let total: u64 = own.iter().sum();
            let candidates = (0..CANDIDATES).map(|candidate| {
                let mut place = hash.below(total, number as u32, 2, candidate);
                let texel = own.iter().position(|&distance| {
                    let hit = place < distance;
                    place -= if hit { 0 } else { distance };
                    hit
                });
                texel.unwrap() as u32
            });
            let lowered = |texel: u32| -> Vec<u64> {
                own.iter().zip(distances(texel)).map(|(&own, distance)| own.min(distance)).collect()
            };
            let best = candidates.min_by_key(|&texel| lowered(texel).iter().sum::<u64>()).unwrap();
            assert_eq!(found, best, "centre {number}");
            own = lowered(best);
        }
    }
}

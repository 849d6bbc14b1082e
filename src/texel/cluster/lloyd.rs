//! Passes of assignment and update until nothing moves.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::kernel::absolute_difference::Kernel;
use crate::run::Context;
use crate::texel::cluster::centre::{self, CentreRule};
use crate::texel::cluster::points::Points;

/// Texels whose distances are computed in one go: their vectors stay in the second cache while the centres pass by.
const BLOCK: usize = 64;

/// Texels that a thread takes at a time; each such part keeps its own nearest texel of every centre.
pub const PART: usize = 1024;

/// When to stop.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Limits {
    /// Most passes.
    pub passes: usize,
    /// Least relative fall of the objective that is worth another pass.
    pub tolerance: f64,
}

/// A texel and its distance to a centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Near {
    /// Fixed-point distance of (1).
    pub distance: u64,
    /// Texel number.
    pub texel: u32,
}

/// What an assignment of all texels to centres found.
pub struct Assignment {
    /// Cluster of each texel, the nearest centre, ties to the smaller number.
    pub index: Vec<u16>,
    /// Distance of each texel to that centre.
    pub distances: Vec<u64>,
    /// The texel nearest to each centre, ties to the smaller number.
    pub nearest: Vec<Near>,
}

impl Assignment {
    /// Sum of all distances, the objective of (1).
    pub fn objective(&self) -> u64 {
        self.distances.iter().sum()
    }
}

/// Assigns every texel to its nearest centre.
pub fn assign(points: &Points, centres: &[u8], kernel: Kernel) -> Assignment {
    let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
    let count = centres.len() / stride;
    let parts: Vec<(Vec<u16>, Vec<u64>, Vec<Near>)> = points
        .vectors
        .par_chunks(PART * stride)
        .enumerate()
        .map(|(part, vectors)| {
            let texels = vectors.len() / stride;
            let mut all = vec![0; BLOCK.min(texels) * count];
            let mut nearest = vec![Near { distance: u64::MAX, texel: u32::MAX }; count];
            let (mut index, mut distances) = (Vec::with_capacity(texels), Vec::with_capacity(texels));
            for vectors in vectors.chunks(BLOCK * stride) {
                let all = &mut all[..vectors.len() / stride * count];
                kernel.distances(vectors, centres, stride, groups, all);
                for row in all.chunks_exact(count) {
                    let texel = (part * PART + index.len()) as u32;
                    let (mut best, mut least) = (0, u64::MAX);
                    for (cluster, (&distance, nearest)) in row.iter().zip(&mut nearest).enumerate() {
                        if distance < least {
                            (best, least) = (cluster, distance);
                        }
                        *nearest = (*nearest).min(Near { distance, texel });
                    }
                    index.push(best as u16);
                    distances.push(least);
                }
            }
            (index, distances, nearest)
        })
        .collect();
    let mut whole = Assignment {
        index: Vec::with_capacity(points.len()),
        distances: Vec::with_capacity(points.len()),
        nearest: vec![Near { distance: u64::MAX, texel: u32::MAX }; count],
    };
    for (index, distances, nearest) in parts {
        whole.index.extend(index);
        whole.distances.extend(distances);
        for (all, part) in whole.nearest.iter_mut().zip(nearest) {
            *all = (*all).min(part);
        }
    }
    whole
}

/// Centres after convergence, and how it went.
pub struct Clustering {
    /// Centres [cluster, stride].
    pub centres: Vec<u8>,
    /// Assignment of the texels to exactly these centres.
    pub assignment: Assignment,
    /// What each pass found.
    pub passes: Vec<Pass>,
}

/// One pass.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Pass {
    /// Objective of (1) as a weighted mean |dL*| of a texel.
    pub mean_lightness_error: f64,
    /// Texels that changed their cluster.
    pub moved: usize,
    /// Empty clusters that were given the farthest texel.
    pub reseeded: usize,
}

/// Improves centres pass by pass from those of the `seeds` texels.
pub fn run(
    points: &Points,
    seeds: &[usize],
    rule: CentreRule,
    limits: Limits,
    kernel: Kernel,
    context: &Context<'_>,
) -> Result<Clustering> {
    let mut centres: Vec<u8> = seeds.iter().flat_map(|&texel| points.vector(texel)).copied().collect();
    let mut passes: Vec<Pass> = Vec::new();
    let mut before: Option<Assignment> = None;
    loop {
        context.check_stop()?;
        let assignment = assign(points, &centres, kernel);
        let mut members = vec![Vec::new(); seeds.len()];
        for (texel, &cluster) in assignment.index.iter().enumerate() {
            members[usize::from(cluster)].push(texel as u32);
        }
        let reseeded = reseed_empty(&mut members, &assignment);
        let moved = before.as_ref().map_or(points.len(), |before| {
            before.index.iter().zip(&assignment.index).filter(|(a, b)| a != b).count()
        });
        let objective = assignment.objective();
        let mean_lightness_error = points.arrangement.mean_lightness(objective) / points.len() as f64;
        passes.push(Pass { mean_lightness_error, moved, reseeded });
        context.progress.remark(&format!("mean |dL*| {mean_lightness_error:.4}, {moved} texels moved"));
        context.progress.advance(1);
        let gain = before.as_ref().map_or(f64::INFINITY, |before| {
            let previous = before.objective() as f64;
            (previous - objective as f64) / previous.max(1.0)
        });
        let settled = reseeded == 0 && (moved == 0 || gain < limits.tolerance);
        if settled || passes.len() >= limits.passes {
            return Ok(Clustering { centres, assignment, passes });
        }
        centre::update(points, &members, rule, &mut centres);
        before = Some(assignment);
    }
}

/// Gives each empty cluster the texel farthest from its own centre (ties: the smaller number).
fn reseed_empty(members: &mut [Vec<u32>], assignment: &Assignment) -> usize {
    let empty: Vec<usize> = (0..members.len()).filter(|&cluster| members[cluster].is_empty()).collect();
    if empty.is_empty() {
        return 0;
    }
    let mut farthest: Vec<u32> = (0..assignment.index.len() as u32).collect();
    farthest.sort_by_key(|&texel| (std::cmp::Reverse(assignment.distances[texel as usize]), texel));
    let mut given = 0;
    for &texel in &farthest {
        let Some(&cluster) = empty.get(given) else { break };
        let home = &mut members[usize::from(assignment.index[texel as usize])];
        if assignment.distances[texel as usize] > 0 && home.len() > 1 {
            home.retain(|&member| member != texel);
            members[cluster].push(texel);
            given += 1;
        }
    }
    given
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;
    use crate::run::progress::Silent;
    use crate::texel::cluster::points::Arrangement;
    use crate::texel::cluster::seeding;
    use btfkit_formats::Direction;
    use std::sync::atomic::AtomicBool;

    /// Texels that scatter by up to 3 codes around `kinds` BRDFs.
    fn points(texels: usize, kinds: u32) -> Points {
        let views: Vec<_> = (0..4).map(|v| Direction::from_degrees(25.0 * f64::from(v), 0.0)).collect();
        let arrangement = Arrangement::new(&views, 6);
        let hash = Hash::new(11, 0);
        let mut vectors = vec![0; texels * arrangement.stride()];
        for view in 0..4u32 {
            let codes: Vec<u8> = (0..texels as u32 * 6)
                .map(|n| {
                    let (texel, light) = (n / 6, n % 6);
                    let base = hash.words(texel % kinds, view, light)[0] as u8 / 2;
                    base + (hash.words(texel, view, 100 + light)[0] % 4) as u8
                })
                .collect();
            arrangement.insert_view(&mut vectors, view as usize, &codes);
        }
        Points { arrangement, vectors }
    }

    fn cluster(
        points: &Points,
        count: usize,
        threads: usize,
        kernel: Kernel,
        rule: CentreRule,
    ) -> Clustering {
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, threads, 1 << 30).unwrap();
        context.install(|| {
            let seeds = seeding::draw(points, count, 1, kernel, &context).unwrap();
            run(points, &seeds, rule, Limits { passes: 50, tolerance: 0.0 }, kernel, &context).unwrap()
        })
    }

    #[test]
    fn the_assignment_is_the_true_argmin_and_the_objective_never_rises() {
        let points = points(600, 9);
        let result = cluster(&points, 7, 2, Kernel::fastest(), CentreRule::Median);
        assert!(result.passes.windows(2).all(|p| p[1].mean_lightness_error <= p[0].mean_lightness_error));
        let (stride, groups) = (points.arrangement.stride(), points.arrangement.groups());
        let distance = |texel: usize, cluster: usize| -> u64 {
            let (a, b) = (points.vector(texel), &result.centres[cluster * stride..(cluster + 1) * stride]);
            groups
                .iter()
                .map(|g| {
                    u64::from(g.weight)
                        * (g.start..g.end).map(|n| u64::from(a[n].abs_diff(b[n]))).sum::<u64>()
                })
                .sum()
        };
        for texel in 0..points.len() {
            let best = (0..7).min_by_key(|&cluster| distance(texel, cluster)).unwrap();
            assert_eq!(usize::from(result.assignment.index[texel]), best);
            assert_eq!(result.assignment.distances[texel], distance(texel, best));
        }
        for cluster in 0..7 {
            let best = (0..points.len()).min_by_key(|&texel| distance(texel, cluster)).unwrap();
            assert_eq!(result.assignment.nearest[cluster].texel as usize, best);
        }
    }

    #[test]
    fn separate_kinds_are_found() {
        let points = points(400, 5);
        let result = cluster(&points, 5, 2, Kernel::fastest(), CentreRule::Median);
        for texel in 0..points.len() {
            assert_eq!(result.assignment.index[texel], result.assignment.index[texel % 5]);
        }
    }

    #[test]
    fn threads_and_kernels_do_not_change_the_result() {
        let points = points(1000, 40);
        for rule in [CentreRule::Median, CentreRule::Mean] {
            let reference = cluster(&points, 16, 1, Kernel::Plain, rule);
            for kernel in Kernel::available() {
                let result = cluster(&points, 16, 3, kernel, rule);
                assert_eq!(result.centres, reference.centres);
                assert_eq!(result.assignment.index, reference.assignment.index);
            }
        }
    }

    #[test]
    fn fewer_distinct_brdfs_than_clusters_give_fewer_clusters() {
        let points = points(3, 3);
        let copies = Points { arrangement: points.arrangement.clone(), vectors: points.vectors.repeat(4) };
        assert_eq!(cluster(&copies, 8, 1, Kernel::Plain, CentreRule::Median).assignment.nearest.len(), 3);
    }
}

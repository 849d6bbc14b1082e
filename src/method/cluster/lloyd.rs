//! Passes of assignment and update over texels in memory, until nothing is gained.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::assign::{Assignment, Texels};
use super::bounds::{Centres, Columns, Guide, Steps};
use super::centre::{self, CentreRule, Members};
use super::nearest::{Farthest, Near};
use super::points::{Arrangement, Points};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::run::Context;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Most passes.
    pub passes: usize,
    /// Least relative fall of the objective that is worth another pass.
    pub tolerance: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { passes: 50, tolerance: 1e-4 }
    }
}

/// One pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Objective of (1) as a weighted mean |dL*| of a texel.
    pub mean_lightness_error: f64,
    /// The same in fixed point, summed over all texels.
    pub objective: u64,
    /// Texels that changed their cluster.
    pub moved: usize,
    /// Empty clusters that were given one of the farthest texels.
    pub reseeded: usize,
}

impl Pass {
    /// A pass over `texels` texels.
    pub fn new(
        arrangement: &Arrangement,
        texels: usize,
        objective: u64,
        moved: usize,
        reseeded: usize,
    ) -> Self {
        let mean_lightness_error = arrangement.mean_lightness(objective) / texels.max(1) as f64;
        Self { mean_lightness_error, objective, moved, reseeded }
    }
}

/// Tells the last pass beside the bar, and how many may follow; `each` is the time that one takes, where it is known.
pub(crate) fn announce(passes: &[Pass], limits: Limits, each: Option<Duration>, context: &Context<'_>) {
    let Some(Pass { mean_lightness_error, moved, .. }) = passes.last() else { return };
    let (number, left) = (passes.len(), limits.passes_left(passes));
    let time = each.map_or(String::new(), |each| format!(", {:.0} s", each.as_secs_f64() * left as f64));
    context.progress.remark(&format!(
        "pass {number}: mean |dL*| {mean_lightness_error:.4}, {moved} texels moved; about {left} passes{time} to go"
    ));
}

impl Limits {
    /// Whether these passes are enough: the last one found no cluster empty, and it moved nothing or gained
    /// too little; or there are as many as allowed.
    pub fn reached(&self, passes: &[Pass]) -> bool {
        let converged = passes.last().is_some_and(|last| {
            let before = passes.len().checked_sub(2).map_or(u64::MAX, |before| passes[before].objective);
            let gain = (before as f64 - last.objective as f64) / (before as f64).max(1.0);
            last.reseeded == 0 && (last.moved == 0 || gain < self.tolerance)
        });
        converged || passes.len() >= self.passes
    }

    /// How many passes may follow: gains are taken to go on shrinking as the last two did.
    pub(crate) fn passes_left(&self, passes: &[Pass]) -> usize {
        let most = self.passes.saturating_sub(passes.len());
        let gain = |n: usize| 1.0 - passes[n].objective as f64 / (passes[n - 1].objective as f64).max(1.0);
        let Some(last) = passes.len().checked_sub(1).filter(|&last| last >= 2) else { return most };
        let (now, shrink) = (gain(last), (gain(last) / gain(last - 1)).ln());
        let left = (self.tolerance.max(f64::MIN_POSITIVE) / now).ln() / shrink;
        if shrink < 0.0 && left >= 0.0 { (left.ceil() as usize).min(most) } else { most }
    }
}

/// Centres after the last pass, and how it went.
pub struct Clustering {
    /// Centres [cluster, stride].
    pub centres: Vec<u8>,
    /// Cluster of each texel: the nearest of exactly these centres, ties to the smaller number.
    pub index: Vec<u16>,
    /// The texel nearest to each centre, ties to the smaller number.
    pub nearest: Vec<Near>,
    /// What each pass found.
    pub passes: Vec<Pass>,
}

impl Clustering {
    /// Weighted mean |dL*| of the texels from their centres.
    pub fn mean_lightness_error(&self) -> f64 {
        self.passes.last().map_or(0.0, |pass| pass.mean_lightness_error)
    }
}

/// How to improve centres.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// How centres follow from their texels.
    pub rule: CentreRule,
    /// When to stop.
    pub limits: Limits,
    /// Columns of bounds a texel; they change the time, not the result.
    pub columns: usize,
    /// Instructions to use; the same.
    pub kernel: Kernel,
    /// After this moment no pass begins.
    pub deadline: Option<Instant>,
}

impl Method {
    /// Whether these passes are enough.
    pub fn is_done(&self, passes: &[Pass]) -> bool {
        self.limits.reached(passes) || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// Improves first centres [cluster, stride] pass by pass.
pub fn run(points: &Points, first: Vec<u8>, method: Method, context: &Context<'_>) -> Result<Clustering> {
    let Method { rule, kernel, .. } = method;
    let arrangement = &points.arrangement;
    let stride = arrangement.stride();
    let clusters = first.len() / stride;
    let steps = Steps::of(arrangement);
    let columns = Columns::new(&Centres { arrangement, vectors: &first, kernel }, method.columns);
    let numbers: Vec<u32> = (0..points.len() as u32).collect();
    let (mut index, mut bounds) = (vec![0; points.len()], vec![0; points.len() * columns.count()]);
    let mut distances = vec![0; points.len()];
    let (mut centres, mut guide) = (first, None);
    let mut passes: Vec<Pass> = Vec::new();
    loop {
        context.check_stop()?;
        let before = index.clone();
        let assignment = Assignment {
            centres: Centres { arrangement, vectors: &centres, kernel },
            columns: &columns,
            steps,
            guide,
        };
        let nearest = assignment.assign(&mut Texels {
            vectors: &points.vectors,
            numbers: &numbers,
            index: &mut index,
            bounds: &mut bounds,
            distances: &mut distances,
        });
        let members = Members::of(&index, clusters);
        let mut changed = vec![passes.is_empty(); clusters];
        let mut moved = if passes.is_empty() { points.len() } else { 0 };
        for (&before, &now) in before.iter().zip(&index).filter(|(before, now)| before != now) {
            changed[usize::from(before)] = true;
            changed[usize::from(now)] = true;
            moved += usize::from(!passes.is_empty());
        }
        let empty: Vec<usize> =
            (0..clusters).filter(|&cluster| members.cluster(cluster).is_empty()).collect();
        let farthest = if empty.is_empty() {
            Farthest::default()
        } else {
            Farthest::of(distances.iter().zip(&numbers).map(|(&distance, &texel)| Near { distance, texel }))
        };
        let reseeded = empty.len().min(farthest.texels().len());
        passes.push(Pass::new(arrangement, points.len(), distances.iter().sum(), moved, reseeded));
        announce(&passes, method.limits, None, context);
        if method.is_done(&passes) {
            return Ok(Clustering { centres, index, nearest, passes });
        }
        let old = centres.clone();
        centre::update(points, &members, &changed, rule, kernel, &mut centres);
        for (&cluster, near) in empty.iter().zip(farthest.texels()) {
            centres[cluster * stride..(cluster + 1) * stride]
                .copy_from_slice(points.vector(near.texel as usize));
        }
        let now = Centres { arrangement, vectors: &centres, kernel };
        guide = Some(Guide::new(&now, &columns, steps, &old, &nearest));
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::cluster::points::Arrangement;
    use crate::method::cluster::seeding;
    use crate::random::Hash;
    use crate::run::progress::Silent;
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

    fn cluster(points: &Points, count: usize, threads: usize, method: Method) -> Clustering {
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, threads, 1 << 30).unwrap();
        context.install(|| {
            let seeds = seeding::draw(points, count, 1, 0, method.kernel, &context).unwrap();
            run(points, points.vectors_of(&seeds), method, &context).unwrap()
        })
    }

    fn method(rule: CentreRule, columns: usize, kernel: Kernel) -> Method {
        Method { rule, limits: Limits { passes: 50, tolerance: 0.0 }, columns, kernel, deadline: None }
    }

    fn distance(points: &Points, texel: usize, centre: &[u8]) -> u64 {
        let vector = points.vector(texel);
        let sum = |range: std::ops::Range<usize>| -> u64 {
            range.map(|n| u64::from(vector[n].abs_diff(centre[n]))).sum()
        };
        points.arrangement.groups().iter().map(|g| u64::from(g.weight) * sum(g.start..g.end)).sum()
    }

    #[test]
    fn the_assignment_is_the_true_argmin_and_the_objective_never_rises() {
        for (columns, rule) in [(1, CentreRule::Median), (3, CentreRule::Median), (16, CentreRule::Mean)] {
            let points = points(900, 300);
            let result = cluster(&points, 16, 2, method(rule, columns, Kernel::fastest()));
            let falls = |p: &[Pass]| p[1].objective <= p[0].objective;
            assert!(result.passes.len() > 3);
            assert!(rule == CentreRule::Mean || result.passes.windows(2).all(falls));
            let centres: Vec<&[u8]> = result.centres.chunks_exact(points.arrangement.stride()).collect();
            let mut objective = 0;
            for texel in 0..points.len() {
                let best = (0..16).min_by_key(|&cluster| distance(&points, texel, centres[cluster])).unwrap();
                assert_eq!(usize::from(result.index[texel]), best, "texel {texel}, {columns} columns");
                objective += distance(&points, texel, centres[best]);
            }
            assert_eq!(result.passes.last().unwrap().objective, objective);
            for (cluster, (centre, nearest)) in centres.iter().zip(&result.nearest).enumerate() {
                let key = |&texel: &usize| (distance(&points, texel, centre), texel);
                let best = (0..points.len()).min_by_key(key).unwrap();
                assert_eq!(nearest.texel as usize, best, "cluster {cluster}");
                assert_eq!(nearest.distance, distance(&points, best, centre));
            }
        }
    }

    #[test]
    fn passes_to_go_follow_from_how_gains_shrink() {
        let pass = |objective| Pass { mean_lightness_error: 0.0, objective, moved: 1, reseeded: 0 };
        let limits = Limits { passes: 50, tolerance: 1e-3 };
        let passes = [pass(1_000_000), pass(900_000), pass(855_000), pass(833_625)]; // gains of 0.1, 0.05, 0.025
        assert_eq!(limits.passes_left(&passes), 5); // 0.025 / 2^5 < 0.001
        assert_eq!(limits.passes_left(&passes[..2]), 48);
        assert_eq!(Limits { passes: 6, ..limits }.passes_left(&passes), 2);
        assert_eq!(limits.passes_left(&[pass(10), pass(10), pass(10)]), 47);
    }

    #[test]
    fn separate_kinds_are_found() {
        let points = points(400, 5);
        let result = cluster(&points, 5, 2, method(CentreRule::Median, 5, Kernel::fastest()));
        for texel in 0..points.len() {
            assert_eq!(result.index[texel], result.index[texel % 5]);
        }
    }

    #[test]
    fn threads_kernels_and_bounds_do_not_change_the_result() {
        let points = points(1000, 300);
        for rule in [CentreRule::Median, CentreRule::Mean] {
            let reference = cluster(&points, 16, 1, method(rule, 1, Kernel::Plain));
            for kernel in Kernel::available() {
                for columns in [1, 2, 5, 16] {
                    let result = cluster(&points, 16, 3, method(rule, columns, kernel));
                    assert_eq!(result.centres, reference.centres);
                    assert_eq!(result.index, reference.index);
                    assert_eq!(result.nearest, reference.nearest);
                    assert_eq!(result.passes, reference.passes);
                }
            }
        }
    }

    #[test]
    fn identical_centres_go_by_the_smaller_number() {
        let points = points(300, 7);
        let first = points.vectors_of(&[0, 1, 0, 2, 1, 0]);
        let kernel = Kernel::fastest();
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, 2, 1 << 30).unwrap();
        for columns in [1, 2, 6] {
            let method = Method {
                limits: Limits { passes: 1, tolerance: 0.0 },
                ..method(CentreRule::Median, columns, kernel)
            };
            let result = run(&points, first.clone(), method, &context).unwrap();
            assert!(result.index.iter().all(|cluster| [0, 1, 3].contains(cluster)));
            assert_eq!(result.passes[0].reseeded, 3);
        }
    }

    #[test]
    fn fewer_distinct_brdfs_than_clusters_give_fewer_clusters() {
        let points = points(3, 3);
        let copies = Points { arrangement: points.arrangement.clone(), vectors: points.vectors.repeat(4) };
        assert_eq!(cluster(&copies, 8, 1, method(CentreRule::Median, 8, Kernel::Plain)).nearest.len(), 3);
    }
}

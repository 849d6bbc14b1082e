//! The fewest clusters that keep the error, and the error that each number of clusters leaves.

use serde::{Deserialize, Serialize};

use super::bounds::Centres;
use super::lloyd::{self, Clustering, Method};
use super::points::Points;
use super::{seeding, total_distance};
use crate::error::Result;
use crate::run::Context;

/// What a number of clusters leaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Clusters.
    pub clusters: usize,
    /// Weighted mean |dL*| of the texels from their centres; in a search for an error, from the representatives.
    pub mean_lightness_error: f64,
}

/// Clusterings of the same texels by the first ones of the same seeds.
pub(crate) struct Trials<'a> {
    points: &'a Points,
    method: Method,
    seed: u64,
    seeds: Vec<u32>,
    found: Vec<Trial>,
}

impl<'a> Trials<'a> {
    /// None yet.
    pub(crate) fn new(points: &'a Points, method: Method, seed: u64) -> Self {
        Self { points, method, seed, seeds: Vec::new(), found: Vec::new() }
    }

    /// What was tried, by the number of clusters.
    pub(crate) fn found(mut self) -> Vec<Trial> {
        self.found.sort_by_key(|trial| trial.clusters);
        self.found
    }

    /// Draws `clusters` seeds, or as many as there are distinct BRDFs: how many there are then. All clusterings by no
    /// more begin with the first of these.
    pub(crate) fn draw(&mut self, clusters: usize, context: &Context<'_>) -> Result<usize> {
        if self.seeds.len() < clusters {
            self.seeds = seeding::draw(self.points, clusters, self.seed, 0, self.method.kernel, context)?;
        }
        Ok(self.seeds.len())
    }

    /// Clusters by `clusters` seeds, or as many as there are distinct BRDFs.
    pub(crate) fn run(&mut self, clusters: usize, context: &Context<'_>) -> Result<Clustering> {
        self.draw(clusters, context)?;
        let clusters = clusters.min(self.seeds.len());
        let first = self.points.vectors_of(&self.seeds[..clusters]);
        let clustering = lloyd::run(self.points, first, self.method, context)?;
        self.found.push(Trial { clusters, mean_lightness_error: clustering.mean_lightness_error() });
        Ok(clustering)
    }

    /// Weighted mean |dL*| of the texels from the texels that stand for their clusters, which is what is stored: a little
    /// more than from the centres.
    fn stored_error(&self, clustering: &Clustering, context: &Context<'_>) -> f64 {
        let Points { arrangement, vectors } = self.points;
        let texels: Vec<u32> = clustering.nearest.iter().map(|near| near.texel).collect();
        let representatives = self.points.vectors_of(&texels);
        let centres = Centres { arrangement, vectors: &representatives, kernel: self.method.kernel };
        let total = context.install(|| total_distance(vectors, &clustering.index, &centres));
        arrangement.mean_lightness(total) / self.points.len().max(1) as f64
    }

    /// The fewest clusters, at most `most`, whose representatives leave an error of at most `target`: doubled until they
    /// do, then halved in between. `None` where `most` are too few.
    pub(crate) fn fewest(
        &mut self,
        target: f64,
        most: usize,
        context: &Context<'_>,
    ) -> Result<Option<Clustering>> {
        let (mut too_few, mut enough) = (0, None::<Clustering>);
        let mut clusters = 1;
        loop {
            let clustering = self.run(clusters, context)?;
            let found = clustering.nearest.len();
            let error = self.stored_error(&clustering, context);
            if let Some(trial) = self.found.last_mut() {
                trial.mean_lightness_error = error;
            }
            if error <= target {
                enough = Some(clustering);
            } else {
                too_few = clusters;
                if found < clusters {
                    return Ok(None);
                }
            }
            clusters = match &enough {
                Some(enough) if enough.nearest.len() <= too_few + 1 => break,
                Some(enough) => too_few + (enough.nearest.len() - too_few) / 2,
                None if too_few >= most => break,
                None => (2 * too_few).min(most),
            };
        }
        Ok(enough)
    }
}

/// A number of clusters that may do where `clusters` leave `error` of the `target`: the error falls as a power of the
/// number, by what the trials tell.
pub(crate) fn more_clusters(clusters: usize, error: f64, target: f64, trials: &[Trial]) -> usize {
    /// Of a surface in many dimensions the error falls slowly.
    const STEADIEST: f64 = 0.1;
    let slope = trials
        .windows(2)
        .rfind(|pair| pair[1].clusters <= clusters.max(2) && pair[1].mean_lightness_error > 0.0)
        .map(|pair| {
            let error = (pair[0].mean_lightness_error / pair[1].mean_lightness_error).ln();
            error / (pair[1].clusters as f64 / pair[0].clusters as f64).ln()
        });
    let slope = slope.filter(|slope| slope.is_finite()).unwrap_or(STEADIEST).max(STEADIEST);
    let more = (clusters as f64 * (error / target).powf(1.0 / slope)).ceil();
    (more.min(2.0 * clusters as f64) as usize).max(clusters + 1)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::kernel::Kernel;
    use crate::method::cluster::centre::CentreRule;
    use crate::method::cluster::lloyd::Limits;
    use crate::method::cluster::points::Arrangement;
    use crate::random::Hash;
    use crate::run::progress::Silent;
    use btfkit_formats::Direction;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn the_fewest_clusters_keep_the_error_and_one_less_does_not() {
        let arrangement = Arrangement::new(&[Direction::from_degrees(0.0, 0.0)], 40);
        let hash = Hash::new(3, 0);
        let mut vectors = vec![0; 300 * arrangement.stride()];
        let codes: Vec<u8> =
            (0..300 * 40).map(|n| (n / 40 % 240) as u8 + (hash.words(n, 0, 0)[0] % 9) as u8).collect();
        arrangement.insert_view(&mut vectors, 0, &codes);
        let points = Points { arrangement, vectors };
        let limits = Limits { passes: 30, tolerance: 0.0 };
        let method = Method {
            rule: CentreRule::Median,
            limits,
            columns: 300,
            kernel: Kernel::fastest(),
            deadline: None,
        };
        let stop = AtomicBool::new(false);
        let context = Context::new(&Silent, &stop, 1, 1 << 30).unwrap();
        let mut trials = Trials::new(&points, method, 1);
        let enough = trials.fewest(2.0, 300, &context).unwrap().unwrap();
        let clusters = enough.nearest.len();
        let error = trials.stored_error(&enough, &context);
        assert!(enough.mean_lightness_error() < error && error <= 2.0 && clusters > 8, "{clusters}: {error}");
        let fewer = trials.run(clusters - 1, &context).unwrap();
        assert!(trials.stored_error(&fewer, &context) > 2.0);
        assert!(trials.fewest(0.001, 20, &context).unwrap().is_none());
        let found = trials.found();
        assert!(found.windows(2).all(|pair| pair[0].clusters <= pair[1].clusters));
    }

    #[test]
    fn more_clusters_follow_the_slope_of_the_trials() {
        let trial =
            |clusters: usize| Trial { clusters, mean_lightness_error: 8.0 / (clusters as f64).sqrt() };
        let trials: Vec<Trial> = [1, 2, 4, 8, 16].map(trial).to_vec();
        assert_eq!(more_clusters(16, 2.2, 2.0, &trials), 20); // 16 (2.2 / 2)^2 = 19.36
        assert_eq!(more_clusters(16, 2.0001, 2.0, &trials), 17);
        assert_eq!(more_clusters(16, 20.0, 2.0, &trials), 32);
    }
}

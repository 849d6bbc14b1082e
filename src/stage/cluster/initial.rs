//! The initial clustering: k-medians of texels that fit in memory, all of them or a sample drawn without preference
//! from the whole measurement or from the first mini-batch.

use std::time::Instant;

use crate::error::{Error, Result};
use crate::method::cluster::bounds::Centres;
use crate::method::cluster::lloyd::{self, Clustering, Method};
use crate::method::cluster::points::Points;
use crate::method::cluster::search::{Trial, Trials, more_clusters};
use crate::method::cluster::{seeding, total_distance};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::stage::cluster::budget::Budget;
use crate::stage::cluster::finish::Clustered;
use crate::stage::cluster::stream::Stream;
use crate::stage::cluster::{Amount, Plan, Report};
use crate::store::clustering::{History, Passes, State};
use crate::words::counted;

impl Plan {
    /// Clusters all texels in memory.
    pub(super) fn run_in_memory(&self, deadline: Option<Instant>, context: &Context<'_>) -> Result<Report> {
        let budget = Budget::of_initial(self, context)?;
        let points = self.read_sample(context)?;
        let method = self.method(budget.sample_columns, deadline);
        let (clustering, trials) = self.cluster_points(&points, budget.clusters, method, context)?;
        let Clustering { centres, index, nearest, passes } = clustering;
        let history = History { passes, trials, ..History::default() };
        let clustered = Clustered { centres, index, nearest, history };
        let represented = self.represent(&clustered, context)?;
        let centres =
            Centres { arrangement: &self.arrangement, vectors: &represented.vectors, kernel: method.kernel };
        let from_representatives =
            context.install(|| total_distance(&points.vectors, &clustered.index, &centres));
        drop(points);
        self.finish(&clustered, represented, from_representatives, context)
    }

    /// What the first pass over all texels begins with.
    pub(super) fn initial_clustering(
        &self,
        deadline: Option<Instant>,
        context: &Context<'_>,
    ) -> Result<State> {
        let budget = Budget::of_initial(self, context)?;
        let points = self.read_sample(context)?;
        let method = self.method(budget.sample_columns, deadline);
        let (clustering, trials) = self.cluster_points(&points, budget.clusters, method, context)?;
        Ok(self.state_of(clustering, History { trials, ..History::default() }))
    }

    /// The same with more clusters than those that left too large an error; it is written as the beginning of `pass`.
    pub(super) fn restart(
        &self,
        passes: &Passes,
        pass: usize,
        history: History,
        deadline: Option<Instant>,
        context: &Context<'_>,
    ) -> Result<State> {
        let clusters = self.more_than_tried(&history);
        let method = self.method(Budget::of(self, clusters, context)?.sample_columns, deadline);
        let points = self.read_sample(context)?;
        context.progress.begin("cluster sample", clusters as u64, Counted::Items("centres"));
        let mut trials = Trials::new(&points, method, self.options.seed);
        let clustering = context.install(|| trials.run(clusters, context))?;
        context.progress.end();
        if let Some(last) = history.attempts.last().filter(|last| clustering.nearest.len() <= last.clusters) {
            return Err(Error::usage(format!(
                "{}, as many as a sample of {} gives, leave a mean |dL*| of {:.3}",
                counted(last.clusters, "cluster"),
                counted(points.len(), "texel"),
                last.mean_lightness_error
            ))
            .hint("choose a larger --error or a larger --sample"));
        }
        let state = self.state_of(clustering, history);
        passes.write_state(pass, self.brdf(), &state)?;
        Ok(state)
    }

    /// Clusters to try after those that were too few.
    fn more_than_tried(&self, history: &History) -> usize {
        match (history.attempts.last(), self.options.amount) {
            (Some(last), Amount::Error(target)) => {
                more_clusters(last.clusters, last.mean_lightness_error, target, &history.trials)
                    .min(self.most_clusters)
            }
            _ => self.most_clusters,
        }
    }

    fn state_of(&self, clustering: Clustering, history: History) -> State {
        State {
            centres: self.arrangement.plain(&clustering.centres),
            index: Vec::new(),
            history: History {
                passes: Vec::new(),
                batches: Vec::new(),
                batch: self.first_batch(),
                sample_texels: self.sample_texels(),
                sample_passes: clustering.passes,
                ..history
            },
        }
    }

    /// Clusters texels in memory: the best of some draws, or the fewest clusters that do.
    fn cluster_points(
        &self,
        points: &Points,
        most: usize,
        method: Method,
        context: &Context<'_>,
    ) -> Result<(Clustering, Vec<Trial>)> {
        let most = most.min(points.len());
        let draws = self.options.restarts.max(1);
        context.progress.begin("cluster", most as u64 * u64::from(draws), Counted::Items("centres"));
        let found = context.install(|| match self.options.amount {
            Amount::Error(target) => {
                let mut trials = Trials::new(points, method, self.options.seed);
                let Some(clustering) = trials.fewest(target, most, context)? else {
                    return Err(Error::usage(format!("{most} clusters leave a mean |dL*| above {target}"))
                        .hint(
                            "choose a larger --error, more --memory to search in, or a number of --clusters",
                        ));
                };
                Ok((clustering, trials.found()))
            }
            Amount::Usual | Amount::Clusters(_) | Amount::Ratio(_) => {
                let mut best: Option<Clustering> = None;
                for attempt in 0..draws {
                    let seeds =
                        seeding::draw(points, most, self.options.seed, attempt, method.kernel, context)?;
                    let clustering = lloyd::run(points, points.vectors_of(&seeds), method, context)?;
                    let objective = |c: &Clustering| c.passes.last().map_or(0, |pass| pass.objective);
                    if best.as_ref().is_none_or(|best| objective(&clustering) < objective(best)) {
                        best = Some(clustering);
                    }
                }
                let best = best.ok_or_else(|| Error::internal("no draw of first centres"))?;
                Ok((best, Vec::new()))
            }
        })?;
        context.progress.end();
        Ok(found)
    }

    /// Reads the texels of the sample, in the order of their numbers.
    pub(super) fn read_sample(&self, context: &Context<'_>) -> Result<Points> {
        let blocks = self.first_batch().unwrap_or(self.selection.blocks().len());
        let sample = self.selection.sample(blocks, self.sample_texels(), self.options.seed);
        let stride = self.arrangement.stride();
        let mut vectors = vec![0; sample.len() * stride];
        let title = if self.fits_the_sample() { "read luminance" } else { "read sample" };
        let passing = self.selection.slots_of(&(0..blocks)).len();
        context.progress.begin(title, passing as u64, Counted::Items("texels"));
        let mut stream = Stream::new(&self.measurement, &self.arrangement, &self.selection, 0);
        stream.for_each(0..blocks, context, |block, read| {
            for (vector, number) in read.chunks_exact(stride).zip(self.selection.numbers(block.slots.clone()))
            {
                if let Ok(at) = sample.binary_search(number) {
                    vectors[at * stride..(at + 1) * stride].copy_from_slice(vector);
                }
            }
            Ok(())
        })?;
        context.progress.end();
        Ok(Points { arrangement: self.arrangement.clone(), vectors })
    }
}

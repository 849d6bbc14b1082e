//! A pass over all texels or a mini-batch: assigned, counted and forgotten, block by block; then summed up.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::method::cluster::assign::{Assignment, Texels};
use crate::method::cluster::bounds::{Centres, Columns, Guide, Steps};
use crate::method::cluster::lloyd::{self, Pass};
use crate::method::cluster::nearest::{Farthest, Near, nearer};
use crate::method::cluster::search::Trial;
use crate::method::cluster::tally::Tally;
use crate::method::cluster::total_distance;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::stage::cluster::budget::Budget;
use crate::stage::cluster::finish::Clustered;
use crate::stage::cluster::stream::Stream;
use crate::stage::cluster::{Amount, Plan, Report, Stepped};
use crate::store::clustering::{BatchPass, Found, History, Passes, State};

/// What follows a pass.
pub(super) enum Next {
    /// Another one, which begins with this.
    Pass(Box<State>),
    /// A initial clustering with more clusters: these left too large an error.
    Restart(Box<History>),
    /// Nothing.
    Finished(Box<Clustered>),
}

/// How a clustering ends.
pub(super) enum End {
    /// The model is written.
    Model(Box<Report>),
    /// Representatives leave too large an error.
    TooLarge(Box<History>),
}

/// What one process keeps from pass to pass.
pub(super) struct Work<'a> {
    plan: &'a Plan,
    stream: Stream<'a>,
    columns_allowed: usize,
    /// Bounds [slot, column] of the slots that the last pass went over, and what they were made by.
    bounds: Option<Bounds>,
    /// What the last pass took.
    pass_time: Option<Duration>,
}

struct Bounds {
    columns: Columns,
    values: Vec<u16>,
    /// Centres of the last pass, and the texel nearest to each.
    centres: Vec<u8>,
    nearest: Vec<Near>,
}

impl<'a> Work<'a> {
    /// For passes one after another over all texels.
    pub(super) fn new(plan: &'a Plan, clusters: usize, context: &Context<'_>) -> Result<Self> {
        let Budget { columns, kept_blocks, .. } = Budget::of(plan, clusters, context)?;
        Ok(Self::with(plan, columns, kept_blocks))
    }

    fn with(plan: &'a Plan, columns_allowed: usize, kept_blocks: usize) -> Self {
        let stream = Stream::new(&plan.measurement, &plan.arrangement, &plan.selection, kept_blocks);
        Self { plan, stream, columns_allowed, bounds: None, pass_time: None }
    }

    /// Runs the pass that begins with `state`, writes what the next one begins with, and returns it.
    pub(super) fn run(
        &mut self,
        passes: &Passes,
        pass: usize,
        state: &State,
        deadline: Option<Instant>,
        context: &Context<'_>,
    ) -> Result<Next> {
        let blocks = 0..self.plan.blocks_of(&state.history)?;
        let texels = self.plan.selection.slots_of(&blocks).len();
        context.progress.begin(&title(&state.history), texels as u64, Counted::Items("texels"));
        lloyd::announce(&state.history.passes, self.plan.options.limits, self.pass_time, context);
        let start = Instant::now();
        let found = self.assign(blocks, state, context)?;
        self.pass_time = state.history.batch.is_none().then(|| start.elapsed());
        context.progress.end();
        self.plan.follow(passes, pass, state, found, deadline, context)
    }

    /// Assigns the texels of some blocks to the centres of `state`.
    fn assign(&mut self, blocks: Range<usize>, state: &State, context: &Context<'_>) -> Result<Found> {
        let Plan { arrangement, selection, .. } = self.plan;
        let method = self.plan.method(self.columns_allowed, None);
        let (rule, kernel) = (method.rule, method.kernel);
        let centres = arrangement.arranged(&state.centres);
        let slots = selection.slots_of(&blocks);
        let now = Centres { arrangement, vectors: &centres, kernel };
        let steps = Steps::of(arrangement);
        let mut bounds = match self.bounds.take() {
            Some(bounds) => bounds,
            None => {
                let columns = context.install(|| Columns::new(&now, self.columns_allowed));
                Bounds { columns, values: Vec::new(), centres: Vec::new(), nearest: Vec::new() }
            }
        };
        let columns = bounds.columns.count();
        // Of texels that the last pass did not go over there are no bounds yet: all their distances are computed.
        let bounded = bounds.values.len() / columns;
        let fresh = Assignment { centres: now, columns: &bounds.columns, steps, guide: None };
        let guided = (bounded > 0).then(|| {
            let guide = context
                .install(|| Guide::new(&now, &bounds.columns, steps, &bounds.centres, &bounds.nearest));
            Assignment { guide: Some(guide), ..fresh }
        });
        let clusters = now.count();
        let known = state.index.get(slots.start..).unwrap_or_default();
        let known = &known[..known.len().min(slots.len())];
        let mut found = Found {
            index: known.to_vec(),
            tally: Tally::new(rule, clusters, arrangement.stride()),
            nearest: vec![Near::NONE; clusters],
            farthest: Farthest::default(),
            distances: vec![0; clusters],
            moved: slots.len() - known.len(),
        };
        found.index.resize(slots.len(), 0);
        let values = &mut bounds.values;
        values.reserve_exact(slots.len() * columns - values.len());
        values.resize(slots.len() * columns, 0);
        let mut distances = Vec::new();
        self.stream.for_each(blocks, context, |block, vectors| {
            let here = block.slots.start - slots.start..block.slots.end - slots.start;
            let numbers = selection.numbers(block.slots.clone());
            let index = &mut found.index[here.clone()];
            distances.resize(index.len(), 0);
            let assignment = guided.as_ref().filter(|_| here.end <= bounded).unwrap_or(&fresh);
            let nearest = assignment.assign(&mut Texels {
                vectors,
                numbers,
                index,
                bounds: &mut values[here.start * columns..here.end * columns],
                distances: &mut distances,
            });
            found.tally.add(&centres, vectors, index, kernel);
            found.nearest = nearer(std::mem::take(&mut found.nearest), nearest);
            for (&cluster, distance) in index.iter().zip(&distances) {
                found.distances[usize::from(cluster)] += distance;
            }
            let before = known.get(here.start..).unwrap_or_default();
            found.moved += before.iter().zip(index.iter()).filter(|(before, now)| before != now).count();
            let texels = distances.iter().zip(numbers);
            found.farthest.add(texels.map(|(&distance, &texel)| Near { distance, texel }));
            Ok(())
        })?;
        bounds.centres = centres;
        bounds.nearest = found.nearest.clone();
        self.bounds = Some(bounds);
        Ok(found)
    }
}

impl Work<'_> {
    /// Writes the model, unless its representatives leave more than was asked for: then there are to be more clusters.
    /// What they leave takes the texels once more: only now are they known.
    pub(super) fn finish(&mut self, clustered: &Clustered, context: &Context<'_>) -> Result<End> {
        let Plan { arrangement, selection, .. } = self.plan;
        let represented = self.plan.represent(clustered, context)?;
        let kernel = self.plan.method(0, None).kernel;
        let representatives = Centres { arrangement, vectors: &represented.vectors, kernel };
        let blocks = 0..selection.blocks().len();
        context.progress.begin("representatives", selection.texels() as u64, Counted::Items("texels"));
        let mut total = 0;
        self.stream.for_each(blocks, context, |block, points| {
            let numbers = selection.numbers(block.slots.clone());
            let index: Vec<u16> = numbers.iter().map(|&number| clustered.index[number as usize]).collect();
            total += total_distance(points, &index, &representatives);
            Ok(())
        })?;
        context.progress.end();
        let error = arrangement.mean_lightness(total) / selection.texels().max(1) as f64;
        match self.plan.too_large(clustered.nearest.len(), error, &clustered.history) {
            Some(history) => Ok(End::TooLarge(Box::new(history))),
            None => self
                .plan
                .finish(clustered, represented, total, context)
                .map(|report| End::Model(Box::new(report))),
        }
    }
}

/// What a pass goes over.
fn title(history: &History) -> String {
    match history.batch {
        Some(_) => format!("mini-batch pass {}", history.batches.len() + 1),
        None => format!("pass {}", history.passes.len() + 1),
    }
}

impl Plan {
    /// Assigns a shard's parts of a pass.
    pub(super) fn assign_shard(
        &self,
        passes: &Passes,
        pass: usize,
        shard: Shard,
        context: &Context<'_>,
    ) -> Result<Stepped> {
        let state = passes.state(pass, self.brdf(), self.selection.texels())?;
        let parts = self.selection.parts(self.blocks_of(&state.history)?);
        let parts: Vec<_> = parts.iter().enumerate().filter(|&(part, _)| shard.has(part)).collect();
        let texels: usize = parts.iter().map(|(_, blocks)| self.selection.slots_of(blocks).len()).sum();
        context.progress.begin(&title(&state.history), texels as u64, Counted::Items("texels"));
        let (mut found, mut written) = (0, 0);
        for (part, blocks) in parts {
            if passes.has_part(pass, part)? {
                context.progress.advance(self.selection.slots_of(blocks).len() as u64);
                found += 1;
                continue;
            }
            // Bounds do not outlive a part: one column is the least.
            let mut work = Work::with(self, 1, 0);
            let assigned = work.assign(blocks.clone(), &state, context)?;
            passes.write_part(pass, part, &assigned)?;
            written += 1;
        }
        context.progress.end();
        Ok(Stepped::Assigned { pass, found, written })
    }

    /// Sums up the parts of a pass.
    pub(super) fn reduce(&self, passes: &Passes, pass: usize, context: &Context<'_>) -> Result<Stepped> {
        let state = passes.state(pass, self.brdf(), self.selection.texels())?;
        let stride = self.arrangement.stride();
        let mut whole: Option<Found> = None;
        let parts = self.selection.parts(self.blocks_of(&state.history)?);
        for (part, blocks) in parts.iter().enumerate() {
            context.check_stop()?;
            let slots = self.selection.slots_of(blocks).len();
            let found = passes.part(pass, part, slots, self.options.centre, stride)?;
            whole = Some(match whole {
                None => found,
                Some(whole) => whole.with(found),
            });
        }
        let whole = whole.ok_or_else(|| Error::internal("a tile without texels"))?;
        match self.follow(passes, pass, &state, whole, None, context)? {
            Next::Pass(_) => Ok(Stepped::Next(pass + 1)),
            Next::Restart(history) => {
                self.restart(passes, pass + 1, *history, None, context)?;
                Ok(Stepped::Next(pass + 1))
            }
            Next::Finished(result) => match Work::with(self, 1, 0).finish(&result, context)? {
                End::Model(report) => Ok(Stepped::Done(report)),
                End::TooLarge(history) => {
                    self.restart(passes, pass + 1, *history, None, context)?;
                    Ok(Stepped::Next(pass + 1))
                }
            },
        }
    }

    /// How a clustering went that leaves more than was asked for, with this attempt; none where it does not, or where
    /// there are to be no more clusters.
    fn too_large(&self, clusters: usize, error: f64, history: &History) -> Option<History> {
        let too_large = matches!(self.options.amount, Amount::Error(target) if error > target);
        (too_large && clusters < self.most_clusters).then(|| {
            let mut history = history.clone();
            history.attempts.push(Trial { clusters, mean_lightness_error: error });
            history
        })
    }

    /// What follows a pass that began with `state`; what the next one begins with is written.
    fn follow(
        &self,
        passes: &Passes,
        pass: usize,
        state: &State,
        found: Found,
        deadline: Option<Instant>,
        context: &Context<'_>,
    ) -> Result<Next> {
        let empty = found.tally.empty_clusters();
        let reseeded = empty.len().min(found.farthest.texels().len());
        let texels = found.index.len();
        let mut history = state.history.clone();
        let this = Pass::new(&self.arrangement, texels, found.objective(), found.moved, reseeded);
        match history.batch {
            Some(_) => history.batches.push(BatchPass { texels, pass: this }),
            None => history.passes.push(this),
        }
        let mut centres = self.arrangement.arranged(&state.centres);
        if history.batch.is_none() && self.method(0, deadline).is_done(&history.passes) {
            let error = history.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
            let clusters = found.nearest.len();
            if let Some(history) = self.too_large(clusters, error, &history) {
                return Ok(Next::Restart(Box::new(history)));
            }
            let index = self.selection.by_number(&found.index);
            let nearest = found.nearest;
            return Ok(Next::Finished(Box::new(Clustered { centres, index, nearest, history })));
        }
        found.tally.update(&mut centres);
        let stride = self.arrangement.stride();
        let farthest: Vec<[u32; 2]> = found.farthest.texels()[..reseeded]
            .iter()
            .map(|near| self.tile.source[near.texel as usize])
            .collect();
        let vectors = self.read_vectors(&farthest, context)?;
        for (cluster, vector) in empty.into_iter().zip(vectors.chunks_exact(stride)) {
            centres[cluster * stride..(cluster + 1) * stride].copy_from_slice(vector);
        }
        if let Some(blocks) = history.batch {
            history.batch = self.next_batch(blocks, &history, &found, &state.centres, &centres, deadline);
        }
        let next = State { centres: self.arrangement.plain(&centres), index: found.index, history };
        passes.write_state(pass + 1, self.brdf(), &next)?;
        Ok(Next::Pass(Box::new(next)))
    }
}

//! What memory allows: how many bounds a texel has and how many blocks are kept.

use crate::error::Result;
use crate::method::cluster::centre::CentreRule;
use crate::method::cluster::points::Arrangement;
use crate::method::cluster::seeding;
use crate::method::cluster::selection::BLOCK_TEXELS;
use crate::method::cluster::tally::Tally;
use crate::run::Context;
use crate::run::read_ahead::IN_FLIGHT;
use crate::stage::cluster::stream::Stream;
use crate::stage::cluster::{Amount, First, MOST_CLUSTERS, Options, Plan, USUAL_CLUSTERS, clusters_of_ratio};
use crate::store::measurement::Description;
use crate::words::counted;

/// The program itself, and what allocators keep.
const PROGRAM_BYTES: usize = 64 << 20;

/// Most bytes of the sample's vectors, unless told otherwise. Fixed, so that a result does not depend on memory.
const SAMPLE_BYTES: usize = 192 << 20;

/// The part of memory that is left to the allocator and the system, so that the promise holds with room to spare.
const SPARE_PART: usize = 16;

/// Blocks' worth of memory that the allocator cannot give back for lying between blocks that are kept.
const SCATTERED_BLOCKS: usize = 3;

/// Texels whose distances to all centres a thread holds.
const TABLE_TEXELS: usize = 64;

/// How memory is spent.
pub(super) struct Budget {
    /// Clusters that it is for.
    pub(super) clusters: usize,
    /// Columns of bounds of a texel in the sample.
    pub(super) sample_columns: usize,
    /// Columns of bounds of a texel in passes over all.
    pub(super) columns: usize,
    /// Blocks that are kept from pass to pass.
    pub(super) kept_blocks: usize,
}

impl Plan {
    /// Texels of the sample.
    pub(super) fn sample_texels(&self) -> usize {
        let affordable = SAMPLE_BYTES / self.arrangement.stride();
        let least = self.least_sample();
        let enough = match self.first {
            First::Sample => affordable,
            First::Minibatch => seeding::drawn_from(least).min(affordable),
        };
        self.options.sample.unwrap_or(enough).max(least).min(self.selection.texels())
    }

    /// No fewer texels than clusters that are asked for.
    fn least_sample(&self) -> usize {
        match self.options.amount {
            Amount::Usual | Amount::Clusters(_) | Amount::Ratio(_) => self.most_clusters,
            Amount::Error(_) => 1,
        }
    }

    /// Whether the sample is all texels.
    pub(super) fn fits_the_sample(&self) -> bool {
        self.sample_texels() == self.selection.texels()
    }
}

impl Budget {
    /// Bytes below which there is no budget for so many clusters.
    fn least(plan: &Plan, clusters: usize, threads: usize) -> usize {
        let both = Needs::both(plan, clusters, threads);
        both.map(|needs| needs.fixed + needs.texels * size_of::<u16>()).into_iter().max().unwrap_or(0)
    }

    /// What the context's memory allows for so many clusters.
    ///
    /// # Errors
    /// Where there is too little for one column of bounds.
    pub(super) fn of(plan: &Plan, clusters: usize, context: &Context<'_>) -> Result<Self> {
        let needed = Self::least(plan, clusters, context.threads);
        let memory = usize::try_from(context.memory_bytes).unwrap_or(usize::MAX);
        let memory = (memory - memory / SPARE_PART).max(needed);
        let what = format!(
            "clustering {} into {}",
            counted(plan.selection.texels(), "texel"),
            counted(clusters, "cluster")
        );
        let otherwise = "choose fewer clusters (--clusters, --most), or --centre mean, which takes less";
        context.memory().require(&what, needed as u64, otherwise)?;
        let [sample, all] = Needs::both(plan, clusters, context.threads);
        let columns = |needs: &Needs| {
            ((memory - needs.fixed) / (needs.texels * size_of::<u16>()).max(1)).clamp(1, clusters)
        };
        let left = memory - all.fixed - all.texels * columns(&all) * size_of::<u16>();
        let block = plan.selection.blocks().iter().map(|block| block.slots.len()).max().unwrap_or(1);
        Ok(Self {
            clusters,
            sample_columns: columns(&sample),
            columns: columns(&all),
            kept_blocks: (left / (block * plan.arrangement.stride())).saturating_sub(SCATTERED_BLOCKS),
        })
    }

    /// The same for as many clusters as are asked for, or as a search may go up to within memory.
    pub(super) fn of_initial(plan: &Plan, context: &Context<'_>) -> Result<Self> {
        let mut clusters = plan.most_clusters;
        if let Amount::Error(_) = plan.options.amount {
            while clusters > 1 && Self::least(plan, clusters, context.threads) as u64 > context.memory_bytes {
                clusters /= 2;
            }
        }
        Self::of(plan, clusters, context)
    }
}

/// What the needs depend on.
struct Sizes {
    texels: usize,
    sample: usize,
    clusters: usize,
    /// Bytes of a texel's vector.
    stride: usize,
    /// Bytes of blocks that are read ahead.
    flight: usize,
    centre: CentreRule,
    threads: usize,
}

/// Memory that is enough to cluster any tile of at most so many texels of a measurement, before there is one.
pub(crate) fn enough_bytes(
    options: &Options,
    description: &Description,
    texels: usize,
    threads: usize,
) -> u64 {
    let arrangement = Arrangement::new(&description.views, description.lights.len());
    let stride = arrangement.stride();
    let brdf = description.bytes_of(1);
    let clusters = match options.amount {
        Amount::Usual => USUAL_CLUSTERS,
        Amount::Clusters(clusters) => clusters,
        Amount::Ratio(ratio) => clusters_of_ratio(description.bytes(), brdf, 0, ratio),
        // A search goes up to what memory allows.
        Amount::Error(_) => 1,
    };
    let clusters = clusters.clamp(1, texels.clamp(1, MOST_CLUSTERS));
    let sample = options.sample.unwrap_or(SAMPLE_BYTES / stride).max(clusters).min(texels);
    let flight = BLOCK_TEXELS * (IN_FLIGHT * stride + arrangement.cosines().len() * arrangement.lights());
    let centre = options.centre;
    let needs = Needs::of(&Sizes { texels, sample, clusters, stride, flight, centre, threads });
    needs.map(|needs| needs.fixed + needs.texels * size_of::<u16>()).into_iter().max().unwrap_or(0) as u64
}

/// Bytes that a phase takes beside bounds and kept blocks, and the texels that bounds are for.
struct Needs {
    fixed: usize,
    texels: usize,
}

impl Needs {
    fn both(plan: &Plan, clusters: usize, threads: usize) -> [Self; 2] {
        Self::of(&Sizes {
            texels: plan.selection.texels(),
            sample: plan.sample_texels(),
            clusters,
            stride: plan.arrangement.stride(),
            flight: Stream::bytes_in_flight(&plan.selection, &plan.arrangement),
            centre: plan.options.centre,
            threads,
        })
    }

    /// Those of the first approach and of a pass over all texels.
    fn of(sizes: &Sizes) -> [Self; 2] {
        let &Sizes { texels, sample, clusters, stride, flight, centre, threads } = sizes;
        // Sources, places, numbers, index now and before, distances.
        let listed = texels * (8 + 4 + 4 + 2 + 2);
        let tables = threads * clusters * (TABLE_TEXELS * size_of::<u64>() + 16);
        let between = clusters * clusters * (size_of::<u64>() + size_of::<u16>());
        let common = PROGRAM_BYTES + listed + tables + between + 4 * clusters * stride;
        let tally = Tally::bytes(centre, clusters, stride);
        [
            Self { fixed: common + sample * (stride + 40) + flight, texels: sample },
            Self { fixed: common + flight + tally, texels },
        ]
    }
}

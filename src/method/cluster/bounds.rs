//! What rules centres out without a distance (Elkan 2003, and by columns of several centres Ding et al. 2015): lower
//! bounds of the distances from each texel to each column, kept true by triangle inequalities. They never change a
//! result, ties included; only how many distances are computed.

use rayon::prelude::*;

use super::nearest::Near;
use super::points::Arrangement;
use crate::kernel::Kernel;
use crate::kernel::bounds;

/// Distances as u16 steps of a power of two.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    bits: u32,
}

impl Steps {
    /// Steps in which the longest distance of an arrangement fits.
    pub fn of(arrangement: &Arrangement) -> Self {
        let longest = 255 * arrangement.weight_sum();
        Self { bits: (u64::BITS - longest.leading_zeros()).saturating_sub(u16::BITS) }
    }

    /// The most steps that a distance certainly has.
    pub fn floor(self, distance: u64) -> u16 {
        (distance >> self.bits).min(u64::from(u16::MAX)) as u16
    }

    /// The fewest steps that are certainly no less than a distance.
    pub(crate) fn ceiling(self, distance: u64) -> u16 {
        self.floor(distance).saturating_add(1)
    }
}

/// Centres that share a lower bound.
#[derive(Clone, Debug)]
pub struct Columns {
    of: Vec<u16>,
    members: Vec<Vec<u16>>,
}

impl Columns {
    /// At most `count` columns: one a centre where that is enough, else each centre goes with the nearest of the
    /// first `count`.
    pub fn new(centres: &Centres<'_>, count: usize) -> Self {
        let clusters = centres.count();
        let count = count.clamp(1, clusters);
        let of: Vec<u16> = if count == clusters {
            (0..clusters).map(|cluster| cluster as u16).collect()
        } else {
            let heads =
                Centres { vectors: &centres.vectors[..count * centres.arrangement.stride()], ..*centres };
            let distances = centres.distances_to(&heads);
            distances
                .chunks_exact(count)
                .map(|row| (0..count).min_by_key(|&head| (row[head], head)).unwrap_or(0) as u16)
                .collect()
        };
        let mut members = vec![Vec::new(); count];
        for (cluster, &column) in of.iter().enumerate() {
            members[usize::from(column)].push(cluster as u16);
        }
        Self { of, members }
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.members.len()
    }

    /// The column of a centre.
    pub fn of(&self, cluster: u16) -> usize {
        usize::from(self.of[usize::from(cluster)])
    }

    /// The centres of a column.
    pub fn members(&self, column: usize) -> &[u16] {
        &self.members[column]
    }

    /// For each column the largest of its centres' values.
    fn most(&self, values: &[u16]) -> Vec<u16> {
        let most = |members: &Vec<u16>| members.iter().map(|&c| values[usize::from(c)]).max().unwrap_or(0);
        self.members.iter().map(most).collect()
    }
}

/// Centres, and how their vectors lie.
#[derive(Clone, Copy)]
pub struct Centres<'a> {
    /// Where directions lie in a vector.
    pub arrangement: &'a Arrangement,
    /// Vectors [cluster, stride].
    pub vectors: &'a [u8],
    /// How distances are computed.
    pub kernel: Kernel,
}

impl Centres<'_> {
    /// Number of clusters.
    pub fn count(&self) -> usize {
        self.vectors.len() / self.arrangement.stride()
    }

    /// The vector of a centre.
    pub fn vector(&self, cluster: u16) -> &[u8] {
        let stride = self.arrangement.stride();
        &self.vectors[usize::from(cluster) * stride..][..stride]
    }

    /// Distances of these centres to others, row by row.
    fn distances_to(&self, others: &Self) -> Vec<u64> {
        /// Rows that a thread takes at a time.
        const ROWS: usize = 16;
        let (stride, groups) = (self.arrangement.stride(), self.arrangement.groups());
        let count = others.count();
        let mut distances = vec![0; self.count() * count];
        let rows = distances.par_chunks_mut(ROWS * count).zip(self.vectors.par_chunks(ROWS * stride));
        rows.for_each(|(row, vectors)| {
            self.kernel.distances(vectors, others.vectors, stride, groups, row);
        });
        distances
    }

    /// Distance of each centre to where it was before.
    pub(crate) fn drifts(&self, before: &[u8]) -> Vec<u64> {
        let stride = self.arrangement.stride();
        let pairs = self.vectors.par_chunks_exact(stride).zip(before.par_chunks_exact(stride));
        pairs
            .map(|(now, before)| self.kernel.row_distances(now, [before], self.arrangement.groups())[0])
            .collect()
    }
}

/// What a pass knows of its centres before it looks at a texel.
pub(crate) struct Guide {
    drift: Vec<u16>,
    between: Vec<u16>,
    reach: Vec<u16>,
}

impl Guide {
    /// For centres that lay at `before` in the last pass, where the texel nearest to each was at `nearest`.
    pub(crate) fn new(
        centres: &Centres<'_>,
        columns: &Columns,
        steps: Steps,
        before: &[u8],
        nearest: &[Near],
    ) -> Self {
        let clusters = centres.count();
        let drifts = centres.drifts(before);
        // The texel that was nearest is now no farther than this, so the nearest one is not either.
        let reach: Vec<u16> = drifts
            .iter()
            .zip(nearest)
            .map(|(&drift, near)| steps.ceiling(near.distance.saturating_add(drift)))
            .collect();
        let drift: Vec<u16> =
            drifts.iter().map(|&drift| steps.ceiling(drift) - u16::from(drift == 0)).collect();
        let mut between = vec![u16::MAX; clusters * columns.count()];
        let distances = centres.distances_to(centres);
        for (from, (row, distances)) in
            between.chunks_exact_mut(columns.count()).zip(distances.chunks_exact(clusters)).enumerate()
        {
            for (to, &distance) in distances.iter().enumerate().filter(|&(to, _)| to != from) {
                let bound = &mut row[columns.of(to as u16)];
                *bound = steps.floor(distance).min(*bound);
            }
        }
        Self { drift: columns.most(&drift), between, reach: columns.most(&reach) }
    }

    /// What the texels of a cluster are pruned by.
    pub(crate) fn of(&self, cluster: u16) -> bounds::Columns<'_> {
        let count = self.drift.len();
        let between = &self.between[usize::from(cluster) * count..][..count];
        bounds::Columns { drift: &self.drift, between, reach: &self.reach }
    }
}

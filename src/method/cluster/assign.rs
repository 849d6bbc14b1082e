//! Assigns texels to their nearest centres, exactly.

use rayon::prelude::*;

use super::bounds::{Centres, Columns, Guide, Steps};
use super::nearest::{Near, nearer};
use crate::kernel::bounds::{Upper, advance};

/// Texels that a thread takes at a time.
const TOGETHER: usize = 64;

/// What a pass assigns by.
pub(crate) struct Assignment<'a> {
    /// The centres to assign to.
    pub centres: Centres<'a>,
    /// Which centres share a bound.
    pub columns: &'a Columns,
    /// What bounds count in.
    pub steps: Steps,
    /// What rules centres out; without it every distance is computed, and bounds begin.
    pub guide: Option<Guide>,
}

/// Texels, and what is kept of them from pass to pass.
pub struct Texels<'a> {
    /// Vectors [texel, stride].
    pub vectors: &'a [u8],
    /// Number of each texel.
    pub numbers: &'a [u32],
    /// Cluster of each texel: the last pass's, then this one's.
    pub index: &'a mut [u16],
    /// Bounds [texel, column]: the last pass's, then this one's.
    pub bounds: &'a mut [u16],
    /// Distance of each texel to its centre.
    pub distances: &'a mut [u64],
}

impl Assignment<'_> {
    /// Assigns every texel to its nearest centre, ties to the smaller number. Returns the texel nearest to each centre.
    pub(crate) fn assign(&self, texels: &mut Texels<'_>) -> Vec<Near> {
        let stride = self.centres.arrangement.stride();
        let none = || vec![Near::NONE; self.centres.count()];
        let parts = texels.vectors.par_chunks(TOGETHER * stride).zip(texels.numbers.par_chunks(TOGETHER));
        let kept = texels
            .index
            .par_chunks_mut(TOGETHER)
            .zip(texels.bounds.par_chunks_mut(TOGETHER * self.columns.count()));
        parts
            .zip(kept)
            .zip(texels.distances.par_chunks_mut(TOGETHER))
            .fold(
                || (none(), Scratch::default()),
                |(mut nearest, mut scratch), (((vectors, numbers), (index, bounds)), distances)| {
                    let texels = &mut Texels { vectors, numbers, index, bounds, distances };
                    match &self.guide {
                        Some(guide) => self.assign_guided(guide, texels, &mut nearest, &mut scratch),
                        None => self.assign_all(texels, &mut nearest, &mut scratch),
                    }
                    (nearest, scratch)
                },
            )
            .map(|(nearest, _)| nearest)
            .reduce(none, nearer)
    }

    /// By all distances.
    fn assign_all(&self, texels: &mut Texels<'_>, nearest: &mut [Near], scratch: &mut Scratch) {
        let count = self.centres.count();
        let (stride, groups) = (self.centres.arrangement.stride(), self.centres.arrangement.groups());
        scratch.table.resize(texels.numbers.len() * count, 0);
        let kernel = self.centres.kernel;
        kernel.distances(texels.vectors, self.centres.vectors, stride, groups, &mut scratch.table);
        for (at, distances) in scratch.table.chunks_exact(count).enumerate() {
            let texel = texels.numbers[at];
            let (mut own, mut least) = (0, u64::MAX);
            for (cluster, (&distance, nearest)) in distances.iter().zip(nearest.iter_mut()).enumerate() {
                if distance < least {
                    (own, least) = (cluster, distance);
                }
                if distance <= nearest.distance {
                    *nearest = Near { distance, texel }.min(*nearest);
                }
            }
            let row = &mut texels.bounds[at * self.columns.count()..][..self.columns.count()];
            row.fill(u16::MAX);
            for (cluster, &distance) in distances.iter().enumerate().filter(|&(cluster, _)| cluster != own) {
                let bound = &mut row[self.columns.of(cluster as u16)];
                *bound = self.steps.floor(distance).min(*bound);
            }
            texels.index[at] = own as u16;
            texels.distances[at] = least;
        }
    }

    /// By the distances that bounds do not rule out.
    fn assign_guided(
        &self,
        guide: &Guide,
        texels: &mut Texels<'_>,
        nearest: &mut [Near],
        scratch: &mut Scratch,
    ) {
        let Scratch { suspects, found, .. } = scratch;
        let Centres { arrangement, kernel, .. } = self.centres;
        let columns = self.columns;
        for (at, point) in texels.vectors.chunks_exact(arrangement.stride()).enumerate() {
            let own = texels.index[at];
            let [upper] = kernel.row_distances(point, [self.centres.vector(own)], arrangement.groups());
            let row = &mut texels.bounds[at * columns.count()..][..columns.count()];
            suspects.clear();
            let steps = Upper { floor: self.steps.floor(upper), ceiling: self.steps.ceiling(upper) };
            advance(kernel, row, guide.of(own), steps, suspects);
            found.clear();
            let members = suspects.iter().flat_map(|&column| columns.members(usize::from(column)));
            found.extend(members.filter(|&&cluster| cluster != own).map(|&cluster| (cluster, 0)));
            for four in found.chunks_mut(4) {
                let centres = std::array::from_fn(|n| self.centres.vector(four[n.min(four.len() - 1)].0));
                let distances: [u64; 4] = kernel.row_distances(point, centres, arrangement.groups());
                four.iter_mut().zip(distances).for_each(|(found, distance)| found.1 = distance);
            }
            found.push((own, upper));
            let texel = texels.numbers[at];
            for &(cluster, distance) in found.iter() {
                let nearest = &mut nearest[usize::from(cluster)];
                *nearest = Near { distance, texel }.min(*nearest);
            }
            let &(best, least) =
                found.iter().min_by_key(|&&(cluster, distance)| (distance, cluster)).unwrap_or(&(own, upper));
            // A column that was looked into has the least of its distances as its bound; the one that the texel's
            // former centre lies in, which may not have been, takes that one up.
            for &column in suspects.iter() {
                row[usize::from(column)] = u16::MAX;
            }
            for &(cluster, distance) in found.iter().filter(|&&(cluster, _)| cluster != best) {
                let bound = &mut row[columns.of(cluster)];
                *bound = self.steps.floor(distance).min(*bound);
            }
            texels.index[at] = best;
            texels.distances[at] = least;
        }
    }
}

/// Memory of a thread.
#[derive(Default)]
struct Scratch {
    /// Distances [texel, cluster].
    table: Vec<u64>,
    /// Columns that are not ruled out.
    suspects: Vec<u16>,
    /// Centres that were looked at, and their distances.
    found: Vec<(u16, u64)>,
}

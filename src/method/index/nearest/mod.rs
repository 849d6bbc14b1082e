//! The n_k nearest normals of the tile, exactly: by squared Euclidean distance of the stored f32 vectors in f64,
//! summed x, y, z; ties by texel number.
//!
//! Unit vectors with z > 0 look a few candidates up by (x, y) and rank them; all other queries, and those where the
//! candidates would be too many, go to a k-d tree.

mod duplicates;
mod leaves;
mod search;
mod square;
pub mod tree;

use crate::kernel::Kernel;
use crate::kernel::ranking::{BATCH, RANKS};
use duplicates::Duplicates;
use leaves::Leaves;
use search::Search;
use tree::{Neighbour, Tree};

/// Bytes of duplicates and tree for each texel, at most.
const TEXEL_BYTES: usize = 64;

/// Normals of a tile, ready to be searched.
pub struct NearestNormals {
    /// None if no two normals are equal.
    duplicates: Option<Duplicates>,
    /// Over the distinct normals.
    tree: Tree,
    /// None if more neighbours are wanted than can be ranked.
    leaves: Option<Leaves>,
    count: usize,
    kernel: Kernel,
}

impl NearestNormals {
    /// Over the normals of a tile, whose order gives the texel numbers, for the `count` nearest. Works in parallel;
    /// what is found depends on neither threads nor kernel.
    pub fn new(normals: &[[f32; 3]], count: usize, kernel: Kernel) -> Self {
        let duplicates = Duplicates::new(normals, count);
        let points: Vec<_> = duplicates.normals.iter().copied().zip(0..).collect();
        let tree = Tree::new(points.clone());
        let leaves = (1..=RANKS).contains(&count).then(|| {
            Leaves::new(&points, &Search { normals: &duplicates.normals, tree: &tree, count, kernel })
        });
        Self { duplicates: (!duplicates.are_none()).then_some(duplicates), tree, leaves, count, kernel }
    }

    /// Finds the nearest normals of each query: `found` is [query, rank], texel numbers, nearest first. There must be
    /// as many normals as ranks.
    pub fn find_row(&self, queries: &[[f32; 3]], found: &mut [u32]) {
        self.find_distinct(queries, found);
        let Some(duplicates) = self.duplicates.as_ref().filter(|_| self.count > 0) else { return };
        let mut buffer = Vec::new();
        for (&query, found) in queries.iter().zip(found.chunks_exact_mut(self.count)) {
            duplicates.tell_apart(query, found, &mut buffer);
        }
    }

    /// The same by the numbers of distinct normals.
    fn find_distinct(&self, queries: &[[f32; 3]], found: &mut [u32]) {
        let (batches, rest) = queries.as_chunks::<BATCH>();
        let Some(leaves) = self.leaves.as_ref().filter(|_| !batches.is_empty()) else {
            return self.find_by_tree(queries, found);
        };
        let (found, found_rest) = found.split_at_mut(batches.len() * BATCH * self.count);
        let mut ranked = [[0; RANKS]; BATCH];
        let mut ahead = leaves.find(&batches[0]);
        for (number, (batch, found)) in
            batches.iter().zip(found.chunks_exact_mut(BATCH * self.count)).enumerate()
        {
            let candidates = ahead;
            // What the next batch needs comes from memory while this one is ranked.
            if let Some(next) = batches.get(number + 1) {
                ahead = leaves.find(next);
                ahead.iter().for_each(|candidates| candidates.prefetch());
            }
            self.kernel.rank(&candidates, batch, &mut ranked);
            if self.count == RANKS {
                found.copy_from_slice(ranked.as_flattened());
            } else {
                for (found, ranked) in found.chunks_exact_mut(self.count).zip(&ranked) {
                    found.copy_from_slice(&ranked[..self.count]);
                }
            }
            for (place, candidates) in candidates.iter().enumerate() {
                if candidates.is_empty() {
                    let found = &mut found[place * self.count..][..self.count];
                    self.find_by_tree(&batch[place..=place], found);
                }
            }
        }
        self.find_by_tree(rest, found_rest);
    }

    fn find_by_tree(&self, queries: &[[f32; 3]], found: &mut [u32]) {
        let mut nearest = vec![Neighbour::NONE; self.count];
        for (&query, found) in queries.iter().zip(found.chunks_exact_mut(self.count)) {
            self.tree.find(query, &mut nearest);
            for (found, nearest) in found.iter_mut().zip(&nearest) {
                *found = nearest.point;
            }
        }
    }

    /// How many candidates are ranked for a query; none if it goes to the tree.
    pub fn candidates(&self, query: [f32; 3]) -> Option<usize> {
        let candidates = self.leaves.as_ref()?.find(&[query; BATCH])[0].len();
        (candidates > 0).then_some(candidates)
    }

    /// What [`Self::memory_bytes`] of a tile of so many texels is at most.
    pub(crate) fn most_bytes(texels: usize) -> usize {
        leaves::MOST_BYTES + texels * TEXEL_BYTES
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.duplicates.as_ref().map_or(0, Duplicates::memory_bytes)
            + self.tree.memory_bytes()
            + self.leaves.as_ref().map_or(0, Leaves::memory_bytes)
    }
}

#[cfg(test)]
mod tests;

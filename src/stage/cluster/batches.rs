//! Nested mini-batches (Newling and Fleuret 2016): passes over batches of chunks drawn over the whole measurement, each
//! of which holds the one before and twice as many texels, up to all. The first centres come from a sample of the first
//! one.
//!
//! A batch is a number of first blocks of a selection whose chunks are drawn, and a pass over it is a pass as all others:
//! bounds and assignments of the texels of the batch before go on, no texel counts twice, and the last batch is
//! the first of the passes over all texels. Nothing depends on a learning rate.

use std::time::Instant;

use crate::error::{Error, Result};
use crate::method::cluster::bounds::Centres;
use crate::method::cluster::choice::First;
use crate::method::cluster::lloyd::Pass;
use crate::stage::cluster::Plan;
use crate::store::clustering::{Found, History};

/// Texels of the first batch for each of its sample. Texels of one chunk are alike, so that first centres from whole
/// chunks miss what few chunks have.
const SPREAD: usize = 8;

impl Plan {
    /// The first mini-batch; `None` where that is all texels, as it is without mini-batches.
    pub(super) fn first_batch(&self) -> Option<usize> {
        match self.first {
            First::Sample => None,
            First::Minibatch => self.batch_of(SPREAD * self.sample_texels()),
        }
    }

    /// The mini-batch of at least so many texels; `None` where that is all.
    fn batch_of(&self, texels: usize) -> Option<usize> {
        let blocks = self.selection.first_blocks(texels);
        (blocks < self.selection.blocks().len()).then_some(blocks)
    }

    /// How many of the first blocks a pass goes over.
    ///
    /// # Errors
    /// Where a state on disk asks for more than there are.
    pub(super) fn blocks_of(&self, history: &History) -> Result<usize> {
        let all = self.selection.blocks().len();
        let blocks = history.batch.unwrap_or(all);
        if (1..=all).contains(&blocks) {
            return Ok(blocks);
        }
        let model = self.model.path().display();
        Err(Error::input(format!(
            "{model}: clustering: got a mini-batch of {blocks} blocks, expected 1 to {all}"
        ))
        .hint("delete the folder `clustering` in the model and run the same command again"))
    }

    /// The batch of the next pass, after one over `blocks` blocks moved the centres from `before` [cluster, view, light]
    /// to `now` [cluster, stride]: the same, until it has no more to say; then twice as many texels.
    pub(super) fn next_batch(
        &self,
        blocks: usize,
        history: &History,
        found: &Found,
        before: &[u8],
        now: &[u8],
        deadline: Option<Instant>,
    ) -> Option<usize> {
        let texels = found.index.len();
        let passes: Vec<Pass> =
            history.batches.iter().filter(|batch| batch.texels == texels).map(|batch| batch.pass).collect();
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return None;
        }
        let centres =
            Centres { arrangement: &self.arrangement, vectors: now, kernel: self.method(0, None).kernel };
        let ways = centres.drifts(&self.arrangement.arranged(before));
        let (counts, _) = found.tally.parts();
        let clusters = ways.iter().zip(&found.distances).zip(counts);
        let still = clusters.filter(|&((&way, &sum), &texels)| is_still(way, sum, texels)).count();
        if self.options.limits.reached(&passes) || 2 * still > ways.len() {
            return self.batch_of(2 * texels);
        }
        Some(blocks)
    }
}

/// Whether a centre went less far than chance lets it: a median of n values is off by 1.25 times their mean distance
/// from it over the root of n (of a normal distribution, in the mean over directions).
fn is_still(way: u64, distances: u64, texels: u32) -> bool {
    // way <= 1.25 (distances / texels) / sqrt(texels), squared; what is beyond u128 is no small way.
    let (way, texels) = (u128::from(way), u128::from(texels));
    let left = (16 * way).checked_mul(way).and_then(|left| left.checked_mul(texels.pow(3)));
    left.is_some_and(|left| left <= u128::from(distances).pow(2).saturating_mul(25))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_is_still_within_its_uncertainty() {
        // 100 texels at 8 from their centre in the mean: 1.25 * 8 / 10 = 1.
        assert!(is_still(1, 800, 100));
        assert!(!is_still(2, 800, 100));
        assert!(is_still(0, 0, 1) && !is_still(1, 0, 1));
        assert!(!is_still(u64::MAX, u64::MAX, u32::MAX));
        // The longest distances of 16 million texels.
        assert!(is_still(1 << 20, 255 << 56, 1 << 24));
    }
}

//! The cheap measures, over a whole enlargement as it streams by: is every cluster still there, how much is copied in one
//! piece, does it repeat itself. Memory grows with the width of the enlargement only.

use serde::{Deserialize, Serialize};

use super::Lightness;
use super::autocorrelation::far_peak;
use super::copies::LargestCopy;

/// Sides of the window in the middle of an enlargement in which repetition is sought.
pub(crate) const WINDOW_SIDE: usize = 512;

/// What the cheap measures say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Shares of clusters that the tile and the enlargement have in common, 0 to 1.
    pub shares: f64,
    /// Share of the enlargement in the largest unbroken copy of the exemplar; absent where sources are not known.
    pub largest_copy: Option<f64>,
}

/// Counts over the rows of an enlargement.
pub struct Tally {
    of_tile: Vec<u64>,
    found: Vec<u64>,
    copy: Option<LargestCopy>,
}

impl Tally {
    /// Against a tile's index into so many clusters; `copy` where sources are known.
    pub fn new(tile: &[u16], clusters: usize, copy: Option<LargestCopy>) -> Self {
        let mut tally = Self { of_tile: vec![0; clusters], found: vec![0; clusters], copy };
        count(&mut tally.of_tile, tile);
        tally
    }

    /// The next row: clusters, all below the number of clusters, and sources, which are ignored where they are not known.
    pub fn push(&mut self, index: &[u16], source: &[u32]) {
        count(&mut self.found, index);
        if let Some(copy) = &mut self.copy {
            copy.push(source);
        }
    }

    /// What was found.
    pub fn verdict(&self) -> Verdict {
        Verdict {
            shares: common(&self.of_tile, &self.found),
            largest_copy: self.copy.as_ref().map(LargestCopy::share),
        }
    }
}

fn count(counts: &mut [u64], index: &[u16]) {
    for &cluster in index {
        if let Some(count) = counts.get_mut(usize::from(cluster)) {
            *count += 1;
        }
    }
}

/// The sum over clusters of the smaller of two shares. In whole numbers, so that the order of counting does not matter.
fn common(a: &[u64], b: &[u64]) -> f64 {
    let [total_a, total_b] = [a, b].map(|counts| u128::from(counts.iter().sum::<u64>()).max(1));
    let smaller = |(&a, &b): (&u64, &u64)| (u128::from(a) * total_b).min(u128::from(b) * total_a);
    let sum: u128 = a.iter().zip(b).map(smaller).sum();
    sum as f64 / (total_a * total_b) as f64
}

/// By how much the largest autocorrelation at a far shift of a window in the middle of an enlargement, of at most
/// [`WINDOW_SIDE`] texels a side, exceeds that of the tile.
pub fn excess_peak(window: &Lightness, tile: &Lightness) -> f64 {
    far_peak(window) - far_peak(tile)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_in_common_count_by_their_smaller_share() {
        let mut tally = Tally::new(&[0, 0, 1, 2], 4, None);
        tally.push(&[0, 1, 1, 3], &[]);
        tally.push(&[0, 1, 1, 3], &[]);
        let expected = Verdict { shares: 0.25 + 0.25, largest_copy: None };
        assert_eq!(tally.verdict(), expected);
    }
}

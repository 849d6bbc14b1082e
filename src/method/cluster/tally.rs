//! Centres from texels that pass by once: counts that are whole numbers, so that any cut of the texels, added in any
//! order, gives the same centres.
//!
//! For a median they are the texels below a few thresholds around the present centre: exact where the median lies
//! within a code of it, and a step of two codes towards it otherwise, which lowers (1) as well. A centre that does not
//! change is the median.

use rayon::prelude::*;

use super::centre::{CentreRule, Members, rounded_mean, strips};
use crate::kernel::Kernel;
use crate::kernel::counting::{STRIP, Thresholds, count_below};

/// Thresholds around a centre.
const THRESHOLDS: usize = 4;

/// What the texels of each cluster sum up to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tally {
    rule: CentreRule,
    stride: usize,
    /// Texels of each cluster.
    texels: Vec<u32>,
    /// Counts [cluster, strip, threshold, value] for medians, sums [cluster, value] for means.
    counts: Vec<u32>,
}

impl Tally {
    /// Most texels of which sums of codes fit.
    pub(crate) const MOST_TEXELS: usize = (u32::MAX / 255) as usize;

    /// Nothing counted yet.
    pub fn new(rule: CentreRule, clusters: usize, stride: usize) -> Self {
        let counts = vec![0; clusters * Self::counts_of_a_cluster(rule, stride)];
        Self { rule, stride, texels: vec![0; clusters], counts }
    }

    /// Bytes of the counts.
    pub fn bytes(rule: CentreRule, clusters: usize, stride: usize) -> usize {
        clusters * Self::counts_of_a_cluster(rule, stride) * size_of::<u32>()
    }

    fn counts_of_a_cluster(rule: CentreRule, stride: usize) -> usize {
        match rule {
            CentreRule::Median => stride * THRESHOLDS,
            CentreRule::Mean => stride,
        }
    }

    /// Texels of each cluster, and their counts.
    pub fn parts(&self) -> (&[u32], &[u32]) {
        (&self.texels, &self.counts)
    }

    /// A tally from its parts; `None` where their lengths do not fit.
    pub(crate) fn from_parts(
        rule: CentreRule,
        stride: usize,
        texels: Vec<u32>,
        counts: Vec<u32>,
    ) -> Option<Self> {
        let fits = counts.len() == texels.len() * Self::counts_of_a_cluster(rule, stride);
        fits.then_some(Self { rule, stride, texels, counts })
    }

    /// Counts texels [texel, stride] by their clusters' centres.
    pub fn add(&mut self, centres: &[u8], vectors: &[u8], index: &[u16], kernel: Kernel) {
        let members = Members::of(index, self.texels.len());
        let stride = self.stride;
        let counts = self.counts.par_chunks_exact_mut(Self::counts_of_a_cluster(self.rule, stride));
        let clusters = self.texels.par_iter_mut().zip(counts).zip(centres.par_chunks_exact(stride));
        clusters.enumerate().for_each(|(cluster, ((texels, counts), centre))| {
            let members = members.cluster(cluster);
            if members.is_empty() {
                return;
            }
            *texels += members.len() as u32;
            match self.rule {
                CentreRule::Median => {
                    let counts = counts.as_chunks_mut::<STRIP>().0.as_chunks_mut::<THRESHOLDS>().0;
                    for (strip, (counts, centre)) in
                        counts.iter_mut().zip(centre.as_chunks::<STRIP>().0).enumerate()
                    {
                        let rows = strips(vectors, stride, members, strip);
                        count_below(kernel, &rows, &thresholds(centre), counts);
                    }
                }
                CentreRule::Mean => {
                    for &member in members {
                        let vector = &vectors[member as usize * stride..][..stride];
                        for (sum, &value) in counts.iter_mut().zip(vector) {
                            *sum += u32::from(value);
                        }
                    }
                }
            }
        });
    }

    /// Adds another part's counts by the same centres.
    pub(crate) fn merge(&mut self, other: &Self) {
        let add = |(sum, &more): (&mut u32, &u32)| *sum += more;
        self.texels.iter_mut().zip(&other.texels).for_each(add);
        self.counts.iter_mut().zip(&other.counts).for_each(add);
    }

    /// Clusters without a texel.
    pub(crate) fn empty_clusters(&self) -> Vec<usize> {
        (0..self.texels.len()).filter(|&cluster| self.texels[cluster] == 0).collect()
    }

    /// Moves the centres by which everything was counted; those of empty clusters stay.
    pub fn update(&self, centres: &mut [u8]) {
        let counts = self.counts.chunks_exact(Self::counts_of_a_cluster(self.rule, self.stride));
        for ((centre, counts), &texels) in centres.chunks_exact_mut(self.stride).zip(counts).zip(&self.texels)
        {
            if texels == 0 {
                continue;
            }
            match self.rule {
                CentreRule::Median => {
                    let counts = counts.as_chunks::<STRIP>().0.as_chunks::<THRESHOLDS>().0;
                    for (centre, counts) in centre.as_chunks_mut::<STRIP>().0.iter_mut().zip(counts) {
                        for (at, value) in centre.iter_mut().enumerate() {
                            *value = moved(*value, counts.map(|counts| counts[at]), texels);
                        }
                    }
                }
                CentreRule::Mean => {
                    for (value, &sum) in centre.iter_mut().zip(counts) {
                        *value = rounded_mean(u64::from(sum), u64::from(texels));
                    }
                }
            }
        }
    }
}

/// Thresholds from one below the centre to two above it.
fn thresholds(centre: &[u8; STRIP]) -> Thresholds<THRESHOLDS> {
    std::array::from_fn(|n| centre.map(|value| threshold(value, n).clamp(0, 255) as u8))
}

fn threshold(value: u8, number: usize) -> i32 {
    i32::from(value) - 1 + number as i32
}

/// Where a centre's code moves to, of `texels` values `below[n]` of which lie below its thresholds.
fn moved(value: u8, below: [u32; THRESHOLDS], texels: u32) -> u8 {
    let rank = (texels - 1) / 2;
    // The median is at least a threshold below which no more than `rank` values lie. None lies beyond 255.
    let reached = (0..THRESHOLDS).rev().find(|&n| threshold(value, n) <= 255 && below[n] <= rank);
    reached.map_or(value.saturating_sub(2), |n| threshold(value, n).max(0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    const STRIDE: usize = 2 * STRIP;

    fn vectors(texels: u32, spread: u32) -> Vec<u8> {
        let hash = Hash::new(4, 0);
        let code = |texel: u32, n: u32| {
            let base = hash.words(n, 1, 0)[0] % 256;
            (base + hash.words(texel, n, 2)[0] % spread).clamp(spread / 2, 255 + spread / 2) - spread / 2
        };
        (0..texels).flat_map(|texel| (0..STRIDE as u32).map(move |n| code(texel, n) as u8)).collect()
    }

    fn median(vectors: &[u8], index: &[u16], cluster: u16, at: usize) -> Option<u8> {
        let mut values: Vec<u8> = index
            .iter()
            .enumerate()
            .filter(|&(_, &of)| of == cluster)
            .map(|(texel, _)| vectors[texel * STRIDE + at])
            .collect();
        values.sort_unstable();
        values.get(values.len().wrapping_sub(1) / 2).copied()
    }

    #[test]
    fn medians_are_reached_by_steps_of_two_at_most_and_stay() {
        let (texels, clusters) = (300, 3);
        let vectors = vectors(texels as u32, 9);
        let index: Vec<u16> = (0..texels).map(|texel| [0, 2, 2][texel % 3]).collect();
        for start in [0u8, 120, 255] {
            let mut centres = vec![start; clusters * STRIDE];
            for step in 0..130 {
                let mut tally = Tally::new(CentreRule::Median, clusters, STRIDE);
                tally.add(&centres, &vectors, &index, Kernel::fastest());
                let before = centres.clone();
                tally.update(&mut centres);
                for (n, (&before, &now)) in before.iter().zip(&centres).enumerate() {
                    let (cluster, at) = (n / STRIDE, n % STRIDE);
                    let expected = match median(&vectors, &index, cluster as u16, at) {
                        None => before,
                        Some(median) => median.clamp(before.saturating_sub(2), before.saturating_add(2)),
                    };
                    assert_eq!(now, expected, "step {step}, value {n}");
                }
            }
            assert_eq!(centres[7], median(&vectors, &index, 0, 7).unwrap_or(0));
            assert!(centres[STRIDE..2 * STRIDE].iter().all(|&value| value == start));
        }
    }

    #[test]
    fn any_cut_gives_the_same_tally() {
        let vectors = vectors(200, 30);
        let index: Vec<u16> = (0..200).map(|texel| (texel * 7 % 5) as u16).collect();
        let centres: Vec<u8> = vectors[..5 * STRIDE].to_vec();
        for rule in [CentreRule::Median, CentreRule::Mean] {
            let mut whole = Tally::new(rule, 5, STRIDE);
            whole.add(&centres, &vectors, &index, Kernel::Plain);
            let mut parts = Tally::new(rule, 5, STRIDE);
            for (vectors, index) in vectors.chunks(67 * STRIDE).zip(index.chunks(67)).rev() {
                let mut part = Tally::new(rule, 5, STRIDE);
                part.add(&centres, vectors, index, Kernel::fastest());
                parts.merge(&part);
            }
            assert_eq!(parts, whole);
            let (texels, counts) = whole.parts();
            assert_eq!(
                Tally::from_parts(rule, STRIDE, texels.to_vec(), counts.to_vec()),
                Some(whole.clone())
            );
            assert_eq!(Tally::from_parts(rule, STRIDE, vec![0; 4], counts.to_vec()), None);
            let mut moved = centres.clone();
            whole.update(&mut moved);
            if rule == CentreRule::Mean {
                let sum: u64 =
                    (0..200).filter(|t| index[*t] == 3).map(|t| u64::from(vectors[t * STRIDE])).sum();
                assert_eq!(moved[3 * STRIDE], rounded_mean(sum, 40));
            }
        }
    }
}

//! Centres from the texels of a cluster in memory: the median, which minimises (1), or the mean.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::points::Points;
use crate::kernel::Kernel;
use crate::kernel::counting::{STRIP, lower_medians};

/// How a centre follows from its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CentreRule {
    /// The lower median of each value: the minimiser of (1).
    Median,
    /// The mean of each value, rounded half up: the textbook's K-means.
    Mean,
}

/// The texels of each cluster, in the order of the texels.
pub struct Members {
    /// Where each cluster's texels begin, and where the last one's end.
    starts: Vec<usize>,
    texels: Vec<u32>,
}

impl Members {
    /// Sorts texels by their cluster.
    pub fn of(index: &[u16], clusters: usize) -> Self {
        let mut starts = vec![0; clusters + 1];
        for &cluster in index {
            starts[usize::from(cluster) + 1] += 1;
        }
        for cluster in 0..clusters {
            starts[cluster + 1] += starts[cluster];
        }
        let mut ends = starts.clone();
        let mut texels = vec![0; index.len()];
        for (texel, &cluster) in index.iter().enumerate() {
            let end = &mut ends[usize::from(cluster)];
            texels[*end] = texel as u32;
            *end += 1;
        }
        Self { starts, texels }
    }

    /// Positions in the index of the texels of a cluster.
    pub fn cluster(&self, cluster: usize) -> &[u32] {
        &self.texels[self.starts[cluster]..self.starts[cluster + 1]]
    }
}

/// One strip of the vectors of some texels.
pub(super) fn strips<'a>(
    vectors: &'a [u8],
    stride: usize,
    texels: &[u32],
    strip: usize,
) -> Vec<&'a [u8; STRIP]> {
    let strips = vectors.as_chunks::<STRIP>().0;
    texels.iter().map(|&texel| &strips[texel as usize * (stride / STRIP) + strip]).collect()
}

/// Recomputes the centres [cluster, stride] of the clusters that have changed and have texels; others stay.
pub fn update(
    points: &Points,
    members: &Members,
    changed: &[bool],
    rule: CentreRule,
    kernel: Kernel,
    centres: &mut [u8],
) {
    let stride = points.arrangement.stride();
    centres.par_chunks_exact_mut(stride).enumerate().for_each(|(cluster, centre)| {
        let texels = members.cluster(cluster);
        if texels.is_empty() || !changed[cluster] {
            return;
        }
        for (strip, values) in centre.as_chunks_mut::<STRIP>().0.iter_mut().enumerate() {
            let rows = strips(&points.vectors, stride, texels, strip);
            match rule {
                CentreRule::Median => lower_medians(kernel, &rows, values),
                CentreRule::Mean => rounded_means(&rows, values),
            }
        }
    });
}

fn rounded_means(rows: &[&[u8; STRIP]], means: &mut [u8; STRIP]) {
    let mut sums = [0u64; STRIP];
    for row in rows {
        for (sum, &value) in sums.iter_mut().zip(*row) {
            *sum += u64::from(value);
        }
    }
    for (mean, sum) in means.iter_mut().zip(sums) {
        *mean = rounded_mean(sum, rows.len() as u64);
    }
}

/// The mean of `count` codes, rounded half up.
pub(super) fn rounded_mean(sum: u64, count: u64) -> u8 {
    ((2 * sum + count) / (2 * count)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn means_are_those_of_summing() {
        let hash = Hash::new(5, 0);
        for count in [1, 2, 3, 8, 101] {
            let rows: Vec<[u8; STRIP]> = (0..count)
                .map(|r| std::array::from_fn(|c| hash.words(r, c as u32, count)[0] as u8 >> (c % 5)))
                .collect();
            let mut means = [7; STRIP];
            rounded_means(&rows.iter().collect::<Vec<_>>(), &mut means);
            for column in 0..STRIP {
                let sum: f64 = rows.iter().map(|row| f64::from(row[column])).sum();
                assert_eq!(means[column], (sum / f64::from(count) + 0.5).floor() as u8);
            }
        }
    }

    #[test]
    fn members_are_every_texel_once_under_its_cluster() {
        let index = [3, 0, 3, 1, 0, 3];
        let members = Members::of(&index, 5);
        let found: Vec<&[u32]> = (0..5).map(|cluster| members.cluster(cluster)).collect();
        assert_eq!(found, [&[1, 4][..], &[3], &[], &[0, 2, 5], &[]]);
    }
}

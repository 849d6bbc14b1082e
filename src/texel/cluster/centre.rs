//! Centres from the texels of a cluster: the median, which minimises (1), or the mean.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::texel::cluster::points::Points;

/// How a centre follows from its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CentreRule {
    /// The lower median of each value: the minimiser of (1).
    Median,
    /// The mean of each value, rounded half up: the textbook's K-means.
    Mean,
}

/// Values that are treated at a time, so that their counters stay in the nearest cache.
const STRIP: usize = 256;

/// Recomputes the centres [cluster, stride] of clusters that have texels; others stay.
pub fn update(points: &Points, members: &[Vec<u32>], rule: CentreRule, centres: &mut [u8]) {
    let stride = points.arrangement.stride();
    centres.par_chunks_exact_mut(stride).zip(members).for_each(|(centre, members)| {
        if members.is_empty() {
            return;
        }
        for (number, values) in centre.chunks_mut(STRIP).enumerate() {
            let strip = number * STRIP..number * STRIP + values.len();
            let rows = members.iter().map(|&texel| &points.vector(texel as usize)[strip.clone()]);
            match rule {
                CentreRule::Median => lower_medians(&rows, members.len(), values),
                CentreRule::Mean => rounded_means(rows, members.len(), values),
            }
        }
    });
}

/// Lower medians of columns: bit by bit from the top, a bit is set where no more than (n - 1) / 2
/// values lie below the trial.
fn lower_medians<'a>(rows: &(impl Iterator<Item = &'a [u8]> + Clone), count: usize, medians: &mut [u8]) {
    let rank = (count as u32 - 1) / 2;
    medians.fill(0);
    for bit in (0..8).rev() {
        let mut below = [0u32; STRIP];
        for row in rows.clone() {
            for ((below, &value), &median) in below.iter_mut().zip(row).zip(medians.iter()) {
                *below += u32::from(value < (median | 1 << bit));
            }
        }
        for (median, &below) in medians.iter_mut().zip(&below) {
            if below <= rank {
                *median |= 1 << bit;
            }
        }
    }
}

fn rounded_means<'a>(rows: impl Iterator<Item = &'a [u8]>, count: usize, means: &mut [u8]) {
    let mut sums = [0u64; STRIP];
    for row in rows {
        for (sum, &value) in sums.iter_mut().zip(row) {
            *sum += u64::from(value);
        }
    }
    let count = count as u64;
    for (mean, sum) in means.iter_mut().zip(sums) {
        *mean = ((2 * sum + count) / (2 * count)) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn medians_and_means_are_those_of_sorting_and_summing() {
        let hash = Hash::new(5, 0);
        for count in [1, 2, 3, 8, 101] {
            let rows: Vec<Vec<u8>> = (0..count)
                .map(|r| (0..40).map(|c| hash.words(r, c, count)[0] as u8 >> (c % 5)).collect())
                .collect();
            let (mut medians, mut means) = (vec![7; 40], vec![7; 40]);
            lower_medians(&rows.iter().map(Vec::as_slice), rows.len(), &mut medians);
            rounded_means(rows.iter().map(Vec::as_slice), rows.len(), &mut means);
            for column in 0..40 {
                let mut values: Vec<u8> = rows.iter().map(|row| row[column]).collect();
                values.sort_unstable();
                assert_eq!(medians[column], values[(values.len() - 1) / 2]);
                let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
                assert_eq!(means[column], (mean + 0.5).floor() as u8);
            }
        }
    }
}

//! Weighted sums of absolute differences of u8 vectors, the distance of (1) in whole numbers.
//!
//! A vector is cut into groups of equal weight, each padded to a multiple of [`LANE_BYTES`] by bytes
//! that are equal in all vectors. All sums are exact, so every kernel gives the same result.

pub use super::Kernel;

/// Bytes to whose multiple groups are padded.
pub const LANE_BYTES: usize = 64;

/// A run of bytes with one weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// Factor of the group's sum.
    pub weight: u32,
    /// First byte.
    pub start: usize,
    /// One past the last byte, padding included.
    pub end: usize,
}

impl Kernel {
    /// Distances of `points` [m, stride] to `centres` [k, stride], written to `distances` [m, k].
    pub fn distances(
        self,
        points: &[u8],
        centres: &[u8],
        stride: usize,
        groups: &[Group],
        distances: &mut [u64],
    ) {
        let count = centres.len() / stride;
        // Four centres stay in the nearest cache while all points pass by them.
        for first in (0..count).step_by(4) {
            let four: [&[u8]; 4] = std::array::from_fn(|k| {
                let centre = (first + k).min(count - 1);
                &centres[centre * stride..(centre + 1) * stride]
            });
            let width = (count - first).min(4);
            for (point, row) in points.chunks_exact(stride).zip(distances.chunks_exact_mut(count)) {
                let sums = self.four(point, four, groups);
                row[first..first + width].copy_from_slice(&sums[..width]);
            }
        }
    }

    fn four(self, point: &[u8], centres: [&[u8]; 4], groups: &[Group]) -> [u64; 4] {
        match self {
            Self::Plain => plain_four(point, centres, groups),
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            // SAFETY: `Avx2` is only ever constructed after the feature was found.
            Self::Avx2 => unsafe { avx2::four(point, centres, groups) },
        }
    }
}

fn plain_four(point: &[u8], centres: [&[u8]; 4], groups: &[Group]) -> [u64; 4] {
    // Sums of a lane fit u32, which compilers make better loops of.
    let lane =
        |(a, b): (&[u8], &[u8])| -> u32 { a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum() };
    centres.map(|centre| {
        groups
            .iter()
            .map(|group| {
                let point = point[group.start..group.end].chunks_exact(LANE_BYTES);
                let centre = centre[group.start..group.end].chunks_exact(LANE_BYTES);
                u64::from(group.weight) * point.zip(centre).map(|pair| u64::from(lane(pair))).sum::<u64>()
            })
            .sum()
    })
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::Group;
    use std::arch::x86_64::{
        __m256i, _mm256_add_epi64, _mm256_loadu_si256, _mm256_sad_epu8, _mm256_setzero_si256,
        _mm256_storeu_si256,
    };

    const REGISTER_BYTES: usize = 32;

    #[target_feature(enable = "avx2")]
    pub(super) fn four(point: &[u8], centres: [&[u8]; 4], groups: &[Group]) -> [u64; 4] {
        let mut total = [0; 4];
        for group in groups {
            let mut sums = [_mm256_setzero_si256(); 4];
            let point = point[group.start..group.end].chunks_exact(REGISTER_BYTES);
            let [a, b, c, d] =
                centres.map(|centre| centre[group.start..group.end].chunks_exact(REGISTER_BYTES));
            for ((((point, a), b), c), d) in point.zip(a).zip(b).zip(c).zip(d) {
                let point = load(point);
                for (sum, centre) in sums.iter_mut().zip([a, b, c, d]) {
                    *sum = _mm256_add_epi64(*sum, _mm256_sad_epu8(point, load(centre)));
                }
            }
            for (total, sum) in total.iter_mut().zip(sums) {
                *total += u64::from(group.weight) * horizontal_sum(sum);
            }
        }
        total
    }

    #[target_feature(enable = "avx2")]
    #[allow(unsafe_code)]
    fn load(bytes: &[u8]) -> __m256i {
        assert_eq!(bytes.len(), REGISTER_BYTES);
        // SAFETY: just checked that there are 32 bytes; the load needs no alignment.
        unsafe { _mm256_loadu_si256(bytes.as_ptr().cast()) }
    }

    #[target_feature(enable = "avx2")]
    #[allow(unsafe_code)]
    fn horizontal_sum(lanes: __m256i) -> u64 {
        let mut values = [0u64; 4];
        // SAFETY: the array has 32 bytes; the store needs no alignment.
        unsafe { _mm256_storeu_si256(values.as_mut_ptr().cast(), lanes) };
        values.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn every_kernel_gives_the_plain_result() {
        let stride = 5 * LANE_BYTES;
        let groups = [
            Group { weight: 65536, start: 0, end: LANE_BYTES },
            Group { weight: 16962, start: LANE_BYTES, end: stride },
        ];
        let hash = Hash::new(1, 0);
        let bytes = |count: usize, salt: u32| -> Vec<u8> {
            (0..count as u32).map(|n| hash.words(n, salt, 0)[0] as u8).collect()
        };
        for centres in 1..=9 {
            let (points, centres_bytes) = (bytes(7 * stride, 0), bytes(centres * stride, 1));
            let run = |kernel: Kernel| {
                let mut distances = vec![0; 7 * centres];
                kernel.distances(&points, &centres_bytes, stride, &groups, &mut distances);
                distances
            };
            let plain = run(Kernel::Plain);
            let by_hand: u64 = (0..stride)
                .map(|n| {
                    let weight = if n < LANE_BYTES { 65536 } else { 16962 };
                    weight * u64::from(points[stride + n].abs_diff(centres_bytes[(centres - 1) * stride + n]))
                })
                .sum();
            assert_eq!(plain[2 * centres - 1], by_hand);
            for kernel in Kernel::available() {
                assert_eq!(run(kernel), plain, "{kernel:?}");
            }
        }
    }
}

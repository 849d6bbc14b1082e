//! Ranking: of up to [`CAPACITY`] candidates the nearest to a query, in order.
//!
//! The SIMD kernels take many queries at once. Each candidate becomes a whole number, a key: the bits of its squared
//! distance in f32, the last [`SLOT_BITS`] of them replaced by its slot. Keys are transposed, so that a lane belongs
//! to a query, and sorted by a network of minima and maxima, which needs no shuffling.
//!
//! *When keys can be trusted.* A squared distance of f32 vectors, computed in f32, takes at most five roundings of
//! a relative 2^-24 each (a difference, which counts twice in its square, a product, two sums) and all terms are
//! positive: it is off by at most 5 x 2^-24 and a little, which is at most 6 units of its last place, also where
//! numbers are subnormal. Bits of positive floats are in the order of the floats, so the exact order of two
//! candidates is known when their bits differ by more than 12; the reference in f64 is off by far less than one.
//! Keys that differ by at least `2 << SLOT_BITS` come from bits that differ by more than `1 << SLOT_BITS` = 64. Where
//! two of the keys that follow each other in the result are nearer than that, the query is ranked again in f64.

use super::{Kernel, dispatch};

#[cfg(target_arch = "x86_64")]
#[macro_use]
mod network;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

/// Most candidates.
pub(crate) const CAPACITY: usize = 48;

/// Ranks that are found.
pub(crate) const RANKS: usize = 16;

/// Queries ranked at a time.
pub(crate) const BATCH: usize = 16;

/// Bits of a key that hold a slot.
#[cfg(target_arch = "x86_64")]
const SLOT_BITS: u32 = CAPACITY.next_power_of_two().ilog2();

/// Keys nearer than this do not tell the order.
#[cfg(target_arch = "x86_64")]
const DOUBTFUL: i32 = 2 << SLOT_BITS;

/// Candidates in the order of their numbers, component by component. Slots behind them lie far away, no two equally
/// far, so that their order is not in doubt.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Candidates {
    x: [f32; CAPACITY],
    y: [f32; CAPACITY],
    z: [f32; CAPACITY],
    number: [u32; CAPACITY],
}

impl Candidates {
    /// From points and their numbers, which must ascend. Points that exceed the capacity are left out.
    pub fn new(points: impl IntoIterator<Item = ([f32; 3], u32)>) -> Self {
        let mut candidates = Self {
            x: std::array::from_fn(|slot| 2.0f32.powi(slot as i32 + 8)),
            y: [0.0; CAPACITY],
            z: [0.0; CAPACITY],
            number: [u32::MAX; CAPACITY],
        };
        for (slot, (point, number)) in points.into_iter().take(CAPACITY).enumerate() {
            [candidates.x[slot], candidates.y[slot], candidates.z[slot]] = point;
            candidates.number[slot] = number;
        }
        candidates
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.number[0] == u32::MAX
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.number.iter().filter(|&&number| number != u32::MAX).count()
    }

    /// Asks the memory for the candidates, to be there when they are ranked.
    #[inline]
    #[allow(unsafe_code)]
    pub(crate) fn prefetch(&self) {
        #[cfg(target_arch = "x86_64")]
        for line in 0..size_of::<Self>() / 64 {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: the address lies within `self`; a prefetch needs no feature beyond the architecture's base.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(self).cast::<i8>().add(64 * line)) };
        }
    }

    /// The nearest to one query by squared distance in f64, summed x, y, z; ties by number.
    fn rank(&self, query: [f32; 3], found: &mut [u32; RANKS]) {
        let query = query.map(f64::from);
        let mut distances = [0.0; CAPACITY];
        for (slot, distance) in distances.iter_mut().enumerate() {
            let x = query[0] - f64::from(self.x[slot]);
            let y = query[1] - f64::from(self.y[slot]);
            let z = query[2] - f64::from(self.z[slot]);
            *distance = x * x + y * y + z * z;
        }
        let mut nearest = [f64::INFINITY; RANKS];
        // Numbers ascend, so that of equal distances the one that comes first stays before the other.
        for (&distance, &number) in distances.iter().zip(&self.number) {
            if distance < nearest[RANKS - 1] {
                let mut place = RANKS - 1;
                while place > 0 && distance < nearest[place - 1] {
                    nearest[place] = nearest[place - 1];
                    found[place] = found[place - 1];
                    place -= 1;
                }
                nearest[place] = distance;
                found[place] = number;
            }
        }
    }
}

impl Kernel {
    /// For each query the numbers of its nearest candidates, nearest first. Queries must be finite; ranks beyond the
    /// number of a query's candidates mean nothing.
    pub fn rank(
        self,
        candidates: &[&Candidates; BATCH],
        queries: &[[f32; 3]; BATCH],
        found: &mut [[u32; RANKS]; BATCH],
    ) {
        let mut doubtful = dispatch!(
            self;
            (1 << BATCH) - 1,
            avx2::rank(candidates, queries, found),
            avx512::rank(candidates, queries, found),
        );
        while doubtful != 0 {
            let query = doubtful.trailing_zeros() as usize;
            candidates[query].rank(queries[query], &mut found[query]);
            doubtful &= doubtful - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn two_that_f32_cannot_tell_apart_are_found_at_every_rank() {
        let query = [0.0, 0.0, 1.0];
        for rank in 0..CAPACITY - 1 {
            for count in [rank + 2, CAPACITY] {
                // The farther one has the smaller number: squares of 1 + 2^-23 and 1 are one step apart.
                let mut distances: Vec<f32> =
                    (0..count).map(|place| 0.5f32.powi(place as i32 % 8) * (1 + place / 8) as f32).collect();
                distances.sort_by(f32::total_cmp);
                distances.dedup();
                let Some(&near) = distances.get(rank) else { continue };
                distances.retain(|&distance| distance != near);
                let points = [near.next_up(), near].into_iter().chain(distances);
                let candidates = Candidates::new(
                    points.take(CAPACITY).zip(0..).map(|(x, number)| ([x, 0.0, 1.0], number)),
                );
                let mut expected = [9; RANKS];
                candidates.rank(query, &mut expected);
                let known = candidates.len().min(RANKS);
                for kernel in Kernel::available() {
                    let mut found = [[7; RANKS]; BATCH];
                    kernel.rank(&[&candidates; BATCH], &[query; BATCH], &mut found);
                    for found in found {
                        assert_eq!(found[..known], expected[..known], "{kernel:?}, {rank} of {count}");
                    }
                }
            }
        }
    }

    #[test]
    fn each_query_is_ranked_among_its_own() {
        let hash = Hash::new(8, 0);
        let vector = |n: u32, of: u32| {
            let [x, y, z, _] = hash.uniforms(n, of, 0);
            [x, y, z].map(|v| v as f32)
        };
        for round in 0..20 {
            let candidates: [Candidates; BATCH] = std::array::from_fn(|query| {
                let of = round * BATCH as u32 + query as u32;
                let count = 16 + hash.below(33, of, 1, 1) as u32;
                Candidates::new((0..count).map(|n| (vector(n, of), 3 * n + of)))
            });
            let queries = std::array::from_fn(|query| vector(query as u32, 1 << 20 | round));
            let candidates = std::array::from_fn(|query| &candidates[query]);
            let mut expected = [[9; RANKS]; BATCH];
            Kernel::Plain.rank(&candidates, &queries, &mut expected);
            for (query, expected) in expected.iter().enumerate() {
                assert!(expected.iter().all(|number| number % 3 == (round * 16 + query as u32) % 3));
            }
            for kernel in Kernel::available() {
                let mut found = [[7; RANKS]; BATCH];
                kernel.rank(&candidates, &queries, &mut found);
                assert_eq!(found, expected, "{kernel:?}");
            }
        }
    }
}

//! Weighted sums of absolute differences of u8 vectors, the distance of (1) in whole numbers.
//!
//! A vector is cut into groups of equal weight, each padded to a multiple of [`LANE_BYTES`] by bytes
//! that are equal in all vectors. All sums are exact, so every kernel gives the same result.
//!
//! Many texels against many centres go by strips of the vectors and tiles of texels and centres: the strip of a few
//! texels stays in the nearest cache while those of all centres pass by, and a tile's sums stay in registers.

/// Defines `lanes` for one set of instructions: the sums of each pair of strips as the u64 of a register, which are
/// yet to be added.
#[cfg(target_arch = "x86_64")]
macro_rules! lanes {
    ($features:literal, $register:ty, $load:ident, $zero:ident, $add:ident, $sad:ident) => {
        #[target_feature(enable = $features)]
        #[inline]
        #[allow(unsafe_code)]
        fn lanes<const P: usize, const C: usize>(
            points: [&[u8]; P],
            centres: [&[u8]; C],
        ) -> [[$register; C]; P] {
            let length = points[0].len();
            assert!(length.is_multiple_of(size_of::<$register>()));
            assert!(points.iter().chain(&centres).all(|strip| strip.len() == length));
            let mut sums = [[$zero(); C]; P];
            for at in (0..length).step_by(size_of::<$register>()) {
                // SAFETY: a register from `at` on lies within each strip, as just checked; loads need no alignment.
                let load = |strip: &[u8]| unsafe { $load(strip.as_ptr().add(at).cast()) };
                let centres = centres.map(load);
                for (sums, point) in sums.iter_mut().zip(points) {
                    let point = load(point);
                    for (sum, centre) in sums.iter_mut().zip(centres) {
                        *sum = $add(*sum, $sad(point, centre));
                    }
                }
            }
            sums
        }
    };
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

pub(crate) use super::Kernel;
use super::dispatch;

/// Bytes to whose multiple groups are padded.
pub(crate) const LANE_BYTES: usize = 64;

/// Texels and centres of a tile.
const TILE: usize = 4;

/// Texels whose strips stay in the nearest cache.
const BLOCK: usize = 16;

/// Most bytes of a strip.
const STRIP_BYTES: usize = 2048;

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

/// Pieces of the groups, none longer than a strip.
fn strips(groups: &[Group]) -> impl Iterator<Item = Group> {
    groups.iter().flat_map(|group| {
        let starts = (group.start..group.end).step_by(STRIP_BYTES);
        starts.map(|start| Group { start, end: (start + STRIP_BYTES).min(group.end), ..*group })
    })
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
        distances.fill(0);
        let count = centres.len() / stride;
        let blocks = points.chunks(BLOCK * stride).zip(distances.chunks_mut(BLOCK * count));
        for (points, distances) in blocks {
            for strip in strips(groups) {
                self.add_strip(points, centres, stride, strip, distances);
            }
        }
    }

    /// Adds the part of the distances that a strip of the vectors makes.
    fn add_strip(self, points: &[u8], centres: &[u8], stride: usize, strip: Group, distances: &mut [u64]) {
        let (texels, count) = (points.len() / stride, centres.len() / stride);
        for centre in (0..count).step_by(TILE) {
            let tile_centres = tile_rows(centres, stride, strip, centre, count);
            for texel in (0..texels).step_by(TILE) {
                let sums = self.tile(tile_rows(points, stride, strip, texel, texels), tile_centres);
                let width = (count - centre).min(TILE);
                for (row, sums) in distances[texel * count..].chunks_mut(count).zip(sums) {
                    for (distance, sum) in row[centre..centre + width].iter_mut().zip(sums) {
                        *distance += u64::from(strip.weight) * u64::from(sum);
                    }
                }
            }
        }
    }

    /// Distances of one texel to a few centres.
    pub fn row_distances<const C: usize>(
        self,
        point: &[u8],
        centres: [&[u8]; C],
        groups: &[Group],
    ) -> [u64; C] {
        let mut distances = [0; C];
        for group in groups {
            let range = group.start..group.end;
            let sums = self.row(&point[range.clone()], centres.map(|centre| &centre[range.clone()]));
            for (distance, sum) in distances.iter_mut().zip(sums) {
                *distance += u64::from(group.weight) * u64::from(sum);
            }
        }
        distances
    }

    /// The distance of a texel to a centre if it is below `limit`; groups after the sum has reached that are not read.
    pub(crate) fn distance_below(
        self,
        point: &[u8],
        centre: &[u8],
        groups: &[Group],
        limit: u64,
    ) -> Option<u64> {
        let mut distance = 0;
        for group in groups {
            let range = group.start..group.end;
            let [sum] = self.row(&point[range.clone()], [&centre[range]]);
            distance += u64::from(group.weight) * u64::from(sum);
            if distance >= limit {
                return None;
            }
        }
        Some(distance)
    }

    fn tile(self, points: [&[u8]; TILE], centres: [&[u8]; TILE]) -> [[u32; TILE]; TILE] {
        dispatch!(self; points.map(|point| plain(point, centres)), avx2::tile(points, centres), avx512::tile(points, centres))
    }

    fn row<const C: usize>(self, point: &[u8], centres: [&[u8]; C]) -> [u32; C] {
        dispatch!(self; plain(point, centres), avx2::row(point, centres), avx512::row(point, centres))
    }
}

/// The strip of the rows `first` to `first + TILE` of `rows` [count, stride]. Beyond the last row that row comes again:
/// its sums are left out.
fn tile_rows(bytes: &[u8], stride: usize, strip: Group, first: usize, count: usize) -> [&[u8]; TILE] {
    std::array::from_fn(|n| {
        let row = (first + n).min(count - 1) * stride;
        &bytes[row + strip.start..row + strip.end]
    })
}

fn plain<const C: usize>(point: &[u8], centres: [&[u8]; C]) -> [u32; C] {
    centres.map(|centre| point.iter().zip(centre).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn every_kernel_gives_the_plain_result() {
        let stride = 40 * LANE_BYTES;
        let groups = [
            Group { weight: 65536, start: 0, end: LANE_BYTES },
            Group { weight: 16962, start: LANE_BYTES, end: stride },
        ];
        let hash = Hash::new(1, 0);
        let bytes = |count: usize, salt: u32| -> Vec<u8> {
            (0..count as u32).map(|n| hash.words(n, salt, 0)[0] as u8).collect()
        };
        let by_hand = |point: &[u8], centre: &[u8]| -> u64 {
            let weight = |n| if n < LANE_BYTES { 65536 } else { 16962 };
            (0..stride).map(|n| weight(n) * u64::from(point[n].abs_diff(centre[n]))).sum()
        };
        for (texels, centres) in [(1, 1), (3, 5), (17, 4), (19, 9)] {
            let (points, centres_bytes) = (bytes(texels * stride, 0), bytes(centres * stride, 1));
            let expected: Vec<u64> = points
                .chunks_exact(stride)
                .flat_map(|point| {
                    centres_bytes.chunks_exact(stride).map(move |centre| by_hand(point, centre))
                })
                .collect();
            for kernel in Kernel::available() {
                let mut distances = vec![7; texels * centres];
                kernel.distances(&points, &centres_bytes, stride, &groups, &mut distances);
                assert_eq!(distances, expected, "{kernel:?}");
                let four: [&[u8]; 4] = std::array::from_fn(|n| {
                    let centre = n.min(centres - 1);
                    &centres_bytes[centre * stride..(centre + 1) * stride]
                });
                for (limit, below) in [(expected[0], None), (expected[0] + 1, Some(expected[0]))] {
                    let found =
                        kernel.distance_below(&points[..stride], &centres_bytes[..stride], &groups, limit);
                    assert_eq!(found, below, "{kernel:?}");
                }
                let found = kernel.row_distances(&points[..stride], four, &groups);
                assert_eq!(found[..centres.min(4)], expected[..centres.min(4)], "{kernel:?}");
            }
        }
    }
}

//! Sums of absolute differences by AVX-512, four texels by four centres at a time.

use std::arch::x86_64::*;

use super::TILE;

type Register = __m512i;
const REGISTER_BYTES: usize = size_of::<Register>();

/// Sums of strips of one length, a multiple of [`super::LANE_BYTES`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[allow(unsafe_code)]
pub(super) fn tile(points: [&[u8]; TILE], centres: [&[u8]; TILE]) -> [[u32; TILE]; TILE] {
    // Two sums, each below 2^32, share a lane; then lanes of two registers are added crosswise, three times.
    let both = |low, high| _mm512_or_si512(low, _mm512_slli_epi64::<32>(high));
    let neighbours = |a, b| _mm512_add_epi64(_mm512_unpacklo_epi64(a, b), _mm512_unpackhi_epi64(a, b));
    let quarters = |a, b| {
        let even = _mm512_shuffle_i64x2::<0b10_00_10_00>(a, b);
        _mm512_add_epi64(even, _mm512_shuffle_i64x2::<0b11_01_11_01>(a, b))
    };
    let [a, b, c, d] = lanes(points, centres).map(|[a, b, c, d]| neighbours(both(a, b), both(c, d)));
    let all = quarters(quarters(a, b), quarters(c, d));
    let mut found = [[0; TILE]; TILE];
    // SAFETY: the array has the bytes of a register; the store needs no alignment.
    unsafe { _mm512_storeu_si512(found.as_mut_ptr().cast(), all) };
    found
}

/// Sums of one strip with each of `C`.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
pub(super) fn row<const C: usize>(point: &[u8], centres: [&[u8]; C]) -> [u32; C] {
    let [sums] = lanes([point], centres);
    sums.map(|lanes| _mm512_reduce_add_epi64(lanes) as u32)
}

/// Sums of each pair as eight u64 that are yet to be added.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[inline]
#[allow(unsafe_code)]
fn lanes<const P: usize, const C: usize>(points: [&[u8]; P], centres: [&[u8]; C]) -> [[Register; C]; P] {
    let length = points[0].len();
    assert!(length.is_multiple_of(REGISTER_BYTES));
    assert!(points.iter().chain(&centres).all(|strip| strip.len() == length));
    let mut sums = [[_mm512_setzero_si512(); C]; P];
    for at in (0..length).step_by(REGISTER_BYTES) {
        // SAFETY: a register from `at` on lies within each strip, as just checked; loads need no alignment.
        let load = |strip: &[u8]| unsafe { _mm512_loadu_si512(strip.as_ptr().add(at).cast()) };
        let centres = centres.map(load);
        for (sums, point) in sums.iter_mut().zip(points) {
            let point = load(point);
            for (sum, centre) in sums.iter_mut().zip(centres) {
                *sum = _mm512_add_epi64(*sum, _mm512_sad_epu8(point, centre));
            }
        }
    }
    sums
}

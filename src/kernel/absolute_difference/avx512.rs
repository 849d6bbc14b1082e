//! Sums of absolute differences by AVX-512, four texels by four centres at a time.

use std::arch::x86_64::*;

use super::TILE;

type Register = __m512i;

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

lanes!(
    "avx512f,avx512bw,avx512vl",
    Register,
    _mm512_loadu_si512,
    _mm512_setzero_si512,
    _mm512_add_epi64,
    _mm512_sad_epu8
);

//! Sums of absolute differences by AVX2, two texels by four centres at a time.

use std::arch::x86_64::*;

use super::TILE;

type Register = __m256i;

/// Sums of strips of one length, a multiple of [`super::LANE_BYTES`].
#[target_feature(enable = "avx2")]
pub(super) fn tile(points: [&[u8]; TILE], centres: [&[u8]; TILE]) -> [[u32; TILE]; TILE] {
    let [a, b, c, d] = points;
    let ([a, b], [c, d]) = (half(lanes([a, b], centres)), half(lanes([c, d], centres)));
    [a, b, c, d]
}

/// Sums of one strip with each of `C`.
#[target_feature(enable = "avx2")]
pub(super) fn row<const C: usize>(point: &[u8], centres: [&[u8]; C]) -> [u32; C] {
    let [sums] = lanes([point], centres);
    sums.map(|lanes| {
        let two = _mm_add_epi64(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256::<1>(lanes));
        (_mm_cvtsi128_si64(two) + _mm_extract_epi64::<1>(two)) as u32
    })
}

lanes!("avx2", Register, _mm256_loadu_si256, _mm256_setzero_si256, _mm256_add_epi64, _mm256_sad_epu8);

/// The eight sums of two texels, each below 2^32.
#[target_feature(enable = "avx2")]
#[inline]
#[allow(unsafe_code)]
fn half(sums: [[Register; TILE]; 2]) -> [[u32; TILE]; 2] {
    // Two sums share a lane; then lanes of two registers are added crosswise, twice.
    let both = |low, high| _mm256_or_si256(low, _mm256_slli_epi64::<32>(high));
    let neighbours = |a, b| _mm256_add_epi64(_mm256_unpacklo_epi64(a, b), _mm256_unpackhi_epi64(a, b));
    let [a, b] = sums.map(|[a, b, c, d]| neighbours(both(a, b), both(c, d)));
    let all =
        _mm256_add_epi64(_mm256_permute2x128_si256::<0x20>(a, b), _mm256_permute2x128_si256::<0x31>(a, b));
    let mut found = [[0; TILE]; 2];
    // SAFETY: the array has the bytes of a register; the store needs no alignment.
    unsafe { _mm256_storeu_si256(found.as_mut_ptr().cast(), all) };
    found
}

//! Ranking by AVX2, eight queries at a time.

use std::arch::x86_64::*;

use super::{BATCH, CAPACITY, Candidates, DOUBTFUL, RANKS, SLOT_BITS};

type Register = __m256i;
const LANES: usize = 8;

networks!("avx2", Register, _mm256_min_epu32, _mm256_max_epu32, _mm256_sub_epi32);

/// The numbers of the nearest of each query's candidates, and a bit for each query whose order is in doubt.
#[target_feature(enable = "avx2")]
pub(super) fn rank(
    candidates: &[&Candidates; BATCH],
    queries: &[[f32; 3]; BATCH],
    found: &mut [[u32; RANKS]; BATCH],
) -> u32 {
    let halves = candidates
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(queries.as_chunks::<LANES>().0)
        .zip(found.as_chunks_mut::<LANES>().0);
    let mut doubtful = 0;
    for (half, ((candidates, queries), found)) in halves.enumerate() {
        doubtful |= rank_half(candidates, queries, found) << (half * LANES);
    }
    doubtful
}

#[target_feature(enable = "avx2")]
#[inline]
fn rank_half(
    candidates: &[&Candidates; LANES],
    queries: &[[f32; 3]; LANES],
    found: &mut [[u32; RANKS]; LANES],
) -> u32 {
    // Keys of eight slots of each query.
    let octets: [[Register; LANES]; CAPACITY / LANES] = std::array::from_fn(|octet| {
        transpose(std::array::from_fn(|query| keys(candidates[query], queries[query], octet)))
    });
    let run = |n: usize| -> [Register; RANKS] {
        std::array::from_fn(|slot| octets[2 * n + slot / LANES][slot % LANES])
    };
    let (least, gap) = least([run(0), run(1), run(2)]);
    let halves = least.as_chunks::<LANES>().0;
    for (half, ranks) in halves.iter().enumerate() {
        for ((keys, candidates), found) in transpose(*ranks).into_iter().zip(candidates).zip(&mut *found) {
            numbers(candidates, keys, &mut found.as_chunks_mut::<LANES>().0[half]);
        }
    }
    let certain = _mm256_cmpgt_epi32(
        _mm256_srli_epi32::<1>(gap), // as a signed number it is then not negative
        _mm256_set1_epi32(DOUBTFUL / 2 - 1),
    );
    !(_mm256_movemask_ps(_mm256_castsi256_ps(certain)) as u32) & ((1 << LANES) - 1)
}

/// Keys of eight of a query's candidates.
#[target_feature(enable = "avx2")]
#[inline]
fn keys(candidates: &Candidates, query: [f32; 3], octet: usize) -> Register {
    let from = |component: &[f32; CAPACITY], axis: usize| {
        _mm256_sub_ps(_mm256_set1_ps(query[axis]), load(component, octet))
    };
    let (x, y, z) = (from(&candidates.x, 0), from(&candidates.y, 1), from(&candidates.z, 2));
    let sum = _mm256_add_ps(_mm256_mul_ps(x, x), _mm256_mul_ps(y, y));
    let distance = _mm256_castps_si256(_mm256_add_ps(sum, _mm256_mul_ps(z, z)));
    let slots = _mm256_add_epi32(
        _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
        _mm256_set1_epi32((octet * LANES) as i32),
    );
    _mm256_or_si256(_mm256_and_si256(distance, _mm256_set1_epi32(-1 << SLOT_BITS)), slots)
}

#[target_feature(enable = "avx2")]
#[inline]
#[allow(unsafe_code)]
fn load(component: &[f32; CAPACITY], octet: usize) -> __m256 {
    assert!(octet < CAPACITY / LANES);
    // SAFETY: the lanes lie within the array; the load needs no alignment.
    unsafe { _mm256_loadu_ps(component.as_ptr().add(octet * LANES)) }
}

/// Numbers of the candidates whose slots the keys hold.
#[target_feature(enable = "avx2")]
#[inline]
#[allow(unsafe_code)]
fn numbers(candidates: &Candidates, keys: Register, found: &mut [u32; LANES]) {
    let slots = _mm256_and_si256(keys, _mm256_set1_epi32((1 << SLOT_BITS) - 1));
    // SAFETY: the array has the bytes of a register; the store needs no alignment.
    unsafe { _mm256_storeu_si256(found.as_mut_ptr().cast(), slots) };
    for found in found {
        *found = candidates.number[*found as usize % CAPACITY];
    }
}

/// Rows to columns.
#[target_feature(enable = "avx2")]
#[inline]
fn transpose(rows: [Register; LANES]) -> [Register; LANES] {
    let mut a = rows;
    for n in (0..8).step_by(2) {
        a[n] = _mm256_unpacklo_epi32(rows[n], rows[n + 1]);
        a[n + 1] = _mm256_unpackhi_epi32(rows[n], rows[n + 1]);
    }
    let mut b = a;
    for n in (0..8).step_by(4) {
        b[n] = _mm256_unpacklo_epi64(a[n], a[n + 2]);
        b[n + 1] = _mm256_unpackhi_epi64(a[n], a[n + 2]);
        b[n + 2] = _mm256_unpacklo_epi64(a[n + 1], a[n + 3]);
        b[n + 3] = _mm256_unpackhi_epi64(a[n + 1], a[n + 3]);
    }
    let mut columns = b;
    for n in 0..4 {
        columns[n] = _mm256_permute2x128_si256::<0x20>(b[n], b[n + 4]);
        columns[n + 4] = _mm256_permute2x128_si256::<0x31>(b[n], b[n + 4]);
    }
    columns
}

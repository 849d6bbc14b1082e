//! Ranking by AVX-512, sixteen queries at a time.

use std::arch::x86_64::*;

use super::{BATCH, CAPACITY, Candidates, DOUBTFUL, RANKS, SLOT_BITS};

type Register = __m512i;
const LANES: usize = 16;
const RUNS: usize = CAPACITY / LANES;

networks!("avx512f,avx512bw,avx512vl", Register, _mm512_min_epu32, _mm512_max_epu32, _mm512_sub_epi32);

/// The numbers of the nearest of each query's candidates, and a bit for each query whose order is in doubt.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
pub(super) fn rank(
    candidates: &[&Candidates; BATCH],
    queries: &[[f32; 3]; BATCH],
    found: &mut [[u32; RANKS]; BATCH],
) -> u32 {
    let mut runs = [[_mm512_setzero_si512(); BATCH]; RUNS];
    for (query, (candidates, point)) in candidates.iter().zip(queries).enumerate() {
        for (run, keys) in keys(candidates, *point).into_iter().enumerate() {
            runs[run][query] = keys;
        }
    }
    let (least, gap) = least(runs.map(|run| transpose(run)));
    for ((keys, candidates), found) in transpose(least).into_iter().zip(candidates).zip(found) {
        numbers(candidates, keys, found);
    }
    u32::from(_mm512_cmplt_epu32_mask(gap, _mm512_set1_epi32(DOUBTFUL)))
}

/// Keys of a query's candidates.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[inline]
fn keys(candidates: &Candidates, query: [f32; 3]) -> [Register; RUNS] {
    let query = query.map(|component| _mm512_set1_ps(component));
    let slot_mask = _mm512_set1_epi32((1 << SLOT_BITS) - 1);
    let first_slots = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    std::array::from_fn(|run| {
        let from =
            |component: &[f32; CAPACITY], axis: usize| _mm512_sub_ps(query[axis], load(component, run));
        let (x, y, z) = (from(&candidates.x, 0), from(&candidates.y, 1), from(&candidates.z, 2));
        let distance = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x)));
        let slots = _mm512_or_si512(first_slots, _mm512_set1_epi32((run * LANES) as i32));
        // The mask chooses: slots where it is set, distance where not.
        _mm512_ternarylogic_epi32::<0b11_00_10_10>(slot_mask, slots, _mm512_castps_si512(distance))
    })
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[inline]
#[allow(unsafe_code)]
fn load(component: &[f32; CAPACITY], run: usize) -> __m512 {
    assert!(run < RUNS);
    // SAFETY: the lanes lie within the array; the load needs no alignment.
    unsafe { _mm512_loadu_ps(component.as_ptr().add(run * LANES)) }
}

/// Numbers of the candidates whose slots the keys hold.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[inline]
#[allow(unsafe_code)]
fn numbers(candidates: &Candidates, keys: Register, found: &mut [u32; RANKS]) {
    // SAFETY: the lanes lie within the array; the load needs no alignment.
    let table =
        |run: usize| unsafe { _mm512_loadu_si512(candidates.number.as_ptr().add(run * LANES).cast()) };
    // Permutations take only as many bits of a slot as they need.
    let low = _mm512_permutex2var_epi32(table(0), keys, table(1));
    let high = _mm512_test_epi32_mask(keys, _mm512_set1_epi32(2 * LANES as i32));
    let numbers = _mm512_mask_permutexvar_epi32(low, high, keys, table(2));
    // SAFETY: the array has the bytes of a register; the store needs no alignment.
    unsafe { _mm512_storeu_si512(found.as_mut_ptr().cast(), numbers) };
}

/// Rows to columns.
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
#[inline]
fn transpose(rows: [Register; 16]) -> [Register; 16] {
    let mut a = rows;
    for n in (0..16).step_by(2) {
        a[n] = _mm512_unpacklo_epi32(rows[n], rows[n + 1]);
        a[n + 1] = _mm512_unpackhi_epi32(rows[n], rows[n + 1]);
    }
    let mut b = a;
    for n in (0..16).step_by(4) {
        b[n] = _mm512_unpacklo_epi64(a[n], a[n + 2]);
        b[n + 1] = _mm512_unpackhi_epi64(a[n], a[n + 2]);
        b[n + 2] = _mm512_unpacklo_epi64(a[n + 1], a[n + 3]);
        b[n + 3] = _mm512_unpackhi_epi64(a[n + 1], a[n + 3]);
    }
    // Each register now has a column of four rows in each quarter; quarters are what is left to transpose.
    let mut c = b;
    for n in 0..4 {
        c[n] = _mm512_shuffle_i64x2::<0b10_00_10_00>(b[n], b[n + 4]);
        c[n + 4] = _mm512_shuffle_i64x2::<0b11_01_11_01>(b[n], b[n + 4]);
        c[n + 8] = _mm512_shuffle_i64x2::<0b10_00_10_00>(b[n + 8], b[n + 12]);
        c[n + 12] = _mm512_shuffle_i64x2::<0b11_01_11_01>(b[n + 8], b[n + 12]);
    }
    let mut columns = c;
    for n in 0..4 {
        columns[n] = _mm512_shuffle_i64x2::<0b10_00_10_00>(c[n], c[n + 8]);
        columns[n + 8] = _mm512_shuffle_i64x2::<0b11_01_11_01>(c[n], c[n + 8]);
        columns[n + 4] = _mm512_shuffle_i64x2::<0b10_00_10_00>(c[n + 4], c[n + 12]);
        columns[n + 12] = _mm512_shuffle_i64x2::<0b11_01_11_01>(c[n + 4], c[n + 12]);
    }
    columns
}

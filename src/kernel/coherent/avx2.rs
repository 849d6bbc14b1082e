//! A sub-pass by AVX2. Longer vectors gain nothing: a texel's candidates are eight, their surroundings 16 or 32 bytes.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::lanes::Lanes;
use super::{Subpass, correct_by};

struct Avx2;

/// Corrects positions.
#[target_feature(enable = "avx2")]
pub(super) fn correct<const D: usize>(positions: &mut [u32], subpass: &Subpass<'_, D>) {
    correct_by::<D, Avx2>(positions, subpass);
}

// Methods of a trait cannot name the instructions that they need; they are inlined into the one above, which does.
impl<const D: usize> Lanes<D> for Avx2 {
    #[inline(always)]
    fn same(candidates: &[u32; 8], position: u32) -> u32 {
        // SAFETY: see above.
        unsafe { same(candidates, position) }
    }

    #[inline(always)]
    fn difference(around: &[[i16; D]; 4], there: &[[i8; D]; 4]) -> i32 {
        const { assert!(D.is_multiple_of(4), "dimensions fill vectors of 16 numbers") };
        let (around, there) = (around.as_flattened().as_chunks().0, there.as_flattened().as_chunks().0);
        // SAFETY: see above.
        unsafe { difference(around, there) }
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn same(candidates: &[u32; 8], position: u32) -> u32 {
    // SAFETY: eight words are read.
    let candidates = unsafe { _mm256_loadu_si256(candidates.as_ptr().cast()) };
    let equal = _mm256_cmpeq_epi32(candidates, _mm256_set1_epi32(position as i32));
    _mm256_movemask_ps(_mm256_castsi256_ps(equal)) as u32
}

/// The sum of squared differences, 16 and 16 at a time.
#[inline]
#[target_feature(enable = "avx2")]
fn difference(around: &[[i16; 16]], there: &[[i8; 16]]) -> i32 {
    let mut squares = _mm256_setzero_si256();
    for (around, there) in around.iter().zip(there) {
        // SAFETY: 16 numbers are read of each.
        let (around, there) =
            unsafe { (_mm256_loadu_si256(around.as_ptr().cast()), _mm_loadu_si128(there.as_ptr().cast())) };
        let there = _mm256_cvtepi8_epi16(there);
        let threefold = _mm256_add_epi16(there, _mm256_add_epi16(there, there));
        let difference = _mm256_sub_epi16(around, threefold);
        squares = _mm256_add_epi32(squares, _mm256_madd_epi16(difference, difference));
    }
    let halves = _mm_add_epi32(_mm256_castsi256_si128(squares), _mm256_extracti128_si256::<1>(squares));
    let quarters = _mm_add_epi32(halves, _mm_unpackhi_epi64(halves, halves));
    _mm_cvtsi128_si32(_mm_add_epi32(quarters, _mm_shuffle_epi32::<0b01>(quarters)))
}

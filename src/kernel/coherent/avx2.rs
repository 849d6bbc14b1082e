//! A sub-pass by AVX2. Longer vectors gain nothing: a texel's candidates are eight, their surroundings 16 or 32 bytes.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::lanes::Lanes;
use super::{Subpass, correct};
use crate::kernel::Kernel;

struct Avx2;

/// Corrects positions at a level of four dimensions; `kernel` vouches for the instructions.
pub(super) fn correct_fine(kernel: Kernel, positions: &mut [u32], subpass: &Subpass<'_, 4>) {
    debug_assert!(kernel != Kernel::Plain);
    #[target_feature(enable = "avx2")]
    fn run(positions: &mut [u32], subpass: &Subpass<'_, 4>) {
        correct::<4, Avx2>(positions, subpass);
    }
    // SAFETY: a kernel other than the plain one is only ever constructed after AVX2 was found.
    unsafe { run(positions, subpass) }
}

/// Corrects positions at a level of eight dimensions; `kernel` vouches for the instructions.
pub(super) fn correct_coarse(kernel: Kernel, positions: &mut [u32], subpass: &Subpass<'_, 8>) {
    debug_assert!(kernel != Kernel::Plain);
    #[target_feature(enable = "avx2")]
    fn run(positions: &mut [u32], subpass: &Subpass<'_, 8>) {
        correct::<8, Avx2>(positions, subpass);
    }
    // SAFETY: as above.
    unsafe { run(positions, subpass) }
}

// Methods of a trait cannot name the instructions that they need; they are inlined into the two above, which do.

impl Lanes<4> for Avx2 {
    #[inline(always)]
    fn same(candidates: &[u32; 8], position: u32) -> u32 {
        // SAFETY: see above.
        unsafe { same(candidates, position) }
    }

    #[inline(always)]
    fn difference(around: &[[i16; 4]; 4], there: &[[i8; 4]; 4]) -> i32 {
        // SAFETY: see above; both arrays have 16 numbers.
        unsafe { sum(squared(around.as_flattened(), there.as_flattened())) }
    }
}

impl Lanes<8> for Avx2 {
    #[inline(always)]
    fn same(candidates: &[u32; 8], position: u32) -> u32 {
        // SAFETY: see above.
        unsafe { same(candidates, position) }
    }

    #[inline(always)]
    fn difference(around: &[[i16; 8]; 4], there: &[[i8; 8]; 4]) -> i32 {
        let (around, there) = (around.as_flattened(), there.as_flattened());
        // SAFETY: see above; both arrays have 32 numbers.
        unsafe {
            sum(_mm256_add_epi32(squared(&around[..16], &there[..16]), squared(&around[16..], &there[16..])))
        }
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

/// Squares of 16 differences, two and two added.
///
/// # Safety
/// Both slices hold 16 numbers.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn squared(around: &[i16], there: &[i8]) -> __m256i {
    // SAFETY: the caller's promise.
    let (around, there) =
        unsafe { (_mm256_loadu_si256(around.as_ptr().cast()), _mm_loadu_si128(there.as_ptr().cast())) };
    let there = _mm256_cvtepi8_epi16(there);
    let threefold = _mm256_add_epi16(there, _mm256_add_epi16(there, there));
    let difference = _mm256_sub_epi16(around, threefold);
    _mm256_madd_epi16(difference, difference)
}

#[inline]
#[target_feature(enable = "avx2")]
fn sum(lanes: __m256i) -> i32 {
    let halves = _mm_add_epi32(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256::<1>(lanes));
    let quarters = _mm_add_epi32(halves, _mm_unpackhi_epi64(halves, halves));
    _mm_cvtsi128_si32(_mm_add_epi32(quarters, _mm_shuffle_epi32::<0b01>(quarters)))
}

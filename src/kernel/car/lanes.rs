//! Sixteen f32 in the registers of each kernel.

/// Lanes of a vector.
pub(super) const LANES: usize = 16;

/// Sixteen numbers that are worked on together; each lane rounds as scalar f32 does.
///
/// Only functions that were compiled for the kernel's instructions may use its vectors.
pub(super) trait Lanes: Copy {
    /// Vectors of each of up to three channels that the registers hold beside one source.
    const TOGETHER: usize;

    fn load(from: &[f32; LANES]) -> Self;
    fn store(self, to: &mut [f32; LANES]);
    fn splat(value: f32) -> Self;
    fn plus(self, other: Self) -> Self;
    /// `self * factor + sum`, rounded once.
    fn times_plus(self, factor: Self, sum: Self) -> Self;
}

impl Lanes for [f32; LANES] {
    const TOGETHER: usize = 1;

    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        *from
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; LANES]) {
        *to = self;
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        [value; LANES]
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        std::array::from_fn(|n| self[n] + other[n])
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, sum: Self) -> Self {
        std::array::from_fn(|n| self[n].mul_add(factor[n], sum[n]))
    }
}

/// The vectors of x86. Their functions are not marked with the features that they need, as those of a trait cannot be:
/// they are inlined into functions that are.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod x86 {
    use std::arch::x86_64::*;

    use super::{LANES, Lanes};

    // SAFETY of every block here: the trait asks its users for AVX-512F; pointers are to arrays of sixteen.
    impl Lanes for __m512 {
        const TOGETHER: usize = 4;

        #[inline(always)]
        fn load(from: &[f32; LANES]) -> Self {
            unsafe { _mm512_loadu_ps(from.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, to: &mut [f32; LANES]) {
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self) }
        }

        #[inline(always)]
        fn splat(value: f32) -> Self {
            unsafe { _mm512_set1_ps(value) }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { _mm512_add_ps(self, other) }
        }

        #[inline(always)]
        fn times_plus(self, factor: Self, sum: Self) -> Self {
            unsafe { _mm512_fmadd_ps(self, factor, sum) }
        }
    }

    // SAFETY of every block here: the trait asks its users for AVX2 and FMA; pointers are to arrays of sixteen.
    impl Lanes for [__m256; 2] {
        const TOGETHER: usize = 2;

        #[inline(always)]
        fn load(from: &[f32; LANES]) -> Self {
            unsafe { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))] }
        }

        #[inline(always)]
        fn store(self, to: &mut [f32; LANES]) {
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), self[0]);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), self[1]);
            }
        }

        #[inline(always)]
        fn splat(value: f32) -> Self {
            unsafe { [_mm256_set1_ps(value); 2] }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { [_mm256_add_ps(self[0], other[0]), _mm256_add_ps(self[1], other[1])] }
        }

        #[inline(always)]
        fn times_plus(self, factor: Self, sum: Self) -> Self {
            unsafe {
                [_mm256_fmadd_ps(self[0], factor[0], sum[0]), _mm256_fmadd_ps(self[1], factor[1], sum[1])]
            }
        }
    }
}

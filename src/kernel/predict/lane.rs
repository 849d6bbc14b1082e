//! The unsigned integers that prediction works on.

use std::fmt::Debug;

/// Samples that are handled together: one 256-bit register of bytes.
pub(super) const BLOCK: usize = 32;

/// The block of `slice` from `at` on.
#[inline(always)]
pub(super) fn block<T>(slice: &[T], at: usize) -> &[T; BLOCK] {
    &slice[at..].as_chunks().0[0]
}

/// [`block`] to write to.
#[inline(always)]
pub(super) fn block_mut<T>(slice: &mut [T], at: usize) -> &mut [T; BLOCK] {
    &mut slice[at..].as_chunks_mut().0[0]
}

/// A sample as an integer whose order is that of the samples; all arithmetic is modulo 2^bits.
pub trait Lane: Copy + Default + Eq + Ord + Debug + Send + Sync + 'static {
    /// Bytes of a sample.
    const BYTES: usize;
    /// Half of the range: differences are centred on it where they must be ordered.
    const HALF: Self;

    /// Reads one from little-endian bytes, of which there are [`Self::BYTES`].
    fn from_le(bytes: &[u8]) -> Self;
    /// Writes one as little-endian bytes.
    fn to_le(self, bytes: &mut [u8]);
    /// Byte `n`, 0 the lowest.
    fn byte(self, n: usize) -> u8;
    /// `byte` at place `n`, 0 the lowest.
    fn at(byte: u8, n: usize) -> Self;
    /// Sum.
    fn plus(self, other: Self) -> Self;
    /// Difference.
    fn minus(self, other: Self) -> Self;
    /// Bitwise and.
    fn and(self, other: Self) -> Self;
    /// Bitwise or.
    fn or(self, other: Self) -> Self;
    /// Mean, rounded up.
    fn mean(self, other: Self) -> Self;
    /// A signed difference as 0, -1, 1, -2, 2, ... numbered from 0 on.
    fn zigzag(self) -> Self;
    /// Inverse of [`Self::zigzag`].
    fn unzigzag(self) -> Self;
    /// IEEE bit patterns in the order of the numbers they stand for.
    fn ordered(self) -> Self;
    /// Inverse of [`Self::ordered`].
    fn unordered(self) -> Self;
    /// Bits that the size of a signed difference takes.
    fn magnitude_bits(self) -> Self;
    /// As a number.
    fn count(self) -> u32;
}

macro_rules! lane {
    ($type:ty) => {
        impl Lane for $type {
            const BYTES: usize = size_of::<Self>();
            const HALF: Self = 1 << (Self::BITS - 1);

            #[inline(always)]
            fn from_le(bytes: &[u8]) -> Self {
                bytes.first_chunk().map_or(0, |bytes| Self::from_le_bytes(*bytes))
            }
            #[inline(always)]
            fn to_le(self, bytes: &mut [u8]) {
                bytes.copy_from_slice(&self.to_le_bytes());
            }
            #[inline(always)]
            fn byte(self, n: usize) -> u8 {
                (self >> (8 * n)) as u8
            }
            #[inline(always)]
            #[allow(clippy::cast_lossless)] // u8 to u8 in one of the types
            fn at(byte: u8, n: usize) -> Self {
                (byte as Self) << (8 * n)
            }
            #[inline(always)]
            fn plus(self, other: Self) -> Self {
                self.wrapping_add(other)
            }
            #[inline(always)]
            fn minus(self, other: Self) -> Self {
                self.wrapping_sub(other)
            }
            #[inline(always)]
            fn and(self, other: Self) -> Self {
                self & other
            }
            #[inline(always)]
            fn or(self, other: Self) -> Self {
                self | other
            }
            #[inline(always)]
            fn mean(self, other: Self) -> Self {
                (self | other) - ((self ^ other) >> 1)
            }
            #[inline(always)]
            fn zigzag(self) -> Self {
                let sign = (self >> (Self::BITS - 1)).wrapping_neg();
                (self << 1) ^ sign
            }
            #[inline(always)]
            fn unzigzag(self) -> Self {
                (self >> 1) ^ (self & 1).wrapping_neg()
            }
            #[inline(always)]
            fn ordered(self) -> Self {
                let negative = (self >> (Self::BITS - 1)).wrapping_neg();
                self ^ (negative | Self::HALF)
            }
            #[inline(always)]
            fn unordered(self) -> Self {
                let positive = (self >> (Self::BITS - 1)).wrapping_neg();
                self ^ (!positive | Self::HALF)
            }
            #[inline(always)]
            fn magnitude_bits(self) -> Self {
                let magnitude = self.min(self.wrapping_neg());
                (Self::BITS - magnitude.leading_zeros()) as Self
            }
            #[inline(always)]
            #[allow(clippy::cast_lossless)] // u32 to u32 in one of the types
            fn count(self) -> u32 {
                self as u32
            }
        }
    };
}
lane!(u8);
lane!(u16);
lane!(u32);

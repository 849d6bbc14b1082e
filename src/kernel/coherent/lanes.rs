//! What a sub-pass does most often, as each set of instructions does it best.

/// Two operations on a candidate, at a level of `D` dimensions.
pub(super) trait Lanes<const D: usize> {
    /// Bit n: whether candidate n is this position.
    fn same(candidates: &[u32; 8], position: u32) -> u32;

    /// Squared difference between the sums of three appearances around a texel, below 2^9 each, and three times the
    /// appearances around a candidate.
    fn difference(around: &[[i16; D]; 4], there: &[[i8; D]; 4]) -> i32;
}

/// Plain Rust.
pub(super) struct Plain;

impl<const D: usize> Lanes<D> for Plain {
    #[inline(always)]
    fn same(candidates: &[u32; 8], position: u32) -> u32 {
        candidates.iter().enumerate().map(|(n, &other)| u32::from(other == position) << n).sum()
    }

    #[inline(always)]
    fn difference(around: &[[i16; D]; 4], there: &[[i8; D]; 4]) -> i32 {
        let pairs = around.as_flattened().iter().zip(there.as_flattened());
        let differences = pairs.map(|(&here, &there)| i32::from(here - 3 * i16::from(there)));
        differences.map(|difference| difference * difference).sum()
    }
}

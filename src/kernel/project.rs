//! Surroundings reduced to a few small whole numbers: a matrix of 16-bit weights times 16-bit inputs, rounded and
//! clamped.

use super::compiled_for_each_kernel;

/// Largest absolute value of what comes out.
const MOST: i32 = 120;

/// How `N` inputs are reduced to `D` numbers: `(sum of weights * inputs - offset) / 2^shift`, rounded, clamped to +-120.
/// Sums wrap, so that no weights can break them.
pub(crate) struct Projection<const N: usize, const D: usize> {
    /// [dim, input].
    pub weights: [[i16; N]; D],
    /// [dim].
    pub offset: [i32; D],
    /// From 1 to 20.
    pub shift: u32,
}

compiled_for_each_kernel! {
    /// Reduces 72 inputs each to four numbers.
    pub(crate) fn project_fine(inputs: &[[i16; 72]], projection: &Projection<72, 4>, out: &mut [[i8; 4]]) = project::<72, 4>
}

compiled_for_each_kernel! {
    /// Reduces 72 inputs each to eight numbers.
    pub(crate) fn project_coarse(inputs: &[[i16; 72]], projection: &Projection<72, 8>, out: &mut [[i8; 8]]) = project::<72, 8>
}

#[inline(always)]
fn project<const N: usize, const D: usize>(
    inputs: &[[i16; N]],
    projection: &Projection<N, D>,
    out: &mut [[i8; D]],
) {
    let Projection { weights, offset, shift } = projection;
    for (inputs, out) in inputs.iter().zip(out) {
        for (d, out) in out.iter_mut().enumerate() {
            let mut sum = 0i32;
            for (&input, &weight) in inputs.iter().zip(&weights[d]) {
                sum = sum.wrapping_add(i32::from(input) * i32::from(weight));
            }
            let rounded = sum.wrapping_sub(offset[d]).wrapping_add(1 << (shift - 1)) >> shift;
            *out = rounded.clamp(-MOST, MOST) as i8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::random::Hash;

    #[test]
    fn every_kernel_gives_the_bits_of_the_formula() {
        let mut drawn = 0;
        let mut draw = || {
            drawn += 1;
            Hash::new(3, 0).words(drawn, 0, 0)[0] as u16 as i16
        };
        let inputs: Vec<[i16; 72]> = (0..37).map(|_| std::array::from_fn(|_| draw())).collect();
        for shift in [1, 9, 20] {
            let weights = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
            let offset = std::array::from_fn(|_| i32::from(draw()) * 1000);
            let projection = Projection::<72, 8> { weights, offset, shift };
            let expected = |inputs: &[i16; 72], d: usize| {
                let products = inputs.iter().zip(&weights[d]).map(|(&a, &b)| i64::from(a) * i64::from(b));
                let sum = products.sum::<i64>() - i64::from(offset[d]) + (1 << (shift - 1));
                ((sum as i32) >> shift).clamp(-120, 120) as i8
            };
            let expected: Vec<[i8; 8]> =
                inputs.iter().map(|inputs| std::array::from_fn(|d| expected(inputs, d))).collect();
            for kernel in Kernel::available() {
                let mut out = vec![[0; 8]; inputs.len()];
                project_coarse(kernel, &inputs, &projection, &mut out);
                assert_eq!(out, expected, "{kernel:?}, shift {shift}");
            }
        }
    }
}

//! Rows of a pyramid's collapse in f32: the expansion of (5) along and across rows, and the mixing of channels.
//!
//! Each value is made by one order of operations, so all kernels give the same bits.

use super::compiled_for_each_kernel;

/// Expanded value on a coarse sample, from it and its two neighbours.
#[inline(always)]
fn even(before: f32, here: f32, after: f32) -> f32 {
    (before + after).mul_add(0.125, 0.75 * here)
}

/// Expanded value half-way between two coarse samples.
#[inline(always)]
fn odd(here: f32, after: f32) -> f32 {
    0.5 * (here + after)
}

#[inline(always)]
fn spread_body(coarse: &[f32], fine: &mut [f32]) {
    let (pairs, last) = fine.as_chunks_mut::<2>();
    let neighbours = coarse.iter().zip(&coarse[1..]).zip(&coarse[2..]);
    for (pair, ((&before, &here), &after)) in pairs.iter_mut().zip(neighbours) {
        *pair = [even(before, here, after), odd(here, after)];
    }
    let n = pairs.len();
    for value in last {
        *value = even(coarse[n], coarse[n + 1], coarse[n + 2]);
    }
}

#[inline(always)]
fn add_even_body(rows: [&[f32]; 3], sum: &mut [f32]) {
    let [before, here, after] = rows;
    for (((sum, &before), &here), &after) in sum.iter_mut().zip(before).zip(here).zip(after) {
        *sum += even(before, here, after);
    }
}

#[inline(always)]
fn add_odd_body(rows: [&[f32]; 2], sum: &mut [f32]) {
    let [here, after] = rows;
    for ((sum, &here), &after) in sum.iter_mut().zip(here).zip(after) {
        *sum += odd(here, after);
    }
}

#[inline(always)]
fn mix_body(planes: &[f32], weights: &[f32], offset: f32, out: &mut [f32]) {
    out.fill(offset);
    for (&weight, plane) in weights.iter().zip(planes.chunks_exact(out.len())) {
        out.iter_mut().zip(plane).for_each(|(sum, &value)| *sum = weight.mul_add(value, *sum));
    }
}

compiled_for_each_kernel! {
    /// Expands a row along itself. Column 0 of `fine` lies on coarse sample 1; `coarse` needs half as many samples,
    /// rounded up, and two.
    pub(crate) fn spread(coarse: &[f32], fine: &mut [f32]) = spread_body
}

compiled_for_each_kernel! {
    /// Adds the expansion across rows on a coarse row, from it and its two neighbours.
    pub(crate) fn add_even(rows: [&[f32]; 3], sum: &mut [f32]) = add_even_body
}

compiled_for_each_kernel! {
    /// Adds the expansion half-way between two coarse rows.
    pub(crate) fn add_odd(rows: [&[f32]; 2], sum: &mut [f32]) = add_odd_body
}

compiled_for_each_kernel! {
    /// One row of `offset + sum of weight * plane`; planes lie one after the other.
    pub(crate) fn mix(planes: &[f32], weights: &[f32], offset: f32, out: &mut [f32]) = mix_body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::random::Hash;

    fn noise(salt: u32, count: usize) -> Vec<f32> {
        let mut row = vec![0.0; count];
        Hash::new(1, 0).normal_row(Kernel::Plain, 0, 0, salt, &mut row);
        row
    }

    #[test]
    fn rows_expand_as_computed_by_hand() {
        let mut fine = [0.0; 5];
        spread(Kernel::Plain, &[16.0, 0.0, 8.0, -8.0, 0.0], &mut fine);
        assert_eq!(fine, [3.0, 4.0, 5.0, 0.0, -5.0]);
        let mut sum = [1.0];
        add_even(Kernel::Plain, [&[16.0], &[0.0], &[8.0]], &mut sum);
        add_odd(Kernel::Plain, [&[6.0], &[1.0]], &mut sum);
        assert_eq!(sum, [7.5]);
        mix(Kernel::Plain, &[3.0, 4.0], &[2.0, -1.0], 0.5, &mut sum);
        assert_eq!(sum, [2.5]);
    }

    #[test]
    fn every_kernel_gives_the_same_bits() {
        for width in [1, 2, 31, 100, 257] {
            let coarse = noise(0, width / 2 + 4);
            let rows = [1, 2, 3].map(|salt| noise(salt, width));
            let run = |kernel| {
                let (mut sum, mut mixed) = (vec![0.0; width], vec![0.0; width]);
                spread(kernel, &coarse, &mut sum);
                add_even(kernel, [&rows[0], &rows[1], &rows[2]], &mut sum);
                add_odd(kernel, [&rows[0], &rows[1]], &mut sum);
                mix(kernel, &rows.concat(), &[0.3, -0.7, 0.6], 0.1, &mut mixed);
                sum.iter().chain(&mixed).map(|value| value.to_bits()).collect::<Vec<_>>()
            };
            for kernel in Kernel::available() {
                assert_eq!(run(kernel), run(Kernel::Plain), "{kernel:?}");
            }
        }
    }
}

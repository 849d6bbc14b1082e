//! Lower bounds of distances, as triangle inequalities keep them from pass to pass: u16 steps of distance, rounded
//! down, a row a texel.

use super::compiled_for_each_kernel;

/// What one texel brings to [`advance`].
#[derive(Clone, Copy, Debug)]
pub struct Upper {
    /// Its distance to its own centre in steps, rounded down.
    pub floor: u16,
    /// The same, rounded up.
    pub ceiling: u16,
}

/// What all texels of a cluster share; a value for each column of bounds.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    /// How far centres of the column moved since the bounds were made, steps, rounded up.
    pub drift: &'a [u16],
    /// Distance of the texel's own centre to the nearest of the column, steps, rounded down.
    pub between: &'a [u16],
    /// Bounds up to this must be looked into whatever the texel's own centre.
    pub reach: &'a [u16],
}

/// Columns that are looked at together.
const TOGETHER: usize = 32;

#[inline(always)]
fn advance_body(row: &mut [u16], columns: Columns<'_>, upper: Upper, suspects: &mut Vec<u16>) {
    let Columns { drift, between, reach } = columns;
    let parts = row.chunks_mut(TOGETHER).zip(drift.chunks(TOGETHER)).zip(between.chunks(TOGETHER));
    for (part, (((row, drift), between), reach)) in parts.zip(reach.chunks(TOGETHER)).enumerate() {
        let mut found = false;
        for (((bound, &drift), &between), &reach) in row.iter_mut().zip(drift).zip(between).zip(reach) {
            let bound_now = bound.saturating_sub(drift).max(between.saturating_sub(upper.ceiling));
            *bound = bound_now;
            found |= bound_now <= reach.max(upper.floor);
        }
        if found {
            for (number, (&bound, &reach)) in row.iter().zip(reach).enumerate() {
                if bound <= reach.max(upper.floor) {
                    suspects.push((part * TOGETHER + number) as u16);
                }
            }
        }
    }
}

compiled_for_each_kernel! {
    /// Brings a row of bounds up to date by the triangle inequality, max(bound - drift, between - upper), and
    /// appends to `suspects` the columns whose bounds do not rule them out.
    pub fn advance(row: &mut [u16], columns: Columns<'_>, upper: Upper, suspects: &mut Vec<u16>) = advance_body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::random::Hash;

    #[test]
    fn every_kernel_gives_the_plain_result() {
        let hash = Hash::new(3, 0);
        for count in [1, 31, 32, 33, 100] {
            let numbers = |salt: u32, most: u32| -> Vec<u16> {
                (0..count).map(|n| (hash.words(n, salt, 0)[0] % most) as u16).collect()
            };
            let (drift, between, reach) = (numbers(1, 90), numbers(2, 3000), numbers(3, 100));
            let columns = Columns { drift: &drift, between: &between, reach: &reach };
            let upper = Upper { floor: 500, ceiling: 501 };
            let run = |kernel| {
                let (mut row, mut suspects) = (numbers(0, 1000), Vec::new());
                advance(kernel, &mut row, columns, upper, &mut suspects);
                (row, suspects)
            };
            let plain = run(Kernel::Plain);
            for (n, bound) in numbers(0, 1000).into_iter().enumerate() {
                let expected =
                    (i32::from(bound) - i32::from(drift[n])).max(i32::from(between[n]) - 501).max(0);
                assert_eq!(i32::from(plain.0[n]), expected);
                assert_eq!(plain.1.contains(&(n as u16)), expected <= i32::from(reach[n].max(500)));
            }
            for kernel in Kernel::available() {
                assert_eq!(run(kernel), plain, "{kernel:?}");
            }
        }
    }
}

//! Counting the texels whose codes lie below thresholds, direction by direction: what exact medians are made of.

use super::compiled_for_each_kernel;

/// Codes that are counted at a time: one or two registers.
pub const STRIP: usize = 64;

/// Most rows whose count fits a byte.
const ROWS: usize = 255;

/// Thresholds of one strip.
pub(crate) type Thresholds<const N: usize> = [[u8; STRIP]; N];

#[inline(always)]
fn count_below_body<const N: usize>(
    rows: &[&[u8; STRIP]],
    thresholds: &Thresholds<N>,
    counts: &mut [[u32; STRIP]; N],
) {
    for rows in rows.chunks(ROWS) {
        let mut few = [[0u8; STRIP]; N];
        for row in rows {
            for (few, thresholds) in few.iter_mut().zip(thresholds) {
                for ((few, &value), &threshold) in few.iter_mut().zip(*row).zip(thresholds) {
                    *few += u8::from(value < threshold);
                }
            }
        }
        for (counts, few) in counts.iter_mut().zip(&few) {
            for (count, &few) in counts.iter_mut().zip(few) {
                *count += u32::from(few);
            }
        }
    }
}

#[inline(always)]
fn lower_medians_body(rows: &[&[u8; STRIP]], medians: &mut [u8; STRIP]) {
    let rank = (rows.len() as u32 - 1) / 2;
    *medians = [0; STRIP];
    for bit in (0..8).rev() {
        let trial = [medians.map(|median| median | 1 << bit)];
        let mut below = [[0; STRIP]];
        count_below_body(rows, &trial, &mut below);
        for ((median, &trial), &below) in medians.iter_mut().zip(&trial[0]).zip(&below[0]) {
            if below <= rank {
                *median = trial;
            }
        }
    }
}

compiled_for_each_kernel! {
    /// Lower medians of columns: bit by bit from the top, a bit is set where no more than (n - 1) / 2 values lie
    /// below the trial. There must be at least one row.
    pub fn lower_medians(rows: &[&[u8; STRIP]], medians: &mut [u8; STRIP]) = lower_medians_body
}

compiled_for_each_kernel! {
    /// Adds to `counts` the number of rows whose codes lie below each threshold.
    pub(crate) fn count_below(rows: &[&[u8; STRIP]], thresholds: &Thresholds<4>, counts: &mut [[u32; STRIP]; 4]) = count_below_body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::random::Hash;

    fn rows(count: u32) -> Vec<[u8; STRIP]> {
        let hash = Hash::new(5, 0);
        (0..count)
            .map(|r| std::array::from_fn(|c| hash.words(r, c as u32, count)[0] as u8 >> (c % 5)))
            .collect()
    }

    #[test]
    fn medians_are_those_of_sorting() {
        for count in [1, 2, 3, 8, 101, 600] {
            let rows = rows(count);
            let rows: Vec<&[u8; STRIP]> = rows.iter().collect();
            for kernel in Kernel::available() {
                let mut medians = [7; STRIP];
                lower_medians(kernel, &rows, &mut medians);
                for column in 0..STRIP {
                    let mut values: Vec<u8> = rows.iter().map(|row| row[column]).collect();
                    values.sort_unstable();
                    assert_eq!(medians[column], values[(values.len() - 1) / 2], "{kernel:?}");
                }
            }
        }
    }

    #[test]
    fn counts_are_those_of_comparing_one_by_one() {
        for count in [0, 1, 255, 256, 700] {
            let rows = rows(count);
            let rows: Vec<&[u8; STRIP]> = rows.iter().collect();
            let thresholds: Thresholds<4> =
                std::array::from_fn(|t| std::array::from_fn(|c| (t * 60 + c) as u8));
            for kernel in Kernel::available() {
                let mut counts = [[1; STRIP]; 4];
                count_below(kernel, &rows, &thresholds, &mut counts);
                for (t, column) in (0..4).flat_map(|t| (0..STRIP).map(move |c| (t, c))) {
                    let below = rows.iter().filter(|row| row[column] < thresholds[t][column]).count();
                    assert_eq!(counts[t][column] as usize, below + 1, "{kernel:?}");
                }
            }
        }
    }
}

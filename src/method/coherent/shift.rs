//! Shifts of an exemplar that map a regular material to itself, in whole numbers.

use crate::error::{Error, Result};
use crate::lattice::WaveCounts;
use crate::shape::Size;

impl WaveCounts {
    /// Checks that shifts of an exemplar of this size can be drawn in 32-bit whole numbers.
    ///
    /// # Errors
    /// More than two rows, rows that are zero or parallel, and counts that are too large.
    pub(super) fn check(&self, size: Size) -> Result<()> {
        let refused = |why: &str| Err(Error::input(format!("lattice {:?}: {why}", self.0)));
        let side = size.height.max(size.width) as i64;
        match self.0[..] {
            [] => Ok(()),
            [[0, 0]] => refused("expected a count other than zero"),
            [[down, across]] => {
                let most = i64::from(down).abs().max(i64::from(across).abs());
                // Numerators of `shift` stay below 2 * height * width * count.
                if 2 * side * side * most >= 1 << 30 {
                    refused("counts are too large for this exemplar")
                } else {
                    Ok(())
                }
            }
            [first, second] => {
                let cells = determinant(first, second);
                let most =
                    [first, second].as_flattened().iter().map(|&c| i64::from(c).abs()).max().unwrap_or(0);
                if cells == 0 {
                    refused("the two directions are parallel")
                } else if cells.abs() >= 1 << 16
                    || most * cells.abs() >= 1 << 30
                    || 2 * side * cells.abs() >= 1 << 30
                {
                    refused("counts are too large for this exemplar")
                } else {
                    Ok(())
                }
            }
            _ => refused("expected at most two directions"),
        }
    }

    /// A shift drawn from two numbers of 16 bits: uniform over the exemplar, or over the shifts of the lattice.
    #[inline]
    pub(super) fn shift(&self, size: Size, [u, v]: [i32; 2]) -> [i32; 2] {
        let (height, width) = (size.height as i32, size.width as i32);
        match self.0[..] {
            [] => [(u * height) >> 16, (v * width) >> 16],
            [[down, across]] => {
                // Free in one direction; in the other to the place where the phase is whole again.
                if across.abs() * height >= down.abs() * width {
                    let dy = (u * height) >> 16;
                    [dy, solve(across, width, down, height, dy, v)]
                } else {
                    let dx = (v * width) >> 16;
                    [solve(down, height, across, width, dx, u), dx]
                }
            }
            [[a, b], [c, d], ..] => {
                let determinant = a * d - b * c;
                let (cells, sign) = (determinant.abs(), determinant.signum());
                let [i, j] = [u, v].map(|word| ((word as u32 * cells as u32) >> 16) as i32);
                let part = |numerator: i32, side: i32| {
                    rounded((sign * numerator).rem_euclid(cells) * side, cells).rem_euclid(side)
                };
                [part(d * i - b * j, height), part(a * j - c * i, width)]
            }
        }
    }
}

/// The shift along an axis of `side` texels and `count` cycles that makes the phase whole for a shift `other` along an
/// axis of `other_side` texels and `other_count` cycles; `word` chooses the cycle.
#[inline]
fn solve(count: i32, side: i32, other_count: i32, other_side: i32, other: i32, word: i32) -> i32 {
    let sign = count.signum();
    let whole = count.abs() * other_side;
    let cycle = (word * count.abs()) >> 16;
    let numerator = (cycle * other_side - sign * other_count * other).rem_euclid(whole);
    rounded(numerator * side, whole).rem_euclid(side)
}

/// `numerator / denominator`, halves up; neither negative.
#[inline]
fn rounded(numerator: i32, denominator: i32) -> i32 {
    (2 * numerator + denominator) / (2 * denominator)
}

fn determinant([a, b]: [i32; 2], [c, d]: [i32; 2]) -> i64 {
    i64::from(a) * i64::from(d) - i64::from(b) * i64::from(c)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::method::coherent::hash;

    /// How far a shift is from a whole number of cycles, in texels.
    fn off(counts: &WaveCounts, size: Size, [sy, sx]: [i32; 2]) -> f64 {
        let phase = |[a, b]: &[i32; 2]| {
            let cycles = [f64::from(*a) / size.height as f64, f64::from(*b) / size.width as f64];
            let phase = cycles[0] * f64::from(sy) + cycles[1] * f64::from(sx);
            (phase - phase.round()).abs() / cycles[0].hypot(cycles[1])
        };
        counts.0.iter().map(phase).fold(0.0, f64::max)
    }

    #[test]
    fn shifts_are_of_the_lattice_and_reach_all_of_the_exemplar() {
        let size = Size::new(152, 184);
        for counts in [
            vec![],
            vec![[0, 9]],
            vec![[4, -7]],
            vec![[-5, 2]],
            vec![[10, 0], [0, 10]],
            vec![[11, 12], [-19, 9]],
        ] {
            let counts = WaveCounts(counts);
            counts.check(size).unwrap();
            let mut quarters = [0; 16];
            for place in 0..4000 {
                let shift @ [sy, sx] = counts.shift(size, hash::place(7, place, -place));
                assert!((0..152).contains(&sy) && (0..184).contains(&sx), "{counts:?} {shift:?}");
                assert!(off(&counts, size, shift) < 0.75, "{counts:?} {shift:?}");
                quarters[(sy / 38 * 4 + sx / 46) as usize] += 1;
            }
            assert!(quarters.iter().all(|&count| count > 100), "{counts:?} {quarters:?}");
        }
    }

    #[test]
    fn counts_that_cannot_be_shifted_by_are_refused() {
        let size = Size::new(152, 184);
        for counts in [
            vec![[0, 0]],
            vec![[2, 4], [1, 2]],
            vec![[1, 0], [0, 1], [1, 1]],
            vec![[i32::MIN, i32::MAX]],
            vec![[1 << 20, 0], [0, 1]],
        ] {
            assert!(WaveCounts(counts.clone()).check(size).is_err(), "{counts:?}");
        }
    }
}

//! The autoregressive field of one level, generated row by row on its lattice.

use std::collections::VecDeque;

use nalgebra::DMatrix;

use super::car::cholesky;
use super::model::{Kind, Level};
use super::neighbourhood::reach;
use crate::error::Result;
use crate::random::Hash;

/// Columns accumulated at a time, so that the sums stay in the first-level cache.
const STRIP: usize = 256;

/// One coefficient of Gamma: what a neighbour's channel gives to a channel.
#[derive(Clone, Copy, Debug)]
struct Tap {
    /// The channel that receives.
    to: usize,
    /// The neighbour's channel.
    from: usize,
    dy: usize,
    dx: isize,
    coefficient: f64,
}

/// Generates rows of Y_r = Gamma X_r + e_r between two columns of an endless lattice, from the zero state.
///
/// A row is stored planar: channels one after the other, each with zeros to both sides as far as a site reaches.
pub(super) struct Lattice {
    above: Vec<Tap>,
    left: Vec<Tap>,
    /// L with L L^T = Sigma.
    noise_factor: DMatrix<f64>,
    hash: Hash,
    channels: usize,
    /// Lattice column of the first generated texel.
    first_column: i32,
    width: usize,
    /// Zeros to each side.
    pad: usize,
    /// The newest row in front; as many as the highest site reaches and one more.
    rows: VecDeque<Vec<f64>>,
    next_row: i32,
}

impl Lattice {
    /// The field of `level` on columns `first_column ..` of `width`, from row `first_row` on. The noise of a texel
    /// depends on `hash` and its place on the lattice only.
    pub(super) fn new(
        level: &Level,
        kind: Kind,
        hash: Hash,
        first_row: i32,
        first_column: i32,
        width: usize,
    ) -> Result<Self> {
        let (gamma, sigma) = level.joint(kind);
        let channels = sigma.nrows();
        let [rows, pad] = reach(&level.neighbourhood);
        let (above, left) = taps(&gamma, &level.neighbourhood);
        let empty = vec![0.0; channels * (width + 2 * pad)];
        Ok(Self {
            above,
            left,
            noise_factor: cholesky(sigma)?.l(),
            hash,
            channels,
            first_column,
            width,
            pad,
            rows: VecDeque::from(vec![empty; rows + 1]),
            next_row: first_row,
        })
    }

    /// The lattice row that [`Self::advance`] will generate.
    pub(super) fn next_row(&self) -> i32 {
        self.next_row
    }

    /// Generates one row.
    pub(super) fn advance(&mut self) {
        // The oldest row is out of every site's reach.
        let mut row = self.rows.pop_back().unwrap_or_default();
        self.fill_noise(&mut row);
        self.add_above(&mut row);
        self.add_left(&mut row);
        self.rows.push_front(row);
        self.next_row += 1;
    }

    /// Channel `channel` of the newest row, from the first generated column.
    pub(super) fn newest(&self, channel: usize) -> &[f64] {
        let start = self.start(channel);
        self.rows.front().map_or(&[], |row| &row[start..start + self.width])
    }

    /// Where the first column of a channel lies in a row.
    fn start(&self, channel: usize) -> usize {
        channel * (self.width + 2 * self.pad) + self.pad
    }

    /// e_r = L z_r with standard normals z counted by (row, column, group of four channels).
    fn fill_noise(&self, row: &mut [f64]) {
        let mut z = vec![0.0; self.channels.next_multiple_of(4)];
        for x in 0..self.width {
            let column = self.first_column.wrapping_add(x as i32);
            for (group, four) in z.chunks_exact_mut(4).enumerate() {
                four.copy_from_slice(&self.hash.normals(self.next_row as u32, column as u32, group as u32));
            }
            for i in 0..self.channels {
                row[self.start(i) + x] = (0..=i).map(|j| self.noise_factor[(i, j)] * z[j]).sum();
            }
        }
    }

    /// The neighbours in the rows above, one tap after the other along a strip.
    fn add_above(&self, row: &mut [f64]) {
        for x in (0..self.width).step_by(STRIP) {
            let strip = STRIP.min(self.width - x);
            for tap in &self.above {
                let to = self.start(tap.to) + x;
                let from = (self.start(tap.from) + x).wrapping_add_signed(-tap.dx);
                let source = &self.rows[tap.dy - 1][from..from + strip];
                for (sum, &value) in row[to..to + strip].iter_mut().zip(source) {
                    *sum += tap.coefficient * value;
                }
            }
        }
    }

    /// The neighbours in the same row: a recursion along it.
    fn add_left(&self, row: &mut [f64]) {
        let steps: Vec<(usize, usize, f64)> = self
            .left
            .iter()
            .map(|tap| {
                (self.start(tap.to), self.start(tap.from).wrapping_add_signed(-tap.dx), tap.coefficient)
            })
            .collect();
        for x in 0..self.width {
            for &(to, from, coefficient) in &steps {
                row[to + x] += coefficient * row[from + x];
            }
        }
    }
}

/// The coefficients that are not 0, those in rows above and those in the same row, the farthest sites first.
fn taps(gamma: &DMatrix<f64>, sites: &[[i32; 2]]) -> (Vec<Tap>, Vec<Tap>) {
    let channels = gamma.nrows();
    let (mut above, mut left) = (Vec::new(), Vec::new());
    for (s, &[dy, dx]) in sites.iter().enumerate().rev() {
        for to in 0..channels {
            for from in 0..channels {
                let coefficient = gamma[(to, s * channels + from)];
                let tap = Tap { to, from, dy: dy as usize, dx: dx as isize, coefficient };
                match (coefficient == 0.0, dy) {
                    (true, _) => {}
                    (false, 0) => left.push(tap),
                    (false, _) => above.push(tap),
                }
            }
        }
    }
    above.sort_by_key(|tap| tap.to);
    (above, left)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::mrf::model::tests::single;

    /// The model equation, texel by texel, without any trick.
    #[test]
    fn rows_are_those_of_the_model_equation() {
        let sites = [[0, 1], [1, 0], [1, -1], [1, 1], [0, 2], [2, 0]];
        let gamma: Vec<f64> = (0..24).map(|i| 0.3 * f64::from(i * 7 % 11 - 5) / 5.0).collect();
        let model = single(Kind::Car3d, &sites, &gamma, &[1.0, 0.4, 0.4, 0.5]);
        let level = &model.levels[0];
        let hash = Hash::new(1, 2);
        let (first_row, first_column, height, width) = (-3, -5, 6_i32, 300_i32);
        let mut lattice =
            Lattice::new(level, Kind::Car3d, hash, first_row, first_column, width as usize).unwrap();
        let factor = [[1.0, 0.0], [0.4, (0.5_f64 - 0.16).sqrt()]];
        let mut field = vec![[0.0; 2]; (height * width) as usize];
        for y in 0..height {
            lattice.advance();
            for x in 0..width {
                let z = hash.normals((first_row + y) as u32, (first_column + x) as u32, 0);
                let mut value = factor.map(|row| row[0] * z[0] + row[1] * z[1]);
                for (s, [dy, dx]) in sites.iter().enumerate() {
                    let (row, column) = (y - dy, x - dx);
                    if row < 0 || column < 0 || column >= width {
                        continue;
                    }
                    for (i, sum) in value.iter_mut().enumerate() {
                        let neighbour = field[(row * width + column) as usize];
                        *sum += level.gamma[(i, 2 * s)] * neighbour[0]
                            + level.gamma[(i, 2 * s + 1)] * neighbour[1];
                    }
                }
                field[(y * width + x) as usize] = value;
                for (i, expected) in value.iter().enumerate() {
                    let found = lattice.newest(i)[x as usize];
                    assert!(
                        (found - expected).abs() < 1e-12 * expected.abs().max(1.0),
                        "row {y}, column {x}"
                    );
                }
            }
        }
        assert_eq!(lattice.next_row(), first_row + height);
    }
}

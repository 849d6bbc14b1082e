//! Synthesis of a field of any size, row by row in bounded memory: (9) or (18) at each level, the collapse of the
//! pyramid, (24) and the mean.
//!
//! Texel 2r of a level lies on texel r of the next. Each level reaches a little farther than the output, so that the
//! expansion meets no border, and begins from zeros a margin earlier (top, left and right), which is thrown away: as
//! many texels as the stability radius takes to bring a disturbance below 1e-3, at least 16, at most 256.

use std::collections::VecDeque;

use nalgebra::DMatrix;

use super::lattice::Lattice;
use super::model::Model;
use super::pyramid::{even, odd};
use crate::error::{Error, Result};
use crate::random::Hash;

/// Domain of the noise of level 0; level k has this plus k.
pub const LEVEL_DOMAIN: u32 = 0x4341_5200;

/// What is left of the zero state after the margin.
const TRANSIENT: f64 = 1e-3;
const LEAST_MARGIN: usize = 16;
const MOST_MARGIN: usize = 256;

/// Lattice places are 32-bit, with room for the margins.
const MOST_TEXELS: usize = 1 << 30;

/// A field that is being synthesised from the top row down.
///
/// The rows depend on the model, the seed and the width only, not on how they are pulled. Memory: a few rows a level.
pub struct Synthesis {
    levels: Vec<Stage>,
    mean: Vec<f64>,
    transform: Option<DMatrix<f64>>,
    height: usize,
    width: usize,
    position: usize,
}

/// One level: its own field, and the sum of it and all coarser levels.
struct Stage {
    lattice: Lattice,
    /// Texels of the lattice's margin at each side.
    margin: usize,
    /// Columns of the sum, from lattice column `first_column` on.
    width: usize,
    first_column: i32,
    channels: usize,
    /// The newest row of the sum, planar.
    sum: Vec<f64>,
    /// Three successive rows of the coarser sum, expanded to the columns of this level, the oldest in front.
    coarser: VecDeque<Vec<f64>>,
    /// Lattice row of the newest of them.
    coarser_row: i32,
}

impl Synthesis {
    /// Prepares a field of `height` x `width` texels (each from 1 to 2^30) and generates the margins at the top.
    ///
    /// # Errors
    /// When the model does not pass [`Model::check`], or the size is out of range.
    pub fn new(model: &Model, seed: u64, height: usize, width: usize) -> Result<Self> {
        model.check()?;
        if !(1..=MOST_TEXELS).contains(&height) || !(1..=MOST_TEXELS).contains(&width) {
            return Err(Error::usage(format!(
                "a field of {height} x {width} texels: each side must lie between 1 and {MOST_TEXELS}"
            )));
        }
        let mut levels = Vec::new();
        let (mut first_row, mut first_column, mut last_column) = (0_i32, 0_i32, width as i32 - 1);
        for (k, level) in model.levels.iter().enumerate() {
            let margin = margin(level.measure_radius(model.kind)?);
            let width = (last_column - first_column) as usize + 1;
            let hash = Hash::new(seed, LEVEL_DOMAIN.wrapping_add(k as u32));
            let before = margin as i32;
            let mut lattice = Lattice::new(
                level,
                model.kind,
                hash,
                first_row - before,
                first_column - before,
                width + 2 * margin,
            )?;
            while lattice.next_row() < first_row {
                lattice.advance();
            }
            let channels = model.channels();
            let (coarser_first_row, coarser_first_column) =
                (coarser_start(first_row), coarser_start(first_column));
            levels.push(Stage {
                lattice,
                margin,
                width,
                first_column,
                channels,
                sum: vec![0.0; channels * width],
                coarser: VecDeque::from(vec![vec![0.0; channels * width]; 3]),
                coarser_row: coarser_first_row - 1,
            });
            (first_row, first_column) = (coarser_first_row, coarser_first_column);
            last_column = last_column.div_euclid(2) + 1;
        }
        let (mean, transform) = (model.mean.clone(), model.transform.clone());
        Ok(Self { levels, mean, transform, height, width, position: 0 })
    }

    /// The row that [`Self::next_row`] will give, from 0.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Writes the next row, `[width][channels]`.
    ///
    /// # Errors
    /// When the row has another length, or all rows have been given.
    pub fn next_row(&mut self, row: &mut [f64]) -> Result<()> {
        let channels = self.mean.len();
        if row.len() != self.width * channels {
            return Err(Error::internal(format!(
                "a row of {} values for {} texels of {channels} channels",
                row.len(),
                self.width
            )));
        }
        self.skip_rows(1)?;
        let Some(Stage { sum, width, .. }) = self.levels.first() else { return Ok(()) };
        for (x, texel) in row.chunks_exact_mut(channels).enumerate() {
            for (i, value) in texel.iter_mut().enumerate() {
                *value = self.mean[i]
                    + match &self.transform {
                        None => sum[i * width + x],
                        // Row j of T is an eigenvector: T^-1 = T^T.
                        Some(t) => (0..channels).map(|j| t[(j, i)] * sum[j * width + x]).sum(),
                    };
            }
        }
        Ok(())
    }

    /// Goes on by `count` rows without giving them. They must be generated all the same, being what the next depend on.
    ///
    /// # Errors
    /// When fewer rows are left.
    pub fn skip_rows(&mut self, count: usize) -> Result<()> {
        if count > self.height - self.position {
            return Err(Error::internal(format!(
                "row {} + {count} of a field of {} rows",
                self.position, self.height
            )));
        }
        for _ in 0..count {
            advance(&mut self.levels);
        }
        self.position += count;
        Ok(())
    }
}

/// Makes the next row of the sum of the first level and all after it.
fn advance(levels: &mut [Stage]) {
    let Some((stage, coarser)) = levels.split_first_mut() else { return };
    let row = stage.lattice.next_row();
    stage.lattice.advance();
    for (i, sum) in stage.sum.chunks_exact_mut(stage.width).enumerate() {
        sum.copy_from_slice(&stage.lattice.newest(i)[stage.margin..][..stage.width]);
    }
    if coarser.is_empty() {
        return;
    }
    while stage.coarser_row < row.div_euclid(2) + 1 {
        advance(coarser);
        stage.take_coarser(&coarser[0]);
    }
    stage.add_coarser(row);
}

impl Stage {
    /// Expands the newest row of the coarser sum along x and keeps it in place of the oldest.
    fn take_coarser(&mut self, coarser: &Self) {
        let mut expanded = self.coarser.pop_front().unwrap_or_default();
        for i in 0..self.channels {
            let from = &coarser.sum[i * coarser.width..][..coarser.width];
            for (x, value) in expanded[i * self.width..][..self.width].iter_mut().enumerate() {
                let column = self.first_column + x as i32;
                let here = (column.div_euclid(2) - coarser.first_column) as usize;
                *value = if column.rem_euclid(2) == 0 {
                    even(from[here - 1], from[here], from[here + 1])
                } else {
                    odd(from[here], from[here + 1])
                };
            }
        }
        self.coarser.push_back(expanded);
        self.coarser_row += 1;
    }

    /// Expands the three kept rows along y onto lattice row `row` and adds them.
    fn add_coarser(&mut self, row: i32) {
        let [before, here, after] = [0, 1, 2].map(|n| &self.coarser[n]);
        let is_even = row.rem_euclid(2) == 0;
        for (x, sum) in self.sum.iter_mut().enumerate() {
            *sum += if is_even { even(before[x], here[x], after[x]) } else { odd(here[x], after[x]) };
        }
    }
}

/// First coarse position that the expansion at fine position `first` and after it reads.
fn coarser_start(first: i32) -> i32 {
    first.div_euclid(2) - 1
}

/// Texels after which a disturbance that decays as radius^n is below [`TRANSIENT`], within limits.
fn margin(radius: f64) -> usize {
    if radius <= 0.0 {
        return LEAST_MARGIN;
    }
    let texels = (libm::log(TRANSIENT) / libm::log(radius)).ceil();
    (texels as usize).clamp(LEAST_MARGIN, MOST_MARGIN)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::mrf::field::{Boundary, Field};
    use crate::mrf::model::tests::single;
    use crate::mrf::{Kind, pyramid};

    /// Three levels of two channels with different fields.
    fn model() -> Model {
        let sites = [[0, 1], [1, 0], [1, -1]];
        let gamma = [0.5, 0.1, 0.3, 0.0, 0.1, -0.05, -0.2, 0.4, 0.1, 0.3, 0.0, 0.1];
        let mut model = single(Kind::Car3d, &sites, &gamma, &[1.0, 0.4, 0.4, 0.5]);
        model.mean = vec![0.25, -3.0];
        for factor in [0.9, -0.7] {
            let mut level = model.levels[0].clone();
            level.gamma *= factor;
            model.levels.push(level);
        }
        model
    }

    fn synthesised(model: &Model, seed: u64, height: usize, width: usize) -> Field {
        let channels = model.channels();
        let mut synthesis = Synthesis::new(model, seed, height, width).unwrap();
        let mut samples = vec![0.0; height * width * channels];
        samples.chunks_exact_mut(width * channels).for_each(|row| synthesis.next_row(row).unwrap());
        Field::new(height, width, channels, samples).unwrap()
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_and_another_seed_does_not() {
        let model = model();
        let bits =
            |seed| synthesised(&model, seed, 37, 41).samples.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(5), bits(5));
        assert_ne!(bits(5), bits(6));
    }

    #[test]
    fn rows_do_not_depend_on_how_they_are_pulled_nor_on_the_height() {
        let model = model();
        let whole = synthesised(&model, 5, 60, 33);
        let mut row = vec![0.0; 66];
        for skipped in [1, 2, 7, 58] {
            let mut synthesis = Synthesis::new(&model, 5, 2000, 33).unwrap();
            synthesis.skip_rows(skipped).unwrap();
            assert_eq!(synthesis.position(), skipped);
            synthesis.next_row(&mut row).unwrap();
            assert_eq!(row, whole.samples[skipped * 66..(skipped + 1) * 66]);
        }
    }

    /// Against the pyramid of whole fields: the levels, made large enough that no border is near, collapse to the same.
    #[test]
    fn the_streamed_collapse_is_that_of_the_pyramid() {
        let model = model();
        let found = synthesised(&model, 9, 21, 24);
        // Fields on the lattices from (-16, -16), (-8, -8) and (-4, -4) on, in the coordinates of the output.
        let mut bands = Vec::new();
        for (k, level) in model.levels.iter().enumerate() {
            let start = 16 >> k;
            let (height, width) = (60_usize.div_ceil(1 << k), 64 >> k);
            let stage = &Synthesis::new(&model, 9, 21, 24).unwrap().levels[k];
            let left = stage.margin as i32 - stage.first_column;
            let total = stage.width + 2 * stage.margin;
            let hash = Hash::new(9, LEVEL_DOMAIN + k as u32);
            let mut lattice =
                Lattice::new(level, model.kind, hash, [0, -1, -2][k] - stage.margin as i32, -left, total)
                    .unwrap();
            let mut band = Field::new(height, width, 2, vec![0.0; height * width * 2]).unwrap();
            while lattice.next_row() < height as i32 - start {
                let y = lattice.next_row() + start;
                lattice.advance();
                for x in 0..width {
                    let column = x as i32 - start + left;
                    for c in 0..2 {
                        if y >= 0 && (0..total as i32).contains(&column) {
                            band.samples[(y as usize * width + x) * 2 + c] =
                                lattice.newest(c)[column as usize];
                        }
                    }
                }
            }
            bands.push(band);
        }
        let whole = pyramid::collapse(&bands, Boundary::Mirrored).unwrap();
        for y in 0..21 {
            for x in 0..24 {
                for c in 0..2 {
                    let expected = whole.texel(y + 16, x + 16)[c] + model.mean[c];
                    assert!((found.texel(y, x)[c] - expected).abs() < 1e-12, "row {y}, column {x}");
                }
            }
        }
    }

    #[test]
    fn the_inverse_transformation_and_the_mean_are_applied() {
        let mut model = single(Kind::Car2d, &[[0, 1]], &[0.5, 0.2], &[4.0, 1.0]);
        let plain = synthesised(&model, 3, 4, 5);
        model.transform = Some(DMatrix::from_row_slice(2, 2, &[0.6, 0.8, -0.8, 0.6]));
        model.mean = vec![10.0, 20.0];
        let turned = synthesised(&model, 3, 4, 5);
        for (a, b) in plain.samples.chunks(2).zip(turned.samples.chunks(2)) {
            assert!((b[0] - (10.0 + 0.6 * a[0] - 0.8 * a[1])).abs() < 1e-12);
            assert!((b[1] - (20.0 + 0.8 * a[0] + 0.6 * a[1])).abs() < 1e-12);
        }
    }

    #[test]
    fn a_long_field_neither_fades_nor_drifts_and_its_edges_are_like_its_middle() {
        // Separable with a = b = 0.8: variance 1 / (1 - 0.64)^2.
        let model = single(Kind::Car3d, &[[0, 1], [1, 0], [1, 1]], &[0.8, 0.8, -0.64], &[1.0]);
        let field = synthesised(&model, 8, 4000, 200);
        let expected = 1.0 / (0.36 * 0.36);
        let variance = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
            sum / count
        };
        let samples = &field.samples;
        let first = variance(&mut samples[..500 * 200].iter().copied());
        let last = variance(&mut samples[3500 * 200..].iter().copied());
        assert!(
            (first / expected - 1.0).abs() < 0.1 && (last / expected - 1.0).abs() < 0.1,
            "{first}, {last}"
        );
        for column in [0, 199] {
            let edge = variance(&mut samples.iter().skip(column).step_by(200).copied());
            assert!((edge / expected - 1.0).abs() < 0.2, "column {column}: {edge}");
        }
    }

    #[test]
    fn margins_follow_the_radius_within_limits() {
        assert_eq!([0.0, 0.5, 0.9, 0.95, 0.998].map(margin), [16, 16, 66, 135, 256]);
    }

    #[test]
    fn wrong_sizes_and_unstable_models_are_refused() {
        let mut model = model();
        assert!(Synthesis::new(&model, 1, 0, 5).is_err());
        assert!(Synthesis::new(&model, 1, 5, usize::MAX).is_err());
        let mut synthesis = Synthesis::new(&model, 1, 2, 5).unwrap();
        assert!(synthesis.next_row(&mut [0.0; 9]).is_err());
        assert!(synthesis.skip_rows(3).is_err());
        synthesis.skip_rows(2).unwrap();
        assert!(synthesis.next_row(&mut [0.0; 10]).is_err());
        model.levels[1].gamma *= 3.0;
        assert!(Synthesis::new(&model, 1, 5, 5).is_err());
    }
}

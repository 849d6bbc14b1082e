//! Synthesis of a field of any size, row by row in bounded memory: (9) or (18) at each level, the collapse of the
//! pyramid, (24) and the mean.
//!
//! Texel 2r of a level lies on texel r of the next. Each level begins from zeros a margin earlier, which is thrown
//! away: as many texels as the stability radius takes to bring a disturbance below 1e-3, at least 16, at most 256 (top,
//! left and right); where the field wraps, as [`Extent::Wrapping`] says.
//!
//! All is f32, summed in one order (`kernel::car`, `kernel::collapse`): no kernel and no machine changes a bit.

mod extent;
#[cfg(test)]
mod tests;
mod torus;

use std::collections::VecDeque;

use super::model::Model;
use crate::error::{Error, Result};
use crate::kernel::{Kernel, collapse};
use crate::random::Hash;
pub use extent::Extent;
use extent::Offset;
use torus::Lattice;

/// Domain of the noise of level 0; level k has this plus k.
pub(crate) const LEVEL_DOMAIN: u32 = 0x4341_5200;

/// A field that is being synthesised from the top row down.
///
/// The rows depend on the model, the seed, the width and (if the field wraps) the height only, not on how they are
/// pulled. Memory: a few rows a level.
pub struct Synthesis {
    levels: Vec<Stage>,
    kernel: Kernel,
    mean: Vec<f32>,
    /// T^-1 = T^T, `[channel][component]`, if there is a T.
    inverse: Option<Vec<f32>>,
    height: usize,
    width: usize,
    position: usize,
}

/// One level: its own field, and the sum of it and all coarser levels.
struct Stage {
    lattice: Lattice,
    kernel: Kernel,
    place: Offset,
    channels: usize,
    /// The newest row of the sum, planar.
    sum: Vec<f32>,
    /// Lattice row of the next.
    next_row: i32,
    /// Three successive rows of the coarser sum, expanded to the columns of this level, the oldest in front; none at
    /// the coarsest level.
    coarser: VecDeque<Vec<f32>>,
    /// Lattice row of the newest of them.
    coarser_row: i32,
}

impl Synthesis {
    /// Prepares a field of `height` x `width` texels (each from 1 to 2^30). The first row comes with the margins above.
    ///
    /// # Errors
    /// When the model does not pass [`Model::check`], or the size is out of range, or cannot wrap.
    pub fn new(
        model: &Model,
        seed: u64,
        height: usize,
        width: usize,
        extent: Extent,
        kernel: Kernel,
    ) -> Result<Self> {
        model.check()?;
        let channels = model.channels();
        let places = extent::places(model, height, width, extent)?;
        let mut levels = Vec::new();
        for (k, (level, &place)) in model.levels.iter().zip(&places).enumerate() {
            let hash = Hash::new(seed, LEVEL_DOMAIN.wrapping_add(k as u32));
            let row = vec![0.0; channels * place.width];
            let coarser = if k + 1 < places.len() { vec![row.clone(); 3] } else { Vec::new() };
            levels.push(Stage {
                lattice: Lattice::new(level, model.kind, hash, place.grid, kernel)?,
                kernel,
                place,
                channels,
                sum: row,
                next_row: place.first_row,
                coarser: coarser.into(),
                coarser_row: first_coarser_row(place.first_row) - 1,
            });
        }
        let mean = model.mean.iter().map(|&value| value as f32).collect();
        // Column i of T, which lies contiguous, is row i of its transpose.
        let inverse = model.transform.as_ref().map(|t| t.iter().map(|&value| value as f32).collect());
        Ok(Self { levels, kernel, mean, inverse, height, width, position: 0 })
    }

    /// Bytes that such a synthesis holds.
    ///
    /// # Errors
    /// As those of [`Self::new`], but for damage of the model that the size of the rows does not depend on.
    pub fn memory_bytes(model: &Model, height: usize, width: usize, extent: Extent) -> Result<u64> {
        Ok(extent::memory_bytes(model, &extent::places(model, height, width, extent)?))
    }

    /// The row that [`Self::next_row`] will give, from 0.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Writes the next row, planar: `[channel][width]`.
    ///
    /// # Errors
    /// When the row has another length, or all rows have been given.
    pub fn next_row(&mut self, row: &mut [f32]) -> Result<()> {
        let channels = self.mean.len();
        if row.len() != self.width * channels {
            return Err(Error::internal(format!(
                "a row of {} values for {} texels of {channels} channels",
                row.len(),
                self.width
            )));
        }
        self.skip_rows(1)?;
        let Some(Stage { sum, .. }) = self.levels.first() else { return Ok(()) };
        for (i, (out, &mean)) in row.chunks_exact_mut(self.width).zip(&self.mean).enumerate() {
            match &self.inverse {
                None => collapse::mix(self.kernel, &sum[i * self.width..][..self.width], &[1.0], mean, out),
                Some(t) => collapse::mix(self.kernel, sum, &t[i * channels..][..channels], mean, out),
            }
        }
        Ok(())
    }

    /// Goes on by `count` rows without giving them. They must be generated all the same, being what the next depend on.
    ///
    /// # Errors
    /// When fewer rows are left.
    fn skip_rows(&mut self, count: usize) -> Result<()> {
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

    /// All that the rows from [`Self::position`] on depend on, beside what [`Self::new`] was given: the position (u64),
    /// then f32 values, little endian.
    pub fn state(&self) -> Vec<u8> {
        let rows = self
            .levels
            .iter()
            .flat_map(|stage| stage.lattice.state().chain(stage.coarser.iter().map(Vec::as_slice)).flatten());
        let mut bytes = (self.position as u64).to_le_bytes().to_vec();
        bytes.extend(rows.flat_map(|value| value.to_le_bytes()));
        bytes
    }

    /// Goes on where another synthesis, made with the same arguments, was when it gave this state.
    ///
    /// # Errors
    /// When the state has another length, a position beyond the height, or values that are not finite. The synthesis is
    /// then as it was.
    pub(crate) fn restore(&mut self, state: &[u8]) -> Result<()> {
        let expected =
            size_of::<u64>() + self.levels.iter().map(Stage::state_len).sum::<usize>() * size_of::<f32>();
        let (position, values) = match state.split_first_chunk() {
            Some((position, values)) if state.len() == expected => (u64::from_le_bytes(*position), values),
            _ => {
                return Err(Error::input(format!(
                    "the state of a synthesis has {} bytes, expected {expected}",
                    state.len()
                )));
            }
        };
        let position = usize::try_from(position).unwrap_or(usize::MAX);
        if position > self.height {
            return Err(Error::input(format!(
                "the state of a synthesis is that at row {position}, the field has {} rows",
                self.height
            )));
        }
        let values: Vec<f32> = values.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
        if !values.iter().all(|value| value.is_finite()) {
            return Err(Error::input("the state of a synthesis holds values that are not finite"));
        }
        let (mut rest, mut last_row) = (values.as_slice(), position as i32 - 1);
        for stage in &mut self.levels {
            let (values, after) = rest.split_at(stage.state_len());
            stage.restore((position > 0).then_some(last_row), values);
            (rest, last_row) = (after, last_coarser_row(last_row));
        }
        self.position = position;
        Ok(())
    }
}

/// Makes the next row of the sum of the first level and all after it.
fn advance(levels: &mut [Stage]) {
    let Some((stage, coarser)) = levels.split_first_mut() else { return };
    let row = stage.next_row;
    stage.next_row += 1;
    // At first the margin too.
    while stage.lattice.next_row() <= row {
        stage.lattice.advance();
    }
    for (i, sum) in stage.sum.chunks_exact_mut(stage.place.width).enumerate() {
        stage.lattice.copy(i, stage.place.first_column, sum);
    }
    if coarser.is_empty() {
        return;
    }
    while stage.coarser_row < last_coarser_row(row) {
        advance(coarser);
        stage.take_coarser(&coarser[0]);
    }
    stage.add_coarser(row);
}

impl Stage {
    /// Expands the newest row of the coarser sum along x and keeps it in place of the oldest.
    fn take_coarser(&mut self, coarser: &Self) {
        let mut expanded = self.coarser.pop_front().unwrap_or_default();
        let first = (self.place.first_column / 2 - 1 - coarser.place.first_column) as usize;
        let rows = coarser.sum.chunks_exact(coarser.place.width);
        for (from, to) in rows.zip(expanded.chunks_exact_mut(self.place.width)) {
            collapse::spread(self.kernel, &from[first..], to);
        }
        self.coarser.push_back(expanded);
        self.coarser_row += 1;
    }

    /// Expands the three kept rows along y onto lattice row `row` and adds them.
    fn add_coarser(&mut self, row: i32) {
        let [before, here, after] = [0, 1, 2].map(|n| self.coarser[n].as_slice());
        if row.rem_euclid(2) == 0 {
            collapse::add_even(self.kernel, [before, here, after], &mut self.sum);
        } else {
            collapse::add_odd(self.kernel, [here, after], &mut self.sum);
        }
    }

    /// Values of the state.
    fn state_len(&self) -> usize {
        self.lattice.state_len() + self.coarser.len() * self.channels * self.place.width
    }

    /// Goes on after row `last_row`, if there was one.
    fn restore(&mut self, last_row: Option<i32>, values: &[f32]) {
        let (first_row, start) = (self.place.first_row, self.place.grid.first_row);
        self.next_row = last_row.map_or(first_row, |row| row + 1);
        self.coarser_row = last_row.map_or(first_coarser_row(first_row) - 1, last_coarser_row);
        let (lattice, rows) = values.split_at(self.lattice.state_len());
        self.lattice.restore(last_row.map_or(start, |row| row + 1), lattice);
        for (to, from) in self.coarser.iter_mut().zip(rows.chunks_exact(self.channels * self.place.width)) {
            to.copy_from_slice(from);
        }
    }
}

/// First coarse row that the expansion at fine row `first` reads.
fn first_coarser_row(first: i32) -> i32 {
    first.div_euclid(2) - 1
}

/// Last coarse row that the expansion at fine row `last` is given.
fn last_coarser_row(last: i32) -> i32 {
    last.div_euclid(2) + 1
}

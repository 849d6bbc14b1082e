//! Appearance of every texel at one level, made of whole numbers from features and a basis.

use rayon::prelude::*;

use super::appearance::{Basis, COARSE_DIMS, FEATURES, FINE_DIMS, INPUTS};
use crate::kernel::Kernel;
use crate::kernel::project::{Projection, project_coarse, project_fine};
use crate::shape::Size;

/// Features of the texels, blurred as the levels become coarser.
pub(super) struct Features {
    size: Size,
    /// Sixteen times the features, [y, x].
    values: Vec<[i16; FEATURES]>,
}

impl Features {
    pub(super) fn new(size: Size, features: impl Iterator<Item = [i8; FEATURES]>) -> Self {
        Self { size, values: features.map(|texel| texel.map(|value| 16 * i16::from(value))).collect() }
    }

    /// Blurs from the level of spacing `spacing` to the next coarser one: [1 2 1] / 4 along the columns of each row,
    /// then along the rows, `spacing` apart, wrapped.
    pub(super) fn blur(&mut self, spacing: usize) {
        let Size { height, width } = self.size;
        let weigh = |before: [i16; FEATURES], here: [i16; FEATURES], after: [i16; FEATURES]| {
            std::array::from_fn(|n| {
                ((i32::from(before[n]) + 2 * i32::from(here[n]) + i32::from(after[n]) + 2) >> 2) as i16
            })
        };
        let down = |y: usize| (y + spacing) % height;
        let up = |y: usize| (y + height - spacing % height) % height;
        let mut blurred = vec![[0; FEATURES]; self.values.len()];
        blurred.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let row = |y: usize| &self.values[y * width..(y + 1) * width];
            let (above, here, below) = (row(up(y)), row(y), row(down(y)));
            for (x, out) in out.iter_mut().enumerate() {
                *out = weigh(above[x], here[x], below[x]);
            }
        });
        self.values.par_chunks_mut(width).zip(blurred.par_chunks(width)).for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = weigh(row[(x + width - spacing % width) % width], row[x], row[(x + spacing) % width]);
            }
        });
    }

    /// The features of the 3 x 3 texels around one, `spacing` apart, wrapped.
    #[inline]
    pub(super) fn surroundings(&self, spacing: usize, y: usize, x: usize) -> [i16; INPUTS] {
        let Size { height, width } = self.size;
        let rows = [(y + height - spacing % height) % height, y, (y + spacing) % height];
        let columns = [(x + width - spacing % width) % width, x, (x + spacing) % width];
        let mut inputs = [0; INPUTS];
        for (n, input) in inputs.chunks_exact_mut(FEATURES).enumerate() {
            input.copy_from_slice(&self.values[rows[n / 3] * width + columns[n % 3]]);
        }
        inputs
    }

    /// Rows and columns.
    pub(super) fn size(&self) -> Size {
        self.size
    }
}

/// Appearance of every texel of the exemplar at a level, with a margin of the level's spacing on every side that wraps.
pub(super) struct AppearanceImage<const D: usize> {
    /// Spacing h of the level in texels.
    pub(super) spacing: usize,
    /// Texels of a row, margins included.
    pub(super) stride: usize,
    /// [y + h, x + h].
    pub(super) values: Vec<[i8; D]>,
}

/// The kernel that reduces the surroundings of texels.
type Project<const D: usize> = fn(Kernel, &[[i16; INPUTS]], &Projection<INPUTS, D>, &mut [[i8; D]]);

impl AppearanceImage<FINE_DIMS> {
    pub(super) fn fine(features: &Features, basis: &Basis, spacing: usize, kernel: Kernel) -> Self {
        Self::new(features, basis, spacing, kernel, project_fine)
    }
}

impl AppearanceImage<COARSE_DIMS> {
    pub(super) fn coarse(features: &Features, basis: &Basis, spacing: usize, kernel: Kernel) -> Self {
        Self::new(features, basis, spacing, kernel, project_coarse)
    }
}

impl<const D: usize> AppearanceImage<D> {
    fn new(features: &Features, basis: &Basis, spacing: usize, kernel: Kernel, project: Project<D>) -> Self {
        let projection = Projection {
            weights: std::array::from_fn(|d| std::array::from_fn(|n| basis.weights[n * D + d])),
            offset: std::array::from_fn(|d| basis.offset[d]),
            shift: basis.shift,
        };
        let Size { height, width } = features.size();
        let mut plain = vec![[0i8; D]; height * width];
        plain.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let inputs: Vec<_> = (0..width).map(|x| features.surroundings(spacing, y, x)).collect();
            project(kernel, &inputs, &projection, row);
        });
        let stride = width + 2 * spacing;
        let wrapped = |place: usize, side: usize| (place + side - spacing % side) % side;
        let mut values = vec![[0i8; D]; stride * (height + 2 * spacing)];
        values.par_chunks_mut(stride).enumerate().for_each(|(y, row)| {
            let from = &plain[wrapped(y, height) * width..][..width];
            for (x, out) in row.iter_mut().enumerate() {
                *out = from[wrapped(x, width)];
            }
        });
        Self { spacing, stride, values }
    }
}

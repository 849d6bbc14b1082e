//! The endless plane: any window of it, alone.

use super::appearance::{
    Appearance, COARSE_DIMS, FINE_DIMS, JITTER_ONE, MOST_SIDE, default_jitter, dims_of, levels_of, sides_at,
};
use super::appearance_image::{AppearanceImage, Features};
use super::region::Region;
use super::start::Start;
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::kernel::coherent::{Repetition, Subpass, correct, unpack};
use crate::lattice::WaveCounts;
use crate::shape::{Size, Window};
use crate::words::counted;

/// Order of the parities, (row, column), in which the sub-passes of a pass correct.
const PARITIES: [[i64; 2]; 4] = [[0, 0], [1, 1], [0, 1], [1, 0]];

/// Rows and columns that each pass reaches.
const REACH: [usize; 2] = [4, 6];
/// And those that the first reaches besides.
const REACH_BEYOND: [usize; 2] = [2, 0];

/// What each pass reaches beyond a side of the exemplar where repetition costs.
const REACH_REPEATING: usize = 6;

/// Shorter side from which on the border of an exemplar that does not wrap is kept.
const LEAST_BORDERED: usize = 8;

/// Places are from minus this to one less than this.
const PLACES: i64 = 1 << 31;

/// Which of all planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variation {
    /// Another seed gives another plane of the same material.
    pub seed: u32,
    /// How far positions are moved at each level, in units of 1 / 256 of its spacing, at most [`JITTER_ONE`]: more
    /// copies less in one piece, and fits less well.
    pub jitter: u32,
    /// Size of an output that joins at its own borders; both sides multiples of [`Plane::period`].
    pub wrap: Option<Size>,
}

/// An endless plane of the material.
pub struct Plane {
    tile_width: usize,
    exemplar: Window,
    wraps: bool,
    lattice: WaveCounts,
    /// The finest first.
    levels: Vec<Correction>,
    kernel: Kernel,
}

/// How a level is corrected.
struct Correction {
    level: Levelled,
    passes: usize,
    /// Cost of a site that comes from the same row or column.
    repetition: i32,
}

enum Levelled {
    Fine(AppearanceImage<FINE_DIMS>),
    Coarse(AppearanceImage<COARSE_DIMS>),
}

impl Plane {
    /// Makes the levels of an appearance; `index` [y, x] is the tile's.
    ///
    /// # Errors
    /// Parts that do not fit each other.
    pub fn new(tile: Size, index: &[u16], appearance: &Appearance, kernel: Kernel) -> Result<Self> {
        appearance.check(tile)?;
        let exemplar = appearance.exemplar;
        let mut texels = Vec::with_capacity(exemplar.size.texels());
        for row in index.chunks_exact(tile.width).skip(exemplar.y).take(exemplar.size.height) {
            for &cluster in &row[exemplar.x..exemplar.x + exemplar.size.width] {
                texels.push(*appearance.features.get(usize::from(cluster)).ok_or_else(|| {
                    Error::input(format!(
                        "appearance: got features of {}, the index has cluster {cluster}",
                        counted(appearance.features.len(), "cluster")
                    ))
                })?);
            }
        }
        let mut features = Features::new(exemplar.size, texels.into_iter());
        let count = appearance.levels.len();
        let mut levels = Vec::with_capacity(count);
        for (number, basis) in appearance.levels.iter().enumerate() {
            let spacing = 1 << number;
            let level = match dims_of(number, count) {
                FINE_DIMS => Levelled::Fine(AppearanceImage::fine(&features, basis, spacing, kernel)),
                _ => Levelled::Coarse(AppearanceImage::coarse(&features, basis, spacing, kernel)),
            };
            levels.push(Correction { level, passes: basis.passes, repetition: basis.repetition });
            if number + 1 < count {
                features.blur(spacing);
            }
        }
        let bordered = exemplar.size.height.min(exemplar.size.width) >= LEAST_BORDERED;
        Ok(Self {
            tile_width: tile.width,
            exemplar,
            wraps: appearance.wraps || !bordered,
            lattice: appearance.lattice.clone(),
            levels,
            kernel,
        })
    }

    /// The variation of a seed as it is by default.
    pub fn variation(&self, seed: u32) -> Variation {
        Variation { seed, jitter: default_jitter(&self.lattice), wrap: None }
    }

    /// Sides of an output that joins at its own borders are multiples of this.
    pub fn period(&self) -> usize {
        1 << self.levels.len()
    }

    /// Source texels of a window: for each of its texels, row by row, `row * width + column` of the tile's texel that it
    /// is. `y` and `x` are the window's first row and column, negative ones too.
    ///
    /// # Errors
    /// Places beyond 32 bits, a jitter above [`JITTER_ONE`], and an output that wraps whose sides are no multiples of
    /// [`Plane::period`].
    pub fn window(&self, variation: &Variation, y: i64, x: i64, size: Size) -> Result<Vec<u32>> {
        self.check(variation)?;
        let is_place = |first: i64, side: usize| {
            first >= -PLACES && i64::try_from(side).is_ok_and(|side| first <= PLACES - side)
        };
        if !is_place(y, size.height) || !is_place(x, size.width) {
            return Err(Error::usage(format!(
                "got the window of {size} at row {y}, column {x}, expected places from -2^31 to 2^31 - 1"
            )));
        }
        let window = Region { y, x, size };
        // The regions that are needed of each level, the finest first.
        let mut regions: Vec<Region> = Vec::with_capacity(self.levels.len());
        for level in 0..self.levels.len() {
            let wanted = regions.last().map_or(window, |finer: &Region| finer.coarser());
            regions.push(wanted.grown(self.halo(level)));
        }
        let start = Start {
            exemplar: self.exemplar.size,
            lattice: &self.lattice,
            seed: variation.seed,
            jitter: variation.jitter,
            wrap: variation.wrap,
        };
        let mut positions = Vec::new();
        for level in (0..self.levels.len()).rev() {
            let region = &regions[level];
            positions = match regions.get(level + 1) {
                None => start.begin(level as u32, region),
                Some(coarser) => start.finer(level as u32, region, &positions, coarser),
            };
            if level == 0 && !self.wraps {
                start.reflect(&mut positions);
            }
            self.correct(level, region, &mut positions);
        }
        let Some(finest) = regions.first() else { return Ok(Vec::new()) };
        let mut source = Vec::with_capacity(size.texels());
        for y in window.rows() {
            let row = &positions[finest.at([y, window.x])..][..size.width];
            source.extend(row.iter().map(|&position| self.source(position)));
        }
        Ok(source)
    }

    /// Bytes that the levels take in memory.
    pub fn bytes(&self) -> u64 {
        let level = |correction: &Correction| match &correction.level {
            Levelled::Fine(level) => size_of_val(&level.values[..]),
            Levelled::Coarse(level) => size_of_val(&level.values[..]),
        };
        self.levels.iter().map(level).sum::<usize>() as u64
    }

    /// Bytes that the levels of any exemplar of a tile take at most.
    pub fn most_bytes(tile: Size) -> u64 {
        let exemplar = Size::new(tile.height.min(MOST_SIDE), tile.width.min(MOST_SIDE));
        let count = levels_of(exemplar);
        let level = |number: usize| {
            // With a margin on every side.
            let [height, width] = [exemplar.height, exemplar.width].map(|side| side + (2 << number));
            (height * width * dims_of(number, count)) as u64
        };
        (0..count).map(level).sum()
    }

    /// Checks a variation, as [`Plane::window`] does.
    ///
    /// # Errors
    /// Those of [`Plane::window`].
    pub fn check(&self, variation: &Variation) -> Result<()> {
        if variation.jitter > JITTER_ONE {
            return Err(Error::usage(format!(
                "got a jitter of {} / 256, expected at most 1",
                variation.jitter
            )));
        }
        let period = self.period();
        match variation.wrap {
            Some(size) if !size.height.is_multiple_of(period) || !size.width.is_multiple_of(period) => {
                let near = |side: usize| side.next_multiple_of(period);
                Err(Error::usage(format!(
                    "an output of {size} cannot join at its own borders: expected sides that are multiples of {period}"
                ))
                .hint(format!("such as {}", Size::new(near(size.height), near(size.width)))))
            }
            _ => Ok(()),
        }
    }

    /// The tile's texel at a position of the exemplar.
    fn source(&self, position: u32) -> u32 {
        let [y, x] = unpack(position).map(|place| place as u32);
        (self.exemplar.y as u32 + y) * self.tile_width as u32 + self.exemplar.x as u32 + x
    }

    /// Rows and columns that a pass reaches, and those that the first reaches besides.
    fn reach(&self, level: usize) -> [[usize; 2]; 2] {
        match self.levels[level].repetition {
            0 => [REACH, REACH_BEYOND],
            _ => [sides_at(self.exemplar.size, level).map(|side| side + REACH_REPEATING), [0, 0]],
        }
    }

    /// Rows and columns around a region that its correction depends on.
    fn halo(&self, level: usize) -> [usize; 2] {
        let [reach, beyond] = self.reach(level);
        std::array::from_fn(|axis| self.levels[level].passes * reach[axis] + beyond[axis])
    }

    /// Corrects the positions of a level; those in the halo come out as whatever they do.
    fn correct(&self, level: usize, region: &Region, positions: &mut [u32]) {
        match &self.levels[level].level {
            Levelled::Fine(appearance) => self.correct_by(appearance, level, region, positions),
            Levelled::Coarse(appearance) => self.correct_by(appearance, level, region, positions),
        }
    }

    fn correct_by<const D: usize>(
        &self,
        appearance: &AppearanceImage<D>,
        level: usize,
        region: &Region,
        positions: &mut [u32],
    ) {
        let Size { height, width } = region.size;
        let Correction { passes, repetition: cost, .. } = self.levels[level];
        let repeats = cost > 0;
        let distance = sides_at(self.exemplar.size, level);
        let [reach, _] = self.reach(level);
        for pass in 0..passes {
            // Each pass leaves out what the passes to come do not reach, and what it cannot look around itself.
            let margin: [usize; 2] = std::array::from_fn(|axis| {
                let sites = if repeats { distance[axis] } else { 0 };
                (pass * reach[axis] + sites).max(2)
            });
            let before = if repeats { positions.to_vec() } else { Vec::new() };
            let repetition = repeats.then_some(Repetition { before: &before, distance, cost });
            for parity in PARITIES {
                let first = |place: i64, parity: i64, margin: usize| {
                    margin + ((parity - place - margin as i64) & 1) as usize
                };
                let subpass = Subpass {
                    width,
                    rows: [first(region.y, parity[0], margin[0]), height.saturating_sub(margin[0])],
                    columns: [first(region.x, parity[1], margin[1]), width.saturating_sub(margin[1])],
                    appearance: &appearance.values,
                    stride: appearance.stride,
                    spacing: appearance.spacing,
                    sides: [self.exemplar.size.height, self.exemplar.size.width],
                    crosses_border: level > 0 || self.wraps,
                    repetition,
                };
                correct(self.kernel, positions, &subpass);
            }
        }
    }
}

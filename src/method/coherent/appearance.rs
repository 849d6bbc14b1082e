//! What a model stores for the coherent rule: how texels of the exemplar look, as small whole numbers.

use crate::error::{Error, Result};
use crate::lattice::WaveCounts;
use crate::shape::{Size, Window};
use crate::words::counted;

/// Features of a cluster.
pub const FEATURES: usize = 8;

/// Numbers that a basis reduces: the features of the 3 x 3 texels around one, a spacing apart.
pub const INPUTS: usize = 9 * FEATURES;

/// Numbers that a texel's surroundings are reduced to, but at the two coarsest levels.
pub const FINE_DIMS: usize = 4;

/// The same at the two coarsest levels, which decide what lies where.
pub(super) const COARSE_DIMS: usize = 8;

/// Most levels, and longest side of an exemplar: so that all sums fit 32 bits.
pub const LEVELS_MOST: usize = 13;
/// Longest side of an exemplar.
pub const MOST_SIDE: usize = 32767;

/// A jitter of a whole spacing.
pub const JITTER_ONE: u32 = 256;

/// Jitter unless another is asked for: half a spacing, and none where it would break a lattice.
pub(crate) fn default_jitter(lattice: &WaveCounts) -> u32 {
    if lattice.0.is_empty() { JITTER_ONE / 2 } else { 0 }
}

/// Number of levels of an exemplar: its shorter side holds at least four of the coarsest spacing.
pub fn levels_of(exemplar: Size) -> usize {
    let side = exemplar.height.min(exemplar.width);
    (side / 4).max(1).ilog2() as usize + 1
}

/// Numbers that a texel's surroundings are reduced to at a level.
pub fn dims_of(level: usize, levels: usize) -> usize {
    if level + 2 >= levels { COARSE_DIMS } else { FINE_DIMS }
}

/// How the texels of an exemplar look.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// The part of the tile that is the exemplar.
    pub exemplar: Window,
    /// Whether its borders join.
    pub wraps: bool,
    /// Features of each cluster.
    pub features: Vec<[i8; FEATURES]>,
    /// How a level's appearance is made of features; of 2^k texels' spacing the k-th.
    pub levels: Vec<Basis>,
    /// The lattice of a regular material.
    pub lattice: WaveCounts,
}

/// How surroundings are reduced to a level's appearance: `(sum of weights * inputs - offset) / 2^shift`.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// Numbers that come out.
    pub dims: usize,
    /// [input, dim], inputs row by row of the 3 x 3 surroundings, features innermost.
    pub weights: Vec<i16>,
    /// [dim].
    pub offset: Vec<i32>,
    /// From 1 to 20.
    pub shift: u32,
    /// Passes of correction, from 1 to 8.
    pub passes: usize,
    /// What a site one side of the exemplar away costs that comes from the same row or column; at most 2^22. It is 0
    /// but at coarse levels, since what it reads lies far away.
    pub repetition: i32,
}

/// Levels, counted from the coarsest, at which repetition costs.
const REPETITION_LEVELS: usize = 2;

/// Longest side of an exemplar, in texels of a level, at which repetition costs there: each pass reads so far away.
const REPETITION_FARTHEST: usize = 64;

/// Most that repetition may cost, so that sums fit 32 bits.
const REPETITION_MOST: i32 = 1 << 22;

/// The square of a deviation of the first dimension (127 / 4, three times over as sums are) in each of four neighbours.
const REPETITION: i32 = 9 * 4 * 32 * 32;

/// Passes of correction that a level is given. Coarse levels decide what lies where, have few texels, and gain from more;
/// at fine ones more passes copy larger pieces and bring little.
pub fn passes_of(level: usize) -> usize {
    match level {
        0 => 1,
        1 | 2 => 2,
        _ => 4,
    }
}

/// Sides of an exemplar in texels of a level, rounded.
pub(super) fn sides_at(exemplar: Size, level: usize) -> [usize; 2] {
    [exemplar.height, exemplar.width].map(|side| (side + (1 << level) / 2) >> level)
}

/// Whether repetition may cost at a level.
fn may_repeat(exemplar: Size, level: usize) -> bool {
    level + REPETITION_LEVELS >= levels_of(exemplar)
        && sides_at(exemplar, level).iter().all(|&side| side <= REPETITION_FARTHEST)
}

/// What repetition is made to cost at a level.
pub fn repetition_of(level: usize, exemplar: Size) -> i32 {
    if may_repeat(exemplar, level) { REPETITION } else { 0 }
}

impl Appearance {
    /// Checks that the parts fit each other and a tile; what comes from a store is not trusted.
    ///
    /// # Errors
    /// Names the part, what was found and what was expected.
    pub fn check(&self, tile: Size) -> Result<()> {
        let Window { size, .. } = self.exemplar;
        let refused = |what: String| Err(Error::input(format!("appearance: {what}")));
        if !self.exemplar.fits(tile) || size.texels() == 0 || size.height.max(size.width) > MOST_SIDE {
            return refused(format!(
                "got the exemplar {}, expected a part of the tile of {tile}, at most {MOST_SIDE} texels a side",
                self.exemplar
            ));
        }
        let levels = levels_of(size);
        if self.levels.len() != levels || levels > LEVELS_MOST {
            return refused(format!(
                "got {}, expected {levels} for {size}",
                counted(self.levels.len(), "level")
            ));
        }
        for (number, basis) in self.levels.iter().enumerate() {
            let dims = dims_of(number, levels);
            let fits =
                basis.dims == dims && basis.weights.len() == INPUTS * dims && basis.offset.len() == dims;
            if !fits || !(1..=20).contains(&basis.shift) {
                return refused(format!(
                    "level {number}: got {} dimensions and a shift of {}, expected {dims} and 1 to 20",
                    basis.dims, basis.shift
                ));
            }
            let most = if may_repeat(size, number) { REPETITION_MOST } else { 0 };
            if !(1..=8).contains(&basis.passes) || !(0..=most).contains(&basis.repetition) {
                return refused(format!(
                    "level {number}: got {} passes and a repetition cost of {}, expected 1 to 8 and 0 to {most}",
                    basis.passes, basis.repetition,
                ));
            }
        }
        self.lattice.check(size)
    }
}

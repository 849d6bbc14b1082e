//! The search for a patch whose borders can be made to join.

use rayon::prelude::*;

use super::seam::least_path;
use super::{Features, Patch, path_cost, vertical_path};
use crate::lattice::{Lattice, whole_cell_sides};
use crate::random::Hash;
use crate::shape::Size;

/// Longest side of a tile that is searched, if its size is not given.
pub const LONGEST_SIDE: usize = 256;

/// Sides of tiles that are searched are multiples of this, so that the levels of the pyramid wrap too; whole cells of
/// a lattice matter more.
const MULTIPLE: usize = 8;

/// Cycles of each wave of a lattice along a whole side, below which the material does not change that way.
const UNCHANGING: f64 = 0.1;

/// What the search for a patch may choose from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SearchRange {
    /// Heights and widths, from the least to the greatest.
    sides: [Vec<usize>; 2],
    /// Width of the overlap.
    overlap: usize,
}

impl SearchRange {
    /// The range for a plane: tiles of five eighths of its sides up to all that an overlap leaves, at most 256 a side.
    ///
    /// Where the plane has a lattice, sides are whole numbers of cells as nearly as texels allow, of half of the
    /// greatest side and more: there is a multiple of every period up to the greatest side. Where no such sides are,
    /// the lattice is passed over. Returns `None` where the plane is too small to cut a tile with an overlap from it.
    pub(crate) fn for_plane(size: Size, lattice: &Lattice) -> Option<Self> {
        let overlap = (size.height.min(size.width) / 8).clamp(6, 48);
        Self::with(size, lattice, overlap, [5, 8])
    }

    /// The same for tiles that hold nearly all of a plane: of four fifths of its sides and more, with half the overlap.
    pub(crate) fn nearly_all(size: Size, lattice: &Lattice) -> Option<Self> {
        let overlap = (size.height.min(size.width) / 16).clamp(4, 24);
        Self::with(size, lattice, overlap, [4, 5])
    }

    /// Sides from a share of the greatest that an overlap leaves.
    fn with(size: Size, lattice: &Lattice, overlap: usize, [part, of]: [usize; 2]) -> Option<Self> {
        let greatest = [size.height, size.width].map(|n| n.saturating_sub(overlap).min(LONGEST_SIDE));
        let most = greatest.map(|n| n / MULTIPLE * MULTIPLE);
        if most.iter().any(|&n| n < 2 * overlap || n < 2 * MULTIPLE) {
            return None;
        }
        let ordinary = most.map(|n| (n * part / of).next_multiple_of(MULTIPLE)..=n);
        let ordinary = ordinary.map(|range| range.step_by(MULTIPLE).collect::<Vec<_>>());
        let whole = [0, 1].map(|axis| sides_of_cells(lattice, axis, &ordinary[axis], greatest[axis]));
        let sides = if whole.iter().all(|sides| !sides.is_empty()) { whole } else { ordinary };
        Some(Self { sides, overlap })
    }

    /// Tiles of one size.
    ///
    /// # Errors
    /// The width of the overlap, where the plane does not hold as much more than the tile, or a side has less than 8
    /// texels.
    pub(crate) fn of_size(size: Size, plane: Size) -> Result<Self, usize> {
        let overlap = (size.height.min(size.width) / 8).clamp(2, 48);
        let fits = size.height + overlap <= plane.height && size.width + overlap <= plane.width;
        if !fits || size.height.min(size.width) < 8 {
            return Err(overlap);
        }
        Ok(Self { sides: [vec![size.height], vec![size.width]], overlap })
    }

    /// Heights and widths that a tile may have, from the least to the greatest.
    pub fn sides(&self) -> &[Vec<usize>; 2] {
        &self.sides
    }

    /// Whether a patch of this plane may be chosen.
    fn allows(&self, plane: Size, patch: Patch) -> bool {
        self.sides[0].binary_search(&patch.height).is_ok()
            && self.sides[1].binary_search(&patch.width).is_ok()
            && patch.y + patch.height + patch.overlap <= plane.height
            && patch.x + patch.width + patch.overlap <= plane.width
    }

    /// The next longer (1) or shorter (-1) side.
    fn beside(&self, axis: usize, side: usize, step: isize) -> Option<usize> {
        let at = self.sides[axis].binary_search(&side).ok()?;
        self.sides[axis].get(at.checked_add_signed(step)?).copied()
    }
}

/// The sides of whole cells, or the ordinary ones where the material does not change along this axis.
fn sides_of_cells(lattice: &Lattice, axis: usize, ordinary: &[usize], greatest: usize) -> Vec<usize> {
    let unchanging = lattice.waves().iter().all(|wave| (wave[axis] * greatest as f64).abs() < UNCHANGING);
    if unchanging {
        return ordinary.to_vec();
    }
    whole_cell_sides(lattice, axis, greatest / 2 + 1..=greatest)
}

/// Number of patches drawn by the search before the best are refined.
const DRAWN: u32 = 4000;

/// Number of drawn patches that are refined.
const REFINED: usize = 8;

/// Finds the patch whose seams cost least, larger ones preferred: a tile of half the area must
/// have seams cheaper by a fifth. The same seed finds the same patch.
pub fn search(features: &Features, range: &SearchRange, seed: u64) -> Patch {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"tile"));
    let draw = |number: u32| {
        let pick = |bound: usize, place: u32| hash.below(bound.max(1) as u64, number, place, 0) as usize;
        let side = |axis: usize| range.sides[axis][pick(range.sides[axis].len(), axis as u32)];
        let (height, width) = (side(0), side(1));
        let y = pick(features.size.height - height - range.overlap + 1, 2);
        let x = pick(features.size.width - width - range.overlap + 1, 3);
        Patch { y, x, height, width, overlap: range.overlap }
    };
    let mut drawn: Vec<(f64, u32)> =
        (0..DRAWN).into_par_iter().map(|number| (score(features, draw(number)), number)).collect();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let refined: Vec<(f64, Patch)> = drawn[..REFINED]
        .par_iter()
        .map(|&(score, number)| refine(features, range, draw(number), score))
        .collect();
    let best = refined.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(|| draw(0), |(_, patch)| *patch)
}

/// Moves a patch and changes its size step by step as long as its score falls.
fn refine(features: &Features, range: &SearchRange, start: Patch, start_score: f64) -> (f64, Patch) {
    let (mut best, mut patch) = (start_score, start);
    loop {
        let mut moves = Vec::new();
        for step in [1i64, 3, 8] {
            for sign in [-1, 1] {
                let shift = |n: usize| n.checked_add_signed((sign * step) as isize);
                moves.push(shift(patch.y).map(|y| Patch { y, ..patch }));
                moves.push(shift(patch.x).map(|x| Patch { x, ..patch }));
            }
        }
        for step in [-1, 1] {
            moves.push(range.beside(0, patch.height, step).map(|height| Patch { height, ..patch }));
            moves.push(range.beside(1, patch.width, step).map(|width| Patch { width, ..patch }));
        }
        let improved = moves
            .into_iter()
            .flatten()
            .filter(|patch| range.allows(features.size, *patch))
            .map(|patch| (score(features, patch), patch))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match improved {
            Some((score, moved)) if score < best => (best, patch) = (score, moved),
            _ => return (best, patch),
        }
    }
}

/// Cost of both seams per texel of seam, weighted towards larger tiles.
fn score(features: &Features, patch: Patch) -> f64 {
    let Patch { y, x, height, width, overlap } = patch;
    let (_, vertical) = vertical_path(features, patch);
    let cost = path_cost(width, overlap, |column, place| {
        features.difference([y + place, x + column], [y + height + place, x + column])
    });
    let (_, horizontal) = least_path(&cost, width, overlap - 1, false);
    let per_texel = vertical as f64 / (height + overlap) as f64 + horizontal as f64 / width as f64;
    (per_texel + 1.0) / libm::cbrt((height * width) as f64)
}

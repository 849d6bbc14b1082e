//! The seamless tile: a map from its texels to the measured texels that they are.
//!
//! A patch of the plane is cut so that its left border continues its right one and its top its
//! bottom one: in the overlap, texels are taken from one side or the other of a minimum-error path,
//! whole BRDFs, never mixed.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::random::Hash;
use crate::shape::{Size, Window};
use crate::texel::seam::least_path;

/// A tile: for each of its texels the measured texel that it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Rows and columns of the tile.
    pub size: Size,
    /// Row and column in the measurement, row by row of the tile.
    pub source: Vec<[u32; 2]>,
    /// Whether its borders join.
    pub wraps: bool,
}

impl Tile {
    /// The whole plane as it is.
    pub fn whole(size: Size, wraps: bool) -> Self {
        let source =
            (0..size.height).flat_map(|y| (0..size.width).map(move |x| [y as u32, x as u32])).collect();
        Self { size, source, wraps }
    }

    /// The smallest window of the measurement that holds every source.
    pub fn bounds(&self) -> Window {
        let extent = |axis: usize| {
            let values = self.source.iter().map(|source| source[axis] as usize);
            (values.clone().min().unwrap_or(0), values.max().unwrap_or(0))
        };
        let ((top, bottom), (left, right)) = (extent(0), extent(1));
        Window { y: top, x: left, size: Size::new(bottom - top + 1, right - left + 1) }
    }

    /// Position of each source within [`Tile::bounds`], counted row by row.
    pub fn offsets_in_bounds(&self) -> Vec<usize> {
        let Window { y, x, size } = self.bounds();
        self.source
            .iter()
            .map(|&[row, column]| (row as usize - y) * size.width + column as usize - x)
            .collect()
    }
}

/// L* codes of every texel under a few direction pairs, by which seams are judged.
pub struct Features {
    /// Size of the plane.
    pub size: Size,
    /// Number of codes of a texel.
    pub count: usize,
    /// Codes [y, x, feature].
    pub codes: Vec<u8>,
}

impl Features {
    fn texel(&self, [row, column]: [usize; 2]) -> &[u8] {
        let at = (row * self.size.width + column) * self.count;
        &self.codes[at..at + self.count]
    }

    /// Sum of squared differences of two texels.
    pub(super) fn difference(&self, first: [usize; 2], second: [usize; 2]) -> u64 {
        let pairs = self.texel(first).iter().zip(self.texel(second));
        u64::from(pairs.map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum::<u32>())
    }
}

/// Where a patch lies: its tile's origin and size; it needs `overlap` more rows and columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Patch {
    /// Topmost measured row.
    pub y: usize,
    /// Leftmost measured column.
    pub x: usize,
    /// Rows of the tile.
    pub height: usize,
    /// Columns of the tile.
    pub width: usize,
    /// Width of the bands in which the paths run.
    pub overlap: usize,
}

impl Patch {
    /// The patch as it is, taken for a tile that wraps without a cut.
    pub fn uncut(self) -> Tile {
        let mut tile = Tile::whole(Size::new(self.height, self.width), true);
        for [row, column] in &mut tile.source {
            (*row, *column) = (*row + self.y as u32, *column + self.x as u32);
        }
        tile
    }
}

/// A tile with the patch that it was cut from and the places of its seams.
pub struct Cut {
    /// The tile.
    pub tile: Tile,
    /// Where it was cut.
    pub patch: Patch,
    /// For each tile texel, whether it was taken from beyond the right (bit 0) or bottom (bit 1) border.
    pub beyond: Vec<u8>,
}

/// Cuts a seamless tile at `patch`.
pub fn cut(features: &Features, patch: Patch) -> Cut {
    let Patch { y, x, height, width, overlap } = patch;
    let (columns, _) = vertical_path(features, patch);
    // The strip of height + overlap rows that already joins left to right.
    let strip = |row: usize, column: usize| {
        let beyond = column < columns[row];
        ([y + row, if beyond { x + width + column } else { x + column }], u8::from(beyond))
    };
    let cost = path_cost(width, overlap, |column, place| {
        features.difference(strip(place, column).0, strip(height + place, column).0)
    });
    let (rows, _) = least_path(&cost, width, overlap - 1, true);
    let mut source = Vec::with_capacity(height * width);
    let mut beyond = Vec::with_capacity(height * width);
    for row in 0..height {
        for (column, &path) in rows.iter().enumerate() {
            let below = row <= path && row < overlap;
            let ([r, c], right) = strip(if below { height + row } else { row }, column);
            source.push([r as u32, c as u32]);
            beyond.push(right | u8::from(below) << 1);
        }
    }
    Cut { tile: Tile { size: Size::new(height, width), source, wraps: true }, patch, beyond }
}

/// The path from top to bottom: at each row the first column that is taken from the left side, and its cost.
fn vertical_path(features: &Features, patch: Patch) -> (Vec<usize>, u64) {
    let Patch { y, x, height, width, overlap } = patch;
    let cost = path_cost(height + overlap, overlap, |row, place| {
        features.difference([y + row, x + place], [y + row, x + width + place])
    });
    let (path, total) = least_path(&cost, height + overlap, overlap - 1, false);
    (path.into_iter().map(|place| place + 1).collect(), total)
}

/// Cost of cutting between places p and p + 1: how far the two sides differ at both.
pub(crate) fn path_cost(length: usize, overlap: usize, difference: impl Fn(usize, usize) -> u64) -> Vec<u64> {
    let mut cost = Vec::with_capacity(length * (overlap - 1));
    for step in 0..length {
        let mut before = difference(step, 0);
        for place in 1..overlap {
            let after = difference(step, place);
            cost.push(before + after);
            before = after;
        }
    }
    cost
}

/// What the search for a patch may choose from.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SearchRange {
    /// Least height and width.
    pub least: [usize; 2],
    /// Greatest height and width.
    pub most: [usize; 2],
    /// Heights and widths are multiples of this, so that the levels of the pyramid wrap too.
    pub multiple: usize,
    /// Width of the overlap.
    pub overlap: usize,
}

impl SearchRange {
    /// The default range for a plane: tiles of five eighths of its side up to all of it, at most 256 a side.
    ///
    /// Returns `None` where the plane is too small to cut a tile with an overlap from it.
    pub fn for_plane(size: Size) -> Option<Self> {
        const MOST: usize = 256;
        const MULTIPLE: usize = 8;
        let side = size.height.min(size.width);
        let overlap = (side / 8).clamp(6, 48);
        let most =
            [size.height, size.width].map(|n| n.saturating_sub(overlap).min(MOST) / MULTIPLE * MULTIPLE);
        let least = most.map(|n| (n * 5 / 8).next_multiple_of(MULTIPLE));
        let enough = most.iter().all(|&n| n >= 2 * overlap && n >= 2 * MULTIPLE);
        enough.then_some(Self { least, most, multiple: MULTIPLE, overlap })
    }
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
        let side = |axis: usize| {
            let steps = (range.most[axis] - range.least[axis]) / range.multiple;
            range.least[axis] + range.multiple * pick(steps + 1, axis as u32)
        };
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
        for sign in [-1isize, 1] {
            let resize = |n: usize| n.checked_add_signed(sign * range.multiple as isize);
            moves.push(resize(patch.height).map(|height| Patch { height, ..patch }));
            moves.push(resize(patch.width).map(|width| Patch { width, ..patch }));
        }
        let improved = moves
            .into_iter()
            .flatten()
            .filter(|patch| allowed(features.size, range, *patch))
            .map(|patch| (score(features, patch), patch))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match improved {
            Some((score, moved)) if score < best => (best, patch) = (score, moved),
            _ => return (best, patch),
        }
    }
}

fn allowed(plane: Size, range: &SearchRange, patch: Patch) -> bool {
    (range.least[0]..=range.most[0]).contains(&patch.height)
        && (range.least[1]..=range.most[1]).contains(&patch.width)
        && patch.y + patch.height + patch.overlap <= plane.height
        && patch.x + patch.width + patch.overlap <= plane.width
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

/// How far neighbours differ across the seams, relative to neighbours elsewhere (1: no more than usual).
///
/// Root mean square differences of adjacent tile texels, wrap-around included, over the features.
pub fn seam_visibility(features: &Features, tile: &Tile) -> f64 {
    let Size { height, width } = tile.size;
    let at = |y: usize, x: usize| tile.source[(y % height) * width + x % width].map(|n| n as usize);
    let (mut seam, mut ordinary) = ((0u64, 0u64), (0u64, 0u64));
    for y in 0..height {
        for x in 0..width {
            let here = at(y, x);
            for (neighbour, step) in [(at(y, x + 1), [0, 1]), (at(y + 1, x), [1, 0])] {
                let natural = [here[0] + step[0], here[1] + step[1]] == neighbour;
                let sum = if natural { &mut ordinary } else { &mut seam };
                sum.0 += features.difference(here, neighbour);
                sum.1 += 1;
            }
        }
    }
    let mean = |(total, count): (u64, u64)| total as f64 / count.max(1) as f64;
    if seam.1 == 0 || ordinary.0 == 0 { 1.0 } else { (mean(seam) / mean(ordinary)).sqrt() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A plane with a periodic pattern of the given periods.
    fn periodic(size: Size, period: [usize; 2]) -> Features {
        let hash = Hash::new(1, 0);
        let codes = (0..size.texels())
            .flat_map(|n| {
                let (y, x) = (n / size.width % period[0], n % size.width % period[1]);
                hash.words(y as u32, x as u32, 0).map(|word| word as u8)
            })
            .collect();
        Features { size, count: 4, codes }
    }

    #[test]
    fn a_periodic_plane_gives_a_tile_of_whole_periods() {
        let features = periodic(Size::new(90, 100), [24, 32]);
        let range = SearchRange::for_plane(features.size).unwrap();
        let patch = search(&features, &range, 1);
        assert_eq!((patch.height % 24, patch.width % 32), (0, 0), "{patch:?}");
        let tile = cut(&features, patch).tile;
        // Every tile texel equals the plane's at its place, so the cut cannot be told.
        for (number, source) in tile.source.iter().enumerate() {
            let (y, x) = (number / tile.size.width, number % tile.size.width);
            let (here, there) = ([patch.y + y, patch.x + x], source.map(|n| n as usize));
            assert_eq!(features.texel(here), features.texel(there));
        }
    }

    #[test]
    fn borders_join_through_texels_that_were_neighbours() {
        let features = periodic(Size::new(64, 64), [64, 64]);
        let patch = Patch { y: 2, x: 3, height: 40, width: 48, overlap: 8 };
        let Cut { tile, beyond, .. } = cut(&features, patch);
        // The first row is taken from beyond the bottom border, the first column from beyond the right
        // one: they continue the last row and the last column.
        for (x, beyond) in beyond[..48].iter().enumerate() {
            let (first, last) = (tile.source[x], tile.source[39 * 48 + x]);
            assert!(beyond & 2 != 0 && first[0] == last[0] + 1);
        }
        for y in 0..40 {
            let (first, last) = (tile.source[y * 48], tile.source[y * 48 + 47]);
            assert!(beyond[y * 48] & 1 != 0 && first[1] == last[1] + 1);
        }
    }

    #[test]
    fn visibility_is_one_where_there_is_no_seam() {
        let features = periodic(Size::new(32, 32), [32, 32]);
        let tile = Tile::whole(features.size, true);
        let visibility = seam_visibility(&features, &tile);
        assert!((0.8..1.25).contains(&visibility), "{visibility}");
    }
}

//! A second tile with the borders of the first, so that the two join in any order over a plane.
//!
//! The interior of the first tile gives way to another region of the measurement, joined by
//! minimum-error paths on all four sides as in image quilting (Efros and Freeman 2001). Texels are
//! whole BRDFs of one side or the other, never mixed, so this tile too is a map of sources.

use rayon::prelude::*;

use crate::method::tile::seam::least_path;
use crate::method::tile::{Cut, Features, Patch, Tile, path_cost};
use crate::random::Hash;

/// Regions drawn, of which the half that shares least with the first tile is tried.
const DRAWN: u32 = 1000;

/// A tile that joins the first one on every side.
pub(crate) struct SecondTile {
    /// Its texels as sources in the measurement; its size is that of the first tile.
    pub tile: Tile,
    /// Row and column in the measurement of the region that became its interior.
    pub origin: [usize; 2],
    /// For each tile texel, whether it comes from that region.
    pub inside: Vec<bool>,
}

/// Cuts a second tile beside `first`: of the regions drawn at random, those that share least with it, and
/// of these the one whose four paths cost least. The same seed cuts the same second tile.
pub(crate) fn second_tile(features: &Features, first: &Cut, seed: u64) -> SecondTile {
    let hash = Hash::new(seed, u32::from_be_bytes(*b"pair"));
    let Patch { height, width, .. } = first.patch;
    let draw = |number: u32| {
        let pick = |room: usize, place: u32| hash.below(room as u64 + 1, number, place, 0) as usize;
        [pick(features.size.height - height, 0), pick(features.size.width - width, 1)]
    };
    let mut regions: Vec<[usize; 2]> = (0..DRAWN).map(draw).collect();
    regions.sort_by_key(|&origin| (shared(first.patch, origin), origin));
    let best = regions[..DRAWN as usize / 2]
        .par_iter()
        .map(|&origin| (Border::between(features, first, origin), origin))
        .min_by_key(|(border, origin)| (border.cost, *origin));
    let (border, origin) = best.unwrap_or_else(|| (Border::between(features, first, regions[0]), regions[0]));
    join(first, &border, origin)
}

/// Texels that the patch and a region of its size at `origin` have in common.
fn shared(patch: Patch, [y, x]: [usize; 2]) -> usize {
    patch.height.saturating_sub(patch.y.abs_diff(y)) * patch.width.saturating_sub(patch.x.abs_diff(x))
}

/// How many texels of each row and column stay the first tile's, counted from the border.
struct Border {
    left: Vec<usize>,
    right: Vec<usize>,
    top: Vec<usize>,
    bottom: Vec<usize>,
    cost: u64,
}

impl Border {
    /// The least paths between the first tile and the region at `origin`.
    fn between(features: &Features, first: &Cut, [y, x]: [usize; 2]) -> Self {
        let Patch { height, width, overlap, .. } = first.patch;
        let mut cost = 0;
        let mut side = |length: usize, place: &dyn Fn(usize, usize) -> (usize, usize)| {
            let cuts = path_cost(length, overlap, |step, depth| {
                let (row, column) = place(step, depth);
                let ours = first.tile.source[row * width + column].map(|n| n as usize);
                features.difference(ours, [y + row, x + column])
            });
            let (path, total) = least_path(&cuts, length, overlap - 1, false);
            cost += total;
            path.into_iter().map(|depth| depth + 1).collect::<Vec<usize>>()
        };
        let left = side(height, &|row, depth| (row, depth));
        let right = side(height, &|row, depth| (row, width - 1 - depth));
        let top = side(width, &|column, depth| (depth, column));
        let bottom = side(width, &|column, depth| (height - 1 - depth, column));
        Self { left, right, top, bottom, cost }
    }
}

/// The first tile outside the paths, the region inside all four.
fn join(first: &Cut, border: &Border, origin: [usize; 2]) -> SecondTile {
    let size = first.tile.size;
    let (mut source, mut inside) = (Vec::with_capacity(size.texels()), Vec::with_capacity(size.texels()));
    for row in 0..size.height {
        for column in 0..size.width {
            let within = column >= border.left[row]
                && size.width - 1 - column >= border.right[row]
                && row >= border.top[column]
                && size.height - 1 - row >= border.bottom[column];
            inside.push(within);
            source.push(if within {
                [(origin[0] + row) as u32, (origin[1] + column) as u32]
            } else {
                first.tile.source[row * size.width + column]
            });
        }
    }
    SecondTile { tile: Tile { size, source, wraps: true }, origin, inside }
}

/// Whether the second tile stands at a place (row, column of tiles) of a plane laid with both: a coin
/// hashed from the place, so that neither order nor size of the plane matters.
pub(crate) fn stands_at(seed: u64, row: usize, column: usize) -> bool {
    Hash::new(seed, u32::from_be_bytes(*b"coin")).below(2, row as u32, column as u32, 0) == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::tile::{cut, seam_visibility};
    use crate::shape::Size;

    /// A plane whose texel values follow from their place.
    fn plane(size: Size, code: impl Fn(usize, usize) -> [u8; 2]) -> Features {
        let codes = (0..size.texels()).flat_map(|n| code(n / size.width, n % size.width)).collect();
        Features { size, count: 2, codes }
    }

    /// Random at every third texel, linear between: neighbours are alike, distant texels are not.
    fn smooth(size: Size) -> Features {
        let hash = Hash::new(5, 0);
        let knot = |y: usize, x: usize, c: usize| hash.uniforms(y as u32, x as u32, c as u32)[0] * 255.0;
        plane(size, |y, x| {
            let (v, u) = ((y % 3) as f64 / 3.0, (x % 3) as f64 / 3.0);
            [0, 1].map(|c| {
                let row = |y| (1.0 - u) * knot(y, x / 3, c) + u * knot(y, x / 3 + 1, c);
                ((1.0 - v) * row(y / 3) + v * row(y / 3 + 1)) as u8
            })
        })
    }

    fn first(features: &Features) -> Cut {
        cut(features, Patch { y: 3, x: 5, height: 40, width: 48, overlap: 10 })
    }

    #[test]
    fn borders_are_the_first_tiles_and_the_middle_is_the_regions() {
        let features = smooth(Size::new(90, 100));
        let first = first(&features);
        let SecondTile { tile, origin, inside } = second_tile(&features, &first, 1);
        for row in 0..40 {
            for column in 0..48 {
                let at = row * 48 + column;
                let region = [(origin[0] + row) as u32, (origin[1] + column) as u32];
                assert_eq!(tile.source[at], if inside[at] { region } else { first.tile.source[at] });
                if row == 0 || row == 39 || column == 0 || column == 47 {
                    assert!(!inside[at], "border texel ({row}, {column}) is not the first tile's");
                }
                if (10..30).contains(&row) && (10..38).contains(&column) {
                    assert!(inside[at], "texel ({row}, {column}) lies beyond all overlaps");
                }
            }
        }
    }

    #[test]
    fn the_region_is_among_those_that_share_least_with_the_first_tile() {
        let features = smooth(Size::new(90, 100));
        let first = first(&features);
        let SecondTile { origin, .. } = second_tile(&features, &first, 1);
        // A region at a random place of the 51 x 53 shares 484 texels with the patch on average.
        assert!(shared(first.patch, origin) < 484, "{origin:?}");
    }

    #[test]
    fn paths_join_better_than_a_straight_cut() {
        let features = smooth(Size::new(90, 100));
        let first = first(&features);
        let cut = second_tile(&features, &first, 1);
        let straight =
            Border { left: vec![5; 40], right: vec![5; 40], top: vec![5; 48], bottom: vec![5; 48], cost: 0 };
        let pasted = join(&first, &straight, cut.origin);
        let [cut, pasted] = [cut.tile, pasted.tile].map(|tile| seam_visibility(&features, &tile));
        assert!(cut < 0.8 * pasted, "visibility {cut} along paths, {pasted} along straight lines");
    }

    #[test]
    fn each_path_finds_the_depth_where_both_agree() {
        // The first tile lies on a plane of noise; the region equals it at one depth on each side.
        let hash = Hash::new(9, 0);
        let noise = |y: usize, x: usize| {
            let [a, b, ..] = hash.words(y as u32, x as u32, 0);
            [a as u8, b as u8]
        };
        let size = Size::new(120, 120);
        let mut features = plane(size, noise);
        let patch = Patch { y: 0, x: 0, height: 40, width: 48, overlap: 10 };
        let first = Cut { tile: patch.uncut(), patch, beyond: vec![0; 40 * 48] };
        for row in 0..40 {
            for column in 0..48 {
                let agrees = |depth: usize, at: usize| at == depth || at == depth + 1;
                if agrees(2, column) || agrees(3, 47 - column) || agrees(4, row) || agrees(5, 39 - row) {
                    let [a, b] = noise(row, column);
                    let at = ((60 + row) * 120 + 60 + column) * 2;
                    (features.codes[at], features.codes[at + 1]) = (a, b);
                }
            }
        }
        let border = Border::between(&features, &first, [60, 60]);
        assert_eq!(border.cost, 0);
        assert_eq!((border.left[20], border.right[20], border.top[24], border.bottom[24]), (3, 4, 5, 6));
    }

    #[test]
    fn about_half_of_the_places_get_the_second_tile() {
        let count = (0..100).flat_map(|y| (0..100).map(move |x| (y, x))).filter(|&(y, x)| stands_at(3, y, x));
        assert!((4700..5300).contains(&count.count()));
    }
}

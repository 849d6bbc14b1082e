//! The mix of three measured directions that stands for another, found in a few steps.
//!
//! An image over the stereographic disc says in which triangle to begin; from there the way leads across the edge whose
//! weight is negative. Beyond the border the edges are sorted by azimuth. Whatever is found in neither way is left to
//! the exhaustive search, so that both agree everywhere.

use btfkit_formats::Direction;

use super::triangulation::Interpolator;
use crate::vector::{cross, dot};

/// Side of the image of first triangles.
const GRID: usize = 64;

/// Bins of azimuth.
const BINS: usize = 256;

/// Weights below this are rounding: a measured direction is itself.
const NEGLIGIBLE: f32 = 1e-6;

/// No triangle lies beyond that edge.
const NONE: u32 = u32::MAX;

/// One term of a mix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Number of the direction.
    pub number: u16,
    /// Its weight, from 0 to 1.
    pub weight: f32,
}

/// Three measured directions that stand for another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Weights sum to 1; those of directions that do not count are 0.
    pub shares: [Share; 3],
    /// Factor on the values where the direction is a light's: below 1 beyond the border of what was measured.
    pub cosine_ratio: f32,
}

/// A triangle of directions.
struct Facet {
    /// Weights of the corners are these rows times the direction.
    inverse: [[f32; 3]; 3],
    corners: [u16; 3],
    /// The facet across the edge opposite each corner.
    beyond: [u32; 3],
}

/// Finds the mix of any direction.
pub struct Locator {
    rule: Interpolator,
    facets: Vec<Facet>,
    /// The facet to begin in, by place in the stereographic disc.
    begin: Vec<u32>,
    /// Where the edges of each bin of azimuth begin in `rim`; one more than bins.
    bins: Vec<u32>,
    rim: Vec<[u16; 2]>,
}

impl Locator {
    /// For directions and their triangles (as stored with a model).
    pub fn new(directions: &[Direction], triangles: &[[u16; 3]]) -> Self {
        let rule = Interpolator::new(directions, triangles);
        let facets = facets(&rule);
        let begin = (0..GRID * GRID).map(|place| nearest_facet(&rule, &facets, place)).collect();
        let (bins, rim) = rim(&rule);
        Self { rule, facets, begin, bins, rim }
    }

    /// How many directions there are.
    pub fn directions(&self) -> usize {
        self.rule.vectors().len()
    }

    /// The mix of a unit vector whose z is not negative.
    #[inline]
    pub fn locate(&self, [x, y, z]: [f32; 3]) -> Located {
        let scale = 0.5 * GRID as f32 / (1.0 + z.max(0.0));
        let cell = |value: f32| ((value * scale + 0.5 * GRID as f32) as usize).min(GRID - 1);
        let mut at = self.begin[cell(y) * GRID + cell(x)];
        // No way is longer than through all facets; rounding could turn it in a circle.
        for _ in 0..self.facets.len() {
            let Some(facet) = self.facets.get(at as usize) else { return self.beyond([x, y, z]) };
            let weight = |row: [f32; 3]| row[0] * x + row[1] * y + row[2] * z;
            let weights = facet.inverse.map(weight);
            let lesser = |least: usize, corner| if weights[corner] < weights[least] { corner } else { least };
            let least = lesser(lesser(0, 1), 2);
            if weights[least] >= -NEGLIGIBLE {
                return Located { shares: shares(facet.corners, weights), cosine_ratio: 1.0 };
            }
            at = facet.beyond[least];
        }
        self.searched([x, y, z])
    }

    /// The mix of a direction that lies in no facet.
    fn beyond(&self, target: [f32; 3]) -> Located {
        let target = target.map(f64::from);
        let bin = bin_of(target[0], target[1]);
        let edges = &self.rim[self.bins[bin] as usize..self.bins[bin + 1] as usize];
        let edges = edges.iter().map(|edge| edge.map(usize::from));
        if let Some((ends, ratio)) = self.rule.crossing(target, edges) {
            let [i, j] = ends.map(|(number, _)| number as u16);
            let weights = [ends[0].1 as f32, ends[1].1 as f32, 0.0];
            return Located { shares: shares([i, j, i], weights), cosine_ratio: ratio as f32 };
        }
        self.searched(target.map(|value| value as f32))
    }

    /// The mix by the exhaustive search.
    fn searched(&self, target: [f32; 3]) -> Located {
        let mix = self.rule.mix_of(target.map(f64::from));
        let mut shares = [Share::default(); 3];
        for (share, &(number, weight)) in shares.iter_mut().zip(&mix.terms) {
            *share = Share { number: number as u16, weight: weight as f32 };
        }
        Located { shares, cosine_ratio: mix.cosine_ratio as f32 }
    }
}

/// Weights that sum to 1, without what is rounding.
#[inline]
fn shares(corners: [u16; 3], weights: [f32; 3]) -> [Share; 3] {
    let weights = weights.map(|weight| if weight > NEGLIGIBLE { weight } else { 0.0 });
    let sum = weights[0] + weights[1] + weights[2];
    std::array::from_fn(|n| Share { number: corners[n], weight: weights[n] / sum })
}

fn facets(rule: &Interpolator) -> Vec<Facet> {
    let corners: Vec<[usize; 3]> = rule.facets().collect();
    let edge = |a: usize, b: usize| [a.min(b), a.max(b)];
    // Every edge with the facet and the corner that it is opposite to.
    let opposite = |(number, &[a, b, c]): (usize, &[usize; 3])| {
        [(edge(b, c), number, 0), (edge(c, a), number, 1), (edge(a, b), number, 2)]
    };
    let mut edges: Vec<([usize; 2], usize, usize)> = corners.iter().enumerate().flat_map(opposite).collect();
    edges.sort_unstable();
    let mut beyond = vec![[NONE; 3]; corners.len()];
    for pair in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let [(_, first, to_first), (_, second, to_second)] = [pair[0], pair[1]];
        beyond[first][to_first] = second as u32;
        beyond[second][to_second] = first as u32;
    }
    let facet = |(corners, beyond): (&[usize; 3], [u32; 3])| {
        let [a, b, c] = corners.map(|corner| rule.vectors()[corner]);
        let volume = dot(a, cross(b, c));
        let row = |first, second| cross(first, second).map(|value: f64| (value / volume) as f32);
        Facet { inverse: [row(b, c), row(c, a), row(a, b)], corners: corners.map(|n| n as u16), beyond }
    };
    corners.iter().zip(beyond).map(facet).collect()
}

/// The facet that holds the middle of a cell of the stereographic disc, or comes nearest to it.
fn nearest_facet(rule: &Interpolator, facets: &[Facet], place: usize) -> u32 {
    let middle = |cell: usize| (2.0 * cell as f64 + 1.0) / GRID as f64 - 1.0;
    let (x, y) = (middle(place % GRID), middle(place / GRID));
    let square = x * x + y * y;
    let target = [2.0 * x / (1.0 + square), 2.0 * y / (1.0 + square), (1.0 - square) / (1.0 + square)];
    let least = |facet: &Facet| {
        let weights = rule.barycentric(facet.corners.map(usize::from), target);
        weights.into_iter().flatten().fold(f64::INFINITY, f64::min)
    };
    let leasts = facets.iter().map(least).enumerate();
    leasts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(NONE, |(number, _)| number as u32)
}

/// The bin of an azimuth, by an angle that needs no arc tangent.
fn bin_of(x: f64, y: f64) -> usize {
    let sum = x.abs() + y.abs();
    let turn = match (sum > 0.0, x >= 0.0) {
        (false, _) => 0.0,
        (true, true) => (y / sum).rem_euclid(4.0),
        (true, false) => 2.0 - y / sum,
    };
    ((turn / 4.0 * BINS as f64) as usize).min(BINS - 1)
}

/// The border edges that each bin of azimuth may cross.
fn rim(rule: &Interpolator) -> (Vec<u32>, Vec<[u16; 2]>) {
    let bin = |number: usize| bin_of(rule.vectors()[number][0], rule.vectors()[number][1]);
    let mut edges: Vec<(usize, [u16; 2])> = Vec::new();
    for &[i, j] in rule.border() {
        let (first, second) = (bin(i), bin(j));
        let ahead = (second + BINS - first) % BINS;
        // The shorter way round, and a bin more at either end; near half a turn, all the way.
        let (from, length) = match ahead {
            ahead if ahead.abs_diff(BINS / 2) < BINS / 16 => (0, BINS),
            ahead if ahead < BINS / 2 => (first + BINS - 1, ahead + 3),
            ahead => (second + BINS - 1, BINS - ahead + 3),
        };
        edges.extend((0..length).map(|step| ((from + step) % BINS, [i as u16, j as u16])));
    }
    edges.sort_unstable();
    let bins = (0..=BINS).map(|bin| edges.partition_point(|&(of, _)| of < bin) as u32).collect();
    (bins, edges.into_iter().map(|(_, edge)| edge).collect())
}

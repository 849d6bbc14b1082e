//! BRDFs as vectors of L* codes, arranged so that directions of equal weight lie together.

use crate::kernel::absolute_difference::{Group, LANE_BYTES};
use btfkit_formats::Direction;

/// Fixed-point one of the weights cos(theta_v).
pub const WEIGHT_ONE: f64 = 65536.0;

/// Where each (view, light) lies in a vector: views of equal weight side by side, each such group
/// padded by zeros.
#[derive(Clone, Debug)]
pub struct Arrangement {
    cosines: Vec<f64>,
    lights: usize,
    /// First byte of each view's lights.
    view_start: Vec<usize>,
    groups: Vec<Group>,
    stride: usize,
}

impl Arrangement {
    /// For these views, each with `lights` lights.
    pub fn new(views: &[Direction], lights: usize) -> Self {
        let cosines: Vec<f64> = views.iter().map(|view| libm::cos(view.theta_rad).max(0.0)).collect();
        let weights: Vec<u32> = cosines.iter().map(|cosine| (cosine * WEIGHT_ONE).round() as u32).collect();
        let mut order: Vec<usize> = (0..views.len()).collect();
        order.sort_by_key(|&view| (std::cmp::Reverse(weights[view]), view));
        let (mut view_start, mut groups, mut at) = (vec![0; views.len()], Vec::new(), 0);
        for group in order.chunk_by(|&a, &b| weights[a] == weights[b]) {
            let start = at;
            for &view in group {
                view_start[view] = at;
                at += lights;
            }
            at = at.next_multiple_of(LANE_BYTES);
            groups.push(Group { weight: weights[group[0]], start, end: at });
        }
        Self { cosines, lights, view_start, groups, stride: at }
    }

    /// cos(theta_v) of each view.
    pub fn cosines(&self) -> &[f64] {
        &self.cosines
    }

    /// Number of lights.
    pub fn lights(&self) -> usize {
        self.lights
    }

    /// Bytes of a vector, padding included.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The groups of equal weight.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Sum of all weights: a distance over it is a mean weighted difference in codes.
    pub fn weight_sum(&self) -> u64 {
        let weight_of = |view: &usize| {
            self.groups.iter().find(|g| (g.start..g.end).contains(view)).map_or(0, |g| g.weight)
        };
        self.view_start.iter().map(|start| u64::from(weight_of(start)) * self.lights as u64).sum()
    }

    /// A distance in L* units: the weighted mean absolute difference.
    pub(crate) fn mean_lightness(&self, distance: u64) -> f64 {
        distance as f64 / self.weight_sum().max(1) as f64 / 2.55
    }

    /// Puts the codes of one view [texel, light] into the vectors of all texels [texel, stride].
    pub fn insert_view(&self, vectors: &mut [u8], view: usize, codes: &[u8]) {
        let start = self.view_start[view];
        for (vector, codes) in vectors.chunks_exact_mut(self.stride).zip(codes.chunks_exact(self.lights)) {
            vector[start..start + self.lights].copy_from_slice(codes);
        }
    }

    /// Puts together the vector of the texel at `place` in windows of all views, each [texel, light].
    pub(crate) fn gather(&self, vector: &mut [u8], views: &[Vec<u8>], place: usize) {
        for (&start, codes) in self.view_start.iter().zip(views) {
            let codes = &codes[place * self.lights..(place + 1) * self.lights];
            vector[start..start + self.lights].copy_from_slice(codes);
        }
    }

    /// Vectors [n, stride] in the plain order [n, view, light].
    pub fn plain(&self, vectors: &[u8]) -> Vec<u8> {
        let mut plain = Vec::with_capacity(vectors.len());
        for vector in vectors.chunks_exact(self.stride) {
            for &start in &self.view_start {
                plain.extend_from_slice(&vector[start..start + self.lights]);
            }
        }
        plain
    }

    /// Vectors [n, stride] from codes in the plain order [n, view, light].
    pub(crate) fn arranged(&self, plain: &[u8]) -> Vec<u8> {
        let brdf = self.view_start.len() * self.lights;
        let mut vectors = vec![0; plain.len() / brdf * self.stride];
        for (vector, plain) in vectors.chunks_exact_mut(self.stride).zip(plain.chunks_exact(brdf)) {
            for (&start, codes) in self.view_start.iter().zip(plain.chunks_exact(self.lights)) {
                vector[start..start + self.lights].copy_from_slice(codes);
            }
        }
        vectors
    }
}

/// BRDFs in memory.
pub struct Points {
    /// Where directions lie in a vector.
    pub arrangement: Arrangement,
    /// Vectors [texel, stride].
    pub vectors: Vec<u8>,
}

impl Points {
    /// Number of texels.
    pub fn len(&self) -> usize {
        self.vectors.len() / self.arrangement.stride
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// The vector of a texel.
    pub fn vector(&self, texel: usize) -> &[u8] {
        let stride = self.arrangement.stride;
        &self.vectors[texel * stride..(texel + 1) * stride]
    }

    /// The vectors of some texels, one after another.
    pub fn vectors_of(&self, texels: &[u32]) -> Vec<u8> {
        texels.iter().flat_map(|&texel| self.vector(texel as usize)).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_of_one_elevation_share_a_group_and_the_plain_order_comes_back() {
        let views = [(60.0, 0.0), (0.0, 0.0), (60.0, 90.0)].map(|(t, p)| Direction::from_degrees(t, p));
        let arrangement = Arrangement::new(&views, 5);
        assert_eq!(
            arrangement.groups(),
            [Group { weight: 65536, start: 0, end: 64 }, Group { weight: 32768, start: 64, end: 128 }]
        );
        assert_eq!(arrangement.weight_sum(), 5 * (65536 + 2 * 32768));
        let mut vectors = vec![0; 2 * arrangement.stride()];
        let codes = |view: usize| -> Vec<u8> { (0..10).map(|n| (view * 10 + n) as u8).collect() };
        for view in 0..3 {
            arrangement.insert_view(&mut vectors, view, &codes(view));
        }
        let expected: Vec<u8> =
            (0..2).flat_map(|t| (0..3).flat_map(move |v| (0..5).map(move |l| v * 10 + t * 5 + l))).collect();
        assert_eq!(arrangement.plain(&vectors), expected);
        assert_eq!(arrangement.arranged(&expected), vectors);
    }
}

//! The choice of (25): row by row, of each texel's candidates the one whose cluster is nearest by D
//! to the clusters chosen at its left and above.

use crate::texel::nearest::Neighbour;

/// What a new index is chosen with: the tile's index and the distances of its clusters.
pub struct Scan {
    /// Cluster of each tile texel.
    index: Vec<u16>,
    /// D of (26), row by row, in L* units.
    distance: Vec<f32>,
    clusters: usize,
}

impl Scan {
    /// `index` is I of the tile, `distance` the square D of (26).
    pub fn new(index: Vec<u16>, distance: Vec<f32>) -> Self {
        let clusters = distance.len().isqrt();
        Self { index, distance, clusters }
    }

    /// The cluster of a source texel.
    pub fn cluster(&self, texel: u32) -> u16 {
        self.index[texel as usize]
    }

    /// Cost of a cluster beside another: D as stored; sums of two are exact in f64.
    fn cost(&self, cluster: u16, neighbour: u16) -> f64 {
        f64::from(self.distance[usize::from(cluster) * self.clusters + usize::from(neighbour)])
    }

    /// Chooses a row: `candidates` holds those of each texel one after another, nearest normal first;
    /// `above` the clusters of the previous row, if any; `sources` receives the tile texel chosen.
    ///
    /// Ties go to the nearest normal. Where a neighbour does not exist only the other counts; the very
    /// first texel takes the nearest normal.
    pub fn choose_row(&self, candidates: &[Neighbour], above: Option<&[u16]>, sources: &mut [u32]) {
        let per_texel = candidates.len() / sources.len();
        let mut left = None;
        for (x, (candidates, source)) in candidates.chunks_exact(per_texel).zip(sources).enumerate() {
            let up = above.map(|row| row[x]);
            let cost = |candidate: &Neighbour| {
                let cluster = self.cluster(candidate.texel);
                left.map_or(0.0, |left| self.cost(cluster, left))
                    + up.map_or(0.0, |up| self.cost(cluster, up))
            };
            let (mut best, mut least) = (0, f64::INFINITY);
            for (rank, candidate) in candidates.iter().enumerate() {
                let cost = cost(candidate);
                if cost < least {
                    (best, least) = (rank, cost);
                }
            }
            *source = candidates[best].texel;
            left = Some(self.cluster(*source));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three clusters in a row: D(0, 1) = 1, D(1, 2) = 1, D(0, 2) = 2. Texel number = cluster.
    fn scan() -> Scan {
        Scan::new(vec![0, 1, 2], vec![0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.0])
    }

    fn candidates(texels: &[u32]) -> Vec<Neighbour> {
        texels.iter().map(|&texel| Neighbour { distance: 0.0, texel }).collect()
    }

    #[test]
    fn the_first_texel_takes_the_nearest_normal_and_the_row_follows_it() {
        let mut sources = [9; 3];
        scan().choose_row(&candidates(&[2, 0, 0, 1, 0, 2]), None, &mut sources);
        assert_eq!(sources, [2, 1, 0]);
    }

    #[test]
    fn both_neighbours_count_and_ties_go_to_the_nearest_normal() {
        let mut sources = [9; 2];
        // Second texel: left is 0, above is 2, so every cluster costs 2: the first candidate wins.
        scan().choose_row(&candidates(&[0, 0, 2, 1]), Some(&[0, 2]), &mut sources);
        assert_eq!(sources, [0, 2]);
    }
}

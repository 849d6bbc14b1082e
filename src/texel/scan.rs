//! The choice of (25): row by row, of each texel's candidates the one whose cluster is nearest by D
//! to the clusters chosen at its left and above.

/// What a new index is chosen with: the tile's index and the distances of its clusters.
pub struct Scan {
    /// Cluster of each tile texel.
    index: Vec<u16>,
    /// D of (26) transposed, in L* units: row by row for each neighbour what each cluster costs beside it.
    costs: Vec<f32>,
    clusters: usize,
}

/// The clusters that are already chosen around a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Neighbours<'a> {
    /// The row above.
    pub above: Option<&'a [u16]>,
    /// The row below: that the first, where the output wraps and the row is its last.
    pub below: Option<&'a [u16]>,
    /// Whether the last texel also lies at the left of the first.
    pub wraps: bool,
}

impl Scan {
    /// `index` is I of the tile, `distance` the square D of (26).
    pub fn new(index: Vec<u16>, distance: &[f32]) -> Self {
        let clusters = distance.len().isqrt();
        let costs = (0..clusters)
            .flat_map(|neighbour| (0..clusters).map(move |cluster| distance[cluster * clusters + neighbour]));
        Self { index, costs: costs.collect(), clusters }
    }

    /// The cluster of a source texel.
    #[inline]
    pub fn cluster(&self, texel: u32) -> u16 {
        self.index[texel as usize]
    }

    /// What each cluster costs beside a neighbour.
    #[inline]
    fn costs(&self, neighbour: u16) -> &[f32] {
        &self.costs[usize::from(neighbour) * self.clusters..][..self.clusters]
    }

    /// Chooses a row: `candidates` holds those of each texel one after another, nearest normal first;
    /// `sources` receives the tile texel chosen.
    ///
    /// Costs of the neighbours that exist are added in f64: left, above, right, below. Ties go to the nearest
    /// normal; so does a texel without neighbours.
    pub fn choose_row(&self, candidates: &[u32], neighbours: Neighbours<'_>, sources: &mut [u32]) {
        let per_texel = candidates.len() / sources.len();
        let last = sources.len() - 1;
        let mut left: Option<u16> = None;
        let mut first = None;
        for (x, (candidates, source)) in candidates.chunks_exact(per_texel).zip(sources).enumerate() {
            let right = first.filter(|_| neighbours.wraps && x == last);
            let around =
                [left, neighbours.above.map(|row| row[x]), right, neighbours.below.map(|row| row[x])];
            let costs = around.map(|neighbour| neighbour.map(|neighbour| self.costs(neighbour)));
            let (mut best, mut least) = (candidates[0], f64::INFINITY);
            for &candidate in candidates {
                let cluster = usize::from(self.cluster(candidate));
                let cost = costs.iter().flatten().map(|costs| f64::from(costs[cluster])).sum();
                if cost < least {
                    (best, least) = (candidate, cost);
                }
            }
            *source = best;
            left = Some(self.cluster(best));
            first = first.or(left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three clusters in a row: D(0, 1) = 1, D(1, 2) = 1, D(0, 2) = 2. Texel number = cluster.
    fn scan() -> Scan {
        Scan::new(vec![0, 1, 2], &[0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.0])
    }

    #[test]
    fn the_first_texel_takes_the_nearest_normal_and_the_row_follows_it() {
        let mut sources = [9; 3];
        scan().choose_row(&[2, 0, 0, 1, 0, 2], Neighbours::default(), &mut sources);
        assert_eq!(sources, [2, 1, 0]);
    }

    #[test]
    fn both_neighbours_count_and_ties_go_to_the_nearest_normal() {
        let mut sources = [9; 2];
        // Second texel: left is 0, above is 2, so every cluster costs 2: the first candidate wins.
        let neighbours = Neighbours { above: Some(&[0, 2]), ..Neighbours::default() };
        scan().choose_row(&[0, 0, 2, 1], neighbours, &mut sources);
        assert_eq!(sources, [0, 2]);
    }

    #[test]
    fn where_the_output_wraps_the_last_column_is_beside_the_first_and_the_last_row_above_the_first() {
        let mut sources = [9; 3];
        let wraps = Neighbours { wraps: true, ..Neighbours::default() };
        // Third texel: left is 0, right is the first column's 2, so all cost 2: the first candidate wins. Without the
        // wrap it would be 0.
        scan().choose_row(&[2, 2, 0, 0, 1, 0], wraps, &mut sources);
        assert_eq!(sources, [2, 0, 1]);
        // Of the first texel only the row below counts.
        scan().choose_row(&[2, 1, 0, 1], Neighbours { below: Some(&[0, 1]), ..wraps }, &mut sources[..2]);
        assert_eq!(sources[..2], [1, 1]);
    }

    #[test]
    fn an_asymmetric_distance_is_read_by_cluster_then_neighbour() {
        // D(1, 0) = 5, D(0, 1) = 1; D(0, 0) = 2.
        let scan = Scan::new(vec![0, 1], &[2.0, 1.0, 5.0, 9.0]);
        let mut sources = [9; 2];
        scan.choose_row(&[0, 0, 1, 0], Neighbours::default(), &mut sources);
        assert_eq!(sources, [0, 0]);
    }
}

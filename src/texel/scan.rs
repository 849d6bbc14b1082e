//! The choice of (25): row by row, of each texel's candidates the one whose cluster is nearest by D
//! to the clusters chosen at its left and above.

/// What a new index is chosen with: the tile's index and the distances of its clusters.
pub struct Scan {
    /// Cluster of each tile texel.
    index: Vec<u16>,
    /// D of (26) transposed, in L* units: row by row for each neighbour what each cluster costs beside it. A last row of
    /// zeros is for a neighbour that does not exist.
    costs: Vec<f32>,
    clusters: usize,
}

/// Candidates that are compared at once.
const SIXTEEN: usize = 16;

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
    /// `index` is I of the tile, `distance` the square D of (26), finite numbers from 0 on.
    pub fn new(index: Vec<u16>, distance: &[f32]) -> Self {
        let clusters = distance.len().isqrt();
        let costs = (0..clusters)
            .flat_map(|neighbour| (0..clusters).map(move |cluster| distance[cluster * clusters + neighbour]));
        Self { index, costs: costs.chain(std::iter::repeat_n(0.0, clusters)).collect(), clusters }
    }

    /// The cluster of a source texel.
    #[inline]
    pub fn cluster(&self, texel: u32) -> u16 {
        self.index[texel as usize]
    }

    /// What each cluster costs beside a neighbour, if there is one.
    #[inline]
    fn costs(&self, neighbour: Option<u16>) -> &[f32] {
        &self.costs[neighbour.map_or(self.clusters, usize::from) * self.clusters..][..self.clusters]
    }

    /// Chooses a row: `candidates` holds those of each texel one after another, nearest normal first;
    /// `sources` receives the tile texel chosen.
    ///
    /// Costs of the neighbours that exist are added in f64. Ties go to the nearest normal; so does a texel without
    /// neighbours.
    pub fn choose_row(&self, candidates: &[u32], neighbours: Neighbours<'_>, sources: &mut [u32]) {
        let Some(last) = sources.len().checked_sub(1) else { return };
        let per_texel = candidates.len() / sources.len();
        let (mut left, mut first) = (None, None);
        for (x, (candidates, source)) in candidates.chunks_exact(per_texel).zip(sources).enumerate() {
            let [above, below] = [neighbours.above, neighbours.below].map(|row| row.map(|row| row[x]));
            let right = first.filter(|_| neighbours.wraps && x == last);
            *source = match (candidates.try_into(), right, below) {
                (Ok(sixteen), None, None) => self.choose_of_sixteen(sixteen, left, above),
                _ => self.choose(candidates, [left, above, right, below]),
            };
            left = Some(self.cluster(*source));
            first = first.or(left);
        }
    }

    /// The first of the candidates with the least cost.
    fn choose(&self, candidates: &[u32], around: [Option<u16>; 4]) -> u32 {
        let around = around.map(|neighbour| self.costs(neighbour));
        let (mut best, mut least) = (candidates[0], f64::INFINITY);
        for &candidate in candidates {
            let cluster = usize::from(self.cluster(candidate));
            let cost = around.iter().map(|costs| f64::from(costs[cluster])).sum();
            if cost < least {
                (best, least) = (candidate, cost);
            }
        }
        best
    }

    /// The same of sixteen between two neighbours, of which the serial scan has nearly all to do.
    ///
    /// Rounding keeps order: what costs least costs least in f32 too. Only where several do are their costs told apart
    /// in f64.
    #[inline]
    fn choose_of_sixteen(&self, candidates: &[u32; SIXTEEN], left: Option<u16>, above: Option<u16>) -> u32 {
        let [left, above] = [left, above].map(|neighbour| &self.costs(neighbour)[..self.clusters]);
        let mut clusters = [0; SIXTEEN];
        let mut costs = [0.0; SIXTEEN];
        for ((cluster, cost), &candidate) in clusters.iter_mut().zip(&mut costs).zip(candidates) {
            *cluster = usize::from(self.cluster(candidate));
            *cost = left[*cluster] + above[*cluster];
        }
        // Four minima, so that none waits for all others.
        let less = |a: f32, b: f32| if a < b { a } else { b };
        let mut least = [f32::INFINITY; 4];
        for (rank, &cost) in costs.iter().enumerate() {
            least[rank % 4] = less(cost, least[rank % 4]);
        }
        let least = less(less(least[0], least[1]), less(least[2], least[3]));
        let mut ties = costs
            .iter()
            .enumerate()
            .fold(0_u32, |ties, (rank, &cost)| ties | u32::from(cost == least) << rank);
        let exactly = |rank: usize| f64::from(left[clusters[rank]]) + f64::from(above[clusters[rank]]);
        let mut best = ties.trailing_zeros() as usize % SIXTEEN;
        let mut least = exactly(best);
        ties &= ties.wrapping_sub(1);
        while ties != 0 {
            let rank = ties.trailing_zeros() as usize;
            if exactly(rank) < least {
                (best, least) = (rank, exactly(rank));
            }
            ties &= ties - 1;
        }
        candidates[best]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

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
    fn costs_are_compared_exactly_for_any_number_of_candidates() {
        const CLUSTERS: u32 = 40;
        let hash = Hash::new(6, 0);
        let index: Vec<u16> = (0..500).map(|texel| hash.below(CLUSTERS.into(), texel, 0, 0) as u16).collect();
        // Distances of very different size: sums of two are exact in f64.
        let distance: Vec<f32> = (0..CLUSTERS * CLUSTERS)
            .map(|n| (100.0 * hash.uniforms(n, 1, 0)[0].powi(1 + n as i32 % 9)) as f32)
            .collect();
        let scan = Scan::new(index.clone(), &distance);
        for count in [1, 3, 16, 17, 35] {
            let candidates: Vec<u32> = (0..60 * count).map(|n| hash.below(500, n, 2, count) as u32).collect();
            let above: Vec<u16> = (0..60).map(|x| hash.below(CLUSTERS.into(), x, 3, 0) as u16).collect();
            let mut sources = [9; 60];
            let neighbours = Neighbours { above: Some(&above), ..Neighbours::default() };
            scan.choose_row(&candidates, neighbours, &mut sources);
            let mut left = None;
            for ((candidates, &source), &up) in candidates.chunks(count as usize).zip(&sources).zip(&above) {
                let cost = |candidate: &&u32| {
                    let row = usize::from(index[**candidate as usize]) * CLUSTERS as usize;
                    let beside = |neighbour: u16| f64::from(distance[row + usize::from(neighbour)]);
                    left.map_or(0.0, beside) + beside(up)
                };
                let least = candidates.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
                assert_eq!(Some(&source), least);
                left = Some(index[source as usize]);
            }
        }
    }

    #[test]
    fn costs_that_are_equal_in_f32_only_are_told_apart() {
        // Beside 0 and 3, 1 costs 2^24 + 1 and 2 costs 2^24 + 1/2: both are 2^24 in f32.
        let mut distance = [0.0; 16];
        (distance[4], distance[8], distance[4 + 3], distance[8 + 3]) = (16_777_216.0, 16_777_216.0, 1.0, 0.5);
        let scan = Scan::new(vec![0, 1, 2, 3], &distance);
        let candidates: Vec<u32> = [0; 16].into_iter().chain([1; 15]).chain([2]).collect();
        let mut sources = [9; 2];
        let neighbours = Neighbours { above: Some(&[0, 3]), ..Neighbours::default() };
        scan.choose_row(&candidates, neighbours, &mut sources);
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

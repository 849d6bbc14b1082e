//! The choice of (25): row by row, of each texel's candidates the one whose cluster is nearest by D
//! to the clusters chosen at its left and above.

/// What a new index is chosen with: the tile's index and the distances of its clusters.
pub struct Scan {
    /// Cluster of each tile texel.
    index: Vec<u16>,
    /// D of (26) transposed: row by row for each neighbour what each cluster costs beside it. A last row of zeros is
    /// for a neighbour that does not exist.
    costs: Vec<u64>,
    clusters: usize,
}

/// Candidates compared at a time.
const TOGETHER: usize = 16;

/// Costs are whole numbers, multiples of this: below there is room for the rank of a candidate.
const COST: u64 = TOGETHER as u64;

/// Bits of the greatest cost without those of the rank: four may be added.
const COST_BITS: i32 = 57;

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
    ///
    /// Distances become whole numbers, of which the greatest has 57 bits: a distance of f32 keeps all its bits unless
    /// it is 2^33 times smaller than the greatest, and sums are exact.
    pub fn new(index: Vec<u16>, distance: &[f32]) -> Self {
        let clusters = distance.len().isqrt();
        let greatest = distance.iter().copied().filter(|distance| distance.is_finite()).fold(0.0, f32::max);
        let scale = f64::from(COST_BITS - f64::from(greatest).log2().ceil().max(-200.0) as i32).exp2();
        let cost = |distance: f32| (f64::from(distance.min(greatest)) * scale) as u64 * COST;
        let costs = (0..clusters)
            .flat_map(|neighbour| (0..clusters).map(move |cluster| distance[cluster * clusters + neighbour]));
        let costs = costs.map(cost).chain(std::iter::repeat_n(0, clusters)).collect();
        Self { index, costs, clusters }
    }

    /// The cluster of a source texel.
    #[inline]
    pub fn cluster(&self, texel: u32) -> u16 {
        self.index[texel as usize]
    }

    /// What each cluster costs beside a neighbour, if there is one.
    #[inline]
    fn costs(&self, neighbour: Option<u16>) -> &[u64] {
        &self.costs[neighbour.map_or(self.clusters, usize::from) * self.clusters..][..self.clusters]
    }

    /// Chooses a row: `candidates` holds those of each texel one after another, nearest normal first;
    /// `sources` receives the tile texel chosen.
    ///
    /// Costs of the neighbours that exist are added. Ties go to the nearest normal; so does a texel without neighbours.
    pub fn choose_row(&self, candidates: &[u32], neighbours: Neighbours<'_>, sources: &mut [u32]) {
        let Some(last) = sources.len().checked_sub(1) else { return };
        let (candidates, last_candidates) = candidates.split_at(candidates.len() / sources.len() * last);
        let (sources, last_source) = sources.split_at_mut(last);
        let above = |x: usize| self.costs(neighbours.above.map(|row| row[x]));
        let below = |x: usize| self.costs(neighbours.below.map(|row| row[x]));
        let left = match neighbours.below {
            None => self.choose_run(candidates, None, |x| [above(x)], sources),
            Some(_) => self.choose_run(candidates, None, |x| [above(x), below(x)], sources),
        };
        let right = sources.first().filter(|_| neighbours.wraps).map(|&first| self.cluster(first));
        let around = |_| [above(last), self.costs(right), below(last)];
        self.choose_run(last_candidates, left, around, last_source);
    }

    /// Chooses for texels that follow each other, the first of which is right of `left`; `around` gives the costs
    /// beside other neighbours. Returns the cluster of the last.
    #[inline]
    fn choose_run<'a, const N: usize>(
        &self,
        candidates: &[u32],
        mut left: Option<u16>,
        around: impl Fn(usize) -> [&'a [u64]; N],
        sources: &mut [u32],
    ) -> Option<u16> {
        let per_texel = candidates.len() / sources.len().max(1);
        for (x, source) in sources.iter_mut().enumerate() {
            // Of one length, so that one check is enough.
            let around = around(x).map(|costs| &costs[..self.clusters]);
            let left_costs = &self.costs(left)[..self.clusters];
            let mut best = (u64::MAX, 0);
            for candidates in candidates[x * per_texel..][..per_texel].chunks(TOGETHER) {
                let mut least = u64::MAX;
                for (rank, &candidate) in candidates.iter().enumerate() {
                    let cluster = usize::from(self.cluster(candidate));
                    let cost: u64 = around.iter().map(|costs| costs[cluster]).sum();
                    least = least.min(cost + left_costs[cluster] + rank as u64);
                }
                if least / COST < best.0 {
                    best = (least / COST, candidates[(least % COST) as usize]);
                }
            }
            *source = best.1;
            left = Some(self.cluster(best.1));
        }
        left
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

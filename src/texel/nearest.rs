//! The n_k nearest normals of the tile, exactly: by squared Euclidean distance of the stored f32
//! vectors in f64, summed x, y, z; ties by texel number.

/// A texel and its squared distance from a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Squared distance.
    pub distance: f64,
    /// Texel number in the tile.
    pub texel: u32,
}

impl Neighbour {
    fn precedes(&self, other: &Self) -> bool {
        self.distance < other.distance || (self.distance == other.distance && self.texel < other.texel)
    }
}

/// Most points of a leaf.
const LEAF: usize = 24;

/// A k-d tree over normals.
pub struct NearestNormals {
    /// Points in the order of the leaves.
    points: Vec<([f64; 3], u32)>,
    nodes: Vec<Node>,
}

struct Node {
    low: [f64; 3],
    high: [f64; 3],
    start: usize,
    end: usize,
    /// Numbers of the two halves; none in a leaf.
    halves: Option<[usize; 2]>,
}

impl NearestNormals {
    /// Over the normals of a tile; their order gives the texel numbers.
    pub fn new(normals: &[[f32; 3]]) -> Self {
        let points: Vec<_> =
            normals.iter().enumerate().map(|(texel, n)| (n.map(f64::from), texel as u32)).collect();
        let count = points.len();
        let mut tree = Self { points, nodes: Vec::new() };
        tree.split(0, count);
        tree
    }

    /// Builds the node of a range of points and returns its number.
    fn split(&mut self, start: usize, end: usize) -> usize {
        let range = &mut self.points[start..end];
        let bound = |pick: fn(f64, f64) -> f64, from: f64| -> [f64; 3] {
            std::array::from_fn(|axis| range.iter().fold(from, |bound, (point, _)| pick(bound, point[axis])))
        };
        let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let number = self.nodes.len();
        self.nodes.push(Node { low, high, start, end, halves: None });
        let widest = (0..3).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        if end - start > LEAF && high[widest] > low[widest] {
            let middle = range.len() / 2;
            range.select_nth_unstable_by(middle, |a, b| {
                a.0[widest].total_cmp(&b.0[widest]).then(a.1.cmp(&b.1))
            });
            let halves = [self.split(start, start + middle), self.split(start + middle, end)];
            self.nodes[number].halves = Some(halves);
        }
        number
    }

    /// Fills `found` with the nearest normals, nearest first. There must be at least `found.len()` normals.
    pub fn find(&self, query: [f32; 3], found: &mut [Neighbour]) {
        found.fill(Neighbour { distance: f64::INFINITY, texel: u32::MAX });
        if !found.is_empty() && !self.points.is_empty() {
            self.visit(0, query.map(f64::from), found);
        }
    }

    fn visit(&self, number: usize, query: [f64; 3], found: &mut [Neighbour]) {
        let node = &self.nodes[number];
        match node.halves {
            None => {
                for &(point, texel) in &self.points[node.start..node.end] {
                    insert(found, Neighbour { distance: squared_distance(query, point), texel });
                }
            }
            Some([a, b]) => {
                let (to_a, to_b) = (self.nodes[a].distance(query), self.nodes[b].distance(query));
                let order = if to_a <= to_b { [(a, to_a), (b, to_b)] } else { [(b, to_b), (a, to_a)] };
                for (half, distance) in order {
                    // At equal distance a smaller texel number may still win.
                    if distance <= found[found.len() - 1].distance {
                        self.visit(half, query, found);
                    }
                }
            }
        }
    }
}

impl Node {
    /// Squared distance to the box: never more than that to a point in it, rounding included,
    /// since every step of the sum is monotone.
    fn distance(&self, query: [f64; 3]) -> f64 {
        squared_distance(
            query,
            std::array::from_fn(|axis| query[axis].clamp(self.low[axis], self.high[axis])),
        )
    }
}

/// Squared Euclidean distance, summed x, y, z.
#[inline]
pub fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (x, y, z) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    x * x + y * y + z * z
}

#[inline]
fn insert(found: &mut [Neighbour], neighbour: Neighbour) {
    let last = found.len() - 1;
    if !neighbour.precedes(&found[last]) {
        return;
    }
    let mut place = last;
    while place > 0 && neighbour.precedes(&found[place - 1]) {
        found[place] = found[place - 1];
        place -= 1;
    }
    found[place] = neighbour;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn the_tree_finds_what_brute_force_finds_ties_included() {
        let hash = Hash::new(3, 0);
        // Coarsely rounded, so that many normals and distances coincide.
        let vector = |n: u32, domain: u32| {
            let u = hash.normals(n, domain, 0);
            let [x, y] = [0, 1].map(|k| (u[k] * 4.0).round() as f32 / 16.0);
            [x, y, 1.0]
        };
        let normals: Vec<[f32; 3]> = (0..3000).map(|n| vector(n, 0)).collect();
        let tree = NearestNormals::new(&normals);
        for q in 0..300 {
            let query = vector(q, 1);
            let mut all: Vec<Neighbour> = (0..normals.len() as u32)
                .map(|texel| Neighbour {
                    distance: squared_distance(query.map(f64::from), normals[texel as usize].map(f64::from)),
                    texel,
                })
                .collect();
            all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.texel.cmp(&b.texel)));
            let mut found = [Neighbour { distance: 0.0, texel: 0 }; 16];
            tree.find(query, &mut found);
            assert_eq!(found[..], all[..16]);
        }
    }
}

//! A k-d tree: finds the nearest normals of any vector, and all normals of a ball.

/// A point and its squared distance from a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Squared distance, summed x, y, z; infinite where it is not a number.
    pub distance: f64,
    /// Number of the point.
    pub point: u32,
}

impl Neighbour {
    /// Of a point that lies nowhere in particular: no neighbour comes after it.
    pub const NONE: Self = Self { distance: f64::INFINITY, point: u32::MAX };

    /// Whether this one is nearer, or as near with a smaller number.
    #[inline]
    fn precedes(&self, other: &Self) -> bool {
        self.distance < other.distance || (self.distance == other.distance && self.point < other.point)
    }

    /// Puts the neighbour in its place among some that are in order, the last of which drops out.
    #[inline]
    pub fn insert(self, found: &mut [Self]) {
        let last = found.len() - 1;
        if !self.precedes(&found[last]) {
            return;
        }
        let mut place = last;
        while place > 0 && self.precedes(&found[place - 1]) {
            found[place] = found[place - 1];
            place -= 1;
        }
        found[place] = self;
    }
}

/// Squared Euclidean distance in f64, summed x, y, z.
#[inline]
pub(crate) fn squared_distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| f64::from(a[axis]) - f64::from(b[axis]));
    (x * x + y * y + z * z).min(f64::INFINITY) // what is not a number becomes infinite
}

/// Most points of a leaf.
const LEAF: usize = 24;

/// The tree.
pub struct Tree {
    /// Points in the order of the leaves, with their numbers.
    points: Vec<([f32; 3], u32)>,
    nodes: Vec<Node>,
}

struct Node {
    low: [f32; 3],
    high: [f32; 3],
    start: u32,
    end: u32,
    /// Numbers of the two halves; none in a leaf.
    halves: Option<[u32; 2]>,
}

impl Tree {
    /// Over numbered points; there may be none.
    pub fn new(points: Vec<([f32; 3], u32)>) -> Self {
        let count = points.len();
        let mut tree = Self { points, nodes: Vec::new() };
        tree.split(0, count);
        tree
    }

    /// Builds the node of a range of points and returns its number.
    fn split(&mut self, start: usize, end: usize) -> u32 {
        let range = &mut self.points[start..end];
        let bound = |pick: fn(f32, f32) -> f32, from: f32| -> [f32; 3] {
            std::array::from_fn(|axis| range.iter().fold(from, |bound, (point, _)| pick(bound, point[axis])))
        };
        let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        let number = self.nodes.len();
        self.nodes.push(Node { low, high, start: start as u32, end: end as u32, halves: None });
        let widest = (0..3).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        if end - start > LEAF && high[widest] > low[widest] {
            let middle = range.len() / 2;
            range.select_nth_unstable_by(middle, |a, b| {
                a.0[widest].total_cmp(&b.0[widest]).then(a.1.cmp(&b.1))
            });
            let halves = [self.split(start, start + middle), self.split(start + middle, end)];
            self.nodes[number].halves = Some(halves);
        }
        number as u32
    }

    /// Fills `found`, which must not be empty, with the nearest points, nearest first, ties by number;
    /// [`Neighbour::NONE`] stands for those that are missing.
    pub fn find(&self, query: [f32; 3], found: &mut [Neighbour]) {
        found.fill(Neighbour::NONE);
        self.visit(0, query, found);
    }

    fn visit(&self, number: u32, query: [f32; 3], found: &mut [Neighbour]) {
        let node = &self.nodes[number as usize];
        match node.halves {
            None => {
                for &(at, point) in &self.points[node.start as usize..node.end as usize] {
                    Neighbour { distance: squared_distance(query, at), point }.insert(found);
                }
            }
            Some([a, b]) => {
                let [to_a, to_b] = [a, b].map(|half| self.nodes[half as usize].distance(query));
                let order = if to_a <= to_b { [(a, to_a), (b, to_b)] } else { [(b, to_b), (a, to_a)] };
                for (half, distance) in order {
                    // At equal distance a smaller number may still win.
                    if distance <= found[found.len() - 1].distance {
                        self.visit(half, query, found);
                    }
                }
            }
        }
    }

    /// The points that `skip` does not rule out, in no particular order; it is asked of boxes, by their least and
    /// greatest coordinates, and of each point as a box of its own.
    pub fn collect(&self, skip: impl Fn([f32; 3], [f32; 3]) -> bool) -> Vec<([f32; 3], u32)> {
        let mut found = Vec::new();
        let mut open = vec![0];
        while let Some(number) = open.pop() {
            let node = &self.nodes[number as usize];
            if !skip(node.low, node.high) {
                match node.halves {
                    Some(halves) => open.extend(halves),
                    None => {
                        let points = &self.points[node.start as usize..node.end as usize];
                        found.extend(points.iter().filter(|&&(at, _)| !skip(at, at)));
                    }
                }
            }
        }
        found
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.points[..]) + size_of_val(&self.nodes[..])
    }
}

impl Node {
    /// Squared distance to the box: never more than that to a point in it, rounding included,
    /// since every step of the sum is monotone.
    fn distance(&self, query: [f32; 3]) -> f64 {
        squared_distance(query, nearest_of_box(query, self.low, self.high))
    }
}

/// The point of a box that is nearest to another.
#[inline]
pub(crate) fn nearest_of_box(to: [f32; 3], low: [f32; 3], high: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| to[axis].max(low[axis]).min(high[axis]))
}

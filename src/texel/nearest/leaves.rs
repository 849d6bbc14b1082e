//! A table over (x, y) of unit vectors: each entry leads to the few normals among which the nearest of every query
//! there are.
//!
//! A grid of cells covers the square around the unit circle; each cell has its own table of a power of two a side,
//! as fine as the densest normals in it call for. Squares of the table that need not be so fine share their
//! candidates.

use rayon::prelude::*;

use super::square::{Point, SLACK, Square};
use super::tree::Tree;
use crate::kernel::Kernel;
use crate::kernel::ranking::{CAPACITY, Candidates};

/// Cells on a side.
const GRID: usize = 64;

/// Most halvings of a cell's side.
const DEEPEST: u32 = 8;

/// Most halvings near the rim, where patches cannot be bounded.
const DEEPEST_AT_RIM: u32 = 3;

/// Fewest candidates for whose sake it is too early to compare each with all others.
const MANY: usize = 192;

/// Least radius of a patch in distances of the last neighbour: where there are still too many candidates, they lie
/// on each other.
const LEAST_RADIUS: f64 = 1.0 / 16.0;

/// Cells built at a time.
const TOGETHER: usize = 8;

/// Most bytes of tables and candidates.
const MOST_BYTES: usize = 32 << 20;

/// Tables and candidates.
pub(super) struct Leaves {
    cells: Vec<Cell>,
    /// Numbers in `candidates` by cell, row and column. Number 0 leads nowhere.
    table: Vec<u32>,
    candidates: Vec<Candidates>,
}

/// Where the table of a cell starts, and the logarithm of its side.
#[derive(Clone, Copy, Default)]
struct Cell {
    start: u32,
    depth: u32,
}

/// A square with its candidates, if they are few enough, or cut in four.
enum Node {
    Leaf(Option<Box<Candidates>>),
    Quarters(Box<[Node; 4]>),
}

impl Leaves {
    /// Over the points of a tree, for the `count` nearest. Cells come in the order of how many normals they hold:
    /// queries will be where normals are, and what does not fit the memory is left to the tree.
    pub(super) fn new(points: &[Point], tree: &Tree, count: usize, kernel: Kernel) -> Self {
        let mut leaves = Self {
            cells: vec![Cell::default(); GRID * GRID],
            table: vec![0],
            candidates: vec![Candidates::NONE],
        };
        let mut held = vec![0usize; GRID * GRID];
        for (normal, _) in points {
            if let Some((cell, _)) = locate(*normal) {
                held[cell] += 1;
            }
        }
        let mut order: Vec<usize> = (0..GRID * GRID).filter(|&cell| !square(cell).is_outside()).collect();
        order.sort_by_key(|&cell| std::cmp::Reverse(held[cell]));
        let search = Search { tree, count, kernel };
        for cells in order.chunks(TOGETHER) {
            let nodes: Vec<Node> =
                cells.par_iter().map(|&cell| search.refine(square(cell), None, 0)).collect();
            for (&cell, node) in cells.iter().zip(&nodes) {
                leaves.add(cell, node);
            }
            if leaves.memory_bytes() > MOST_BYTES {
                break;
            }
        }
        leaves
    }

    fn add(&mut self, cell: usize, node: &Node) {
        let depth = node.depth();
        let start = self.table.len();
        self.cells[cell] = Cell { start: start as u32, depth };
        self.table.resize(start + (1 << (2 * depth)), 0);
        self.fill(node, start, 1 << depth, 1 << depth);
    }

    /// Fills a square of a table from its first entry on; `stride` leads to the next row.
    fn fill(&mut self, node: &Node, first: usize, side: usize, stride: usize) {
        match node {
            Node::Leaf(None) => {}
            Node::Leaf(Some(candidates)) => {
                let number = self.candidates.len() as u32;
                self.candidates.push(Candidates::clone(candidates));
                for row in 0..side {
                    self.table[first + row * stride..][..side].fill(number);
                }
            }
            Node::Quarters(quarters) => {
                let half = side / 2;
                let firsts = [first, first + half, first + half * stride, first + half * stride + half];
                for (node, first) in quarters.iter().zip(firsts) {
                    self.fill(node, first, half, stride);
                }
            }
        }
    }

    /// The candidates for a query; none if it is not of unit length, has z <= 0 or lies where there is no table.
    #[inline]
    pub(super) fn find(&self, query: [f32; 3]) -> &Candidates {
        let [x, y, z] = query;
        // Of a unit vector with the same x and y, the query's z is off by at most this surplus over z. Half the slack
        // is left for rounding.
        let surplus = (x * x + y * y + z * z - 1.0).abs();
        let entry = match locate(query) {
            Some((cell, [column, row])) if surplus <= z * (0.5 * SLACK) => {
                let Cell { start, depth } = self.cells[cell];
                let side = (1 << depth) as f32;
                start as usize + (((row * side) as usize) << depth) + (column * side) as usize
            }
            _ => 0,
        };
        &self.candidates[self.table[entry] as usize]
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.cells[..]) + size_of_val(&self.table[..]) + size_of_val(&self.candidates[..])
    }
}

/// The cell of a vector and where in it, in 0..1 by x and y.
#[inline]
fn locate([x, y, _]: [f32; 3]) -> Option<(usize, [f32; 2])> {
    let [x, y] = [x, y].map(|component| (component + 1.0) * (GRID / 2) as f32);
    let inside = |place: f32| (0.0..GRID as f32).contains(&place);
    let (column, row) = (x as usize, y as usize);
    (inside(x) && inside(y)).then(|| (row * GRID + column, [x - column as f32, y - row as f32]))
}

fn square(cell: usize) -> Square {
    let side = 2.0 / GRID as f32;
    let [x, y] = [cell % GRID, cell / GRID].map(|place| place as f32 * side - 1.0);
    Square { x, y, side }
}

/// What is needed to find candidates.
struct Search<'a> {
    tree: &'a Tree,
    count: usize,
    kernel: Kernel,
}

impl Search<'_> {
    /// Cuts a square until candidates are few; `among` are points that hold them all, if such are known.
    fn refine(&self, square: Square, among: Option<&[Point]>, depth: u32) -> Node {
        let Some(patch) = square.patch() else {
            return if depth < DEEPEST_AT_RIM && !square.is_outside() {
                self.cut(square, None, depth)
            } else {
                Node::Leaf(None)
            };
        };
        let Some((mut points, last)) = (match among {
            None => patch.of_tree(self.tree, self.count),
            Some(points) => patch.of_points(points, self.count),
        }) else {
            return Node::Leaf(None);
        };
        if points.len() <= MANY {
            patch.without_preceded(&mut points, self.count, self.kernel);
        }
        if points.len() <= CAPACITY {
            Node::Leaf(Some(Box::new(Candidates::new(points))))
        } else if depth < DEEPEST && patch.radius > LEAST_RADIUS * last {
            self.cut(square, Some(&points), depth)
        } else {
            Node::Leaf(None)
        }
    }

    fn cut(&self, square: Square, among: Option<&[Point]>, depth: u32) -> Node {
        Node::Quarters(Box::new(square.quarters().map(|quarter| self.refine(quarter, among, depth + 1))))
    }
}

impl Node {
    /// Most halvings.
    fn depth(&self) -> u32 {
        match self {
            Self::Leaf(_) => 0,
            Self::Quarters(quarters) => 1 + quarters.iter().map(Self::depth).max().unwrap_or(0),
        }
    }
}

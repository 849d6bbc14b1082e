//! The search for candidates: squares are cut until few normals can be among the nearest of their queries.

use super::square::{Point, Square};
use super::tree::Tree;
use crate::kernel::Kernel;
use crate::kernel::ranking::{CAPACITY, Candidates};

/// Most halvings of a side.
pub(super) const DEEPEST: u32 = 14;

/// Most halvings near the rim, where patches cannot be bounded and normals are few.
const DEEPEST_AT_RIM: u32 = 6;

/// Least radius of a patch in distances of the last neighbour: where there are still too many candidates, they lie
/// on each other.
const LEAST_RADIUS: f64 = 1.0 / 16.0;

/// A square with its candidates, if they are few enough, or cut in four.
pub(super) enum Node {
    Leaf(Option<Box<Candidates>>),
    Quarters(Box<[Node; 4]>),
}

impl Node {
    /// Most halvings.
    pub(super) fn depth(&self) -> u32 {
        match self {
            Self::Leaf(_) => 0,
            Self::Quarters(quarters) => 1 + quarters.iter().map(Self::depth).max().unwrap_or(0),
        }
    }
}

/// What candidates are sought with.
pub(super) struct Search<'a> {
    pub tree: &'a Tree,
    /// How many of the nearest are wanted.
    pub count: usize,
    pub kernel: Kernel,
}

impl Search<'_> {
    /// Cuts a square until candidates are few.
    pub(super) fn refine(&self, square: Square) -> Node {
        self.refine_among(square, None)
    }

    /// `among` are points that hold all candidates, if such are known.
    fn refine_among(&self, square: Square, among: Option<&[Point]>) -> Node {
        let Some(patch) = square.patch() else {
            return if square.level < DEEPEST_AT_RIM && !square.is_outside() {
                self.cut(square, None)
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
        patch.drop_preceded(&mut points, self.count, self.kernel);
        if points.len() <= CAPACITY {
            points.sort_unstable_by_key(|&(_, number)| number);
            Node::Leaf(Some(Box::new(Candidates::new(points))))
        } else if square.level < DEEPEST && patch.radius > LEAST_RADIUS * last {
            self.cut(square, Some(&points))
        } else {
            Node::Leaf(None)
        }
    }

    fn cut(&self, square: Square, among: Option<&[Point]>) -> Node {
        Node::Quarters(Box::new(square.quarters().map(|quarter| self.refine_among(quarter, among))))
    }
}

//! The search for candidates: squares are cut until few normals can be among the nearest of their queries.

use super::square::{Point, RIVALS, STEP, Square};
use super::tree::{Neighbour, Tree, squared_distance};
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
    pub normals: &'a [[f32; 3]],
    pub tree: &'a Tree,
    /// How many of the nearest are wanted.
    pub count: usize,
    pub kernel: Kernel,
}

impl Search<'_> {
    /// Cuts a square until candidates are few; `among` are points that hold them all, if such are known.
    pub(super) fn refine(&self, square: Square, among: Option<&[Point]>) -> Node {
        let Some(patch) = square.patch() else {
            return if square.level < DEEPEST_AT_RIM { self.cut(square, None) } else { Node::Leaf(None) };
        };
        let nearest = self.nearest(patch.middle, among);
        let Some(last) = nearest.get(self.count - 1) else {
            return Node::Leaf(None);
        };
        let rivals = patch.rivals(nearest.iter().map(|rival| self.normals[rival.point as usize]));
        let preceded = |low, high| rivals.precede(self.kernel, low, high, self.count);
        let mut points = match among {
            None => self.tree.collect(preceded),
            Some(points) => points.iter().filter(|&&(at, _)| !preceded(at, at)).copied().collect(),
        };
        if points.len() <= CAPACITY {
            points.sort_unstable_by_key(|&(_, number)| number);
            Node::Leaf(Some(Box::new(Candidates::new(points))))
        } else if square.level < DEEPEST && f64::from(patch.radius) > LEAST_RADIUS * last.distance.sqrt() {
            self.cut(square, Some(&points))
        } else {
            Node::Leaf(None)
        }
    }

    fn cut(&self, square: Square, among: Option<&[Point]>) -> Node {
        Node::Quarters(Box::new(square.quarters().map(|quarter| self.refine(quarter, among))))
    }

    /// Points near a vector: the [`RIVALS`] nearest, of them the [`STEP`] nearest first, of them those that are wanted
    /// first and the last of those in its place. There may be fewer.
    fn nearest(&self, to: [f32; 3], among: Option<&[Point]>) -> Vec<Neighbour> {
        let mut nearest = vec![Neighbour::NONE; RIVALS];
        match among {
            None => self.tree.find(to, &mut nearest),
            Some(points) => {
                let neighbour =
                    |&(at, point): &Point| Neighbour { distance: squared_distance(to, at), point };
                nearest = points.iter().map(neighbour).collect();
                let mut end = nearest.len();
                for place in [RIVALS, STEP, self.count - 1] {
                    if place < end {
                        let by_distance = |a: &Neighbour, b: &Neighbour| a.distance.total_cmp(&b.distance);
                        nearest[..end].select_nth_unstable_by(place, by_distance);
                        end = place;
                    }
                }
                nearest.truncate(RIVALS);
            }
        }
        nearest.retain(|neighbour| neighbour.distance.is_finite());
        nearest
    }
}

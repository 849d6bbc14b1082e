//! Cutting a patch into what is there already.

use crate::method::tile::path_cost;
use crate::method::tile::seam::least_path;
use crate::shape::Size;

/// Rows or columns at each side of a patch that it shares with what is there; 0 where it shares none, else at least 2.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shared {
    pub(super) top: usize,
    pub(super) bottom: usize,
    pub(super) left: usize,
    pub(super) right: usize,
}

impl Shared {
    /// Whether a place of a patch of this size is shared.
    #[inline]
    pub(super) fn has(&self, size: Size, y: usize, x: usize) -> bool {
        y < self.top || y + self.bottom >= size.height || x < self.left || x + self.right >= size.width
    }
}

/// For each place of a patch, row by row, whether what is there stays; and what the cuts cost.
///
/// At each shared side a minimum-error path parts the two, after Efros and Freeman 2001; where two paths cross, what
/// is beyond either stays. The outermost row or column of a side always stays, the innermost never does.
/// `difference` is between what is there and the patch at a shared place (y, x).
pub(super) fn stays(
    size: Size,
    shared: Shared,
    difference: impl Fn(usize, usize) -> u64,
) -> (Vec<bool>, u64) {
    let Size { height, width } = size;
    // A place from how far along a side it is, and how far from it.
    type TexelOf = fn(Size, usize, usize) -> [usize; 2];
    let sides: [(usize, usize, TexelOf); 4] = [
        (shared.top, width, |_, along, inwards| [inwards, along]),
        (shared.bottom, width, |size, along, inwards| [size.height - 1 - inwards, along]),
        (shared.left, height, |_, along, inwards| [along, inwards]),
        (shared.right, height, |size, along, inwards| [along, size.width - 1 - inwards]),
    ];
    let mut stays = vec![false; size.texels()];
    let mut total = 0;
    for (depth, length, place) in sides.into_iter().filter(|&(depth, ..)| depth > 0) {
        let costs = path_cost(length, depth, |along, inwards| {
            let [y, x] = place(size, along, inwards);
            difference(y, x)
        });
        let (path, cost) = least_path(&costs, length, depth - 1, false);
        total += cost;
        for (along, last) in path.into_iter().enumerate() {
            for inwards in 0..=last {
                let [y, x] = place(size, along, inwards);
                stays[y * width + x] = true;
            }
        }
    }
    (stays, total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_is_cut_where_the_two_agree() {
        let size = Size::new(9, 8);
        // They agree on the ring two texels within the border.
        let agree = |y: usize, x: usize| y == 2 || y == 6 || x == 2 || x == 5;
        let shared = Shared { top: 4, bottom: 4, left: 4, right: 4 };
        let (stays, _) = stays(size, shared, |y, x| if agree(y, x) { 0 } else { 100 });
        for (number, &stays) in stays.iter().enumerate() {
            let (y, x) = (number / 8, number % 8);
            let inner = (3..6).contains(&y) && (3..5).contains(&x);
            let within = (2..7).contains(&y) && (2..6).contains(&x);
            // Where all places across a side agree, the cut may be at any of them.
            assert!(if stays { !inner } else { within || agree(y, x) }, "{y}, {x}: {stays}");
        }
    }

    #[test]
    fn a_side_that_is_not_shared_is_all_the_patch() {
        let shared = Shared { left: 3, ..Shared::default() };
        let (stays, _) = stays(Size::new(4, 6), shared, |_, _| 1);
        assert!((0..4).all(|y| stays[y * 6] && stays[y * 6 + 2..][..4].iter().all(|stays| !stays)));
    }
}

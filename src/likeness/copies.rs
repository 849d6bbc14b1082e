//! How much of an enlargement is one unbroken copy of its exemplar?

use crate::shape::Window;

/// The largest piece in which neighbours continue each other as they do in the exemplar, found row by row: memory grows
/// with the width only.
pub struct LargestCopy {
    exemplar: Window,
    tile_width: usize,
    wraps: bool,
    /// Position in the exemplar of each texel of the row before, and the piece that it belongs to.
    before: Vec<([usize; 2], usize)>,
    /// Texels of the pieces that reach the row before.
    pieces: Vec<u64>,
    largest: u64,
    texels: u64,
}

impl LargestCopy {
    /// Of an enlargement whose sources are `row * tile_width + column` of the tile, within an exemplar that wraps or not.
    pub fn new(exemplar: Window, tile_width: usize, wraps: bool) -> Self {
        Self {
            exemplar,
            tile_width: tile_width.max(1),
            wraps,
            before: Vec::new(),
            pieces: Vec::new(),
            largest: 0,
            texels: 0,
        }
    }

    /// The next row of sources.
    pub fn push(&mut self, row: &[u32]) {
        let mut joined =
            Joined { parent: (0..self.pieces.len()).collect(), texels: std::mem::take(&mut self.pieces) };
        let mut line: Vec<([usize; 2], usize)> = Vec::with_capacity(row.len());
        for (x, &source) in row.iter().enumerate() {
            let here = self.position(source);
            let left =
                line.last().filter(|(left, _)| self.continues(*left, here, 1)).map(|&(_, piece)| piece);
            let above = self.before.get(x).filter(|(above, _)| self.continues(*above, here, 0));
            let above = above.map(|&(_, piece)| piece);
            let piece = match (left, above) {
                (Some(left), Some(above)) => joined.join(left, above),
                (Some(piece), None) | (None, Some(piece)) => joined.root(piece),
                (None, None) => joined.add(),
            };
            joined.texels[piece] += 1;
            line.push((here, piece));
        }
        self.texels += row.len() as u64;
        // Pieces that do not reach this row are whole; the others are numbered anew.
        self.largest = joined.texels.iter().copied().fold(self.largest, u64::max);
        let mut numbers = vec![None; joined.texels.len()];
        for (_, piece) in &mut line {
            let root = joined.root(*piece);
            *piece = *numbers[root].get_or_insert_with(|| {
                self.pieces.push(joined.texels[root]);
                self.pieces.len() - 1
            });
        }
        self.before = line;
    }

    /// Its share of all texels, 0 to 1.
    pub fn share(&self) -> f64 {
        self.largest as f64 / self.texels.max(1) as f64
    }

    fn position(&self, source: u32) -> [usize; 2] {
        let source = source as usize;
        [source / self.tile_width, source % self.tile_width]
    }

    /// Whether a position is followed by another along an axis, rows (0) or columns (1).
    fn continues(&self, from: [usize; 2], to: [usize; 2], axis: usize) -> bool {
        let Window { y, x, size } = self.exemplar;
        let [first, side] = [[y, size.height], [x, size.width]][axis];
        let next = from[axis] + 1;
        let next = if self.wraps && next == first + side { first } else { next };
        to[axis] == next && to[1 - axis] == from[1 - axis]
    }
}

/// Pieces that grow together (union-find).
struct Joined {
    parent: Vec<usize>,
    /// Of roots.
    texels: Vec<u64>,
}

impl Joined {
    fn add(&mut self) -> usize {
        self.parent.push(self.parent.len());
        self.texels.push(0);
        self.parent.len() - 1
    }

    fn root(&mut self, mut piece: usize) -> usize {
        while self.parent[piece] != piece {
            self.parent[piece] = self.parent[self.parent[piece]];
            piece = self.parent[piece];
        }
        piece
    }

    fn join(&mut self, a: usize, b: usize) -> usize {
        let (a, b) = (self.root(a), self.root(b));
        let (kept, gone) = (a.min(b), a.max(b));
        if kept != gone {
            self.parent[gone] = kept;
            self.texels[kept] += std::mem::take(&mut self.texels[gone]);
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;
    use crate::shape::Size;

    fn share(rows: &[Vec<u32>], exemplar: Window, width: usize, wraps: bool) -> f64 {
        let mut copy = LargestCopy::new(exemplar, width, wraps);
        rows.iter().for_each(|row| copy.push(row));
        copy.share()
    }

    #[test]
    fn a_repeated_exemplar_is_one_copy_where_it_wraps() {
        let size = Size::new(5, 7);
        let rows: Vec<Vec<u32>> =
            (0..15u32).map(|y| (0..21u32).map(|x| y % 5 * 7 + x % 7).collect()).collect();
        assert_eq!(share(&rows, size.window(), 7, true), 1.0);
        assert_eq!(share(&rows, size.window(), 7, false), 35.0 / 315.0);
    }

    #[test]
    fn it_is_the_largest_component_that_a_flood_finds() {
        // Shifts that change by blocks and by single texels, so that pieces have holes and join from both sides.
        let (hash, side, tile) = (Hash::new(3, 0), 60u32, 16u32);
        let shift =
            |y: u32, x: u32| hash.words(y / 9, x / 11, 0)[0] % 3 + u32::from(hash.words(y, x, 1)[0] % 4 == 0);
        let source = |y: u32, x: u32| (y + shift(y, x)) % tile * tile + (x + shift(y, x)) % tile;
        let rows: Vec<Vec<u32>> = (0..side).map(|y| (0..side).map(|x| source(y, x)).collect()).collect();
        let same = |a: (u32, u32), b: (u32, u32)| shift(a.0, a.1) == shift(b.0, b.1);
        let mut seen = vec![false; (side * side) as usize];
        let mut largest = 0;
        for start in 0..side * side {
            let mut open = vec![(start / side, start % side)];
            let mut count = 0;
            while let Some(at) = open.pop() {
                let number = (at.0 * side + at.1) as usize;
                if seen[number] {
                    continue;
                }
                (seen[number], count) = (true, count + 1);
                for (dy, dx) in [(0, 1), (1, 0), (0, -1), (-1, 0)] {
                    if let (Some(y), Some(x)) = (at.0.checked_add_signed(dy), at.1.checked_add_signed(dx))
                        && y < side
                        && x < side
                        && same(at, (y, x))
                    {
                        open.push((y, x));
                    }
                }
            }
            largest = largest.max(count);
        }
        let found = share(&rows, Size::new(16, 16).window(), 16, true);
        assert_eq!(found, f64::from(largest) / f64::from(side * side));
    }
}

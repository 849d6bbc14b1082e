//! One sub-pass of the coherent rule: texels of one parity take the best of the positions that their neighbours
//! continue to. Whole numbers only, so every kernel gives the same.

use super::compiled_for_each_kernel;

/// A position in the exemplar as one word: row in the high half, column in the low one, each below 2^15.
#[inline]
pub fn pack([y, x]: [i32; 2]) -> u32 {
    (y as u32) << 16 | x as u32 & 0xFFFF
}

/// Row and column of a packed position.
#[inline]
pub fn unpack(position: u32) -> [i32; 2] {
    [(position >> 16) as i32, (position & 0xFFFF) as i32]
}

/// What a sub-pass works with, beside the positions.
#[derive(Clone, Copy)]
pub struct Subpass<'a, const D: usize> {
    /// Positions of a row of the region.
    pub width: usize,
    /// First row and first column to correct, one after the last; every other one is, and at least two lie around them.
    pub rows: [usize; 2],
    /// The same of the columns.
    pub columns: [usize; 2],
    /// Appearance of the exemplar at this level, [y + h, x + h], with a margin of h on every side.
    pub appearance: &'a [[i8; D]],
    /// Texels of a row of it, margins included.
    pub stride: usize,
    /// Spacing h of the level.
    pub spacing: usize,
    /// Height and width of the exemplar.
    pub sides: [usize; 2],
    /// Whether a position may be in the outermost rows and columns of the exemplar, and continue across its border.
    pub crosses_border: bool,
    /// What repeating the exemplar costs.
    pub repetition: Option<Repetition<'a>>,
}

/// The cost of coming from the same row or column of the exemplar as sites one side of the exemplar away.
#[derive(Clone, Copy)]
pub struct Repetition<'a> {
    /// The positions as they were when the pass began.
    pub before: &'a [u32],
    /// Sides of the exemplar in texels of the level.
    pub distance: [usize; 2],
    /// Cost for each site and axis.
    pub cost: i32,
}

/// The directions of the four diagonal neighbours, (row, column).
const DIAGONALS: [[isize; 2]; 4] = [[-1, -1], [-1, 1], [1, -1], [1, 1]];

/// The neighbours whose continuations are candidates, after the texel itself; of equally good ones the first is taken.
const NEIGHBOURS: [[i32; 2]; 8] = [[0, -1], [0, 1], [-1, 0], [-1, -1], [-1, 1], [1, 0], [1, -1], [1, 1]];

/// Sites that tell of repetition.
const SITES: usize = 12;

compiled_for_each_kernel! {
    /// Corrects positions at a level of four dimensions.
    pub fn correct_fine(positions: &mut [u32], subpass: Subpass<'_, 4>) = correct::<4>
}

compiled_for_each_kernel! {
    /// Corrects positions at a level of eight dimensions.
    pub fn correct_coarse(positions: &mut [u32], subpass: Subpass<'_, 8>) = correct::<8>
}

#[inline(always)]
fn correct<const D: usize>(positions: &mut [u32], subpass: Subpass<'_, D>) {
    for y in (subpass.rows[0]..subpass.rows[1]).step_by(2) {
        for x in (subpass.columns[0]..subpass.columns[1]).step_by(2) {
            let at = y * subpass.width + x;
            let (candidates, count) = subpass.candidates(positions, at);
            if count > 1 {
                positions[at] = subpass.best(positions, at, &candidates[..count]);
            }
        }
    }
}

impl<const D: usize> Subpass<'_, D> {
    /// The different positions that the texel and its neighbours propose, in order, and their number.
    #[inline(always)]
    fn candidates(&self, positions: &[u32], at: usize) -> ([u32; 9], usize) {
        let [height, width] = self.sides.map(|side| side as u16);
        let spacing = self.spacing as i32;
        let here = positions[at];
        let proposals: [u32; 8] = std::array::from_fn(|n| {
            let [dy, dx] = NEIGHBOURS[n];
            positions[at.wrapping_add_signed(dy as isize * self.width as isize + dx as isize)]
        });
        let continued: [u32; 8] = std::array::from_fn(|n| {
            let [dy, dx] = NEIGHBOURS[n];
            let y = wrapped(((proposals[n] >> 16) as u16).wrapping_sub((dy * spacing) as u16), height);
            let x = wrapped((proposals[n] as u16).wrapping_sub((dx * spacing) as u16), width);
            u32::from(y) << 16 | u32::from(x)
        });
        let mut candidates = [here; 9];
        if continued == [here; 8] {
            return (candidates, 1);
        }
        let mut count = 1;
        for (n, candidate) in continued.into_iter().enumerate() {
            let seen = candidates[..count].contains(&candidate);
            if !seen && (self.crosses_border || self.is_inside(proposals[n], NEIGHBOURS[n])) {
                candidates[count] = candidate;
                count += 1;
            }
        }
        (candidates, count)
    }

    /// Whether a neighbour's position continues to one that is neither beyond the border nor at it.
    #[inline(always)]
    fn is_inside(&self, proposal: u32, [dy, dx]: [i32; 2]) -> bool {
        let [y, x] = unpack(proposal);
        let within = |place: i32, side: usize| (1..side as i32 - 1).contains(&place);
        let spacing = self.spacing as i32;
        within(y - dy * spacing, self.sides[0]) && within(x - dx * spacing, self.sides[1])
    }

    /// Where a position's appearance lies.
    #[inline(always)]
    fn place(&self, position: u32) -> usize {
        let [y, x] = unpack(position).map(|place| place as usize);
        (y + self.spacing) * self.stride + x + self.spacing
    }

    /// The candidate whose four diagonal neighbours in the exemplar look most like those around `at`.
    #[inline(always)]
    fn best(&self, positions: &[u32], at: usize, candidates: &[u32]) -> u32 {
        let around = self.around(positions, at);
        let sites = self.repetition.map(|repetition| (repetition, self.sites(&repetition, at)));
        let (mut best, mut least) = (candidates[0], i32::MAX);
        for &candidate in candidates {
            let mut cost = self.cost(&around, candidate);
            if let Some((repetition, sites)) = &sites {
                cost += repetition.cost * self.repeated(sites, candidate);
            }
            if cost < least {
                (best, least) = (candidate, cost);
            }
        }
        best
    }

    /// What the four diagonal neighbours of `at` look like: each the sum of its own appearance and of those that the
    /// two texels beyond it continue to.
    #[inline(always)]
    fn around(&self, positions: &[u32], at: usize) -> [[i16; D]; 4] {
        let width = self.width as isize;
        DIAGONALS.map(|[dy, dx]| {
            let look = |row: isize, column: isize, back: isize| {
                let position = positions[at.wrapping_add_signed(row * width + column)];
                self.appearance[self.place(position).wrapping_add_signed(-back)]
            };
            let spacing = self.spacing as isize;
            let looks = [
                look(dy, dx, 0),
                look(2 * dy, dx, dy * spacing * self.stride as isize),
                look(dy, 2 * dx, dx * spacing),
            ];
            std::array::from_fn(|n| looks.iter().map(|look| i16::from(look[n])).sum())
        })
    }

    /// Squared difference between what lies around and three times what lies around a candidate in the exemplar.
    #[inline(always)]
    fn cost(&self, around: &[[i16; D]; 4], candidate: u32) -> i32 {
        let place = self.place(candidate);
        let spacing = self.spacing as isize;
        let mut cost = 0;
        for (around, [dy, dx]) in around.iter().zip(DIAGONALS) {
            let there =
                &self.appearance[place.wrapping_add_signed(spacing * (dy * self.stride as isize + dx))];
            for (&here, &there) in around.iter().zip(there) {
                let difference = i32::from(here - 3 * i16::from(there));
                cost += difference * difference;
            }
        }
        cost
    }

    /// The positions that sites one side of the exemplar away continue to.
    #[inline(always)]
    fn sites(&self, repetition: &Repetition<'_>, at: usize) -> [[i32; 2]; SITES] {
        let [rows, columns] = repetition.distance.map(|distance| distance as i32);
        let offset = |n: usize| {
            let (sign, aside) = (if n.is_multiple_of(2) { -1 } else { 1 }, (n / 2 % 3) as i32 - 1);
            if n < SITES / 2 { [sign * rows, aside] } else { [aside, sign * columns] }
        };
        let spacing = self.spacing as i32;
        std::array::from_fn(|n| {
            let [dy, dx] = offset(n);
            let place = at.wrapping_add_signed(dy as isize * self.width as isize + dx as isize);
            let [y, x] = unpack(repetition.before[place]);
            [
                (y - spacing * dy).rem_euclid(self.sides[0] as i32),
                (x - spacing * dx).rem_euclid(self.sides[1] as i32),
            ]
        })
    }

    /// How many sites come from about a candidate's row, and how many from about its column.
    #[inline(always)]
    fn repeated(&self, sites: &[[i32; 2]; SITES], candidate: u32) -> i32 {
        let candidate = unpack(candidate);
        let near = |axis: usize, site: &[i32; 2]| {
            let apart = (site[axis] - candidate[axis]).abs();
            i32::from(2 * apart.min(self.sides[axis] as i32 - apart) <= self.spacing as i32)
        };
        sites.iter().map(|site| near(0, site) + near(1, site)).sum()
    }
}

/// A place at most one side beyond `0..side`, brought back into it; negative ones are given modulo 2^16.
#[inline(always)]
fn wrapped(place: u16, side: u16) -> u16 {
    let place = place.min(place.wrapping_add(side));
    place.min(place.wrapping_sub(side))
}

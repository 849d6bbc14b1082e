//! One sub-pass of the coherent rule: texels of one parity take the best of the positions that their neighbours
//! continue to. Whole numbers only, so every kernel gives the same.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod lanes;

use lanes::{Lanes, Plain};

use super::{Kernel, dispatch};

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
pub(crate) struct Subpass<'a, const D: usize> {
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
pub(crate) struct Repetition<'a> {
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

/// Corrects positions at a level of `D` dimensions, a multiple of four.
pub(crate) fn correct<const D: usize>(kernel: Kernel, positions: &mut [u32], subpass: &Subpass<'_, D>) {
    dispatch!(
        kernel;
        correct_by::<D, Plain>(positions, subpass),
        avx2::correct(positions, subpass),
        avx2::correct(positions, subpass),
    );
}

/// Texels of a row that are looked at together.
const BLOCK: usize = 32;

#[inline(always)]
fn correct_by<const D: usize, L: Lanes<D>>(positions: &mut [u32], subpass: &Subpass<'_, D>) {
    let steps = subpass.repetition.as_ref().map(|repetition| subpass.site_steps(repetition));
    for y in (subpass.rows[0]..subpass.rows[1]).step_by(2) {
        let mut first = subpass.columns[0];
        while first < subpass.columns[1] {
            let count = BLOCK.min(subpass.columns[1] - first);
            let at = y * subpass.width + first;
            // Most texels continue all their neighbours already.
            let broken = subpass.broken(positions, at, count);
            for n in (0..count).step_by(2).filter(|&n| broken[n]) {
                positions[at + n] = subpass.best::<L>(positions, steps.as_ref(), at + n);
            }
            first += BLOCK;
        }
    }
}

/// A row of the exemplar, in the high half of a word, so many rows on.
#[inline(always)]
fn rows_on(position: u32, rows: i32, height: usize) -> u32 {
    continued(position & 0xFFFF_0000, (rows << 16) as u32, (height as u32) << 16)
}

/// A column of the exemplar, in the low half of a word, so many columns on.
#[inline(always)]
fn columns_on(position: u32, columns: i32, width: usize) -> u32 {
    continued(position & 0xFFFF, columns as u32, width as u32)
}

/// `place + step`, wrapped into `0..side`; the step is at most a side long, negative ones are given modulo 2^32.
#[inline(always)]
fn continued(place: u32, step: u32, side: u32) -> u32 {
    let place = place.wrapping_add(step);
    // What is below 0, or is not beyond the side, becomes huge by one of the two.
    let place = place.min(place.wrapping_add(side));
    place.min(place.wrapping_sub(side))
}

impl<const D: usize> Subpass<'_, D> {
    /// Of the `count` texels from `at` on, which have a neighbour that does not continue them.
    #[inline(always)]
    fn broken(&self, positions: &[u32], at: usize, count: usize) -> [bool; BLOCK] {
        let row = |dy: isize, dx: isize| {
            &positions[at.wrapping_add_signed(dy * self.width as isize + dx)..][..count]
        };
        let [height, width] = self.sides;
        let spacing = self.spacing as i32;
        let here = row(0, 0);
        let neighbours = [
            [row(-1, -1), row(-1, 0), row(-1, 1)],
            [row(0, -1), here, row(0, 1)],
            [row(1, -1), row(1, 0), row(1, 1)],
        ];
        let mut broken = [false; BLOCK];
        for (n, broken) in broken[..count].iter_mut().enumerate() {
            let here = here[n];
            let rows = [-spacing, 0, spacing].map(|step| rows_on(here, step, height));
            let columns = [-spacing, 0, spacing].map(|step| columns_on(here, step, width));
            let mut differing = 0;
            for (row, neighbours) in rows.iter().zip(&neighbours) {
                for (column, neighbour) in columns.iter().zip(neighbours) {
                    differing |= neighbour[n] ^ (row | column);
                }
            }
            *broken = differing != 0;
        }
        broken
    }

    /// The best of the different positions that the texel and its neighbours propose: the one whose four diagonal
    /// neighbours in the exemplar look most like those around the texel.
    #[inline(always)]
    fn best<L: Lanes<D>>(&self, positions: &[u32], steps: Option<&SiteSteps>, at: usize) -> u32 {
        let [height, width] = self.sides;
        let spacing = self.spacing as i32;
        let (mut proposals, mut candidates) = ([0; 8], [0; 8]);
        for (n, [dy, dx]) in NEIGHBOURS.into_iter().enumerate() {
            proposals[n] = positions[at.wrapping_add_signed(dy as isize * self.width as isize + dx as isize)];
            candidates[n] =
                rows_on(proposals[n], -dy * spacing, height) | columns_on(proposals[n], -dx * spacing, width);
        }
        // Bit n: candidate n differs from all that have been looked at.
        let mut left = 0xFF;
        if !self.crosses_border {
            left = (0..8).map(|n| u32::from(self.is_inside(proposals[n], NEIGHBOURS[n])) << n).sum();
        }
        let around = self.around(positions, at);
        let sites = match (&self.repetition, steps) {
            (Some(repetition), Some(steps)) => Some(self.sites(repetition, steps, at)),
            _ => None,
        };
        let mut best = positions[at];
        let mut least = self.cost::<L>(&around, &sites, best);
        left &= !L::same(&candidates, best);
        while left != 0 {
            let candidate = candidates[left.trailing_zeros() as usize & 7];
            left &= !L::same(&candidates, candidate);
            let cost = self.cost::<L>(&around, &sites, candidate);
            if cost < least {
                (best, least) = (candidate, cost);
            }
        }
        best
    }

    /// How little a candidate fits what lies around.
    #[inline(always)]
    fn cost<L: Lanes<D>>(&self, around: &[[i16; D]; 4], sites: &Option<Sites>, candidate: u32) -> i32 {
        let unlike = L::difference(around, &self.there(candidate));
        match sites {
            Some(sites) => unlike + sites.cost * self.repeated(sites, candidate),
            None => unlike,
        }
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
        let [y, x] = unpack(position);
        (y as usize + self.spacing) * self.stride + x as usize + self.spacing
    }

    /// Texels of the exemplar's appearance from one to that so many spacings down and across.
    #[inline(always)]
    fn step(&self, [dy, dx]: [isize; 2]) -> isize {
        (dy * self.stride as isize + dx) * self.spacing as isize
    }

    /// How a texel looks that lies `from` the texel `at`, or what the texel there continues to, `steps` on.
    #[inline(always)]
    fn look(&self, positions: &[u32], at: usize, [dy, dx]: [isize; 2], steps: [isize; 2]) -> [i8; D] {
        let position = positions[at.wrapping_add_signed(dy * self.width as isize + dx)];
        self.appearance[self.place(position).wrapping_add_signed(self.step(steps))]
    }

    /// What the four diagonal neighbours of `at` look like: each the sum of its own appearance and of those that the
    /// two texels beyond it continue to.
    #[inline(always)]
    fn around(&self, positions: &[u32], at: usize) -> [[i16; D]; 4] {
        let (mut near, mut below, mut beside) = ([[0; D]; 4], [[0; D]; 4], [[0; D]; 4]);
        for (n, [dy, dx]) in DIAGONALS.into_iter().enumerate() {
            near[n] = self.look(positions, at, [dy, dx], [0, 0]);
            below[n] = self.look(positions, at, [2 * dy, dx], [-dy, 0]);
            beside[n] = self.look(positions, at, [dy, 2 * dx], [0, -dx]);
        }
        let mut sums = [[0; D]; 4];
        let looks = near.as_flattened().iter().zip(below.as_flattened()).zip(beside.as_flattened());
        for (sum, ((&near, &below), &beside)) in sums.as_flattened_mut().iter_mut().zip(looks) {
            *sum = i16::from(near) + i16::from(below) + i16::from(beside);
        }
        sums
    }

    /// What the four diagonal neighbours of a position in the exemplar look like.
    #[inline(always)]
    fn there(&self, position: u32) -> [[i8; D]; 4] {
        let place = self.place(position);
        let mut there = [[0; D]; 4];
        for (there, diagonal) in there.iter_mut().zip(DIAGONALS) {
            *there = self.appearance[place.wrapping_add_signed(self.step(diagonal))];
        }
        there
    }

    /// Where the sites one side of the exemplar away lie, and how they continue to the texel.
    fn site_steps(&self, repetition: &Repetition<'_>) -> SiteSteps {
        let [rows, columns] = repetition.distance.map(|distance| distance as isize);
        let mut steps = SiteSteps { places: [0; SITES], rows: [0; SITES], columns: [0; SITES] };
        for n in 0..SITES {
            let (sign, aside) = (if n.is_multiple_of(2) { -1 } else { 1 }, (n / 2 % 3) as isize - 1);
            let [dy, dx] = if n < SITES / 2 { [sign * rows, aside] } else { [aside, sign * columns] };
            let back =
                |step: isize, side: usize| (-step * self.spacing as isize).rem_euclid(side as isize) as i32;
            steps.places[n] = dy * self.width as isize + dx;
            steps.rows[n] = back(dy, self.sides[0]);
            steps.columns[n] = back(dx, self.sides[1]);
        }
        steps
    }

    /// The positions that sites one side of the exemplar away continue to.
    #[inline(always)]
    fn sites(&self, repetition: &Repetition<'_>, steps: &SiteSteps, at: usize) -> Sites {
        let [height, width] = self.sides.map(|side| side as i32);
        let mut sites = Sites { rows: [0; SITES], columns: [0; SITES], cost: repetition.cost };
        for n in 0..SITES {
            let [y, x] = unpack(repetition.before[at.wrapping_add_signed(steps.places[n])]);
            let (y, x) = (y + steps.rows[n], x + steps.columns[n]);
            sites.rows[n] = if y < height { y } else { y - height };
            sites.columns[n] = if x < width { x } else { x - width };
        }
        sites
    }

    /// How many sites come from about a candidate's row, and how many from about its column.
    #[inline(always)]
    fn repeated(&self, sites: &Sites, candidate: u32) -> i32 {
        let [y, x] = unpack(candidate);
        let [height, width] = self.sides.map(|side| side as i32);
        let mut count = 0;
        for n in 0..SITES {
            let near = |site: i32, place: i32, side: i32| {
                let apart = (site - place).abs();
                i32::from(2 * apart.min(side - apart) <= self.spacing as i32)
            };
            count += near(sites.rows[n], y, height) + near(sites.columns[n], x, width);
        }
        count
    }
}

/// How to get from a texel to the sites one side of the exemplar away, and from their positions back.
struct SiteSteps {
    /// In places of the region.
    places: [isize; SITES],
    /// In rows of the exemplar, below its height.
    rows: [i32; SITES],
    /// In columns of the exemplar, below its width.
    columns: [i32; SITES],
}

/// Rows and columns that sites one side of the exemplar away continue to.
struct Sites {
    rows: [i32; SITES],
    columns: [i32; SITES],
    /// Cost for each site and axis.
    cost: i32,
}

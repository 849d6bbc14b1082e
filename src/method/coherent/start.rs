//! First positions of a level, before they are corrected: drawn by hash at the coarsest, continued from the level above
//! and shaken at the others.

use super::hash;
use super::region::Region;
use crate::kernel::coherent::{pack, unpack};
use crate::lattice::WaveCounts;
use crate::shape::Size;

/// What all levels of a window share.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) exemplar: Size,
    pub(super) lattice: &'a WaveCounts,
    pub(super) seed: u32,
    /// In units of 1 / 256 of the spacing.
    pub(super) jitter: u32,
    /// Rows and columns after which the output repeats, at the finest level.
    pub(super) wrap: Option<Size>,
}

impl Start<'_> {
    /// Rows and columns after which a level repeats, in an output that wraps.
    fn period(&self, level: u32) -> Option<[i64; 2]> {
        self.wrap.map(|size| [size.height, size.width].map(|side| (side >> level) as i64))
    }

    /// Coarsest positions: the place itself plus a hashed shift.
    pub(super) fn begin(&self, level: u32, region: &Region) -> Vec<u32> {
        let key = hash::key(self.seed, level);
        let Size { height, width } = self.exemplar;
        let period = self.period(level);
        region.map(|[y, x]| {
            let [y, x] = period.map_or([y, x], |[rows, columns]| [y.rem_euclid(rows), x.rem_euclid(columns)]);
            let [dy, dx] = self.lattice.shift(self.exemplar, hash::place(key, y as i32, x as i32));
            pack([
                ((y << level) + i64::from(dy)).rem_euclid(height as i64) as i32,
                ((x << level) + i64::from(dx)).rem_euclid(width as i64) as i32,
            ])
        })
    }

    /// Positions continued from those of the next coarser level, each moved by a hashed jitter.
    pub(super) fn finer(&self, level: u32, region: &Region, parents: &[u32], coarser: &Region) -> Vec<u32> {
        let key = hash::key(self.seed, level);
        let Size { height, width } = self.exemplar;
        let period = self.period(level);
        let columns: Vec<u32> = region
            .columns()
            .map(|x| hash::column(key, period.map_or(x, |[_, columns]| x.rem_euclid(columns)) as i32))
            .collect();
        let moves = [0, 0xFFFF].map(|word| self.jittered(level, word)) != [0, 0];
        let first = region.columns().start;
        let mut positions = Vec::with_capacity(region.size.texels());
        for y in region.rows() {
            let parents = &parents[coarser.at([y >> 1, coarser.columns().start])..][..coarser.size.width];
            let down = ((y & 1) as i32) << level;
            let row = period.map_or(y, |[rows, _]| y.rem_euclid(rows)) as i32;
            positions.extend(columns.iter().enumerate().map(|(n, &column)| {
                let x = first + n as i64;
                let [parent_y, parent_x] = unpack(parents[((x >> 1) - coarser.columns().start) as usize]);
                let across = ((x & 1) as i32) << level;
                let [jitter_y, jitter_x] = match moves {
                    true => hash::in_column(column, row).map(|word| self.jittered(level, word)),
                    false => [0, 0],
                };
                pack([
                    wrapped(parent_y + down + jitter_y, height as i32),
                    wrapped(parent_x + across + jitter_x, width as i32),
                ])
            }));
        }
        positions
    }

    /// Rounds `spacing * jitter / 256 * (word - 2^15) / 2^15`.
    fn jittered(&self, level: u32, word: i32) -> i32 {
        ((word - 32768) * self.jitter as i32 + (1 << (22 - level))) >> (23 - level)
    }

    /// Reflects positions at the outermost rows and columns of the exemplar into what lies within.
    pub(super) fn reflect(&self, positions: &mut [u32]) {
        let reflected = |place: i32, side: usize| match side as i32 - 2 {
            last if place > last => 2 * last - place,
            _ if place < 1 => 2 - place,
            _ => place,
        };
        for position in positions {
            let [y, x] = unpack(*position);
            *position = pack([reflected(y, self.exemplar.height), reflected(x, self.exemplar.width)]);
        }
    }
}

/// A place less than one side beyond `0..side`, brought back into it.
fn wrapped(place: i32, side: i32) -> i32 {
    match place {
        _ if place < 0 => place + side,
        _ if place >= side => place - side,
        _ => place,
    }
}

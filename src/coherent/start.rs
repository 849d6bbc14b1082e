//! First positions of a level, before they are corrected: drawn by hash at the coarsest, continued from the level above
//! and shaken at the others.

use crate::coherent::hash;
use crate::coherent::plane::Region;
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
    /// A place of a level, brought into the first period of an output that wraps.
    fn canonical(&self, level: u32, [y, x]: [i64; 2]) -> [i64; 2] {
        match self.wrap {
            None => [y, x],
            Some(size) => {
                [y.rem_euclid((size.height >> level) as i64), x.rem_euclid((size.width >> level) as i64)]
            }
        }
    }

    /// Coarsest positions: the place itself plus a hashed shift.
    pub(super) fn begin(&self, level: u32, region: &Region) -> Vec<u32> {
        let key = hash::key(self.seed, level);
        let Size { height, width } = self.exemplar;
        region.map(|place| {
            let [y, x] = self.canonical(level, place);
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
        let sides = [self.exemplar.height as i32, self.exemplar.width as i32];
        region.map(|place| {
            let [y, x] = self.canonical(level, place);
            let jitter = hash::place(key, y as i32, x as i32).map(|word| self.jittered(level, word));
            let parent = unpack(parents[coarser.at(place.map(|place| place >> 1))]);
            pack(std::array::from_fn(|axis| {
                let child = ((place[axis] & 1) as i32) << level;
                (parent[axis] + child + jitter[axis]).rem_euclid(sides[axis])
            }))
        })
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

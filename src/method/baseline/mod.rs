//! What people would use instead of the coherent rule: whole pieces of the tile, repeated, laid or stitched.
//!
//! [`Repeat`], [`Tiles`] and [`Roller`] make any window of an endless plane alone; [`Quilt`] goes from the top down. All
//! give texels of the tile by their number, `row * width + column`, and judge joints by D of (26) between the clusters
//! of the two texels that meet, in whole numbers. All that is random is a hash of the place and the seed.

mod cut;
mod grid;
mod quilt;
mod repeat;
mod roller;
mod tiles;

pub use quilt::Quilt;
pub use repeat::Repeat;
pub use roller::Roller;
pub use tiles::{MOST_TILES, Tiles};

use crate::error::{Error, Result};
use crate::shape::Size;

/// Shortest side of a tile that patches with overlaps are cut from.
pub(crate) const LEAST_SIDE: usize = 8;

/// Binary places of the greatest distance as a whole number: all that an f32 has.
const DISTANCE_BITS: i32 = 24;

/// A tile and how far its texels differ.
pub struct Exemplar {
    size: Size,
    wraps: bool,
    index: Vec<u16>,
    /// D of (26), row by row, in whole numbers.
    distance: Vec<u32>,
    clusters: usize,
}

impl Exemplar {
    /// `index` [y, x] is the tile's, `distance` the square D of (26); `wraps` says whether the tile's borders join.
    ///
    /// # Errors
    /// Parts that do not fit each other, and a tile with a side below [`LEAST_SIDE`].
    pub fn new(size: Size, wraps: bool, index: Vec<u16>, distance: &[f32]) -> Result<Self> {
        let clusters = distance.len().isqrt();
        if index.len() != size.texels() || index.iter().any(|&cluster| usize::from(cluster) >= clusters) {
            return Err(Error::input(format!(
                "a tile of {size} and distances of {clusters} clusters do not fit its index"
            )));
        }
        if size.height.min(size.width) < LEAST_SIDE {
            return Err(Error::usage(format!(
                "a tile of {size} is too small to cut patches from, expected at least {LEAST_SIDE} texels a side"
            )));
        }
        let greatest = distance.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let scale = f64::from(1 << DISTANCE_BITS) / f64::from(greatest);
        let distance = distance.iter().map(|&distance| (f64::from(distance) * scale) as u32).collect();
        Ok(Self { size, wraps, index, distance, clusters })
    }

    /// Rows and columns of the tile.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Bytes that it takes in memory.
    pub fn bytes(&self) -> u64 {
        Self::bytes_of(self.size, self.clusters)
    }

    /// The same of a tile of this size with so many clusters.
    pub fn bytes_of(tile: Size, clusters: usize) -> u64 {
        (tile.texels() * size_of::<u16>() + clusters * clusters * size_of::<u32>()) as u64
    }

    /// How far two texels differ.
    #[inline]
    fn difference(&self, first: u32, second: u32) -> u64 {
        self.costs_beside(first)[usize::from(self.index[second as usize])].into()
    }

    /// How far each cluster differs from a texel's.
    #[inline]
    fn costs_beside(&self, texel: u32) -> &[u32] {
        &self.distance[usize::from(self.index[texel as usize]) * self.clusters..][..self.clusters]
    }

    /// Where the first texel of a patch may lie: numbers of rows and of columns. The patch is no larger than the tile.
    fn origins(&self, patch: Size) -> Size {
        if self.wraps {
            return self.size;
        }
        Size::new(self.size.height - patch.height + 1, self.size.width - patch.width + 1)
    }

    /// The texel at a place, each coordinate of which may be beyond the border by less than a side.
    #[inline]
    fn texel(&self, [y, x]: [usize; 2]) -> u32 {
        let within = |place: usize, side: usize| if place < side { place } else { place - side };
        (within(y, self.size.height) * self.size.width + within(x, self.size.width)) as u32
    }

    /// How far apart two places are in rows and in columns, across the borders where that is shorter.
    fn apart(&self, first: [usize; 2], second: [usize; 2]) -> [usize; 2] {
        let sides = [self.size.height, self.size.width];
        std::array::from_fn(|axis| {
            let apart = first[axis].abs_diff(second[axis]);
            apart.min(sides[axis].abs_diff(apart))
        })
    }
}

/// Checks that an output joins at its own borders where it is to: its sides are multiples of the period's, and at least
/// `least` times as long.
///
/// # Errors
/// Other sides; the hint names some that fit.
fn check_wrap(wrap: Option<Size>, period: Size, least: usize) -> Result<()> {
    let fits = |side: usize, period: usize| side.is_multiple_of(period) && side >= least * period;
    match wrap {
        Some(size) if !fits(size.height, period.height) || !fits(size.width, period.width) => {
            let near = |side: usize, period: usize| side.div_ceil(period).max(least) * period;
            let near = Size::new(near(size.height, period.height), near(size.width, period.width));
            Err(Error::usage(format!(
                "an output of {size} cannot join at its own borders: expected multiples of {} (width) and {} (height){}",
                period.width,
                period.height,
                if least > 1 { format!(", at least {least} of each") } else { String::new() }
            ))
            .hint(format!("such as {near}")))
        }
        _ => Ok(()),
    }
}

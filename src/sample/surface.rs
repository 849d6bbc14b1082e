//! The synthetic surface as maps over the texels and a margin around them, so
//! that what lies beyond the border still casts shadows and hides.

use rayon::prelude::*;

use super::HORIZON;
use super::leather::Leather;
use super::noise::DOMAIN;
use super::wood::Wood;
use super::{Material, MaterialKind, Matter};
use crate::error::{Error, Result};
use crate::random::Hash;

/// What shading needs to know of a texel; bilinear between texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    /// dh/dx and dh/dy of the surface, y up.
    pub(super) slope: [f32; 2],
    /// The same of the coat.
    pub(super) coat_slope: [f32; 2],
    /// Linear RGB.
    pub(super) albedo: [f32; 3],
    /// GGX alpha.
    pub(super) alpha: f32,
    /// Share of the coat.
    pub(super) coat: f32,
    /// Weight of the fibre lobe.
    pub(super) fibre: f32,
    /// dz/dx and dy/dx of the fibres.
    pub(super) fibre_slope: [f32; 2],
}

impl Texel {
    /// A texel of some matter, its slopes still 0.
    fn of(matter: &Matter) -> Self {
        Self {
            slope: [0.0; 2],
            coat_slope: [0.0; 2],
            albedo: matter.albedo.map(|a| a as f32),
            alpha: matter.alpha as f32,
            coat: matter.coat as f32,
            fibre: matter.fibre as f32,
            fibre_slope: [matter.fibre_dive as f32, matter.fibre_turn as f32],
        }
    }
}

/// A surface with its truth. Lengths in texels, heights over the mean plane.
#[derive(Clone, Debug)]
pub struct Surface {
    kind: MaterialKind,
    seed: u64,
    width: usize,
    height: usize,
    pub(super) margin: usize,
    /// Columns and rows with the margins.
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Bound on |height|, texels.
    pub(super) relief: f32,
    /// Heights [row, column] of the padded plane.
    pub(super) heights: Vec<f32>,
    /// Texels of the padded plane; slopes at its outermost ring are 0.
    pub(super) texels: Vec<Texel>,
}

/// Tangent of the steepest direction (75.3 degrees) for which the margin suffices.
const STEEPEST: f64 = 3.81;

/// Longest side of a surface, texels.
pub const MOST_SIDE: usize = 1 << 16;

impl Surface {
    /// A surface of `width` x `height` texels. `scale` (0.25 to 8) multiplies the size of all
    /// features, heights with them; at 1 a cell of leather is about 14 texels across, a growth
    /// ring about 9. The same seed and scale give the same texel at the same place whatever the
    /// size. Below 1 the finest features are smaller than texels, and aliased.
    ///
    /// # Errors
    /// A size that is zero or above 65536, or a scale out of its range.
    pub fn new(kind: MaterialKind, width: usize, height: usize, scale: f64, seed: u64) -> Result<Self> {
        if !(1..=MOST_SIDE).contains(&width) || !(1..=MOST_SIDE).contains(&height) {
            return Err(Error::usage(format!(
                "a surface of {width}x{height} texels; each side may be 1 to {MOST_SIDE}"
            )));
        }
        if !(0.25..=8.0).contains(&scale) {
            return Err(Error::usage(format!("scale {scale}; it may be 0.25 to 8")));
        }
        let lattice = Lattice::new(kind, scale, seed);
        let (from, to) =
            (lattice.place(0, 0), lattice.place(width + 2 * lattice.margin, height + 2 * lattice.margin));
        let material: Box<dyn Material> = match kind {
            MaterialKind::Wood => Box::new(Wood::new(seed)),
            MaterialKind::Leather => Box::new(Leather::new(seed, from, to)),
        };
        Ok(Self::sampled(material.as_ref(), kind, [width, height], scale, seed))
    }

    /// A material sampled at the texels; `kind` bounds its heights.
    pub(super) fn sampled(
        material: &dyn Material,
        kind: MaterialKind,
        [width, height]: [usize; 2],
        scale: f64,
        seed: u64,
    ) -> Self {
        let lattice = Lattice::new(kind, scale, seed);
        let margin = lattice.margin;
        let (columns, rows) = (width + 2 * margin, height + 2 * margin);
        let relief = kind.relief();
        let made: Vec<(f32, f32, Texel)> = (0..rows * columns)
            .into_par_iter()
            .map(|n| {
                let [x, y] = lattice.place(n % columns, n / columns);
                let matter = material.matter(x, y);
                let height = matter.height.clamp(-relief, relief);
                ((scale * height) as f32, (scale * matter.coat_height) as f32, Texel::of(&matter))
            })
            .collect();
        let heights = made.iter().map(|m| m.0).collect();
        let coat: Vec<f32> = made.iter().map(|m| m.1).collect();
        let texels = made.into_iter().map(|m| m.2).collect();
        let relief = (scale * relief) as f32;
        let mut surface = Self { kind, seed, width, height, margin, columns, rows, relief, heights, texels };
        let slopes =
            |map: &[f32]| (0..rows * columns).into_par_iter().map(|n| surface.slope(map, n)).collect();
        let (slopes, coat_slopes): (Vec<_>, Vec<_>) = (slopes(&surface.heights), slopes(&coat));
        for (texel, (slope, coat_slope)) in surface.texels.iter_mut().zip(slopes.into_iter().zip(coat_slopes))
        {
            (texel.slope, texel.coat_slope) = (slope, coat_slope);
        }
        surface
    }

    /// The material.
    pub fn kind(&self) -> MaterialKind {
        self.kind
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// True heights over the mean plane, [y, x], texels.
    pub fn heights(&self) -> Vec<f32> {
        self.inner().map(|n| self.heights[n]).collect()
    }

    /// True unit normals, [y, x], x right, y up, z out.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        self.inner().map(|n| normal(self.texels[n].slope)).collect()
    }

    /// Padded positions of the texels, row by row.
    fn inner(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.height).flat_map(move |y| {
            (0..self.width).map(move |x| (y + self.margin) * self.columns + x + self.margin)
        })
    }

    /// Central differences of a padded map; y up, hence against the rows.
    fn slope(&self, map: &[f32], n: usize) -> [f32; 2] {
        let (row, column) = (n / self.columns, n % self.columns);
        if row == 0 || column == 0 || row + 1 == self.rows || column + 1 == self.columns {
            return [0.0, 0.0];
        }
        [0.5 * (map[n + 1] - map[n - 1]), 0.5 * (map[n - self.columns] - map[n + self.columns])]
    }
}

/// Where the texels of the padded plane lie on the endless material.
pub(super) struct Lattice {
    pub(super) origin: [f64; 2],
    margin: usize,
    scale: f64,
}

impl Lattice {
    pub(super) fn new(kind: MaterialKind, scale: f64, seed: u64) -> Self {
        // Every seed begins elsewhere, so that none shows a special place.
        let [x, y, ..] = Hash::new(seed, DOMAIN + 0xFE).uniforms(0, 0, 0);
        // A view ray strays by the relief on its way; from there a shadow ray goes through twice
        // the relief, and the openness looks around.
        let stray = kind.relief() * scale * STEEPEST;
        let margin = (3.0 * stray).max(stray + f64::from(HORIZON)).ceil() as usize + 3;
        Self { origin: [(1000.0 * x).floor(), (1000.0 * y).floor()], margin, scale }
    }

    /// The place of a padded texel, in units of the material, y downwards.
    fn place(&self, column: usize, row: usize) -> [f64; 2] {
        let along =
            |index: usize, origin: f64| origin + (index as f64 + 0.5 - self.margin as f64) / self.scale;
        [along(column, self.origin[0]), along(row, self.origin[1])]
    }
}

/// The unit normal of a surface of given slopes.
pub(super) fn normal([x, y]: [f32; 2]) -> [f32; 3] {
    let length = (x * x + y * y + 1.0).sqrt();
    [-x / length, -y / length, 1.0 / length]
}

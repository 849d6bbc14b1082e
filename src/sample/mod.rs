//! A synthetic measurement that looks like a material: a height field with
//! albedo and gloss, seen and lit from any direction with shadows, masking and
//! parallax. The truth (height, normals, albedo) is known, the material never
//! repeats, and a texel's value depends on its place and the seed alone: a
//! larger surface shows more of the same material.
//!
//! Data flow: [`Surface::new`] → [`Scene::new`] (what every light reaches) →
//! [`Scene::view`] (what every pixel sees) → [`ViewPoints::image`].

mod cells;
mod encode;
mod leather;
mod noise;
mod shading;
mod surface;
#[cfg(test)]
mod tests;
mod visibility;
mod wood;

pub use shading::{Scene, ViewPoints};
pub use surface::{MOST_SIDE, Surface};

/// The materials that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MaterialKind {
    /// Lacquered, ring-porous wood with the grain along x.
    Wood,
    /// Grained leather: cells, grooves, creases and pores.
    Leather,
}

/// How far around a texel the openness looks, texels.
const HORIZON: f32 = 18.0;

/// What a material is at one place of the mean plane. Lengths in units of the
/// material, which [`Surface`] scales to texels.
#[derive(Clone, Copy, Debug)]
struct Matter {
    /// Height over the mean plane.
    height: f64,
    /// Height whose slopes the surface of the coat follows.
    coat_height: f64,
    /// Linear RGB reflectance of the Lambertian base under the coat.
    albedo: [f64; 3],
    /// Roughness alpha of the coat's GGX lobe.
    alpha: f64,
    /// Share of the surface that the coat covers, 0 to 1.
    coat: f64,
    /// Weight of the fibre lobe against the Lambertian base.
    fibre: f64,
    /// Slope dz/dx with which the fibres leave the surface.
    fibre_dive: f64,
    /// In-plane slope dy/dx of the fibres, y up.
    fibre_turn: f64,
}

/// A procedural material: a function of place in its own units, y downwards.
trait Material: Sync {
    /// The matter at (x, y).
    fn matter(&self, x: f64, y: f64) -> Matter;
}

impl MaterialKind {
    /// Bound on |height| in units of the material; heights are held within it.
    fn relief(self) -> f64 {
        match self {
            Self::Wood => 1.6,
            Self::Leather => 2.6,
        }
    }

    /// Factor from pi L / E (E across the beam) to the linear value that is encoded; a white
    /// diffuser under normal light would read this.
    pub fn exposure(self) -> f32 {
        match self {
            Self::Wood => 0.8,
            Self::Leather => 2.0,
        }
    }
}

//! BTF values under any view and light.
//!
//! One rule for all who ask: values are mixed in linear light from the three views and the three lights around the
//! wanted ones, barycentrically within the stored spherical triangles; beyond the lowest measured ring the elevation is
//! clamped to it, and a light's values are scaled by the cosine. [`triangulation`] is that rule in double precision,
//! and what [`evaluate`] makes pictures by. [`locate`] is the same rule for a single direction out of millions, and
//! [`evaluator`] asks it for colours at places of a texture.
//!
//! Radiometry: a stored value is the reflectance times the cosine of the light (rho cos), 1 for a perfect diffuser that
//! is lit frontally. So BRDF times cosine is the value over pi.

pub mod components;
pub(crate) mod evaluate;
pub mod evaluator;
pub mod locate;
pub mod table;
#[cfg(test)]
mod tests;
pub(crate) mod triangulation;

pub use triangulation::triangulate as triangles;

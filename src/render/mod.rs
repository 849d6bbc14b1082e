//! Pictures of a material on an object: a camera, lights, a surface, and an evaluator that says how the material looks
//! at each place of it.
//!
//! The world is right-handed: x to the right, y up, z towards a camera in its default place. The object lies around the
//! origin and its radius is 1; a texture has so many texels along a length of 1, see [`Scene::density`]. Every pixel is
//! computed by itself from its place alone, so that pictures are the same whatever the threads. Light reaches a surface
//! straight from lights; what surfaces reflect onto each other is left to path tracers.

pub mod camera;
pub mod corner;
mod environment;
mod glb;
pub mod hit;
pub mod interior;
pub mod light;
pub mod mesh;
mod obj;
pub mod surface;
#[cfg(test)]
mod tests;
pub mod texture;
mod trace;

pub use environment::Environment;
pub use trace::{Background, Scene, render};

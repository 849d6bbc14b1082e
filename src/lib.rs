//! btfkit turns a measured Bidirectional Texture Function into a small model that covers a surface
//! of any size (Filip and Haindl 2007, "BTF modelling using BRDF texels").
//!
//! Data flows to the right only:
//!
//! ```text
//! archive -import-> measurement -tile, cluster, normals, fit-> model -enlarge-> enlarged index -image-> pictures
//! ```
//!
//! [`stage`] holds one module a step, [`store`] what lies on disk, [`run`] what makes long work
//! survive, [`texel`], [`mrf`], [`likeness`] and [`color`] the science, [`baseline`] what it is
//! measured by, [`kernel`] the hot loops.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod archive;
pub mod baseline;
pub mod coherent;
pub mod color;
pub mod demo;
pub mod error;
pub mod factor;
pub mod hdf5;
pub mod kernel;
pub mod lattice;
pub mod likeness;
pub mod mrf;
pub mod picture;
pub mod random;
pub mod run;
pub mod sample;
pub mod shape;
mod signal;
pub mod stage;
pub mod store;
pub mod texel;
pub mod text;
pub mod views;
pub mod words;

pub use error::{Error, Kind, Result};

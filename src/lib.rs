//! btfkit turns a measured Bidirectional Texture Function into a small model that covers a surface
//! of any size (Filip and Haindl 2007, "BTF modelling using BRDF texels").
//!
//! Data flows to the right only:
//!
//! ```text
//! archive -import-> measurement -tile, cluster, normals, fit-> model -enlarge-> enlarged index -image-> pictures
//! ```
//!
//! [`stage`] holds what each command does, [`method`] the steps of the paper as pure computation, [`check`] what can be
//! wrong with a measurement. [`archive`] reads what others publish, [`store`] says what our own files mean, over [`zarr`]
//! and [`disk`]. [`run`] makes long work survive, [`kernel`] holds the hot loops.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod archive;
pub mod check;
pub mod color;
pub mod demo;
pub mod disk;
pub mod error;
pub mod kernel;
pub mod lattice;
pub mod likeness;
pub mod method;
pub mod names;
pub mod picture;
pub mod random;
pub mod run;
pub mod sample;
pub mod shape;
mod signal;
pub mod stage;
pub mod store;
pub mod text;
pub mod words;
pub mod zarr;

pub use error::{Error, Kind, Result};

//! The steps of the work, one module a command: options, then a plan, then a run.

pub mod about;
pub mod appearance;
pub mod cluster;
pub mod compare;
pub mod components;
pub mod deepzoom;
pub mod enlarge;
pub mod estimate;
pub mod export;
pub mod fit;
pub mod image;
pub mod import;
pub mod judge;
pub(crate) mod kept;
pub mod loss;
pub mod normals;
pub mod pack;
pub mod partial;
pub mod render;
pub mod sample;
pub mod slurm;
pub mod status;
pub mod tile;
pub mod values;
pub mod verify;

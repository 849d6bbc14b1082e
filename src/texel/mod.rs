//! Texels and their BRDFs: directions, tiles, clusters, normals, and looking values up.

pub mod cluster;
pub mod companion;
pub mod components;
pub mod evaluate;
pub mod nearest;
pub mod scan;
pub mod seam;
pub mod stereo;
pub mod tile;
pub mod triangulation;

//! The method of the paper, a room a step, and what this program adds to it. Pure computation: nothing here reads or
//! writes files, takes locks or shows progress.
//!
//! | step | room |
//! | --- | --- |
//! | cut a seamless tile | [`tile`] |
//! | cluster the texels' BRDFs | [`cluster`] |
//! | estimate normals by photometric stereo | [`stereo`] |
//! | model the normals by causal autoregressive fields, and synthesise more of them | [`field`] |
//! | match synthesised normals to the tile's, which gives the enlarged index | [`index`] |
//! | look BTF values up between the measured directions | [`value`] |
//!
//! [`coherent`] enlarges without the field, by places in the tile; [`baseline`] holds simpler ways to compare with;
//! [`components`] are the leading components of BRDFs that tile and coherent rule look at; [`principal`] are those of
//! all samples, a model beside the clusters.

pub mod baseline;
pub mod cluster;
pub mod coherent;
pub mod components;
pub mod field;
pub mod index;
pub(crate) mod principal;
pub mod stereo;
pub mod tile;
pub mod value;

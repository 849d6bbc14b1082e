//! The coherent rule: an enlargement whose texels are source positions in the exemplar, found from coarse to fine so
//! that neighbours look as they do in the exemplar.
//!
//! After Lefebvre and Hoppe, "Parallel controllable texture synthesis" (2005) and "Appearance-space texture synthesis"
//! (2006), carried over to clusters of BRDFs. Everything after the fit is made of whole numbers, and nothing is
//! scanned: a texel is a pure function of the appearance, the seed and its place, so any window of an endless plane
//! comes out alone. `docs/method/coherent.md` is the specification, which readers in other languages share.
//!
//! [`fit`] makes an [`Appearance`] from clusters; [`Plane`] evaluates it.

mod appearance;
mod appearance_image;
pub mod fit;
pub mod hash;
mod plane;
mod region;
mod shift;
mod start;

pub(crate) use appearance::default_jitter;
pub use appearance::{
    Appearance, Basis, FEATURES, FINE_DIMS, INPUTS, JITTER_ONE, LEVELS_MOST, MOST_SIDE, dims_of, levels_of,
    passes_of, repetition_of,
};
pub use plane::{Plane, Variation};

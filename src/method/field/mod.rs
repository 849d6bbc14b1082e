//! The probabilistic model of the normal map (section 4 of the paper): a pyramid of causal autoregressive fields,
//! fitted to a tile by [`Surface::fit`] and sampled at any size by [`Synthesis`].
//!
//! ```text
//! normals ─▶ coordinates ─▶ mean ─▶ (2D: Karhunen-Loeve) ─▶ pyramid ─▶ one CAR field a level
//!         ─▶ number of levels and their gains by autocovariance ─▶ Model
//! Model, seed ─▶ one CAR field a level ─▶ collapse ─▶ (2D: inverse) ─▶ mean ─▶ marginals ─▶ rows of normals
//! ```
//!
//! Pure computation, fits in f64 and syntheses in f32; any number of channels; sums in one fixed order, so results are
//! bit-identical.

pub mod fit;
pub(crate) mod karhunen_loeve;
pub mod marginals;
pub mod model;
pub mod pyramid;
pub mod raster;
pub mod surface;
pub mod synthesis;

pub use fit::fit;
pub use model::{CarKind, Gains, Level, Model, Options};
pub use raster::{Boundary, Field};
pub use surface::{Coordinates, Surface};
pub use synthesis::{Extent, Synthesis};

//! The probabilistic model of the normal map (section 4 of the paper): a pyramid of causal autoregressive fields,
//! fitted to a tile by [`fit()`] and sampled at any size by [`Synthesis`].
//!
//! ```text
//! normals ─▶ mean ─▶ (2D: Karhunen-Loeve) ─▶ pyramid ─▶ one CAR field a level ─▶ Model
//! Model, seed ─▶ one CAR field a level ─▶ collapse ─▶ (2D: inverse) ─▶ mean ─▶ rows
//! ```
//!
//! Pure computation, fits in f64 and syntheses in f32; any number of channels; sums in one fixed order, so results are
//! bit-identical.

mod budget;
pub mod car;
mod extent;
pub mod field;
pub mod fit;
pub mod karhunen_loeve;
mod lattice;
pub mod model;
pub mod neighbourhood;
pub mod pyramid;
pub mod recursion;
pub mod stability;
pub mod synthesis;

pub use extent::Extent;
pub use field::{Boundary, Field};
pub use fit::fit;
pub use model::{Kind, Level, Model, Options};
pub use synthesis::Synthesis;

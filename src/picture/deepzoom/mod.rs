//! Deep Zoom: a picture as a pyramid of tiles, which viewers load as they need them. Pure computation; which store is shown,
//! and where the tiles go, is said in [`crate::stage::deepzoom`].

pub(crate) mod cascade;
mod encoding;
pub(crate) mod page;
pub mod pyramid;

pub use encoding::Encoding;

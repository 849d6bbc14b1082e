//! Arrays of numpy, `.npy`: a whole measurement as one array `[view, light, y, x, channel]`, and lists of
//! directions beside it.
//!
//! The header is read by own code: it is a Python literal, and parsers of those take memory or stack that a
//! damaged file asks for. Layout: numpy's `numpy.lib.format`, versions 1.0 to 3.0.

mod archive;
mod directions;
mod header;

pub use archive::{Archive, Beside, channels, channels_file, header, sample_bytes};
pub use directions::{directions, directions_file};

//! The packed model of a BTF, `NAME.btfc`: a mean and principal components, transformed, quantised and entropy-coded.
//!
//! A value of texel (y, x) under view v and light l in channel c is
//!
//! ```text
//! mean[v, l, c] + sum over k of coefficients[k][y, x] * basis[k][v, l, c]
//! ```
//!
//! on the sRGB curve times 255 (continued above 255, straight below 0). [`pack`] turns such a [`Model`] into bytes that are
//! some thousand times fewer than the samples, [`unpack`] turns them back. The file is a list of sections, each of
//! which halves the step of quantisation: a file that was cut after any section is a model, a coarser one.
//!
//! | step | room |
//! | --- | --- |
//! | polynomials of the directions, a cosine transform of the texels, a rotation of the colours | [`polynomials`], [`dct`], [`channels`], [`spectrum`] |
//! | whole numbers, bit plane by bit plane | [`quantise`], [`grid`], [`stream`] |
//! | bits to bytes | [`range_coder`] |
//! | or, instead of the cosine transform, an index into few centres | [`palette`], [`centres`] |
//! | header, sections, checksums | [`header`], [`section`] |
//! | the two ways | [`encode`], [`decode`] |
//!
//! This crate knows of no store and opens no file. Nothing that a file claims is trusted: see [`unpack`].
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bytes;
mod centres;
mod channels;
mod dct;
mod decode;
mod directions;
mod encode;
mod error;
mod grid;
mod header;
mod model;
mod palette;
mod polynomials;
mod quantise;
mod range_coder;
mod search;
mod section;
mod spectrum;
mod stream;
mod turn;

pub use decode::{Ending, Outline, SectionEnd, Unpacked, outline, unpack};
pub use encode::Packed;
pub use error::{Error, Result};
pub use header::{MAGIC, MOST_DIRECTIONS, MOST_SIDE};
pub use model::{Component, Direction, LARGEST, LARGEST_OF_BASIS, Model};
pub use search::{Target, pack};

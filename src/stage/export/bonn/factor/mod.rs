//! A measurement's matrix as a product of two, as factorised archives store it.
//!
//! Rows of the matrix are direction pairs (view * lights + light), columns are pixels (y * width + x); it is one
//! channel of a measurement. A sample is the inner product of a row of U and a row of S*V. Either of full rank,
//! which is trivial and exact, or truncated to the components that matter most.

mod exact;
mod matrix;
mod truncated;

pub(crate) use exact::{Identity, identity_rows};
pub(crate) use matrix::{Block, Factors, Size};
pub(crate) use truncated::{Options, truncated};

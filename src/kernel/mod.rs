//! The hot loops: plain Rust, always compiled and always the reference, beside SIMD chosen at run time.

pub mod absolute_difference;
pub mod predict;

//! Index synthesis: which cluster each texel of an enlargement takes, by its synthesised normal and by what its
//! neighbours took.

pub mod nearest;
pub mod scan;

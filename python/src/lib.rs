//! The Python package btfkit: stores as objects whose values are numpy arrays, and the stages as functions.
//!
//! Everything here hands on to the library. What takes long runs without Python's lock, tells its progress, and obeys
//! Ctrl-C ([`work`]).

// Python hands arguments over by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod errors;
mod look;
mod measurement;
mod model;
mod stages;
mod work;

use pyo3::prelude::*;

/// What `btfkit/__init__.py` gives out.
#[pymodule]
mod _btfkit {
    #[pymodule_export]
    use crate::measurement::Measurement;
    #[pymodule_export]
    use crate::model::{Enlargement, Model, Plane};
    #[pymodule_export]
    use crate::stages::{enlarge, import_, model};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

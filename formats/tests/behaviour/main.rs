//! What the readers and writers promise, one module for each promise.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout // the test on real files says whether it found any
)]

mod big;
mod catalogue;
mod damage;
mod jpeg;
mod measured_files;
mod mif;
mod mlvq;
mod mlvq_files;
mod support;
mod utia_files;
mod zip_reading;
mod zip_writing;

//! What the readers and writers promise, one module for each promise.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout // the test on real files says whether it found any
)]

mod big;
mod bonn_color;
mod bonn_damage;
mod bonn_reading;
mod bonn_support;
mod bonn_writing;
mod catalogue;
mod damage;
mod jpeg;
mod jpeg_arrangements;
mod jpeg_ends;
mod lists;
mod measured_files;
mod measured_lists;
mod mif;
mod mlvq;
mod mlvq_files;
mod npy;
mod picture;
mod picture_damage;
mod picture_exr;
mod picture_files;
mod picture_hdr;
mod picture_png;
mod picture_said;
mod picture_tiff;
mod support;
mod utia_files;
mod zip_reading;
mod zip_writing;

//! btfkit turns a measured Bidirectional Texture Function (BTF) into a small model, and the model into textures of any
//! size (Filip and Haindl 2007, "BTF modelling using BRDF texels").
//!
//! ```text
//! archive -import-> measurement -tile, cluster, normals, fit, appearance-> model -enlarge-> enlargement -image->
//! picture
//! ```
//!
//! # From an archive to values of an enlarged texture
//!
//! Each step writes a store that the next one reads. A step that is interrupted goes on when it is run again, and one
//! that is done already does nothing.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//!
//! use btfkit::run::{Context, progress::Silent};
//! use btfkit::shape::{Size, Window};
//! use btfkit::stage::{appearance, cluster, enlarge, image, import, sample, tile};
//! use btfkit::store::{enlarged::Enlarged, model::Model};
//! use btfkit::{Direction, archive};
//!
//! # fn main() -> btfkit::Result<()> {
//! # let folder = tempfile::tempdir().map_err(|error| btfkit::Error::io("create", "".as_ref(), error))?;
//! # let [archive_path, measurement, model, output] =
//! #     ["wood.zip", "wood.zarr", "wood.model.zarr", "big.zarr"].map(|name| folder.path().join(name));
//! // Two threads and 512 MiB; setting `stop` from another thread ends the work at its next unit.
//! let stop = AtomicBool::new(false);
//! let context = Context::new(&Silent, &stop, 2, 512 << 20)?;
//!
//! // An archive of pictures; here a synthetic one of 13 views and 13 lights.
//! let made = sample::Options::new(&archive_path);
//! sample::run(&sample::Options { size: Size::new(48, 48), views: 13, lights: 13, ..made }, &context)?;
//!
//! // Archive to measurement.
//! let source = archive::open(&[archive_path], &archive::Options::default())?;
//! import::plan(source.as_ref(), import::Options::new(&measurement), &context)?.run(&context)?;
//!
//! // Measurement to model: a tile, clusters of its texels, and what enlarging has to know of their surroundings.
//! tile::plan(&tile::Options::new(&measurement, &model))?.run(&context)?;
//! cluster::plan(&cluster::Options::new(&measurement, &model))?.run(&context)?;
//! appearance::plan(&appearance::Options::new(&model))?.run(&context)?;
//!
//! // Model to an enlargement: for each texel, the number of its cluster.
//! enlarge::plan(&enlarge::Options::new(&model, &output, Size::new(300, 200)))?.run(&context)?;
//!
//! // The colour (linear RGB) of one texel, seen from above and lit from 30 degrees.
//! let index = Enlarged::open(&output)?.read(Window { y: 120, x: 50, size: Size::new(1, 1) })?;
//! let [view, light] = [Direction::from_degrees(0.0, 0.0), Direction::from_degrees(30.0, 90.0)];
//! let colors = image::cluster_colors(&Model::open(&model)?, view, light)?;
//! let rgb = colors[usize::from(index[0])];
//! assert!(rgb.iter().all(|value| (0.0..=1.5).contains(value)));
//! # Ok(())
//! # }
//! ```
//!
//! `examples/` has more: converting an archive, enlarging in a loop, reading a window of an enlargement.
//!
//! # Where things are
//!
//! [`stage`] holds what each command does, [`method`] the steps of the paper as pure computation, [`check`] what can be
//! wrong with a measurement. [`archive`] reads what others publish, [`store`] says what our own files mean. [`render`] makes pictures of a
//! material on objects. [`run`] makes long work survive. Rooms that the page does not list (kernels, Zarr, files) are no part of the interface.
//!
//! # Errors
//!
//! Every error has a [`ErrorKind`], which decides the exit code of the program, a message that names the file and the place
//! in it, and often a hint what to do ([`Error::guidance`]).
//!
//! | kind | meaning | exit code |
//! | --- | --- | --- |
//! | [`ErrorKind::Usage`] | an argument that cannot be | 2 |
//! | [`ErrorKind::Input`] | an archive or a store that is damaged, or is something else | 65 |
//! | [`ErrorKind::Recipe`] | a result that was made with other options lies where this one is to be | 65 |
//! | [`ErrorKind::Missing`] | an input that is not there, or not yet | 66 |
//! | [`ErrorKind::Io`] | the system refuses to read or write | 74 |
//! | [`ErrorKind::Stopped`] | stopped on request; running it again goes on | 75 |
//! | [`ErrorKind::Internal`] | a fault of this program, or no memory | 1 |
//!
//! # Features
//!
//! | feature | adds | needs |
//! | --- | --- | --- |
//! | `hdf5` (off) | reading and writing of HDF5 archives | the HDF5 C library |
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod archive;
pub mod check;
pub mod color;
pub mod demo;
pub mod error;
pub mod lattice;
pub mod likeness;
pub mod method;
pub mod picture;
pub mod render;
pub mod run;
pub mod sample;
pub mod shape;
mod signal;
pub mod stage;
pub mod store;
pub mod view;

// For the program, the tests and the benches of this package; no part of the interface.
#[doc(hidden)]
pub mod disk;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod names;
#[doc(hidden)]
pub mod random;
#[doc(hidden)]
pub mod text;
#[doc(hidden)]
pub mod vector;
#[doc(hidden)]
pub mod words;
#[doc(hidden)]
pub mod zarr;

pub use btfkit_formats::Direction;
pub use error::{Error, ErrorKind, Result};

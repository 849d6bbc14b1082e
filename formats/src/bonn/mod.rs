//! The `.btf` containers of the University of Bonn (UBO2014, SPECTRAL): DFMF, FMF, PVF and BDI.
//!
//! | kind | what is stored |
//! | --- | --- |
//! | DFMF | for each channel of a colour model, matrices U and S*V; sample = U row . S*V row |
//! | FMF | one such pair for all channels, perhaps of logarithms |
//! | PVF | for each view, a mean, components and weights |
//! | BDI | all samples, f16 |
//!
//! [`Archive::open`] reads headers only. [`Images::read_images`](crate::Images::read_images) then computes the
//! images that are asked for out of the bytes (a map of the file), with f32 sums in a fixed order: the same
//! bits on every machine. Samples are f16 if all scalars of the file are, else f32; sums beyond the range of
//! f16 become its ends, and sums that are not finite are errors.
//!
//! Samples are linear reflectance. If the file's cosine flag is set, the cosine of the light's polar angle has
//! been multiplied into the data; it is left in and
//! [`Contents::cosine_included`](crate::Contents::cosine_included) is true. If it is not set the cosine is not
//! there: whoever wants samples as a camera saw them multiplies every image by `lights[i].vector()[2]`.
//!
//! # Sources
//!
//! Layouts as in cgbonn/btflib (Bonn's own, MATLAB) and zeroeffects/btf, written down independently. `.btf` is
//! also the ending of an unrelated format (MLVQ): [`recognise`] tells by the first bytes.

mod archive;
mod bdi;
mod color;
mod factors;
mod header;
mod images;
mod product;
mod scalar;
mod signature;
mod writer;

pub use archive::{Archive, OpenOptions, RowOrder};
pub use color::ColorModel;
pub use scalar::Scalar;
pub use signature::{BonnKind, recognise};
pub use writer::{Description, Writer};

//! What an archive holds, said alike by all readers of single-file containers.

use std::ops::Range;

use crate::{Assumption, Direction, Result, SampleType, Samples};

/// Sizes, directions, and how the samples that [`Images::read_images`] returns are meant.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// The format and its variant, for people: "Bonn DFMF, f16, rank 100".
    pub format: String,
    /// Columns.
    pub width: u32,
    /// Rows; row 0 is the top.
    pub height: u32,
    /// Names of the channels: "R", "G", "B"; "Y"; "X", "Y", "Z"; or wavelengths in nanometres.
    pub channels: Vec<String>,
    /// Type of the samples as they are read.
    pub sample_type: SampleType,
    /// Directions to the viewer, in the archive's order.
    pub views: Vec<Direction>,
    /// Directions to the light, the same for every view, in the archive's order.
    pub lights: Vec<Direction>,
    /// Samples are proportional to reflectance; else they are display values through the sRGB curve.
    pub linear: bool,
    /// The cosine of the light's polar angle is in the samples as they are read.
    pub cosine_included: bool,
    /// What the reader had to assume because the format does not say it.
    pub assumptions: Vec<Assumption>,
    /// What else the archive says of itself (device, scale, names): key and value.
    pub remarks: Vec<(String, String)>,
}

/// A container in one file whose images are computed or cut out on demand. The value owns what was parsed
/// when it was opened, not the bytes; they are handed in again (a memory map, say).
pub trait Images: Send + Sync {
    /// What the container holds.
    fn contents(&self) -> &Contents;

    /// The images of one view under a range of lights, `[light, y, x, channel]`, of [`Contents::sample_type`].
    /// Nothing but these images is decoded.
    ///
    /// # Errors
    /// A view or light that there is none of; bytes that are not those that were opened; damaged data.
    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples>;
}

//! Single pictures in the formats that laboratories use.

use crate::{SampleType, Samples};

/// A decoded picture of any of the formats.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows; row 0 is the top.
    pub height: u32,
    /// Names of the channels: "Y"; "R", "G", "B"; or as the file names them (wavelengths).
    pub channels: Vec<String>,
    /// `[y, x, channel]`.
    pub samples: Samples,
}

/// What the header of a picture says.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureHeader {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Names of the channels, as in [`Picture::channels`].
    pub channels: Vec<String>,
    /// Type of the samples.
    pub sample_type: SampleType,
    /// Samples are proportional to reflectance (Radiance, OpenEXR); else display values.
    pub linear: bool,
}

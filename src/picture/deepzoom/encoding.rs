//! Formats of tiles.

use btfkit_formats::jpeg;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::shape::Size;

/// Format of the tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// Lossless.
    Png,
    /// Lossy, of a quality from 1 to 100.
    Jpeg(u8),
}

impl Encoding {
    /// Ending of the names of tiles.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg(_) => "jpg",
        }
    }

    /// The file of 8-bit pixels.
    pub(crate) fn encode(self, size: Size, pixels: &[u8]) -> Result<Vec<u8>> {
        match self {
            Self::Png => crate::picture::png(size, pixels),
            Self::Jpeg(quality) => {
                let options = jpeg::EncodeOptions { quality, progressive: false, chroma: jpeg::Chroma::Half };
                Ok(jpeg::encode(pixels, size.width as u32, size.height as u32, 3, &options)?)
            }
        }
    }
}

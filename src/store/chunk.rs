//! Encoding of one chunk without the library's general machinery; the bytes are those of its codec chain.

use crate::error::{Error, Result};
use crate::store::ZSTD_LEVEL;

/// How chunks of samples are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Codec {
    /// zstd.
    Stock,
}

impl std::fmt::Display for Codec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stock => f.write_str("stock"),
        }
    }
}

/// Encodes chunks of one shape, one after another.
pub struct Encoder {
    zstd: Option<zstd::bulk::Compressor<'static>>,
}

impl Encoder {
    /// For chunks of this shape.
    pub fn new(_codec: Codec, _shape: Vec<u64>) -> Self {
        let zstd = zstd::bulk::Compressor::new(ZSTD_LEVEL).and_then(|mut compressor| {
            compressor.include_checksum(true)?;
            Ok(compressor)
        });
        Self { zstd: zstd.ok() }
    }

    /// The encoded chunk.
    pub fn encode(&mut self, bytes: &[u8]) -> Result<Vec<u8>> {
        let zstd = self.zstd.as_mut().ok_or_else(|| Error::internal("zstd cannot be started"))?;
        zstd.compress(bytes).map_err(|error| Error::internal(format!("zstd: {error}")))
    }
}

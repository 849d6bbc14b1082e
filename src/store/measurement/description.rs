//! What a measurement holds: sizes, directions, and how samples are meant.

use super::CHUNK_SIDE;
use crate::color::{Decoder, LightnessCodes, Transfer};
use crate::error::Result;
use crate::kernel::predict::Shape;
use crate::shape::Size;
use crate::zarr::codec::Chunk;
use btfkit_formats::{Contents, Direction, SampleType};

/// Most bytes of samples in one shard.
pub(super) const SHARD_LIMIT_BYTES: usize = 256 << 20;

/// Sizes, directions, and how samples are meant.
#[derive(Clone, Debug)]
pub struct Description {
    /// Rows and columns of the rectified images.
    pub size: Size,
    /// Names of the channels: Y; R, G, B; X, Y, Z; or wavelengths in nanometres.
    pub channels: Vec<String>,
    /// Type of the samples.
    pub sample_type: SampleType,
    /// View directions, in the order of the arrays.
    pub views: Vec<Direction>,
    /// Light directions, the same for all views.
    pub lights: Vec<Direction>,
    /// Transfer curve of the samples.
    pub transfer: Transfer,
    /// Reflectance that counts as L* = 100.
    pub white: f64,
}

impl Description {
    /// Views, rows, columns, lights, channels.
    pub fn shape(&self) -> [usize; 5] {
        let Size { height, width } = self.size;
        [self.views.len(), height, width, self.lights.len(), self.channels.len()]
    }

    /// Samples of a texel under one pair of directions.
    pub fn n_channels(&self) -> usize {
        self.channels.len()
    }

    /// Samples of a texel under one view.
    pub fn texel_samples(&self) -> usize {
        self.lights.len() * self.channels.len()
    }

    /// Bytes of a texel under one view.
    pub(crate) fn texel_bytes(&self) -> usize {
        self.texel_samples() * self.sample_type.bytes()
    }

    /// Side of a chunk in texels.
    pub(crate) fn chunk_side(&self) -> usize {
        CHUNK_SIDE
    }

    /// A chunk of samples.
    pub(super) fn chunk(&self) -> Chunk {
        Chunk { samples: self.sample_type, shape: self.chunk_shape(), channels: Some(self.n_channels()) }
    }

    /// A chunk of L* codes.
    pub(super) fn code_chunk(&self) -> Chunk {
        Chunk { samples: SampleType::U8, shape: self.chunk_shape(), channels: None }
    }

    fn chunk_shape(&self) -> Shape {
        Shape { rows: CHUNK_SIDE, columns: CHUNK_SIDE, lights: self.lights.len() }
    }

    /// Bytes of one view's samples.
    pub(crate) fn view_bytes(&self) -> u64 {
        self.size.texels() as u64 * self.texel_bytes() as u64
    }

    /// Bytes of all samples.
    pub fn bytes(&self) -> u64 {
        self.view_bytes() * self.views.len() as u64
    }

    /// Bytes of the samples of so many texels.
    pub(crate) fn bytes_of(&self, texels: usize) -> u64 {
        texels as u64 * (self.views.len() * self.texel_bytes()) as u64
    }

    /// The same as an archive says it of itself.
    pub(crate) fn contents(&self, format: String) -> Contents {
        Contents {
            format,
            width: self.size.width as u32,
            height: self.size.height as u32,
            channels: self.channels.clone(),
            sample_type: self.sample_type,
            views: self.views.clone(),
            lights: self.lights.clone(),
            linear: self.transfer == Transfer::Linear,
            cosine_included: true,
            assumptions: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// What turns its samples into linear RGB.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub fn decoder(&self) -> Result<Decoder> {
        Decoder::new(self.transfer, self.sample_type, &self.channels)
    }

    /// What turns its samples into L* codes.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub fn codes(&self) -> Result<LightnessCodes> {
        LightnessCodes::new(self.transfer, self.sample_type, &self.channels, self.white)
    }

    /// Side of a shard: the whole plane, or as much as keeps a shard within `limit_bytes`.
    pub(super) fn shard_side(&self, limit_bytes: usize) -> usize {
        let affordable = (limit_bytes / self.texel_bytes().max(1)).isqrt() / CHUNK_SIDE * CHUNK_SIDE;
        let plane = self.size.height.max(self.size.width).next_multiple_of(CHUNK_SIDE);
        plane.min(affordable.max(CHUNK_SIDE))
    }
}

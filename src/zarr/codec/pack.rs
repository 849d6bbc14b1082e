//! Chunks to bytes and back, without Zarr.

use std::ops::Range;

use btfkit_formats::SampleType;
use zstd::bulk::{Compressor, Decompressor};
use zstd::zstd_safe::{CParameter, ParamSwitch, compress_bound};

use super::{Chain, Chunk, Result, ZSTD_LEVEL, damaged};
use crate::error::Error;
use crate::kernel::predict::mode::Mode;
use crate::kernel::predict::{Deltas, Kernel, Lane, Numbers, Predictor, Shape};

/// Version of the layout of bytes, the first of them.
const VERSION: u8 = 1;

/// Bytes of the checksum at the end.
const CHECKSUM_BYTES: usize = 4;

/// More channels than any camera has; it bounds the header.
pub const MOST_CHANNELS: usize = 4096;

/// Encodes and decodes chunks of one kind; what one thread needs for it is kept from chunk to chunk.
///
/// The codecs of [`super::chunk_codecs`] read its bytes, and it reads theirs; but for zstd's parameters on differences
/// the bytes are the same.
pub struct ChunkCodec {
    chunk: Chunk,
    work: Work,
    /// Residuals, or what else goes into zstd.
    packed: Vec<u8>,
    /// Room for what a stream is compressed to.
    frame: Vec<u8>,
    decompressor: Decompressor<'static>,
    compressor: Compressor<'static>,
}

enum Work {
    Stock(Box<dyn Rearrange + Send>),
    Predictive(Box<dyn Predict + Send>, Vec<Mode>),
}

/// [`Predictor`] of any type of samples.
trait Predict {
    fn forward(&mut self, samples: &[u8], residuals: &mut [u8], modes: &mut Vec<Mode>);
    fn inverse(&mut self, residuals: &[u8], modes: &[Mode], samples: &mut [u8]);
}

impl<T: Lane> Predict for Predictor<T> {
    fn forward(&mut self, samples: &[u8], residuals: &mut [u8], modes: &mut Vec<Mode>) {
        Predictor::forward(self, samples, residuals, modes);
    }
    fn inverse(&mut self, residuals: &[u8], modes: &[Mode], samples: &mut [u8]) {
        Predictor::inverse(self, residuals, modes, samples);
    }
}

/// What the codecs before zstd do together.
trait Rearrange {
    fn forward(&mut self, samples: &[u8], bytes: &mut [u8]);
    fn inverse(&mut self, bytes: &[u8], samples: &mut [u8]);
}

impl<T: Lane> Rearrange for Deltas<T> {
    fn forward(&mut self, samples: &[u8], bytes: &mut [u8]) {
        Deltas::forward(self, samples, bytes);
    }
    fn inverse(&mut self, bytes: &[u8], samples: &mut [u8]) {
        Deltas::inverse(self, bytes, samples);
    }
}

/// Lights outermost (where a sample has several bytes), lowest bytes of all samples first.
struct Shuffled {
    shape: Shape,
    channels: usize,
    bytes: usize,
}

impl Shuffled {
    /// Calls `f` with the place of each byte before and after.
    fn places(&self, mut f: impl FnMut(usize, usize)) {
        let (texels, lights) = (self.shape.rows * self.shape.columns, self.shape.lights);
        let count = texels * lights * self.channels;
        let mut to = 0;
        for byte in 0..self.bytes {
            for light in 0..lights {
                for texel in 0..texels {
                    let from = (texel * lights + light) * self.channels;
                    for channel in 0..self.channels {
                        f((from + channel) * self.bytes + byte, to + channel);
                    }
                    to += self.channels;
                }
            }
        }
        debug_assert_eq!(to, count * self.bytes);
    }
}

impl Rearrange for Shuffled {
    fn forward(&mut self, samples: &[u8], bytes: &mut [u8]) {
        self.places(|from, to| bytes[to] = samples[from]);
    }
    fn inverse(&mut self, bytes: &[u8], samples: &mut [u8]) {
        self.places(|from, to| samples[from] = bytes[to]);
    }
}

/// Nothing is moved.
struct AsIs;

impl Rearrange for AsIs {
    fn forward(&mut self, samples: &[u8], bytes: &mut [u8]) {
        bytes.copy_from_slice(samples);
    }
    fn inverse(&mut self, bytes: &[u8], samples: &mut [u8]) {
        samples.copy_from_slice(bytes);
    }
}

fn rearrange(chunk: &Chunk) -> Box<dyn Rearrange + Send> {
    let (shape, channels) = (chunk.shape, chunk.channels.unwrap_or(1));
    match (chunk.samples, chunk.has_deltas()) {
        (SampleType::U8, true) => Box::new(Deltas::<u8>::new(Kernel::fastest(), shape, channels)),
        (_, true) => Box::new(Deltas::<u16>::new(Kernel::fastest(), shape, channels)),
        (SampleType::U8, false) => Box::new(AsIs),
        (samples, false) => Box::new(Shuffled { shape, channels, bytes: samples.bytes() }),
    }
}

fn predict(chunk: &Chunk) -> Box<dyn Predict + Send> {
    let (kernel, shape, channels) = (Kernel::fastest(), chunk.shape, chunk.channels.unwrap_or(1));
    match chunk.samples {
        SampleType::U8 => Box::new(Predictor::<u8>::new(kernel, shape, channels, Numbers::Integer)),
        SampleType::U16 => Box::new(Predictor::<u16>::new(kernel, shape, channels, Numbers::Integer)),
        SampleType::F16 => Box::new(Predictor::<u16>::new(kernel, shape, channels, Numbers::Float)),
        SampleType::F32 => Box::new(Predictor::<u32>::new(kernel, shape, channels, Numbers::Float)),
    }
}

impl ChunkCodec {
    /// For chunks of this kind, none of whose extents is 0.
    ///
    /// # Errors
    /// Where a chunk has more than [`MOST_CHANNELS`] channels or more than 2^32 bytes, or there is no memory for zstd.
    pub fn new(chain: Chain, chunk: Chunk) -> Result<Self> {
        if chunk.channels.unwrap_or(1) > MOST_CHANNELS || u32::try_from(chunk.bytes()).is_err() {
            return Err(Error::usage(format!("a chunk of {chunk:?} is too large")));
        }
        let failed = |error: std::io::Error| Error::internal(format!("zstd: {error}"));
        let mut compressor = Compressor::new(ZSTD_LEVEL).map_err(failed)?;
        if chain == Chain::Predictive || chunk.has_deltas() {
            // Residuals hardly repeat: look for long matches only, give up soon, and leave the rest to the
            // entropy coder, which the level would switch off for such haste.
            for parameter in [
                CParameter::MinMatch(7),
                CParameter::HashLog(12),
                CParameter::TargetLength(16),
                CParameter::LiteralCompressionMode(ParamSwitch::Enable),
            ] {
                compressor.set_parameter(parameter).map_err(failed)?;
            }
        }
        let work = match chain {
            Chain::Stock => {
                compressor.include_checksum(true).map_err(failed)?;
                Work::Stock(rearrange(&chunk))
            }
            Chain::Predictive => Work::Predictive(predict(&chunk), Vec::new()),
        };
        let decompressor = Decompressor::new().map_err(failed)?;
        let packed = vec![0; chunk.bytes()];
        let frame = vec![0; compress_bound(packed.len())];
        Ok(Self { chunk, work, packed, frame, decompressor, compressor })
    }

    /// Appends the encoded chunk to `out`; `samples` are little-endian in C order.
    ///
    /// # Errors
    /// Where `samples` are not as many bytes as the chunk has.
    pub fn encode(&mut self, samples: &[u8], out: &mut Vec<u8>) -> Result<()> {
        self.expect(samples.len())?;
        match &mut self.work {
            Work::Stock(rearrange) => {
                rearrange.forward(samples, &mut self.packed);
                let length = compress(&mut self.compressor, &self.packed, &mut self.frame)?;
                out.extend_from_slice(&self.frame[..length]);
            }
            Work::Predictive(predictor, modes) => {
                predictor.forward(samples, &mut self.packed, modes);
                let start = out.len();
                out.push(VERSION);
                out.extend(modes.iter().map(|mode| mode.to_byte()));
                let plane = self.chunk.shape.samples();
                let lengths = out.len();
                out.resize(lengths + 4 * (self.packed.len() / plane), 0);
                for (number, bytes) in self.packed.chunks_exact(plane).enumerate() {
                    let length = compress(&mut self.compressor, bytes, &mut self.frame)?;
                    let stream = if length < plane { &self.frame[..length] } else { bytes };
                    out.extend_from_slice(stream);
                    let length = stream.len() as u32;
                    out[lengths + 4 * number..][..4].copy_from_slice(&length.to_le_bytes());
                }
                let checksum = crc32fast::hash(&out[start..]);
                out.extend_from_slice(&checksum.to_le_bytes());
            }
        }
        Ok(())
    }

    /// Decodes a chunk into `samples`, whatever its bytes hold.
    ///
    /// # Errors
    /// Where the bytes are not those of such a chunk, or `samples` has not as many bytes as the chunk has.
    pub fn decode(&mut self, bytes: &[u8], samples: &mut [u8]) -> Result<()> {
        self.expect(samples.len())?;
        match &mut self.work {
            Work::Stock(rearrange) => {
                unpack(&mut self.decompressor, bytes, &mut self.packed)?;
                rearrange.inverse(&self.packed, samples);
            }
            Work::Predictive(predictor, modes) => {
                let planes = self.chunk.channels.unwrap_or(1) * self.chunk.samples.bytes();
                let streams = read_header(bytes, planes / self.chunk.samples.bytes(), planes, modes)?;
                let plane = self.chunk.shape.samples();
                for (stream, plane) in streams.into_iter().zip(self.packed.chunks_exact_mut(plane)) {
                    let stream = bytes.get(stream).unwrap_or_default();
                    if stream.len() == plane.len() {
                        plane.copy_from_slice(stream);
                    } else {
                        unpack(&mut self.decompressor, stream, plane)?;
                    }
                }
                predictor.inverse(&self.packed, modes, samples);
            }
        }
        Ok(())
    }

    fn expect(&self, bytes: usize) -> Result<()> {
        if bytes == self.chunk.bytes() {
            return Ok(());
        }
        Err(Error::internal(format!("got a chunk of {bytes} bytes, expected {}", self.chunk.bytes())))
    }
}

/// Compresses into a buffer that is large enough for the worst; returns how many bytes that took.
fn compress(compressor: &mut Compressor<'_>, bytes: &[u8], frame: &mut [u8]) -> Result<usize> {
    compressor.compress_to_buffer(bytes, frame).map_err(|error| Error::internal(format!("zstd: {error}")))
}

/// Decompresses to exactly as many bytes as `out` has.
fn unpack(decompressor: &mut Decompressor<'_>, bytes: &[u8], out: &mut [u8]) -> Result<()> {
    let found =
        decompressor.decompress_to_buffer(bytes, out).map_err(|error| damaged(format!("zstd: {error}")))?;
    if found != out.len() {
        return Err(damaged(format!("a zstd frame of {found} bytes, expected {}", out.len())));
    }
    Ok(())
}

/// Checks an encoded chunk and finds the modes of its channels and its streams.
fn read_header(
    bytes: &[u8],
    channels: usize,
    planes: usize,
    modes: &mut Vec<Mode>,
) -> Result<Vec<Range<usize>>> {
    let header = 1 + channels + 4 * planes;
    let short =
        || damaged(format!("got {} bytes, expected {} or more", bytes.len(), header + CHECKSUM_BYTES));
    let (body, checksum) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or_else(short)?;
    let (head, _) = body.split_at_checked(header).ok_or_else(short)?;
    if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
        return Err(damaged("its checksum does not match its bytes"));
    }
    if head[0] != VERSION {
        return Err(damaged(format!("got layout version {}, expected {VERSION}", head[0])));
    }
    modes.clear();
    for &byte in &head[1..1 + channels] {
        let mode = Mode::from_byte(byte);
        modes.push(mode.ok_or_else(|| damaged(format!("{byte:#04x} is not a mode of prediction")))?);
    }
    let mut end = header;
    let (lengths, _) = head[1 + channels..].as_chunks::<4>();
    let streams = lengths.iter().map(|&length| {
        let start = end;
        end = start.saturating_add(u32::from_le_bytes(length) as usize);
        start..end
    });
    let streams: Vec<_> = streams.collect();
    if end != body.len() {
        return Err(damaged(format!("its streams end at byte {end}, its checksum begins at {}", body.len())));
    }
    Ok(streams)
}

//! Pixels of the chunks, put where they belong.

use exr::math::RoundingMode;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{
    ChannelDescription, IntegerBounds, LevelMode, LineOrder, SampleType as Stored, Text, TileDescription,
};
use exr::meta::header::Header as ChunkHeader;

use super::channels::{Channel, Role};
use super::chunks::Chunk;
use super::header::Header;
use super::trusted;
use crate::picture::alpha::not_opaque;
use crate::picture::size::unsupported;
use crate::reader::Reader;
use crate::{Error, ErrorKind, Result, SampleType, Samples, f16};

/// A sample type of the output that samples of the file convert to without loss.
trait Sample: Copy {
    const ZERO: Self;
    fn from_stored(bytes: &[u8], stored: Stored) -> Result<Self>;
}

impl Sample for f16 {
    const ZERO: f16 = f16::ZERO;

    fn from_stored(bytes: &[u8], _: Stored) -> Result<f16> {
        Ok(f16::from_ne_bytes(array(bytes)))
    }
}

impl Sample for f32 {
    const ZERO: f32 = 0.0;

    fn from_stored(bytes: &[u8], stored: Stored) -> Result<f32> {
        match stored {
            Stored::F16 => Ok(f16::from_ne_bytes(array(bytes)).to_f32()),
            Stored::F32 => Ok(f32::from_ne_bytes(array(bytes))),
            Stored::U32 => {
                let value = u32::from_ne_bytes(array(bytes));
                let float = value as f32;
                if f64::from(float) == f64::from(value) {
                    return Ok(float);
                }
                Err(unsupported(format!("the whole number {value}"), "one that single precision can hold"))
            }
        }
    }
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.try_into().unwrap_or([0; N])
}

fn bytes_of(stored: Stored) -> usize {
    if stored == Stored::F16 { 2 } else { 4 }
}

pub(super) fn read(bytes: &[u8], header: &Header, chunks: &[Chunk]) -> Result<Samples> {
    Ok(match header.channels.sample_type() {
        SampleType::F16 => Samples::F16(read_as(bytes, header, chunks)?),
        _ => Samples::F32(read_as(bytes, header, chunks)?),
    })
}

fn read_as<T: Sample>(bytes: &[u8], header: &Header, chunks: &[Chunk]) -> Result<Vec<T>> {
    let chunk_header = chunk_header(header)?;
    let channels = header.channels.order.len();
    // Earned: every chunk was found long enough for its pixels.
    let mut out = vec![T::ZERO; header.size.pixels().saturating_mul(channels)];
    // Of a channel in the file: where it is handed out, if it is.
    let targets: Vec<Option<usize>> = (0..header.channels.stored.len())
        .map(|number| header.channels.order.iter().position(|&ordered| ordered == number))
        .collect();
    for chunk in chunks {
        let data = decompress(bytes, chunk, header, &chunk_header).map_err(|e| e.at(chunk.data.start))?;
        let mut reader = Reader::new(&data);
        for row in chunk.y..chunk.y.saturating_add(chunk.height) {
            let first = u64::from(row)
                .saturating_mul(u64::from(header.size.width))
                .saturating_add(u64::from(chunk.x));
            let first = usize::try_from(first).unwrap_or(usize::MAX);
            let width = usize::try_from(chunk.width).unwrap_or(usize::MAX);
            for (channel, target) in header.channels.stored.iter().zip(&targets) {
                let len = bytes_of(channel.stored);
                let line = reader.take(width.saturating_mul(len))?;
                let values = line.chunks_exact(len);
                let Some(target) = target else {
                    if channel.role == Role::Alpha {
                        require_opaque(values, channel, first)?;
                    }
                    continue;
                };
                let start = first.saturating_mul(channels).saturating_add(*target);
                let places = out.get_mut(start..).unwrap_or_default().iter_mut().step_by(channels);
                for (place, value) in places.zip(values) {
                    *place = T::from_stored(value, channel.stored)?;
                }
            }
        }
    }
    Ok(out)
}

fn require_opaque<'a>(values: impl Iterator<Item = &'a [u8]>, channel: &Channel, first: usize) -> Result<()> {
    for (value, pixel) in values.zip(first..) {
        if f32::from_stored(value, channel.stored)? != 1.0 {
            return Err(not_opaque(pixel));
        }
    }
    Ok(())
}

/// What the decompressor looks at.
fn chunk_header(header: &Header) -> Result<ChunkHeader> {
    let channels = header.channels.stored.iter().map(|channel| {
        let name = Text::new_or_none(&channel.name)
            .ok_or_else(|| unsupported(format!("the channel {:?}", channel.name), "a name in Latin-1"))?;
        Ok(ChannelDescription {
            name,
            sample_type: channel.stored,
            quantize_linearly: channel.quantize_linearly,
            sampling: Vec2(1, 1),
        })
    });
    let blocks = match header.tile {
        None => BlockDescription::ScanLines,
        Some(tile) => BlockDescription::Tiles(TileDescription {
            tile_size: size(tile),
            level_mode: LevelMode::Singular,
            rounding_mode: RoundingMode::Down,
        }),
    };
    let window = size((header.size.width, header.size.height));
    let made = ChunkHeader::new(Text::default(), window, channels.collect::<Result<_>>()?);
    Ok(made.with_encoding(header.compression, blocks, LineOrder::Increasing))
}

fn size((width, height): (u32, u32)) -> Vec2<usize> {
    Vec2(usize::try_from(width).unwrap_or(usize::MAX), usize::try_from(height).unwrap_or(usize::MAX))
}

/// Lines from the top, in a line channels as in the file, in a channel samples from the left, in the machine's byte order.
fn decompress(bytes: &[u8], chunk: &Chunk, header: &Header, chunk_header: &ChunkHeader) -> Result<Vec<u8>> {
    let data = bytes.get(chunk.data.clone()).unwrap_or_default();
    trusted::require(data, chunk, header)?;
    let corner = |position: u32| i32::try_from(position).unwrap_or(i32::MAX);
    let section = IntegerBounds {
        position: Vec2(corner(chunk.x), corner(chunk.y)),
        size: size((chunk.width, chunk.height)),
    };
    chunk_header
        .compression
        .decompress_image_section_from_le(chunk_header, data.to_vec(), section, true)
        .map_err(|e| refused(&e))
}

fn refused(error: &exr::error::Error) -> Error {
    let kind = match error {
        exr::error::Error::NotSupported(_) => ErrorKind::Unsupported,
        _ => ErrorKind::Malformed,
    };
    Error::new(
        kind,
        format!("a chunk that the OpenEXR decompressor refuses: {error}"),
        "one that decompresses",
    )
}

//! Samples of the strips or tiles, put where they belong.

use super::decompress::decompress;
use super::layout::{Chunk, Layout, Predictor};
use crate::picture::alpha::without_alpha;
use crate::{Error, Result, SampleType, Samples, f16};

/// A sample type by its bits.
trait Sample: Copy + PartialEq {
    const ZERO: Self;
    const OPAQUE: Self;
    /// The upper bits are not looked at.
    fn from_bits(bits: u32) -> Self;
}

impl Sample for u8 {
    const ZERO: u8 = 0;
    const OPAQUE: u8 = u8::MAX;
    fn from_bits(bits: u32) -> u8 {
        let [low, ..] = bits.to_le_bytes();
        low
    }
}

impl Sample for u16 {
    const ZERO: u16 = 0;
    const OPAQUE: u16 = u16::MAX;
    fn from_bits(bits: u32) -> u16 {
        let [low, high, ..] = bits.to_le_bytes();
        u16::from_le_bytes([low, high])
    }
}

impl Sample for f16 {
    const ZERO: f16 = f16::ZERO;
    const OPAQUE: f16 = f16::ONE;
    fn from_bits(bits: u32) -> f16 {
        f16::from_bits(<u16 as Sample>::from_bits(bits))
    }
}

impl Sample for f32 {
    const ZERO: f32 = 0.0;
    const OPAQUE: f32 = 1.0;
    fn from_bits(bits: u32) -> f32 {
        f32::from_bits(bits)
    }
}

/// The layout's data are known to be all there.
pub(super) fn read(bytes: &[u8], layout: &Layout) -> Result<Samples> {
    Ok(match layout.sample_type {
        SampleType::U8 => Samples::U8(read_as(bytes, layout)?),
        SampleType::U16 => Samples::U16(read_as(bytes, layout)?),
        SampleType::F16 => Samples::F16(read_as(bytes, layout)?),
        SampleType::F32 => Samples::F32(read_as(bytes, layout)?),
    })
}

fn read_as<T: Sample>(bytes: &[u8], layout: &Layout) -> Result<Vec<T>> {
    let mut out = vec![T::ZERO; layout.size.samples()];
    for chunk in layout.chunks() {
        place(bytes, layout, &chunk, &mut out).map_err(|e| e.at(chunk.offset))?;
    }
    if layout.alpha { without_alpha(&out, layout.size.channels, T::OPAQUE) } else { Ok(out) }
}

fn place<T: Sample>(bytes: &[u8], layout: &Layout, chunk: &Chunk, out: &mut [T]) -> Result<()> {
    let index = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
    let start = index(chunk.offset);
    let data = bytes.get(start..start.saturating_add(index(chunk.len))).unwrap_or_default();
    let mut unpacked = decompress(data, layout.compression, index(layout.decoded_bytes(chunk)))
        .map_err(|e| Error::malformed(format!("strip or tile {}: {e}", chunk.number), "one that unpacks"))?;

    let (width, channels, together) =
        (u64::from(layout.size.width), layout.size.channels, layout.channels_in_chunk());
    let samples_in_row = index(chunk.width).saturating_mul(together);
    let row_bytes = samples_in_row.saturating_mul(layout.sample_type.bytes());
    // Of a tile at the edge: the part inside the picture.
    let inside = index(chunk.width.min(width.saturating_sub(chunk.x))).saturating_mul(together);
    let rows_inside = u64::from(layout.size.height).saturating_sub(chunk.y);
    let mut bits = Vec::new();
    for (row, number) in unpacked.chunks_exact_mut(row_bytes).zip(0..chunk.rows.min(rows_inside)) {
        unpredict(row, layout, together, &mut bits);
        let pixel = chunk.y.saturating_add(number).saturating_mul(width).saturating_add(chunk.x);
        let first = index(pixel).saturating_mul(channels).saturating_add(index(chunk.plane));
        let step = if layout.planar { channels } else { 1 };
        let targets = out.get_mut(first..).unwrap_or_default().iter_mut().step_by(step);
        for (target, &value) in targets.zip(bits.iter().take(inside)) {
            *target = T::from_bits(value);
        }
    }
    Ok(())
}

/// Turns a row as stored into the bits of its samples.
fn unpredict(row: &mut [u8], layout: &Layout, channels: usize, bits: &mut Vec<u32>) {
    let sample_bytes = layout.sample_type.bytes();
    bits.clear();
    if layout.predictor == Predictor::FloatingPoint {
        for number in channels..row.len() {
            let left =
                number.checked_sub(channels).and_then(|left| row.get(left)).copied().unwrap_or_default();
            if let Some(byte) = row.get_mut(number) {
                *byte = byte.wrapping_add(left);
            }
        }
        bits.resize(row.len().checked_div(sample_bytes).unwrap_or(0), 0);
        for plane in row.chunks_exact(bits.len().max(1)) {
            for (value, &byte) in bits.iter_mut().zip(plane) {
                *value = (*value << 8) | u32::from(byte);
            }
        }
        return;
    }
    let add = |value: u32, &byte: &u8| (value << 8) | u32::from(byte);
    if layout.little_endian {
        bits.extend(row.chunks_exact(sample_bytes).map(|sample| sample.iter().rev().fold(0, add)));
    } else {
        bits.extend(row.chunks_exact(sample_bytes).map(|sample| sample.iter().fold(0, add)));
    }
    if layout.predictor == Predictor::Horizontal {
        for number in channels..bits.len() {
            let left =
                number.checked_sub(channels).and_then(|left| bits.get(left)).copied().unwrap_or_default();
            if let Some(value) = bits.get_mut(number) {
                // Modulo the sample's range, since its upper bits are not looked at.
                *value = value.wrapping_add(left);
            }
        }
    }
}

//! TIFF 6.0 and BigTIFF.
//!
//! Read are 8- and 16-bit integers and 16- and 32-bit floats, grey, RGB, or any number of channels without meaning
//! (named C0, C1, ...), in strips or tiles, uncompressed or by LZW, deflate or PackBits, with either predictor. Planes
//! may be separate in strips. Refused: several pictures in one file, palettes, white-is-zero, CMYK, YCbCr and Lab, turned
//! pictures (Orientation), JPEG inside a TIFF (its decoder shows what it can of a damaged picture; this reader must not).

mod directory;
mod layout;

use std::io::Cursor;

use ::tiff::TiffError;
use ::tiff::decoder::{Decoder, DecodingResult, Limits as Memory};

use super::alpha::without_alpha;
use super::{Picture, PictureHeader};
use crate::{Error, ErrorKind, Limits, Result, SampleType, Samples, f16};

use layout::Layout;

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_layout(&Layout::read(bytes, limits)?))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    let layout = Layout::read(bytes, limits)?;
    layout.require_data(bytes)?;
    Ok(of_layout(&layout))
}

fn of_layout(layout: &Layout) -> PictureHeader {
    PictureHeader {
        width: layout.size.width,
        height: layout.size.height,
        channels: layout.channel_names(),
        sample_type: layout.sample_type,
        linear: matches!(layout.sample_type, SampleType::F16 | SampleType::F32),
        scanlines_are_columns: false,
    }
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    // The decoder computes with what the directory says before it holds it against anything.
    let layout = Layout::read(bytes, limits)?;
    layout.require_data(bytes)?;

    let mut memory = Memory::default();
    memory.decoding_buffer_size = usize::try_from(limits.max_decoded_bytes).unwrap_or(usize::MAX);
    memory.intermediate_buffer_size = bytes.len();
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| undecodable(&e))?.with_limits(memory);
    let mut decoded = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut decoded).map_err(|e| undecodable(&e))?;
    let samples = match decoded {
        DecodingResult::U8(list) => Samples::U8(arrange(list, &layout, u8::MAX)?),
        DecodingResult::U16(list) => Samples::U16(arrange(list, &layout, u16::MAX)?),
        DecodingResult::F16(list) => Samples::F16(arrange(list, &layout, f16::ONE)?),
        DecodingResult::F32(list) => Samples::F32(arrange(list, &layout, 1.0)?),
        _ => {
            return Err(Error::malformed("other samples than the directory says", layout.sample_type.name()));
        }
    };
    Ok(Picture {
        width: layout.size.width,
        height: layout.size.height,
        channels: layout.channel_names(),
        samples,
    })
}

/// Channels side by side, without alpha.
fn arrange<T: Copy + PartialEq>(decoded: Vec<T>, layout: &Layout, opaque: T) -> Result<Vec<T>> {
    if decoded.len() != layout.size.samples() {
        let found = format!("{} decoded samples", decoded.len());
        return Err(Error::malformed(found, format!("{}", layout.size.samples())));
    }
    let interleaved = if layout.planar { interleave(&decoded, layout.size.pixels()) } else { decoded };
    if layout.alpha { without_alpha(&interleaved, layout.size.channels, opaque) } else { Ok(interleaved) }
}

fn interleave<T: Copy>(planes: &[T], pixels: usize) -> Vec<T> {
    let mut out = Vec::with_capacity(planes.len());
    for pixel in 0..pixels {
        out.extend(planes.iter().skip(pixel).step_by(pixels));
    }
    out
}

fn undecodable(error: &TiffError) -> Error {
    let kind = match error {
        TiffError::LimitsExceeded => ErrorKind::Limit,
        TiffError::UnsupportedError(_) => ErrorKind::Unsupported,
        _ => ErrorKind::Malformed,
    };
    Error::new(kind, format!("data that the TIFF decoder refuses: {error}"), "a TIFF that decodes")
}

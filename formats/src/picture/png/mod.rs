//! PNG (ISO/IEC 15948), 8 and 16 bits; smaller depths and palettes are expanded to 8.
//!
//! Not applied: `gAMA`, `cHRM`, `sRGB`, `iCCP`, `sBIT`. Refused: animations.

mod chunks;
mod palette;
mod said;

use std::borrow::Cow;
use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, DecodeOptions, Decoder, DecodingError, Encoder, Limits as Memory, Transformations,
};

use super::alpha::without_alpha;
use super::{Picture, PictureHeader, grey_or_rgb};
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, Samples};

pub(super) use chunks::SIGNATURE;
use said::Said;

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_image(&chunks::header(bytes, limits)?, bytes))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_image(&chunks::walk(bytes, limits)?.image, bytes))
}

fn of_image(image: &chunks::ImageHeader, bytes: &[u8]) -> PictureHeader {
    let said = Said::of(bytes);
    PictureHeader {
        width: image.width,
        height: image.height,
        channels: grey_or_rgb(image.grey),
        sample_type: image.sample_type,
        linear: false,
        scanlines_are_columns: false,
        orientation: said.orientation(),
        profile: said.profile(),
        remarks: said.remarks(),
    }
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    let walked = chunks::walk(bytes, limits)?;
    // The decoder is content as soon as it has all rows, whatever else the stream says.
    walked.require_exact_data(bytes)?;

    let mut options = DecodeOptions::default();
    options.set_ignore_checksums(true); // verified above
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = Decoder::new_with_options(Cursor::new(bytes), options);
    decoder.set_limits(Memory { bytes: usize::try_from(limits.max_decoded_bytes).unwrap_or(usize::MAX) });
    let image = walked.image;
    // For numbers without a colour the decoder has black.
    decoder.set_transformations(if image.palette {
        Transformations::IDENTITY
    } else {
        Transformations::EXPAND
    });
    let mut reader = decoder.read_info().map_err(|e| undecodable(&e))?;
    let Some(len) = reader.output_buffer_size() else {
        return Err(Error::new(ErrorKind::Limit, "a picture", "a size that this machine can address"));
    };
    let mut raw = vec![0; len];
    let decoded = reader.next_frame(&mut raw).map_err(|e| undecodable(&e))?;
    raw.truncate(decoded.buffer_size());
    let channels = grey_or_rgb(image.grey);
    if image.palette {
        let info = reader.info();
        let part = |part: &Option<Cow<'_, [u8]>>| part.as_deref().unwrap_or_default().to_vec();
        let samples = palette::expand(&image, &raw, &part(&info.palette), &part(&info.trns))?;
        return Ok(Picture {
            width: image.width,
            height: image.height,
            channels,
            samples: Samples::U8(samples),
        });
    }
    let samples = match decoded.bit_depth {
        BitDepth::Sixteen => {
            let pairs = raw.chunks_exact(2).map(|pair| pair.iter().fold(0, |v, &b| (v << 8) | u16::from(b)));
            Samples::U16(pairs.collect())
        }
        _ => Samples::U8(raw),
    };
    let stored = decoded.color_type.samples();
    let samples = match (decoded.color_type, samples) {
        (ColorType::GrayscaleAlpha | ColorType::Rgba, Samples::U8(list)) => {
            Samples::U8(without_alpha(&list, stored, u8::MAX)?)
        }
        (ColorType::GrayscaleAlpha | ColorType::Rgba, Samples::U16(list)) => {
            Samples::U16(without_alpha(&list, stored, u16::MAX)?)
        }
        (_, samples) => samples,
    };
    Ok(Picture { width: image.width, height: image.height, channels, samples })
}

fn undecodable(error: &DecodingError) -> Error {
    let kind = match error {
        DecodingError::LimitsExceeded => ErrorKind::Limit,
        _ => ErrorKind::Malformed,
    };
    Error::new(kind, format!("data that the PNG decoder refuses: {error}"), "a PNG that decodes")
}

/// Encodes a picture of one (grey) or three (colour) channels of 8 or 16 bits, without any statement about its transfer
/// curve. The same picture gives the same bytes.
///
/// # Errors
/// [`ErrorKind::Argument`]: other numbers of channels, samples that are floats or not `height * width * channels`.
pub fn encode(picture: &Picture) -> Result<Vec<u8>> {
    let colour = match picture.channels.len() {
        1 => ColorType::Grayscale,
        3 => ColorType::Rgb,
        other => {
            return Err(Error::new(
                ErrorKind::Argument,
                counted(other, "channel"),
                "1 or 3 channels for a PNG",
            ));
        }
    };
    let (depth, raw) = match &picture.samples {
        Samples::U8(list) => (BitDepth::Eight, list.clone()),
        Samples::U16(list) => {
            (BitDepth::Sixteen, list.iter().flat_map(|sample| sample.to_be_bytes()).collect())
        }
        other => {
            let found = format!("samples of type {}", other.sample_type().name());
            return Err(Error::new(ErrorKind::Argument, found, "8 or 16 bits for a PNG"));
        }
    };
    picture.require_whole()?;
    let refused = |e: ::png::EncodingError| {
        Error::new(ErrorKind::Argument, e.to_string(), "a picture that PNG can hold")
    };
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, picture.width, picture.height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(&raw).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(out)
}

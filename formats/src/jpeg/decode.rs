//! Samples of a JPEG.

use std::borrow::Cow;

use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::frame::Arrangement;
use super::interleave::interleaved;
use super::structure;
use crate::{Error, Limits, Result};

/// A decoded image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows; row 0 is the top.
    pub height: u32,
    /// 1 (grey) or 3 (red, green, blue).
    pub channels: u8,
    /// `height * width * channels` samples, 0..=255 with the file's transfer curve: rows from the top, within
    /// a row pixels from the left, within a pixel channels.
    pub samples: Vec<u8>,
}

/// Decodes a JPEG that is complete in every respect that its structure shows; see the [module](super).
///
/// # Errors
///
/// - [`ErrorKind::Malformed`](crate::ErrorKind::Malformed): not a JPEG; cut anywhere; scans, restart markers or
///   tables missing; data that do not decode.
/// - [`ErrorKind::Unsupported`](crate::ErrorKind::Unsupported): arithmetic coding, lossless or hierarchical
///   modes, other than 8 bits, other than 1 or 3 components, unusual sampling factors.
/// - [`ErrorKind::Limit`](crate::ErrorKind::Limit): more pixels or scans than `limits` allows.
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Image> {
    let structure::Walked { header, arrangement, length, not_adobe } = structure::walk(bytes, limits)?;
    let picture = bytes.get(..length).unwrap_or(bytes);
    let picture = without_names(picture, &not_adobe);
    let picture = picture.as_ref();
    let bytes: Cow<'_, [u8]> = match arrangement {
        Arrangement::Ordinary => Cow::Borrowed(picture),
        Arrangement::OneComponent(at) => {
            let mut plain = picture.to_vec();
            if let Some(factors) = plain.get_mut(at) {
                *factors = 0x11;
            }
            Cow::Owned(plain)
        }
        Arrangement::ScatteredScans(grid) => Cow::Owned(interleaved(picture, &grid)?),
    };
    let colours = if header.channels == 1 { ColorSpace::Luma } else { ColorSpace::RGB };
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_max_scans(usize::try_from(limits.max_scans_per_image).unwrap_or(usize::MAX))
        .jpeg_set_out_colorspace(colours);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes.as_ref()), options);
    let samples = decoder.decode().map_err(|e| undecodable(&e))?;

    let pixels = u64::from(header.width).saturating_mul(u64::from(header.height));
    let expected = pixels.saturating_mul(u64::from(header.channels));
    if u64::try_from(samples.len()).ok() != Some(expected) {
        return Err(Error::malformed(
            format!("{} decoded samples", samples.len()),
            format!("{expected}, for {} x {} x {}", header.width, header.height, header.channels),
        ));
    }
    Ok(Image { width: header.width, height: header.height, channels: header.channels, samples })
}

/// The picture with the segments whose names begin at these bytes made segments of no name, which decoders step over.
fn without_names<'a>(picture: &'a [u8], names: &[usize]) -> Cow<'a, [u8]> {
    if names.is_empty() {
        return Cow::Borrowed(picture);
    }
    let mut plain = picture.to_vec();
    for &at in names {
        if let Some(letter) = plain.get_mut(at) {
            *letter = 0;
        }
    }
    Cow::Owned(plain)
}

fn undecodable(error: &DecodeErrors) -> Error {
    Error::malformed(format!("data that the JPEG decoder refuses: {error}"), "a JPEG that decodes")
}

//! Samples of a JPEG.

use std::borrow::Cow;
use std::cell::Cell;

use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::frame::Arrangement;
use super::interleave::interleaved;
use super::structure::{self, Walked};
use super::watched::{Marked, Watched};
use crate::words::counted;
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
    let walked = structure::walk(bytes, limits)?;
    let plain = bytes.get(..walked.length).unwrap_or(bytes);
    let picture = with_colours(plain, &walked);
    let picture = picture.as_ref();
    let header = walked.header;
    let marked = || Marked::new(picture, &walked, picture.len().saturating_sub(plain.len()));
    let data = match &walked.arrangement {
        Arrangement::Ordinary => marked(),
        Arrangement::OneComponent(at) => marked().with(*at, 0x11),
        // Read to the last bit as its scans are put together.
        Arrangement::ScatteredScans(grid) => {
            let mut grid = grid.clone();
            let is_red = !walked.rgb && !walked.red_ids.is_empty();
            if let Some((id, _)) = grid.components.first_mut().filter(|_| is_red) {
                *id = NO_RED;
            }
            Marked::exact(interleaved(picture, &grid)?)
        }
    };
    let colours = if header.channels == 1 { ColorSpace::Luma } else { ColorSpace::RGB };
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_max_scans(usize::try_from(limits.max_scans_per_image).unwrap_or(usize::MAX))
        .jpeg_set_out_colorspace(colours);
    let refilled = Cell::new(0);
    let mut decoder = JpegDecoder::new_with_options(Watched::new(&data.bytes, &refilled), options);
    let samples = decoder.decode().map_err(|e| undecodable(&e))?;
    data.require_all_read(refilled.get())?;

    let pixels = u64::from(header.width).saturating_mul(u64::from(header.height));
    let expected = pixels.saturating_mul(u64::from(header.channels));
    if u64::try_from(samples.len()).ok() != Some(expected) {
        return Err(Error::malformed(
            counted(samples.len(), "decoded sample").to_string(),
            format!("{expected}, for {} x {} x {}", header.width, header.height, header.channels),
        ));
    }
    Ok(Image { width: header.width, height: header.height, channels: header.channels, samples })
}

/// An Adobe segment that says of three components that they are red, green and blue.
const ADOBE_RGB: &[u8] = b"\xFF\xEE\0\x0EAdobe\0\x64\0\0\0\0\0";

/// The id that R becomes where it is none of red.
const NO_RED: u8 = b'Y';

/// The picture with no more than one word about what its components are, that which counts: Adobe segments become ones
/// of no name, which decoders step over, ids that say RGB of what is YCbCr say it no longer, and RGB gets a segment of
/// our own.
fn with_colours<'a>(picture: &'a [u8], walked: &Walked) -> Cow<'a, [u8]> {
    let Walked { adobe, red_ids, rgb, .. } = walked;
    if adobe.is_empty() && red_ids.is_empty() && !rgb {
        return Cow::Borrowed(picture);
    }
    let mut plain = picture.to_vec();
    let names = adobe.iter().map(|&at| (at, 0));
    let ids = red_ids.iter().map(|&at| (at, NO_RED)).filter(|_| !rgb);
    for (at, byte) in names.chain(ids) {
        if let Some(place) = plain.get_mut(at) {
            *place = byte;
        }
    }
    if *rgb && plain.len() > 2 {
        plain.splice(2..2, ADOBE_RGB.iter().copied());
    }
    Cow::Owned(plain)
}

fn undecodable(error: &DecodeErrors) -> Error {
    Error::malformed(format!("data that the JPEG decoder refuses: {error}"), "a JPEG that decodes")
}

//! TIFF 6.0 and BigTIFF.
//!
//! Read are 8- and 16-bit integers and 16- and 32-bit floats, grey, RGB, or any number of channels without meaning
//! (named C0, C1, ...), side by side or apart, in strips or tiles, uncompressed or by LZW, deflate or PackBits, with
//! either predictor. Refused: several pictures in one file (smaller versions beside one do not matter), palettes,
//! white-is-zero, CMYK, YCbCr and Lab, JPEG and fax inside a TIFF.
//!
//! The layout of the file and the predictors are read here, and crates unpack LZW and deflate. (The crate `tiff`
//! multiplies what the directory says before it has held it against anything, refuses some valid LZW tiles at the edge
//! of a picture, and verifies no checksum of deflate.)

mod colours;
mod decompress;
mod directory;
mod layout;
mod pixels;
mod remarks;
mod stack;

use super::{Picture, PictureHeader};
use crate::{Limits, Result, SampleType};

use directory::{Directory, tag};
use layout::Layout;

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_layout(&Layout::read(bytes, limits)?))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    let layout = Layout::read(bytes, limits)?;
    layout.require_data(bytes)?;
    Ok(of_layout(&layout))
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    let layout = Layout::read(bytes, limits)?;
    layout.require_data(bytes)?;
    let samples = pixels::read(bytes, &layout)?;
    let PictureHeader { width, height, channels, .. } = of_layout(&layout);
    Ok(Picture { width, height, channels, samples })
}

/// The orientation that the first directory of a TIFF, or of Exif data, asks for; 1 where it says nothing.
pub(super) fn orientation(bytes: &[u8]) -> Result<u64> {
    Directory::first(bytes)?.number(tag::ORIENTATION, Some(1))
}

/// The colour space that Exif data state (tag 40961 in the directory that tag 34665 leads to).
pub(super) fn exif_colour_space(bytes: &[u8]) -> Result<Option<u64>> {
    let first = Directory::first(bytes)?;
    let Some(offset) = first.list(tag::EXIF_IFD)?.and_then(|list| list.first().copied()) else {
        return Ok(None);
    };
    Ok(first.sibling(offset)?.list(tag::COLOUR_SPACE)?.and_then(|list| list.first().copied()))
}

fn of_layout(layout: &Layout) -> PictureHeader {
    PictureHeader {
        width: layout.size.width,
        height: layout.size.height,
        channels: layout.channel_names(),
        sample_type: layout.sample_type,
        linear: matches!(layout.sample_type, SampleType::F16 | SampleType::F32),
        scanlines_are_columns: false,
        orientation: layout.orientation,
        profile: layout.profile.clone(),
        remarks: layout.remarks.clone(),
    }
}

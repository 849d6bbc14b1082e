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
pub(super) mod exif;
mod layout;
mod pixels;
mod remarks;
mod stack;

use super::{Picture, PictureHeader};
use crate::{Limits, Result, SampleType};

use directory::Directory;
use layout::Layout;

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_layout(&layout(bytes, limits)?))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_layout(&layout_with_data(bytes, limits)?))
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    let layout = layout_with_data(bytes, limits)?;
    let samples = pixels::read(bytes, &layout)?;
    let PictureHeader { width, height, channels, .. } = of_layout(&layout);
    Ok(Picture { width, height, channels, samples })
}

/// The layout of the one picture of a file.
fn layout(bytes: &[u8], limits: &Limits) -> Result<Layout> {
    let directory = Directory::read(bytes)?;
    let layout = Layout::read(&directory, bytes, limits)?;
    stack::require_single(&directory, &layout, bytes.len())?;
    Ok(layout)
}

/// The same with its data, whose strips are all there.
fn layout_with_data(bytes: &[u8], limits: &Limits) -> Result<Layout> {
    let layout = layout(bytes, limits)?;
    layout.require_data(bytes)?;
    stack::require_short_strips(&layout)?;
    Ok(layout)
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

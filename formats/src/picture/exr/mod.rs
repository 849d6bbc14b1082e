//! OpenEXR: one flat part of half and float channels, in scan lines or tiles.
//!
//! The container is read here, strictly: every chunk of the offset table must be there, at its place, with a length
//! that its pixels can come from. The crate `exr` decompresses one chunk at a time. (Its own reader sizes its tables by
//! the header before it has seen that many bytes, takes the last of two attributes of one name, and goes on where the
//! offset table is damaged.)
//!
//! The picture is the data window; another display window is told. Beside R, G and B only channels of light are read:
//! depth, normals and their like are left out and told. Chromaticities and white luminance are not applied. Refused:
//! several parts, several layers with colours (a single one is the picture), deep data, mip maps, subsampled channels,
//! HTJ2K.
//!
//! Source: "OpenEXR File Layout" of the Academy Software Foundation.

mod channels;
mod chunks;
mod encode;
mod header;
mod pixels;
mod trusted;

pub use encode::{Compression, encode};

use super::{Picture, PictureHeader};
use crate::{Limits, Result};

use header::Header;

pub(super) use header::MAGIC;

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_header(&Header::read(bytes, limits)?))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    let header = Header::read(bytes, limits)?;
    chunks::find(bytes, &header)?;
    Ok(of_header(&header))
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture> {
    let header = Header::read(bytes, limits)?;
    let chunks = chunks::find(bytes, &header)?;
    let samples = pixels::read(bytes, &header, &chunks)?;
    let PictureHeader { width, height, channels, .. } = of_header(&header);
    Ok(Picture { width, height, channels, samples })
}

fn of_header(header: &Header) -> PictureHeader {
    PictureHeader {
        width: header.size.width,
        height: header.size.height,
        channels: header.channels.names(),
        sample_type: header.channels.sample_type(),
        linear: true,
        scanlines_are_columns: false,
        orientation: header.orientation,
        profile: header.profile.clone(),
        remarks: remarks(header),
    }
}

fn remarks(header: &Header) -> Vec<String> {
    let layer = header.channels.layer.as_ref().map(|layer| format!("the layer {layer:?} is the picture"));
    let left_out = header.channels.left_out().join(", ");
    let left_out = (!left_out.is_empty())
        .then(|| format!("the channels {left_out}, which are no colours, are left out"));
    let windows = header.windows.map(|[data, shown]| {
        format!("the data window {data:?} is the picture, and not the display window {shown:?}")
    });
    layer.into_iter().chain(left_out).chain(windows).chain(header.not_applied.iter().cloned()).collect()
}

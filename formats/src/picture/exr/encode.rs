//! Pictures of any channels as OpenEXR files.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, LayerAttributes, LineOrder, SmallVec,
    Text, WritableImage,
};
use exr::prelude::{Compression as Method, Layer};

use crate::picture::Picture;
use crate::{Error, ErrorKind, Result, Samples};

/// How the samples are stored; both keep every bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compression {
    /// As they are.
    None,
    /// Deflate, 16 rows at a time: every reader knows it.
    #[default]
    Zip,
}

/// Encodes a picture of halves or floats with its channels' names, as one flat part in scan lines, rows from the top, data window
/// and display window `[0, width) x [0, height)`. The same picture gives the same bytes.
///
/// The format sorts channels by name; [`decode()`](crate::picture::decode) hands them out in its own order.
///
/// # Errors
/// [`ErrorKind::Argument`]: integer samples, not `height * width * channels` of them; names that are empty, longer
/// than 255 bytes, not ASCII or used twice.
pub fn encode(picture: &Picture, compression: Compression) -> Result<Vec<u8>> {
    picture.require_whole()?;
    let count = picture.channels.len();
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (number, name) in picture.channels.iter().enumerate() {
        let used = picture.channels.iter().take(number).any(|before| before == name);
        if name.is_empty() || name.len() > 255 || !name.is_ascii() || name.contains('\0') || used {
            let found = format!("the channel name {name:?}, number {number}");
            return Err(Error::new(ErrorKind::Argument, found, "1 to 255 ASCII characters, none twice"));
        }
        let samples = match &picture.samples {
            Samples::F16(list) => {
                FlatSamples::F16(list.iter().skip(number).step_by(count).copied().collect())
            }
            Samples::F32(list) => {
                FlatSamples::F32(list.iter().skip(number).step_by(count).copied().collect())
            }
            other => {
                let found = format!("samples of type {}", other.sample_type().name());
                return Err(Error::new(ErrorKind::Argument, found, "float16 or float32 for an OpenEXR file"));
            }
        };
        channels.push(AnyChannel::new(Text::from(name.as_str()), samples));
    }
    let encoding = Encoding {
        compression: match compression {
            Compression::None => Method::Uncompressed,
            Compression::Zip => Method::ZIP16,
        },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let [width, height] = [picture.width, picture.height].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let layer =
        Layer::new((width, height), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut out = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut out)
        .map_err(|e| Error::new(ErrorKind::Argument, e.to_string(), "a picture that OpenEXR can hold"))?;
    Ok(out.into_inner())
}

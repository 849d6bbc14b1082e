//! Picture files written row by row, so that a picture may be larger than memory.

use std::io::{Seek, Write};
use std::path::Path;

use exr::block::writer::ChunksWriter;
use exr::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType, Text};
use exr::meta::header::Header;

use crate::disk::output::{self, Ready, prepare_seeking};
use crate::error::{Error, Result};
use crate::picture::{Bits, Encoding, Ending, Meaning, encoded, refused};
use crate::run::Existing;
use crate::shape::Size;

/// Bytes of compressed pixels that are written at once.
const PIECE_BYTES: usize = 64 << 10;

/// Writes a picture file from rows that `row` gives from the top down; it gets its name when it is published.
///
/// PNG and EXR are written as the rows come; of other formats all rows are gathered first.
///
/// # Errors
/// A size that the format does not take, those of `row` and of writing, and [`crate::ErrorKind::Recipe`] where another
/// file is.
pub fn prepare(
    path: &Path,
    encoding: Encoding,
    size: Size,
    meaning: Meaning,
    existing: Existing,
    row: impl FnMut(&mut [[f32; 3]]) -> Result<()>,
) -> Result<Ready> {
    encoding.check_size(size)?;
    if encoding.ending == Ending::Exr {
        return prepare_seeking(path, existing, |output| exr(output, size, row));
    }
    output::prepare(path, existing, |output| match encoding.ending {
        Ending::Png => png(output, encoding.bits, size, meaning, row),
        Ending::Exr => exr(output, size, row),
        Ending::Jpeg | Ending::WebP | Ending::Tiff => encoded::write(output, encoding, size, meaning, row),
    })
}

/// A PNG of display values.
fn png(
    output: impl Write,
    bits: Bits,
    size: Size,
    meaning: Meaning,
    mut row: impl FnMut(&mut [[f32; 3]]) -> Result<()>,
) -> Result<()> {
    let mut writer = png_header(output, size, bits)?;
    let mut stream = writer.stream_writer_with_size(PIECE_BYTES).map_err(png_failed)?;
    let mut pixels = vec![[0.0; 3]; size.width];
    let mut bytes = vec![0; 3 * size.width * bits.bytes()];
    let mut wide = vec![0u16; 3 * size.width];
    for _ in 0..size.height {
        row(&mut pixels)?;
        match bits {
            Bits::Eight => meaning.encode(&pixels, &mut bytes),
            Bits::Sixteen => {
                meaning.encode_wide(&pixels, &mut wide);
                let samples = wide.iter().flat_map(|sample| sample.to_be_bytes());
                bytes.iter_mut().zip(samples).for_each(|(to, byte)| *to = byte);
            }
        }
        stream.write_all(&bytes).map_err(refused)?;
    }
    stream.finish().map_err(png_failed)?;
    writer.finish().map_err(png_failed)
}

/// Begins a PNG of sRGB values.
pub(super) fn png_header<W: Write>(output: W, size: Size, bits: Bits) -> Result<png::Writer<W>> {
    let side = |texels: usize| u32::try_from(texels).unwrap_or(0);
    let mut encoder = png::Encoder::new(output, side(size.width), side(size.height));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(match bits {
        Bits::Eight => png::BitDepth::Eight,
        Bits::Sixteen => png::BitDepth::Sixteen,
    });
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.write_header().map_err(png_failed)
}

/// An error of writing a PNG.
pub(super) fn png_failed(error: png::EncodingError) -> Error {
    match error {
        png::EncodingError::IoError(error) => refused(error),
        error => Error::internal(format!("cannot encode a PNG: {error}")),
    }
}

/// An EXR of the values as 32-bit floats, a row a block.
pub(super) fn exr(
    output: impl Write + Seek,
    size: Size,
    mut row: impl FnMut(&mut [[f32; 3]]) -> Result<()>,
) -> Result<()> {
    let channels = ["B", "G", "R"].map(|name| ChannelDescription::named(name, SampleType::F32));
    let header = Header::new(Text::default(), (size.width, size.height), channels.into_iter().collect())
        .with_encoding(
            exr::compression::Compression::RLE,
            BlockDescription::ScanLines,
            LineOrder::Increasing,
        );
    let mut pixels = vec![[0.0f32; 3]; size.width];
    let mut failed = None;
    let written = exr::block::write(output, [header].into_iter().collect(), true, |meta, file| {
        let mut file = file.sequential_blocks_compressor(&meta);
        for (number, index) in enumerate_ordered_header_block_indices(&meta.headers) {
            if let Err(error) = row(&mut pixels) {
                failed = Some(error);
                return Err(exr::error::Error::Aborted);
            }
            let channel = |c: usize| pixels.iter().flat_map(move |pixel| pixel[c].to_ne_bytes());
            let data = [2, 1, 0].into_iter().flat_map(channel).collect();
            file.compress_block(number, UncompressedBlock { index, data })?;
        }
        Ok(())
    });
    match (failed, written) {
        (Some(error), _) => Err(error),
        (None, Err(exr::error::Error::Io(error))) => Err(refused(error)),
        (None, written) => written.map_err(|error| Error::internal(format!("cannot encode an EXR: {error}"))),
    }
}

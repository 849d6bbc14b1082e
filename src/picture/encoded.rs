//! Picture files that are put together in memory, by the crate `image`: JPEG, lossless WebP and TIFF, without metadata.

use std::io::{Cursor, Write};

use image::codecs::jpeg::JpegEncoder;
use image::codecs::tiff::TiffEncoder;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageResult};

use super::{Bits, Encoding, Ending, Meaning, refused};
use crate::error::{Error, Result};
use crate::shape::Size;

/// Writes the rows that `row` gives from the top down.
///
/// # Errors
/// Those of `row`, [`crate::ErrorKind::Io`] where the system refuses to write, and what the encoder refuses.
pub(super) fn write(
    mut output: impl Write,
    encoding: Encoding,
    size: Size,
    meaning: Meaning,
    mut row: impl FnMut(&mut [[f32; 3]]) -> Result<()>,
) -> Result<()> {
    let mut pixels = vec![[0.0; 3]; size.width];
    let row_bytes = 3 * size.width * encoding.bits.bytes();
    let mut bytes = vec![0; row_bytes * size.height];
    let mut wide = vec![0u16; 3 * size.width];
    for line in bytes.chunks_exact_mut(row_bytes.max(1)) {
        row(&mut pixels)?;
        match encoding.bits {
            Bits::Eight => meaning.encode(&pixels, line),
            Bits::Sixteen => {
                meaning.encode_wide(&pixels, &mut wide);
                // The encoder takes samples in the order of the machine and writes them in one order.
                line.copy_from_slice(bytemuck::cast_slice(&wide));
            }
        }
    }
    let color = match encoding.bits {
        Bits::Eight => ExtendedColorType::Rgb8,
        Bits::Sixteen => ExtendedColorType::Rgb16,
    };
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let (width, height) = (side(size.width), side(size.height));
    let mut file = Cursor::new(Vec::new());
    let encoded: ImageResult<()> = match encoding.ending {
        Ending::Jpeg => JpegEncoder::new_with_quality(&mut file, encoding.quality)
            .write_image(&bytes, width, height, color),
        Ending::WebP => WebPEncoder::new_lossless(&mut file).write_image(&bytes, width, height, color),
        Ending::Tiff => TiffEncoder::new(&mut file).write_image(&bytes, width, height, color),
        Ending::Png | Ending::Exr => return Err(Error::internal("PNG and EXR are written row by row")),
    };
    encoded.map_err(|error| Error::internal(format!("cannot encode the picture: {error}")))?;
    // From front to back, as an output is compared with what is there.
    output.write_all(file.get_ref()).map_err(refused)
}

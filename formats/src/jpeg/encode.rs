//! Writing JPEG, in the flavour of the published sets.

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, EncodingError, SamplingFactor};

use crate::words::counted;
use crate::{Error, ErrorKind, Result};

/// Resolution at which the two colour differences are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chroma {
    /// One value a pixel, 4:4:4.
    Full,
    /// One value for 2 x 2 pixels, their mean, 4:2:0.
    Half,
}

/// How to write a JPEG.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncodeOptions {
    /// 1..=100 on the scale of the Independent JPEG Group; 100 makes every quantisation step 1.
    pub quality: u8,
    /// Progressive, else baseline.
    pub progressive: bool,
    /// Resolution of the colour differences; of no effect on a grey image.
    pub chroma: Chroma,
}

impl EncodeOptions {
    /// As the published UBO2003 files are: progressive, 4:2:0, quantisation steps of 1.
    pub const UBO2003: EncodeOptions =
        EncodeOptions { quality: 100, progressive: true, chroma: Chroma::Half };
}

/// Encodes `samples` in the layout of [`Image::samples`](super::Image::samples): `height * width * channels`
/// values, `channels` 1 (grey) or 3 (red, green, blue). The bytes depend on the arguments only.
///
/// # Errors
///
/// [`ErrorKind::Argument`]: width or height not in 1..=65535, channels neither 1 nor 3, a quality outside
/// 1..=100, or a number of samples that does not fit.
///
/// ```
/// use btfkit_formats::{Limits, jpeg};
///
/// # fn main() -> Result<(), btfkit_formats::Error> {
/// let grey = vec![128u8; 20 * 10];
/// let bytes = jpeg::encode(&grey, 20, 10, 1, &jpeg::EncodeOptions::UBO2003)?;
/// let image = jpeg::decode(&bytes, &Limits::default())?;
/// assert_eq!((image.width, image.height, image.channels), (20, 10, 1));
/// assert_eq!(image.samples, grey);
/// # Ok(())
/// # }
/// ```
pub fn encode(
    samples: &[u8],
    width: u32,
    height: u32,
    channels: u8,
    options: &EncodeOptions,
) -> Result<Vec<u8>> {
    let argument = |found: String, expected| Error::new(ErrorKind::Argument, found, expected);
    let size = u16::try_from(width).ok().zip(u16::try_from(height).ok()).filter(|&(w, h)| w > 0 && h > 0);
    let Some((columns, rows)) = size else {
        return Err(argument(format!("{width} x {height} pixels"), "1..=65535 each way"));
    };
    let colours = match channels {
        1 => ColorType::Luma,
        3 => ColorType::Rgb,
        _ => return Err(argument(counted(channels, "channel"), "1 or 3")),
    };
    if !(1..=100).contains(&options.quality) {
        return Err(argument(format!("quality {}", options.quality), "1..=100"));
    }
    let needed = u64::from(columns).saturating_mul(u64::from(rows)).saturating_mul(u64::from(channels));
    if u64::try_from(samples.len()).ok() != Some(needed) {
        let found = format!("{} for {width} x {height} x {channels}", counted(samples.len(), "sample"));
        return Err(argument(found, "exactly as many as the product"));
    }

    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, options.quality);
    encoder.set_progressive(options.progressive);
    encoder.set_sampling_factor(match options.chroma {
        Chroma::Full => SamplingFactor::R_4_4_4,
        Chroma::Half if channels == 1 => SamplingFactor::R_4_4_4,
        Chroma::Half => SamplingFactor::R_4_2_0,
    });
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    encoder.encode(samples, columns, rows, colours).map_err(|e| match e {
        EncodingError::IoError(io) => Error::io("writing the image", io),
        other => argument(other.to_string(), "an image that a JPEG can hold"),
    })?;
    Ok(bytes)
}

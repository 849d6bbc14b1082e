//! Radiance pictures: three mantissas and a shared exponent a pixel, in runs.
//!
//! A sample is `mantissa * 2^(exponent - 136)`, exact in single precision, divided by the product of the header's
//! `EXPOSURE` lines and of its channel's factors in `COLORCORR` lines. (Radiance's own tools add half a step to
//! every mantissa; most other readers do not, and neither does this one.) XYZE pictures keep their channels X, Y, Z.
//!
//! Sources: the file format chapter of the Radiance reference manual ("Picture File Format") and Ward's
//! "Real Pixels", Graphics Gems II.

mod header;
mod scanline;

use header::{Axis, Header};

use super::{HdrOrientation, Picture, PictureHeader};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Limits, Result, SampleType, Samples};

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    Ok(of_header(&Header::read(&mut Reader::new(bytes), limits)?))
}

pub(super) fn check(bytes: &[u8], limits: &Limits) -> Result<PictureHeader> {
    let mut reader = Reader::new(bytes);
    let header = Header::read(&mut reader, limits)?;
    let mut line = Vec::new();
    for _ in 0..header.scanlines() {
        scanline::read(&mut reader, header.scanline_len(), &mut line)?;
    }
    require_end(&reader)?;
    Ok(of_header(&header))
}

pub(super) fn decode(bytes: &[u8], orientation: HdrOrientation, limits: &Limits) -> Result<Picture> {
    let mut reader = Reader::new(bytes);
    let header = Header::read(&mut reader, limits)?;
    // As many pixels as the bytes yield; only when all are there is the picture's own memory taken.
    let mut pixels: Vec<[u8; 4]> = Vec::new();
    let mut line = Vec::new();
    for _ in 0..header.scanlines() {
        scanline::read(&mut reader, header.scanline_len(), &mut line)?;
        pixels.extend_from_slice(&line);
    }
    require_end(&reader)?;

    let place = header.placement(orientation)?;
    let factors = header.factors();
    let mut samples = vec![0.0f32; pixels.len().saturating_mul(3)];
    for (line_number, line) in pixels.chunks_exact(header.scanline_len()).enumerate() {
        for (position, &[r, g, b, exponent]) in line.iter().enumerate() {
            let scale = scale_of(exponent);
            let start = place.pixel(line_number, position).saturating_mul(3);
            let target = samples.get_mut(start..start.saturating_add(3)).unwrap_or_default();
            for ((sample, mantissa), factor) in target.iter_mut().zip([r, g, b]).zip(factors) {
                *sample = (f64::from(mantissa) * scale / factor) as f32;
            }
        }
    }
    if let Some(position) = samples.iter().position(|sample| !sample.is_finite()) {
        let found = format!("a value beyond single precision at pixel {}", position / 3);
        return Err(Error::malformed(found, "EXPOSURE and COLORCORR that keep it within"));
    }
    Ok(Picture {
        width: header.width,
        height: header.height,
        channels: header.channel_names(),
        samples: Samples::F32(samples),
    })
}

/// `2^(exponent - 136)`, and 0 for the exponent 0, which means black.
fn scale_of(exponent: u8) -> f64 {
    const BIAS_F64_LESS_136: u64 = 1023 - 136;
    match exponent {
        0 => 0.0,
        _ => f64::from_bits(BIAS_F64_LESS_136.saturating_add(u64::from(exponent)) << 52),
    }
}

fn require_end(reader: &Reader<'_>) -> Result<()> {
    if reader.rest().is_empty() {
        return Ok(());
    }
    let found = format!("{} after the last scan line", counted(reader.rest().len(), "byte"));
    Err(Error::malformed(found, "none").at(reader.position()))
}

fn of_header(header: &Header) -> PictureHeader {
    PictureHeader {
        width: header.width,
        height: header.height,
        channels: header.channel_names(),
        sample_type: SampleType::F32,
        linear: true,
        scanlines_are_columns: header.scanline_axis() == Axis::Y,
        // The resolution line says where the first pixel lies, and is obeyed.
        orientation: 1,
        profile: header.profile.clone(),
        remarks: header.remarks.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::scale_of;

    #[test]
    fn scales_are_powers_of_two() {
        assert_eq!(scale_of(0), 0.0);
        assert_eq!(scale_of(136), 1.0);
        assert_eq!(scale_of(128), 1.0 / 256.0);
        assert_eq!(scale_of(255), 2f64.powi(119));
        assert_eq!(scale_of(1), 2f64.powi(-135));
    }
}

//! Pictures: linear values or false colours, written as PNG, JPEG, WebP or TIFF (display) or EXR (values).

pub mod chart;
pub mod deepzoom;
pub mod drawing;
mod encoded;
pub mod ending;
pub mod false_color;
pub mod stream;

use std::path::Path;

pub use ending::{Bits, Encoding, Ending};

use crate::color::{srgb_encode, srgb_encode_all};
use crate::disk::output::{Made, Ready};
use crate::error::{Error, Result};
use crate::run::Existing;
use crate::shape::{Size, Window};

/// What the values of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Linear RGB: a display needs the sRGB curve.
    Linear,
    /// Display values 0..1 as they are: false colours.
    Display,
}

impl Meaning {
    /// 8-bit display values of pixels, three a pixel.
    pub fn encode(self, pixels: &[[f32; 3]], bytes: &mut [u8]) {
        let values = pixels.as_flattened().iter();
        match self {
            Self::Linear => srgb_encode_all(values.copied(), bytes),
            Self::Display => {
                let byte = |value: &f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
                values.zip(bytes).for_each(|(value, to)| *to = byte(value));
            }
        }
    }

    /// 16-bit display values of pixels, three a pixel.
    pub(crate) fn encode_wide(self, pixels: &[[f32; 3]], samples: &mut [u16]) {
        for (&value, to) in pixels.as_flattened().iter().zip(samples) {
            // What is no number is black.
            let value = if value > 0.0 { f64::from(value.min(1.0)) } else { 0.0 };
            let display = if self == Self::Linear { srgb_encode(value) } else { value };
            *to = (display * 65535.0).round() as u16;
        }
    }
}

/// An RGB picture, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Rows and columns.
    pub size: Size,
    /// Values, row by row.
    pub pixels: Vec<[f32; 3]>,
    /// What they mean.
    pub meaning: Meaning,
}

impl Picture {
    /// A picture of linear values.
    pub fn linear(size: Size, pixels: Vec<[f32; 3]>) -> Self {
        Self { size, pixels, meaning: Meaning::Linear }
    }

    /// A picture of display values.
    pub fn display(size: Size, pixels: Vec<[f32; 3]>) -> Self {
        Self { size, pixels, meaning: Meaning::Display }
    }

    /// 8-bit display values, row by row.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; 3 * self.pixels.len()];
        self.meaning.encode(&self.pixels, &mut bytes);
        bytes
    }

    /// The same picture as display values.
    pub fn as_display(&self) -> Self {
        let pixels =
            self.bytes().chunks_exact(3).map(|p| std::array::from_fn(|c| f32::from(p[c]) / 255.0)).collect();
        Self::display(self.size, pixels)
    }

    /// The picture of another size that repeats this one from its top left corner.
    pub fn repeated(&self, size: Size) -> Self {
        let pixel = |n: usize| {
            let (y, x) = (n / size.width % self.size.height, n % size.width % self.size.width);
            self.pixels[y * self.size.width + x]
        };
        Self { size, pixels: (0..size.texels()).map(pixel).collect(), meaning: self.meaning }
    }

    /// A part of it.
    pub fn part(&self, window: Window) -> Self {
        let rows = self.pixels.chunks_exact(self.size.width).skip(window.y).take(window.size.height);
        let pixels = rows.flat_map(|row| &row[window.x..window.x + window.size.width]).copied().collect();
        Self { size: window.size, pixels, meaning: self.meaning }
    }

    /// Each pixel as a square of `factor` pixels.
    pub fn magnified(&self, factor: usize) -> Self {
        let size = Size::new(self.size.height * factor, self.size.width * factor);
        let pixel =
            |n: usize| self.pixels[n / size.width / factor * self.size.width + n % size.width / factor];
        Self { size, pixels: (0..size.texels()).map(pixel).collect(), meaning: self.meaning }
    }

    /// Pictures of one height and meaning side by side with a white gap between.
    pub fn side_by_side(pictures: &[Self], gap: usize) -> Self {
        let height = pictures.iter().map(|picture| picture.size.height).min().unwrap_or(0);
        let width =
            pictures.iter().map(|picture| picture.size.width + gap).sum::<usize>().saturating_sub(gap);
        let mut pixels = Vec::with_capacity(height * width);
        for y in 0..height {
            for (number, picture) in pictures.iter().enumerate() {
                if number > 0 {
                    pixels.extend(std::iter::repeat_n([1.0; 3], gap));
                }
                pixels
                    .extend_from_slice(&picture.pixels[y * picture.size.width..(y + 1) * picture.size.width]);
            }
        }
        let meaning = pictures.first().map_or(Meaning::Display, |picture| picture.meaning);
        Self { size: Size::new(height, width), pixels, meaning }
    }

    /// The bytes of a PNG file.
    pub fn png(&self) -> Result<Vec<u8>> {
        png(self.size, &self.bytes())
    }

    /// The bytes of an EXR file: the values as 32-bit floats.
    pub fn exr(&self) -> Result<Vec<u8>> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut rows = self.pixels.chunks_exact(self.size.width);
        stream::exr(&mut bytes, self.size, |row| {
            rows.next().into_iter().for_each(|pixels| row.copy_from_slice(pixels));
            Ok(())
        })?;
        Ok(bytes.into_inner())
    }

    /// Writes a file whose format the ending of its name says; it appears whole or not at all.
    ///
    /// # Errors
    /// An ending that is not known, a size that the format does not take, those of writing, and
    /// [`crate::ErrorKind::Recipe`] where another file is.
    pub fn write(&self, path: &Path, existing: Existing) -> Result<Made> {
        self.prepare(path, existing)?.publish()
    }

    /// As [`Self::write`], without its name yet.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn prepare(&self, path: &Path, existing: Existing) -> Result<Ready> {
        let encoding = Encoding::of(path, &Ending::ALL)?;
        let mut rows = self.pixels.chunks_exact(self.size.width);
        stream::prepare(path, encoding, self.size, self.meaning, existing, |row| {
            rows.next().into_iter().for_each(|pixels| row.copy_from_slice(pixels));
            Ok(())
        })
    }
}

/// The bytes of a PNG file of 8-bit display values, three a pixel.
pub fn png(size: Size, pixels: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer = stream::png_header(&mut bytes, size, Bits::Eight)?;
    writer.write_image_data(pixels).map_err(stream::png_failed)?;
    writer.finish().map_err(stream::png_failed)?;
    Ok(bytes)
}

/// What the operating system refused; the caller knows the path.
fn refused(error: std::io::Error) -> Error {
    Error::refused("write", error)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn picture() -> Picture {
        Picture::linear(Size::new(2, 3), (0..6).map(|n| [n as f32 / 5.0, 0.25, 1.5]).collect())
    }

    #[test]
    fn an_exr_holds_the_values_themselves() {
        use exr::prelude::{ReadChannels, ReadLayers};
        let bytes = picture().exr().unwrap();
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| {
                    Picture::linear(Size::new(size.height(), size.width()), vec![[0.0; 3]; size.area()])
                },
                |picture, place, (r, g, b): (f32, f32, f32)| {
                    picture.pixels[place.y() * picture.size.width + place.x()] = [r, g, b];
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(std::io::Cursor::new(bytes))
            .unwrap();
        assert_eq!(image.layer_data.channel_data.pixels, picture());
    }

    #[test]
    fn a_png_holds_display_values() {
        let bytes = picture().png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut samples).unwrap();
        assert_eq!(samples, picture().bytes());
        assert_eq!(&samples[..3], [0, 137, 255]);
    }

    #[test]
    fn repetition_and_parts_take_the_right_pixels() {
        let repeated = picture().repeated(Size::new(5, 7));
        assert_eq!(repeated.pixels[3 * 7 + 4], picture().pixels[3 + 1]);
        let part = repeated.part(Window { y: 2, x: 3, size: Size::new(2, 3) });
        assert_eq!(part, picture());
    }
}

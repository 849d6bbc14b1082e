//! Formats of pictures: what the ending of a name asks for, and what each format can take.

use std::path::Path;

use crate::error::{Error, Result};
use crate::run::budget::Allowance;
use crate::shape::Size;
use crate::words::counted;

/// Formats of pictures, by the endings of their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Display values of 8 or 16 bits, without loss.
    Png,
    /// 8-bit display values, with loss.
    Jpeg,
    /// 8-bit display values, without loss.
    WebP,
    /// Display values of 8 or 16 bits, without loss.
    Tiff,
    /// 32-bit float values.
    Exr,
}

/// Bits of a display value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// 0 to 255.
    Eight,
    /// 0 to 65535.
    Sixteen,
}

impl Bits {
    /// Bytes of a value.
    pub fn bytes(self) -> usize {
        match self {
            Self::Eight => 1,
            Self::Sixteen => 2,
        }
    }
}

/// Quality of a JPEG unless one is asked for.
pub const QUALITY: u8 = 90;

impl Ending {
    /// All formats.
    pub const ALL: [Self; 5] = [Self::Png, Self::Jpeg, Self::WebP, Self::Tiff, Self::Exr];
    /// The formats of display values: for charts, sheets and comparisons, which have no linear values.
    pub const DISPLAY: [Self; 4] = [Self::Png, Self::Jpeg, Self::WebP, Self::Tiff];

    /// The endings of its names, the usual one first.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Png => &["png"],
            Self::Jpeg => &["jpg", "jpeg"],
            Self::WebP => &["webp"],
            Self::Tiff => &["tif", "tiff"],
            Self::Exr => &["exr"],
        }
    }

    /// The format that a name asks for, of those that are allowed.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Usage`] for any other ending; the message lists those that are allowed.
    pub fn of(path: &Path, allowed: &[Self]) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        let named = |format: &&Self| ending.as_deref().is_some_and(|name| format.endings().contains(&name));
        if let Some(&format) = allowed.iter().find(named) {
            return Ok(format);
        }
        let list = allowed.iter().flat_map(|format| format.endings()).map(|name| format!(".{name}"));
        let list = list.collect::<Vec<_>>().join(", ");
        let why = match Self::ALL.iter().find(named) {
            Some(_) => "this picture has display values only, no linear ones; ",
            None => "",
        };
        Err(Error::usage(format!("{}: {why}expected a name that ends in {list}", path.display())))
    }

    fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::WebP => "WebP",
            Self::Tiff => "TIFF",
            Self::Exr => "EXR",
        }
    }

    /// The longest side that its files have.
    fn most_side(self) -> usize {
        match self {
            Self::Png | Self::Exr | Self::Tiff => (1 << 31) - 1,
            Self::Jpeg => 65_535,
            Self::WebP => 16_383,
        }
    }

    /// Whether rows go into the file as they come, so that a picture may be larger than memory.
    fn streams(self) -> bool {
        matches!(self, Self::Png | Self::Exr)
    }
}

/// Most bytes of the pixels of a TIFF: its offsets have 32 bits.
const TIFF_BYTES: u64 = (1 << 32) - (1 << 20);

/// How a picture is written: the format and what is chosen about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// The format.
    pub ending: Ending,
    /// Of display values.
    pub bits: Bits,
    /// Of a JPEG, 1 to 100.
    pub quality: u8,
}

impl Encoding {
    /// What a name asks for, of the formats that are allowed: 8 bits, and the usual quality.
    ///
    /// # Errors
    /// See [`Ending::of`].
    pub fn of(path: &Path, allowed: &[Ending]) -> Result<Self> {
        Ok(Self { ending: Ending::of(path, allowed)?, bits: Bits::Eight, quality: QUALITY })
    }

    /// With another quality or depth, where they are asked for.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Usage`] where the format does not have them.
    pub fn with(mut self, bits: Option<Bits>, quality: Option<u8>) -> Result<Self> {
        let name = self.ending.name();
        if let Some(quality) = quality {
            if self.ending != Ending::Jpeg {
                return Err(Error::usage(format!("got --quality for a {name}, only JPEG has one")));
            }
            self.quality = quality;
        }
        if let Some(bits) = bits {
            if bits == Bits::Sixteen && !matches!(self.ending, Ending::Png | Ending::Tiff) {
                return Err(Error::usage(format!("got --bits 16 for a {name}, only PNG and TIFF have them"))
                    .hint("an .exr holds the linear values themselves, as 32-bit floats"));
            }
            self.bits = bits;
        }
        Ok(self)
    }

    /// Checks that the format takes pictures of this size.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Usage`] with the limit.
    pub(crate) fn check_size(self, size: Size) -> Result<()> {
        let name = self.ending.name();
        let most = self.ending.most_side();
        if size.width.max(size.height) > most {
            return Err(Error::usage(format!(
                "a picture of {size}: a {name} has at most {} a side",
                counted(most, "pixel")
            ))
            .hint("show a part with --window, or write .png or .exr"));
        }
        let bytes = self.raw_bytes(size);
        if self.ending == Ending::Tiff && bytes > TIFF_BYTES {
            return Err(Error::usage(format!(
                "a picture of {size} has {} of pixels: a TIFF holds at most {TIFF_BYTES}",
                counted(bytes, "byte")
            ))
            .hint("show a part with --window, or write .png or .exr"));
        }
        Ok(())
    }

    /// Bytes of the display values of all pixels.
    fn raw_bytes(self, size: Size) -> u64 {
        (size.width as u64).saturating_mul(size.height as u64).saturating_mul(3 * self.bits.bytes() as u64)
    }

    /// Memory that writing takes, beside what reading the rows does: grows with the width only where the format
    /// is written row by row, else with the number of pixels.
    pub fn memory_bytes(self, size: Size) -> u64 {
        // Rows as values, bytes and packed bytes, and the file's buffers.
        let row = 32 * size.width as u64;
        let whole = self.raw_bytes(size);
        match self.ending {
            Ending::Png | Ending::Exr => row,
            Ending::Jpeg => row + whole + whole / 2,
            // The samples in the order of the machine, and the file, which grows by doubling.
            Ending::Tiff => row + 3 * whole,
            // The encoder keeps pixels of four bytes, and the packed picture twice.
            Ending::WebP => row + 5 * whole,
        }
    }

    /// Checks that memory is allowed for a picture of this size, beside `least` bytes that reading its rows takes.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Usage`] with what it needs.
    pub(crate) fn check_memory(self, size: Size, least: u64, allowed: Allowance) -> Result<()> {
        let needed = self.memory_bytes(size).saturating_add(least);
        if self.ending.streams() {
            return Ok(());
        }
        let what = format!("a {} of {size}, which is put together in memory,", self.ending.name());
        allowed.require(
            &what,
            needed,
            "write .png or .exr, which take any size, or show a part with --window",
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn encoding(name: &str) -> Encoding {
        Encoding::of(Path::new(name), &Ending::ALL).unwrap()
    }

    #[test]
    fn every_ending_is_known_and_others_are_told_which() {
        for ending in Ending::ALL {
            for name in ending.endings() {
                assert_eq!(encoding(&format!("a.b.{}", name.to_uppercase())).ending, ending);
            }
        }
        for name in ["a", "a.gif", "png", ".png", "a.png/", "a.jp2"].iter().filter(|name| **name != "a.png/")
        {
            let error = Ending::of(Path::new(name), &Ending::ALL).unwrap_err().to_string();
            assert!(error.contains(".png, .jpg, .jpeg, .webp, .tif, .tiff, .exr"), "{error}");
        }
        let error = Ending::of(Path::new("sheet.exr"), &Ending::DISPLAY).unwrap_err().to_string();
        assert!(error.contains("display values only") && error.ends_with(".tif, .tiff"), "{error}");
    }

    #[test]
    fn sizes_beyond_a_format_are_refused_and_the_largest_are_not() {
        for (name, side) in [("a.jpg", 65_535), ("a.webp", 16_383)] {
            encoding(name).check_size(Size::new(1, side)).unwrap();
            encoding(name).check_size(Size::new(side, 1)).unwrap();
            for size in [Size::new(1, side + 1), Size::new(side + 1, 1)] {
                let error = encoding(name).check_size(size).unwrap_err();
                assert_eq!(error.kind(), crate::ErrorKind::Usage);
                assert!(error.to_string().contains(&side.to_string()), "{error}");
            }
        }
        assert!(encoding("a.tif").check_size(Size::new(40_000, 40_000)).is_err());
        encoding("a.png").check_size(Size::new(1 << 24, 1 << 24)).unwrap();
        encoding("a.exr").check_size(Size::new(1 << 24, 1 << 24)).unwrap();
    }

    #[test]
    fn only_formats_that_have_them_take_a_quality_and_16_bits() {
        for ending in Ending::ALL {
            let encoding = encoding(&format!("a.{}", ending.endings()[0]));
            assert_eq!(encoding.with(None, Some(50)).is_ok(), ending == Ending::Jpeg);
            let wide = encoding.with(Some(Bits::Sixteen), None);
            assert_eq!(wide.is_ok(), [Ending::Png, Ending::Tiff].contains(&ending));
        }
    }
}

//! What the samples of a TIFF are and where they lie in the file.

use super::directory::{Directory, tag};
use super::{colours, exif, remarks};
use crate::picture::size::{Size, unsupported};
use crate::picture::{grey_or_rgb, orientation};
use crate::words::counted;
use crate::{Error, Limits, Result, SampleType};

/// How the bytes of a strip or tile are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lzw,
    Deflate,
    PackBits,
}

impl Compression {
    fn of(number: u64) -> Option<Compression> {
        match number {
            1 => Some(Compression::None),
            5 => Some(Compression::Lzw),
            8 | 32946 => Some(Compression::Deflate),
            32773 => Some(Compression::PackBits),
            _ => None,
        }
    }

    /// What one byte may become at most.
    fn expansion(self) -> u64 {
        match self {
            Compression::None => 1,
            // Codes of 9 to 12 bits for strings that grow by a byte a code, 4096 of them.
            Compression::Lzw => 2048,
            Compression::Deflate => 1032,
            // Two bytes for 128.
            Compression::PackBits => 64,
        }
    }
}

/// What is stored instead of the samples of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Predictor {
    None,
    /// Differences to the pixel at the left.
    Horizontal,
    /// The bytes of floats, most significant first of all, then differences.
    FloatingPoint,
}

/// A strip or a tile.
pub(super) struct Chunk {
    pub(super) number: usize,
    /// In the file.
    pub(super) offset: u64,
    pub(super) len: u64,
    /// The channel that it holds, if channels are stored apart; else 0.
    pub(super) plane: u64,
    /// Of its first pixel.
    pub(super) x: u64,
    pub(super) y: u64,
    /// Of a tile also the pixels beyond the picture.
    pub(super) width: u64,
    pub(super) rows: u64,
}

pub(super) struct Layout {
    /// All channels of the file, alpha too.
    pub(super) size: Size,
    pub(super) sample_type: SampleType,
    pub(super) alpha: bool,
    pub(super) planar: bool,
    pub(super) little_endian: bool,
    pub(super) compression: Compression,
    pub(super) predictor: Predictor,
    /// How the picture asks to be turned, 1..=8; samples are as stored.
    pub(super) orientation: u8,
    /// What is said of colours if it is not sRGB.
    pub(super) profile: Option<String>,
    /// What of the picture is read and what is not, a sentence each.
    pub(super) remarks: Vec<String>,
    rgb: bool,
    chunks: Chunks,
    /// Of the strips or tiles: offset and length.
    places: Vec<(u64, u64)>,
}

enum Chunks {
    Strips { rows: u64 },
    Tiles { width: u64, height: u64 },
}

impl Layout {
    pub(super) fn read(directory: &Directory<'_>, bytes: &[u8], limits: &Limits) -> Result<Layout> {
        let at = directory.at;
        let of = |found: String, expected: &'static str| Err(unsupported(found, expected).at(at));

        let dimensions = (directory.number(tag::WIDTH, None)?, directory.number(tag::HEIGHT, None)?);
        let stored = directory.number(tag::SAMPLES_PER_PIXEL, Some(1))?;
        let sample_type = sample_type(directory)?;
        let size = Size::within(dimensions, stored, sample_type, at, limits)?;

        let number = directory.number(tag::COMPRESSION, Some(1))?;
        let Some(compression) = Compression::of(number) else {
            return of(format!("compression {number}"), "1 (none), 5 (LZW), 8 (deflate) or 32773 (PackBits)");
        };
        let float = matches!(sample_type, SampleType::F16 | SampleType::F32);
        let may_predict = matches!(compression, Compression::Lzw | Compression::Deflate);
        let predictor = match directory.number(tag::PREDICTOR, Some(1))? {
            1 => Predictor::None,
            2 if may_predict => Predictor::Horizontal,
            3 if may_predict && float => Predictor::FloatingPoint,
            other => {
                let found = format!("predictor {other} with compression {number}");
                return of(found, "1, or with LZW and deflate 2 and, for floats, 3");
            }
        };
        if directory.number(tag::FILL_ORDER, Some(1))? != 1 {
            return of("fill order 2".to_owned(), "1");
        }
        let orientation = match stated_orientation(directory, bytes)? {
            0 => 1,
            stated => match u8::try_from(stated) {
                Ok(stated @ 1..=8) => stated,
                _ => return Err(Error::malformed(format!("orientation {stated}"), "1 to 8").at(at)),
            },
        };
        let planar = match directory.number(tag::PLANAR_CONFIGURATION, Some(1))? {
            1 => false,
            2 => stored > 1,
            other => return Err(Error::malformed(format!("planar configuration {other}"), "1 or 2").at(at)),
        };
        let (rgb, alpha) = interpretation(directory, stored)?;
        let (chunks, places) = places(directory)?;
        if let Chunks::Tiles { width, height } = chunks {
            // A tile is unpacked whole, whatever part of it lies in the picture.
            Size::within((width, height), stored, sample_type, at, limits)?;
        }
        let little_endian = directory.little_endian();
        let most = match sample_type {
            SampleType::U8 => Some(255.0),
            SampleType::U16 => Some(65535.0),
            SampleType::F16 | SampleType::F32 => None,
        };
        Ok(Layout {
            size,
            sample_type,
            alpha,
            planar,
            little_endian,
            compression,
            predictor,
            orientation,
            profile: colours::said(directory, exif::colour_space(bytes).ok().flatten(), most),
            remarks: remarks::of(directory, dimensions, most),
            rgb,
            chunks,
            places,
        })
    }

    /// Names of the channels but alpha.
    pub(super) fn channel_names(&self) -> Vec<String> {
        let channels = self.size.channels.saturating_sub(usize::from(self.alpha));
        if self.rgb || channels == 1 {
            return grey_or_rgb(!self.rgb);
        }
        (0..channels).map(|number| format!("C{number}")).collect()
    }

    /// Channels side by side in a strip or tile.
    pub(super) fn channels_in_chunk(&self) -> usize {
        if self.planar { 1 } else { self.size.channels }
    }

    /// All strips or tiles: from the top, in a row of tiles from the left, and so for each plane.
    pub(super) fn chunks(&self) -> impl Iterator<Item = Chunk> {
        let (width, height) = (u64::from(self.size.width), u64::from(self.size.height));
        let (across, down) = self.grid();
        let places = self.places.iter().enumerate().zip(0u64..);
        places.map(move |((number, &(offset, len)), counted)| {
            let in_plane = counted.checked_rem(across.saturating_mul(down)).unwrap_or(0);
            let plane = counted.checked_div(across.saturating_mul(down)).unwrap_or(0);
            let column = in_plane.checked_rem(across).unwrap_or(0);
            let row = in_plane.checked_div(across).unwrap_or(0);
            match self.chunks {
                // The last strip holds the rows that are left.
                Chunks::Strips { rows } => {
                    let y = row.saturating_mul(rows);
                    let rows = rows.min(height.saturating_sub(y));
                    Chunk { number, offset, len, plane, x: 0, y, width, rows }
                }
                Chunks::Tiles { width, height } => {
                    let (x, y) = (column.saturating_mul(width), row.saturating_mul(height));
                    Chunk { number, offset, len, plane, x, y, width, rows: height }
                }
            }
        })
    }

    /// Strips or tiles of a plane side by side and below each other.
    fn grid(&self) -> (u64, u64) {
        let (width, height) = (u64::from(self.size.width), u64::from(self.size.height));
        match self.chunks {
            Chunks::Strips { rows } => (1, height.div_ceil(rows)),
            Chunks::Tiles { width: across, height: down } => (width.div_ceil(across), height.div_ceil(down)),
        }
    }

    pub(super) fn decoded_bytes(&self, chunk: &Chunk) -> u64 {
        let channels = u64::try_from(self.channels_in_chunk()).unwrap_or(u64::MAX);
        let pixel = u64::try_from(self.sample_type.bytes()).unwrap_or(u64::MAX).saturating_mul(channels);
        chunk.width.saturating_mul(chunk.rows).saturating_mul(pixel)
    }

    /// Every strip or tile lies within the file, apart from the others, and is long enough for what it must hold.
    pub(super) fn require_data(&self, bytes: &[u8]) -> Result<()> {
        let (across, down) = self.grid();
        let planes = if self.planar { u64::try_from(self.size.channels).unwrap_or(u64::MAX) } else { 1 };
        let expected = across.saturating_mul(down).saturating_mul(planes);
        if u64::try_from(self.places.len()).ok() != Some(expected) {
            let found = format!("{} strips or tiles", self.places.len());
            let wanted = format!("{expected} for {} x {} pixels", self.size.width, self.size.height);
            return Err(Error::malformed(found, wanted));
        }
        let file = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        for chunk in self.chunks() {
            let Chunk { number, offset, len, .. } = chunk;
            if offset.checked_add(len).is_none_or(|end| end > file) {
                let found = format!("strip or tile {number} of {} at {offset}", counted(len, "byte"));
                return Err(Error::malformed(
                    found,
                    format!("it within the {} of the file", counted(file, "byte")),
                )
                .at(offset));
            }
            let decoded = self.decoded_bytes(&chunk);
            if len.saturating_mul(self.compression.expansion()) < decoded {
                let found =
                    format!("{} of strip or tile {number} ({:?})", counted(len, "byte"), self.compression);
                return Err(
                    Error::malformed(found, format!("enough for {}", counted(decoded, "byte"))).at(offset)
                );
            }
        }
        self.require_apart()
    }

    fn require_apart(&self) -> Result<()> {
        let mut sorted = self.places.clone();
        sorted.sort_unstable();
        let pairs = sorted.iter().zip(sorted.iter().skip(1));
        for (&(offset, len), &(next, _)) in pairs {
            if offset.saturating_add(len) > next {
                let found =
                    format!("a strip or tile of {} at {offset} and one at {next}", counted(len, "byte"));
                return Err(Error::malformed(found, "none that overlap").at(next));
            }
        }
        Ok(())
    }
}

fn sample_type(directory: &Directory<'_>) -> Result<SampleType> {
    let one_of = |tag, default| -> Result<u64> {
        let list = directory.list(tag)?.unwrap_or_else(|| vec![default]);
        match list.split_first() {
            Some((first, rest)) if rest.iter().all(|other| other == first) => Ok(*first),
            _ => Err(unsupported(format!("values {list:?} of tag {tag}"), "the same for all channels")
                .at(directory.at)),
        }
    };
    match (one_of(tag::BITS_PER_SAMPLE, 1)?, one_of(tag::SAMPLE_FORMAT, 1)?) {
        (8, 1) => Ok(SampleType::U8),
        (16, 1) => Ok(SampleType::U16),
        (16, 3) => Ok(SampleType::F16),
        (32, 3) => Ok(SampleType::F32),
        (bits, format) => {
            let found = format!("samples of {} and format {format}", counted(bits, "bit"));
            Err(unsupported(found, "8 or 16 bits unsigned (1), or 16 or 32 bits float (3)").at(directory.at))
        }
    }
}

/// Whether the first three channels are red, green and blue, and whether the last one is alpha.
fn interpretation(directory: &Directory<'_>, stored: u64) -> Result<(bool, bool)> {
    let extra = directory.list(tag::EXTRA_SAMPLES)?.unwrap_or_default();
    let alpha = matches!(extra.as_slice(), [1 | 2]);
    match (directory.number(tag::PHOTOMETRIC, None)?, stored, alpha) {
        (2, 3, false) if extra.is_empty() => Ok((true, false)),
        (2, 4, true) => Ok((true, true)),
        (1, 2, true) => Ok((false, true)),
        (1, _, false) if !extra.iter().any(|&meaning| meaning != 0) => Ok((false, false)),
        // TIFF/EP and DNG: a mosaic of colour filters, or what is left when it is filled in.
        (photometric @ (32803 | 34892), ..) => Err(unsupported(
            format!("a camera's raw picture (photometric interpretation {photometric})"),
            "grey (1) or RGB (2); convert it to a TIFF of 16 bits, the same way for all pictures",
        )
        .at(directory.at)),
        (photometric, ..) => {
            let found = format!(
                "photometric interpretation {photometric}, {}, extra samples {extra:?}",
                counted(stored, "channel")
            );
            Err(unsupported(
                found,
                "grey (1) or RGB (2), with one alpha channel or none, or channels of no meaning",
            )
            .at(directory.at))
        }
    }
}

/// How the picture asks to be turned. Cameras put it into the first directory, whichever is the picture; others into
/// XMP.
fn stated_orientation(directory: &Directory<'_>, bytes: &[u8]) -> Result<u64> {
    if directory.list(tag::ORIENTATION)?.is_some() {
        return directory.number(tag::ORIENTATION, None);
    }
    let by_xmp = directory.bytes_of(tag::XMP).map_or(1, orientation::of_xmp);
    Directory::first(bytes)?.number(tag::ORIENTATION, Some(u64::from(by_xmp)))
}

fn places(directory: &Directory<'_>) -> Result<(Chunks, Vec<(u64, u64)>)> {
    let strips = (directory.list(tag::STRIP_OFFSETS)?, directory.list(tag::STRIP_BYTE_COUNTS)?);
    let tiles = (directory.list(tag::TILE_OFFSETS)?, directory.list(tag::TILE_BYTE_COUNTS)?);
    let (chunks, offsets, lens) = match (strips, tiles) {
        ((Some(offsets), Some(lens)), (None, None)) => {
            let rows = directory.number(tag::ROWS_PER_STRIP, Some(u64::from(u32::MAX)))?;
            (Chunks::Strips { rows }, offsets, lens)
        }
        ((None, None), (Some(offsets), Some(lens))) => {
            let (width, height) =
                (directory.number(tag::TILE_WIDTH, None)?, directory.number(tag::TILE_LENGTH, None)?);
            (Chunks::Tiles { width, height }, offsets, lens)
        }
        _ => {
            return Err(Error::malformed("no or two lists of strips and tiles", "one, offsets and lengths")
                .at(directory.at));
        }
    };
    let sides = match chunks {
        Chunks::Strips { rows } => [rows, 1],
        Chunks::Tiles { width, height } => [width, height],
    };
    if sides.contains(&0) || offsets.len() != lens.len() {
        let found = format!(
            "{} and {} lengths of strips or tiles of side {sides:?}",
            counted(offsets.len(), "offset"),
            lens.len()
        );
        return Err(Error::malformed(found, "as many, and no side of 0").at(directory.at));
    }
    Ok((chunks, offsets.into_iter().zip(lens).collect()))
}

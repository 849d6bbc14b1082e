//! The header of an OpenEXR file: magic number, flags, attributes.

use exr::compression::Compression;

use super::channels::{Channels, text};
use crate::picture::profile::{of_chromaticities, of_space_name};
use crate::picture::size::{Size, unsupported};
use crate::picture::{aspect, unapplied};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Limits, Result};

/// The first four bytes of every OpenEXR file.
pub(crate) const MAGIC: &[u8] = b"\x76\x2F\x31\x01";

const FLAG_TILES: u32 = 1 << 9;
const FLAG_LONG_NAMES: u32 = 1 << 10;
const FLAG_DEEP: u32 = 1 << 11;
const FLAG_PARTS: u32 = 1 << 12;

pub(super) struct Header {
    pub(super) size: Size,
    pub(super) channels: Channels,
    pub(super) compression: Compression,
    /// Of the first scan line.
    pub(super) top: i32,
    /// Columns and rows of a tile; scan lines if there is none.
    pub(super) tile: Option<(u32, u32)>,
    /// Where the table of chunk offsets starts.
    pub(super) end: usize,
    /// Primaries that are not those of sRGB, in words.
    pub(super) profile: Option<String>,
    /// The data window where the display window is another: left, top, right, bottom of both.
    pub(super) windows: Option<[[i32; 4]; 2]>,
    /// As in other formats: 1..=8.
    pub(super) orientation: u8,
    /// What else is not applied, a sentence each.
    pub(super) not_applied: Vec<String>,
}

/// The attributes that say where pixels are and what they mean; each may be there once.
#[derive(Default)]
struct Attributes<'a> {
    channels: Option<&'a [u8]>,
    compression: Option<&'a [u8]>,
    data_window: Option<&'a [u8]>,
    display_window: Option<&'a [u8]>,
    chromaticities: Option<&'a [u8]>,
    tiles: Option<&'a [u8]>,
    kind: Option<&'a [u8]>,
    chunk_count: Option<&'a [u8]>,
    pixel_aspect: Option<&'a [u8]>,
    white_luminance: Option<&'a [u8]>,
    orientation: Option<&'a [u8]>,
    space: Option<&'a [u8]>,
    interop: Option<&'a [u8]>,
    /// Of other attributes, a sentence each.
    others: Vec<String>,
}

impl<'a> Attributes<'a> {
    fn read(reader: &mut Reader<'a>) -> Result<Attributes<'a>> {
        let mut attributes = Attributes::default();
        loop {
            let at = reader.position();
            let name = text(reader)?;
            if name.is_empty() {
                return Ok(attributes);
            }
            let kind = text(reader)?;
            let len = reader.i32_le()?;
            let Ok(len) = usize::try_from(len) else {
                return Err(Error::malformed(
                    format!("{} of the attribute {name:?}", counted(len, "byte")),
                    "at least 0",
                )
                .at(at));
            };
            let data = reader.take(len)?;
            let (slot, wanted) = match name.as_str() {
                "channels" => (&mut attributes.channels, "chlist"),
                "compression" => (&mut attributes.compression, "compression"),
                "dataWindow" => (&mut attributes.data_window, "box2i"),
                "displayWindow" => (&mut attributes.display_window, "box2i"),
                "chromaticities" => (&mut attributes.chromaticities, "chromaticities"),
                "tiles" => (&mut attributes.tiles, "tiledesc"),
                "type" => (&mut attributes.kind, "string"),
                "chunkCount" => (&mut attributes.chunk_count, "int"),
                "pixelAspectRatio" => (&mut attributes.pixel_aspect, "float"),
                "whiteLuminance" => (&mut attributes.white_luminance, "float"),
                "Orientation" if kind == "int" => (&mut attributes.orientation, "int"),
                "oiio:ColorSpace" if kind == "string" => (&mut attributes.space, "string"),
                "colorInteropID" if kind == "string" => (&mut attributes.interop, "string"),
                other => {
                    attributes.others.extend(unapplied::remark(other, &value_of(&kind, data)));
                    continue;
                }
            };
            if kind != wanted || slot.is_some() {
                let found = format!("the attribute {name:?} of type {kind:?}, or a second one");
                return Err(Error::malformed(found, format!("one of type {wanted:?}")).at(at));
            }
            *slot = Some(data);
        }
    }
}

impl Attributes<'_> {
    /// What changes the meaning of pixels and samples and is not applied, a sentence each.
    fn not_applied(&self) -> Vec<String> {
        let number = |data: Option<&[u8]>| Some(f64::from(f32::from_le_bytes(data?.try_into().ok()?)));
        let aspect = number(self.pixel_aspect).and_then(|ratio| aspect::remark(ratio, "pixelAspectRatio"));
        let white = number(self.white_luminance).filter(|&white| white != 1.0).map(|white| {
            format!(
                "a white of {white} cd/m2 (whiteLuminance) is not applied: samples are taken as reflectance"
            )
        });
        aspect.into_iter().chain(white).chain(self.others.iter().cloned()).collect()
    }
}

impl Header {
    pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Header> {
        let mut reader = Reader::new(bytes);
        match reader.take(MAGIC.len())? {
            MAGIC => {}
            other => {
                return Err(
                    Error::malformed(format!("{other:02x?}"), "the magic number of OpenEXR").at(0usize)
                );
            }
        }
        let at = reader.position();
        let version = reader.u32_le()?;
        if version & 0xFF != 2
            || version & !(0xFF | FLAG_TILES | FLAG_LONG_NAMES | FLAG_DEEP | FLAG_PARTS) != 0
        {
            return Err(unsupported(format!("version and flags {version:#x}"), "version 2").at(at));
        }
        if version & (FLAG_DEEP | FLAG_PARTS) != 0 {
            return Err(unsupported("several parts, or deep data", "one flat part").at(at));
        }
        let attributes = Attributes::read(&mut reader)?;
        let end = reader.position();
        let missing = |name: &str| Error::malformed(format!("no attribute {name:?}"), "one").at(end);

        let channels = Channels::read(attributes.channels.ok_or_else(|| missing("channels"))?)?;
        let compression = compression(attributes.compression.ok_or_else(|| missing("compression"))?)?;
        let window = attributes.data_window.ok_or_else(|| missing("dataWindow"))?;
        let data_window = window_of(window)?;
        let ((width, height), top) = extent(data_window);
        let stored = u64::try_from(channels.stored.len()).unwrap_or(u64::MAX);
        let size = Size::within((width, height), stored, channels.sample_type(), end, limits)?;
        let tiled = version & FLAG_TILES != 0;
        let tile = match attributes.tiles {
            Some(tiles) if tiled => Some(tile_size(tiles)?),
            None if tiled => return Err(missing("tiles")),
            _ => None,
        };
        let kind = if tiled { "tiledimage" } else { "scanlineimage" };
        if let Some(other) = attributes.kind.filter(|&found| found != kind.as_bytes()) {
            let found = format!("a part of type {}", other.escape_ascii());
            return Err(Error::malformed(found, kind).at(end));
        }
        let coloured =
            ["R", "G", "B"].iter().all(|colour| channels.names().iter().any(|name| name == colour));
        let primaries = attributes.chromaticities.filter(|_| coloured).and_then(|data| {
            let values = data.as_chunks::<4>().0.iter().map(|&bytes| f64::from(f32::from_le_bytes(bytes)));
            of_chromaticities(&values.collect::<Vec<_>>())
        });
        let space =
            |data: Option<&[u8]>| of_space_name(&String::from_utf8_lossy(data.unwrap_or_default()), true);
        let profile = primaries.or_else(|| space(attributes.interop)).or_else(|| space(attributes.space));
        let display_window = attributes.display_window.map(window_of).transpose()?;
        let windows = display_window.filter(|&shown| shown != data_window).map(|shown| [data_window, shown]);
        let orientation = attributes.orientation.and_then(|data| Reader::new(data).i32_le().ok());
        let orientation =
            orientation.and_then(|stated| u8::try_from(stated).ok()).filter(|n| (1..=8).contains(n));
        let header = Header {
            size,
            channels,
            compression,
            top,
            tile,
            end,
            profile,
            windows,
            orientation: orientation.unwrap_or(1),
            not_applied: attributes.not_applied(),
        };
        if let Some(stated) = attributes.chunk_count {
            let stated = Reader::new(stated).i32_le()?;
            if u64::try_from(stated).ok() != Some(header.chunk_count()) {
                let expected = format!("{} for {width} x {height} pixels", header.chunk_count());
                return Err(Error::malformed(counted(stated, "chunk"), expected).at(end));
            }
        }
        Ok(header)
    }

    /// Columns and rows of every chunk but those at the right and lower edge, where there may be less.
    pub(super) fn chunk_size(&self) -> (u32, u32) {
        let lines = u32::try_from(self.compression.scan_lines_per_block()).unwrap_or(u32::MAX);
        self.tile.unwrap_or((self.size.width, lines))
    }

    /// How many chunks there are side by side, and how many such rows.
    pub(super) fn chunk_grid(&self) -> (u32, u32) {
        let (width, height) = self.chunk_size();
        (self.size.width.div_ceil(width), self.size.height.div_ceil(height))
    }

    pub(super) fn chunk_count(&self) -> u64 {
        let (across, down) = self.chunk_grid();
        u64::from(across).saturating_mul(u64::from(down))
    }
}

/// A value for people: a text, or a number; nothing of other types.
fn value_of(kind: &str, data: &[u8]) -> String {
    match (kind, data) {
        ("string", text) => String::from_utf8_lossy(text).into_owned(),
        ("float", &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).to_string(),
        ("int", &[a, b, c, d]) => i32::from_le_bytes([a, b, c, d]).to_string(),
        _ => String::new(),
    }
}

fn compression(data: &[u8]) -> Result<Compression> {
    Ok(match data {
        [0] => Compression::Uncompressed,
        [1] => Compression::RLE,
        [2] => Compression::ZIP1,
        [3] => Compression::ZIP16,
        [4] => Compression::PIZ,
        [5] => Compression::PXR24,
        [6] => Compression::B44,
        [7] => Compression::B44A,
        [8] => Compression::DWAA(None),
        [9] => Compression::DWAB(None),
        other => return Err(unsupported(format!("compression {other:?}"), "0 (none) to 9 (DWAB)")),
    })
}

/// Left, top, right and bottom.
fn window_of(data: &[u8]) -> Result<[i32; 4]> {
    let mut reader = Reader::new(data);
    Ok([reader.i32_le()?, reader.i32_le()?, reader.i32_le()?, reader.i32_le()?])
}

/// Width and height, and the number of the first row.
fn extent([left, top, right, bottom]: [i32; 4]) -> ((u64, u64), i32) {
    let len = |first: i32, last: i32| {
        let len = i64::from(last).saturating_sub(i64::from(first)).saturating_add(1);
        u64::try_from(len).unwrap_or(0)
    };
    ((len(left, right), len(top, bottom)), top)
}

fn tile_size(data: &[u8]) -> Result<(u32, u32)> {
    let mut reader = Reader::new(data);
    let size = (reader.u32_le()?, reader.u32_le()?);
    let mode = reader.u8()?;
    if mode & 0x0F != 0 {
        return Err(unsupported(format!("levels of detail (mode {mode})"), "one level"));
    }
    if size.0 == 0 || size.1 == 0 {
        return Err(Error::malformed(format!("tiles of {size:?} pixels"), "at least 1 x 1"));
    }
    Ok(size)
}

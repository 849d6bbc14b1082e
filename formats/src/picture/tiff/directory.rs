//! The image file directories of a TIFF (TIFF 6.0, section 2; BigTIFF: libtiff's specification), and which of them is
//! the picture.
//!
//! Many files hold more than the picture: previews before it (camera raws, of which the first directory is a
//! thumbnail), smaller versions after it, pages, masks. `NewSubfileType` tells them apart. The picture is the only
//! directory of the file's chain that is no reduced version of another; if all of the chain are reduced, the only
//! such one among their `SubIFDs`. Anything else is refused, as what is meant cannot be known; so is a picture that is
//! smaller than another directory's, wherever that stands.

use crate::picture::size::unsupported;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// Numbers of the tags that are looked at.
pub(super) mod tag {
    pub(crate) const NEW_SUBFILE_TYPE: u16 = 254;
    pub(crate) const SUBFILE_TYPE: u16 = 255;
    pub(crate) const WIDTH: u16 = 256;
    pub(crate) const HEIGHT: u16 = 257;
    pub(crate) const BITS_PER_SAMPLE: u16 = 258;
    pub(crate) const COMPRESSION: u16 = 259;
    pub(crate) const PHOTOMETRIC: u16 = 262;
    pub(crate) const FILL_ORDER: u16 = 266;
    pub(crate) const IMAGE_DESCRIPTION: u16 = 270;
    pub(crate) const STRIP_OFFSETS: u16 = 273;
    pub(crate) const ORIENTATION: u16 = 274;
    pub(crate) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(crate) const ROWS_PER_STRIP: u16 = 278;
    pub(crate) const STRIP_BYTE_COUNTS: u16 = 279;
    pub(crate) const MAX_SAMPLE_VALUE: u16 = 281;
    pub(crate) const X_RESOLUTION: u16 = 282;
    pub(crate) const Y_RESOLUTION: u16 = 283;
    pub(crate) const PLANAR_CONFIGURATION: u16 = 284;
    pub(crate) const GRAY_RESPONSE_CURVE: u16 = 291;
    pub(crate) const TRANSFER_FUNCTION: u16 = 301;
    pub(crate) const PREDICTOR: u16 = 317;
    pub(crate) const WHITE_POINT: u16 = 318;
    pub(crate) const PRIMARIES: u16 = 319;
    pub(crate) const TILE_WIDTH: u16 = 322;
    pub(crate) const TILE_LENGTH: u16 = 323;
    pub(crate) const TILE_OFFSETS: u16 = 324;
    pub(crate) const TILE_BYTE_COUNTS: u16 = 325;
    pub(crate) const SUB_IFDS: u16 = 330;
    pub(crate) const EXTRA_SAMPLES: u16 = 338;
    pub(crate) const SAMPLE_FORMAT: u16 = 339;
    pub(crate) const SMIN_SAMPLE_VALUE: u16 = 340;
    pub(crate) const SMAX_SAMPLE_VALUE: u16 = 341;
    pub(crate) const REFERENCE_BLACK_WHITE: u16 = 532;
    pub(crate) const XMP: u16 = 700;
    pub(crate) const IMAGE_DEPTH: u16 = 32997;
    pub(crate) const MODEL_PIXEL_SCALE: u16 = 33550;
    pub(crate) const METAMORPH_PLANES: u16 = 33629;
    pub(crate) const EXIF_IFD: u16 = 34665;
    pub(crate) const ICC_PROFILE: u16 = 34675;
    pub(crate) const COLOUR_SPACE: u16 = 40961;
    pub(crate) const GDAL_METADATA: u16 = 42112;
    pub(crate) const GDAL_NODATA: u16 = 42113;
    pub(crate) const EXIF_GAMMA: u16 = 42240;
    pub(crate) const LINEARIZATION_TABLE: u16 = 50712;
    pub(crate) const BLACK_LEVEL: u16 = 50714;
    pub(crate) const WHITE_LEVEL: u16 = 50717;
    pub(crate) const BASELINE_EXPOSURE: u16 = 50730;
    pub(crate) const DEFAULT_CROP_ORIGIN: u16 = 50719;
    pub(crate) const DEFAULT_CROP_SIZE: u16 = 50720;
    pub(crate) const ACTIVE_AREA: u16 = 50829;
    pub(crate) const DEFAULT_USER_CROP: u16 = 51125;
}

/// Directories of one file that are looked at.
const MAX_DIRECTORIES: usize = 256;

/// Bits of `NewSubfileType`: a smaller version of another picture; a mask that says what of one is seen.
const REDUCED: u64 = 1;
const MASK: u64 = 4;

/// Fields of either byte order, and of either width where the two forms of TIFF differ.
struct Fields<'a> {
    reader: Reader<'a>,
    little_endian: bool,
    big: bool,
}

impl<'a> Fields<'a> {
    fn uint(&mut self, len: usize) -> Result<u64> {
        let bytes = self.reader.take(len)?;
        let add = |value: u64, &byte: &u8| (value << 8) | u64::from(byte);
        Ok(if self.little_endian { bytes.iter().rev().fold(0, add) } else { bytes.iter().fold(0, add) })
    }

    fn u16(&mut self) -> Result<u16> {
        Ok(u16::try_from(self.uint(2)?).unwrap_or_default())
    }

    /// An offset or a count: 4 bytes, or 8 in BigTIFF.
    fn word(&mut self) -> Result<u64> {
        self.uint(self.word_len())
    }

    fn word_len(&self) -> usize {
        if self.big { 8 } else { 4 }
    }

    fn moved_to(&self, bytes: &'a [u8], offset: u64) -> Result<Fields<'a>> {
        let mut reader = Reader::new(bytes);
        reader.take(usize::try_from(offset).unwrap_or(usize::MAX))?;
        Ok(Fields { reader, little_endian: self.little_endian, big: self.big })
    }
}

struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// Where the values start, from the start of the file.
    at: u64,
}

/// The entries of one directory of a file.
pub(super) struct Directory<'a> {
    bytes: &'a [u8],
    little_endian: bool,
    big: bool,
    entries: Vec<Entry>,
    /// Offset of the directory after it; 0 is none.
    next: u64,
    pub(super) at: usize,
}

impl<'a> Directory<'a> {
    /// The directory of the picture; see the [module](self).
    pub(super) fn read(bytes: &'a [u8]) -> Result<Directory<'a>> {
        let mut directories = Directory::first(bytes)?.followed()?;
        let (at, mut looked_at) = (directories.first().map_or(0, |first| first.at), directories.len());
        add_below(&mut directories)?;
        if directories.iter().take(looked_at).all(|one| one.is_reduced().unwrap_or(false)) {
            looked_at = directories.len();
        }
        let (mut pictures, mut others) = (Vec::new(), Vec::new());
        for (number, directory) in directories.into_iter().enumerate() {
            let kind = directory.number(tag::NEW_SUBFILE_TYPE, Some(0))?;
            if kind & MASK != 0 && kind & REDUCED == 0 && number < looked_at {
                return Err(unsupported("a transparency mask", "a picture that is opaque").at(directory.at));
            }
            if number < looked_at && !directory.is_reduced()? {
                pictures.push(directory);
            } else if kind & MASK == 0 {
                others.push(directory);
            }
        }
        let sizes = pictures.iter().map(Directory::size).collect::<Result<Vec<_>>>()?;
        let mut pictures = pictures.into_iter();
        match (pictures.next(), pictures.len()) {
            (Some(only), 0) => only.unless_rivalled(&others),
            (Some(first), more) => Err(unsupported(
                format!("{} in {} ({})",
                    counted(more.saturating_add(1), "picture"),
                    counted(looked_at, "directory"),
                    told(&sizes)),
                "one, beside smaller versions of it; save it alone in a file (tiffcp, or ImageMagick's FILE.tif[0])",
            )
            .at(first.at)),
            (None, _) => Err(unsupported(
                format!("only smaller versions of a picture (NewSubfileType 1) in {}", counted(looked_at, "directory")),
                "the full picture; a camera's raw file must be converted first, to a TIFF of 16 bits say",
            )
            .at(at)),
        }
    }

    /// Itself, if no other directory holds more pixels, or as many and does not say that it is a version of another:
    /// some programs put a thumbnail first and say nothing of it.
    fn unless_rivalled(self, others: &[Directory<'_>]) -> Result<Directory<'a>> {
        let (width, height) = self.size()?;
        let pixels = width.saturating_mul(height);
        for other in others {
            let (other_width, other_height) = other.size()?;
            let others_pixels = other_width.saturating_mul(other_height);
            if others_pixels > pixels || (others_pixels == pixels && !other.is_reduced()?) {
                let sizes = told(&[(width, height), (other_width, other_height)]);
                return Err(unsupported(
                    format!("pictures of {sizes} pixels, of which the first claims to be the picture"),
                    "the picture larger than all its other versions; save it alone in a file (tiffcp, or \
                     ImageMagick's FILE.tif[0])",
                )
                .at(other.at));
            }
        }
        Ok(self)
    }

    /// Columns and rows, 0 where they are not told.
    fn size(&self) -> Result<(u64, u64)> {
        Ok((self.number(tag::WIDTH, Some(0))?, self.number(tag::HEIGHT, Some(0))?))
    }

    /// The first directory of a file, whatever it is for.
    pub(super) fn first(bytes: &'a [u8]) -> Result<Directory<'a>> {
        let mut start = Fields { reader: Reader::new(bytes), little_endian: false, big: false };
        start.little_endian = match start.reader.take(2)? {
            b"II" => true,
            b"MM" => false,
            other => {
                return Err(Error::malformed(format!("{other:02x?}"), "the byte order II or MM").at(0usize));
            }
        };
        start.big = match start.u16()? {
            42 => false,
            43 => true,
            other => return Err(Error::malformed(format!("the version {other}"), "42 or 43").at(2usize)),
        };
        if start.big && (start.u16()?, start.u16()?) != (8, 0) {
            return Err(Error::malformed("other offsets", "BigTIFF with offsets of 8 bytes").at(4usize));
        }
        let offset = start.word()?;
        Directory::at(bytes, &start, offset)
    }

    fn at(bytes: &'a [u8], start: &Fields<'a>, offset: u64) -> Result<Directory<'a>> {
        let mut fields = start.moved_to(bytes, offset)?;
        let at = fields.reader.position();
        let count = if fields.big { fields.word()? } else { u64::from(fields.u16()?) };
        // An entry takes 12 or 20 bytes, so that the end of the file ends this loop.
        let mut entries = Vec::new();
        for _ in 0..count {
            let (tag, kind, count) = (fields.u16()?, fields.u16()?, fields.word()?);
            let value_at = fields.reader.position();
            let value = fields.word()?;
            let inline = count.saturating_mul(u64::from(bytes_of(kind).unwrap_or(u8::MAX)))
                <= u64::try_from(fields.word_len()).unwrap_or_default();
            let at = if inline { u64::try_from(value_at).unwrap_or(u64::MAX) } else { value };
            entries.push(Entry { tag, kind, count, at });
        }
        let next = fields.word()?;
        entries.sort_by_key(|entry| entry.tag);
        if let Some((entry, _)) = entries.iter().zip(entries.iter().skip(1)).find(|(a, b)| a.tag == b.tag) {
            return Err(Error::malformed(format!("two entries of tag {}", entry.tag), "one").at(at));
        }
        Ok(Directory { bytes, little_endian: start.little_endian, big: start.big, entries, next, at })
    }

    fn start(&self) -> Fields<'a> {
        Fields { reader: Reader::new(self.bytes), little_endian: self.little_endian, big: self.big }
    }

    /// Another directory of the same file.
    pub(super) fn sibling(&self, offset: u64) -> Result<Directory<'a>> {
        Directory::at(self.bytes, &self.start(), offset)
    }

    /// This directory and those that follow it.
    fn followed(self) -> Result<Vec<Directory<'a>>> {
        let mut chain = vec![self];
        while let Some(last) = chain.last().filter(|last| last.next != 0) {
            let next = last.sibling(last.next)?;
            if chain.len() >= MAX_DIRECTORIES {
                return Err(too_many(next.at));
            }
            if chain.iter().any(|known| known.at == next.at) {
                return Err(
                    Error::malformed("directories that follow each other in a ring", "an end").at(next.at)
                );
            }
            chain.push(next);
        }
        Ok(chain)
    }

    /// Whether it is a smaller version of another picture. (The older tag counts from 1, the full picture.)
    fn is_reduced(&self) -> Result<bool> {
        let older = self.number(tag::SUBFILE_TYPE, Some(1))?;
        Ok(self.number(tag::NEW_SUBFILE_TYPE, Some(0))? & REDUCED != 0 || older == 2)
    }

    pub(super) fn little_endian(&self) -> bool {
        self.little_endian
    }

    /// The unsigned integers of a tag, if there is one.
    pub(super) fn list(&self, tag: u16) -> Result<Option<Vec<u64>>> {
        let Some(entry) = self.entries.iter().find(|entry| entry.tag == tag) else { return Ok(None) };
        let Some(len) = bytes_of(entry.kind).filter(|_| matches!(entry.kind, 1 | 3 | 4 | 13 | 16 | 18))
        else {
            let found = format!("the type {} of tag {tag}", entry.kind);
            return Err(Error::malformed(found, "unsigned integers").at(self.at));
        };
        let mut fields = self.start().moved_to(self.bytes, entry.at)?;
        let left = fields.reader.rest().len();
        let needed = entry.count.saturating_mul(u64::from(len));
        if needed > u64::try_from(left).unwrap_or(u64::MAX) {
            let found =
                format!("{} for the {} of tag {tag}", counted(left, "byte"), counted(entry.count, "value"));
            return Err(Error::malformed(found, format!("{needed}")).at(fields.reader.position()));
        }
        (0..entry.count).map(|_| fields.uint(usize::from(len))).collect::<Result<Vec<_>>>().map(Some)
    }

    /// How many values a tag has; 0 where there is no such tag.
    pub(super) fn count(&self, tag: u16) -> u64 {
        self.entries.iter().find(|entry| entry.tag == tag).map_or(0, |entry| entry.count)
    }

    /// The numbers of a tag, whole, fractions or doubles; `None` if there is no such tag, or it is of another type or cut.
    pub(super) fn reals(&self, tag: u16) -> Option<Vec<f64>> {
        const RATIONAL: u16 = 5;
        const DOUBLE: u16 = 12;
        let entry = self.entries.iter().find(|entry| entry.tag == tag)?;
        if entry.kind == DOUBLE {
            let (numbers, _) = self.bytes_of(tag)?.as_chunks::<8>();
            let little = self.little_endian;
            let number = |bytes: &[u8; 8]| {
                if little { f64::from_le_bytes(*bytes) } else { f64::from_be_bytes(*bytes) }
            };
            return Some(numbers.iter().map(number).collect());
        }
        if entry.kind != RATIONAL {
            return Some(self.list(tag).ok()??.into_iter().map(|value| value as f64).collect());
        }
        let (terms, _) = self.bytes_of(tag)?.as_chunks::<4>();
        let term = |bytes: &[u8; 4]| {
            f64::from(if self.little_endian {
                u32::from_le_bytes(*bytes)
            } else {
                u32::from_be_bytes(*bytes)
            })
        };
        Some(terms.as_chunks::<2>().0.iter().map(|[over, under]| term(over) / term(under)).collect())
    }

    /// The bytes of a tag of any type, as far as they lie in the file; `None` if there is no such tag.
    pub(super) fn bytes_of(&self, tag: u16) -> Option<&'a [u8]> {
        let entry = self.entries.iter().find(|entry| entry.tag == tag)?;
        let len = entry.count.saturating_mul(u64::from(bytes_of(entry.kind).unwrap_or(1)));
        let rest = self.bytes.get(usize::try_from(entry.at).ok()?..).unwrap_or_default();
        Some(rest.get(..usize::try_from(len).ok()?).unwrap_or(rest))
    }

    /// The only value of a tag, or `default` where there is no such tag.
    pub(super) fn number(&self, tag: u16, default: Option<u64>) -> Result<u64> {
        match (self.list(tag)?.as_deref(), default) {
            (Some([value]), _) => Ok(*value),
            (Some(list), _) => {
                let found = format!("{} of tag {tag}", counted(list.len(), "value"));
                Err(Error::malformed(found, "one").at(self.at))
            }
            (None, Some(value)) => Ok(value),
            (None, None) => Err(Error::malformed(format!("no tag {tag}"), "one").at(self.at)),
        }
    }
}

/// Adds the directories that those of the chain lead to by `SubIFDs`, and those below and behind these.
fn add_below(directories: &mut Vec<Directory<'_>>) -> Result<()> {
    let chain = directories.len();
    let mut parent = 0usize;
    while let Some(one) = directories.get(parent) {
        let mut offsets = one.list(tag::SUB_IFDS)?.unwrap_or_default();
        if parent >= chain && one.next != 0 {
            offsets.push(one.next);
        }
        for offset in offsets.into_iter().filter(|&offset| offset != 0) {
            if directories.iter().any(|known| u64::try_from(known.at) == Ok(offset)) {
                continue;
            }
            let Some(one) = directories.get(parent) else { break };
            if directories.len() >= MAX_DIRECTORIES {
                return Err(too_many(one.at));
            }
            let child = one.sibling(offset)?;
            directories.push(child);
        }
        parent = parent.saturating_add(1);
    }
    Ok(())
}

fn told(sizes: &[(u64, u64)]) -> String {
    const SHOWN: usize = 4;
    let shown = sizes.iter().take(SHOWN).map(|(width, height)| format!("{width} x {height}"));
    let more = sizes.len().checked_sub(SHOWN).filter(|&more| more > 0).map(|more| format!("{more} more"));
    shown.chain(more).collect::<Vec<_>>().join(" and ")
}

fn too_many(at: usize) -> Error {
    unsupported(format!("more than {MAX_DIRECTORIES} directories"), "one picture in the file").at(at)
}

/// Bytes of a value of a type.
fn bytes_of(kind: u16) -> Option<u8> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

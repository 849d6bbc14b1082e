//! The walk over the chunks of a PNG (ISO/IEC 15948, clauses 5 and 11).

use std::io::Read;

use flate2::Crc;
use flate2::read::ZlibDecoder;

use crate::picture::size::{Size, unsupported};
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Limits, Result, SampleType};

/// The first eight bytes of every PNG.
pub(crate) const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1A\n";

/// Column and row of the first sample of each pass of an interlaced picture, and the steps between them.
const PASSES: [(u32, u32, u32, u32); 7] =
    [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)];

/// What IHDR says.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImageHeader {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) grey: bool,
    pub(super) sample_type: SampleType,
    /// Pixels are numbers of colours.
    pub(super) palette: bool,
    pub(super) bits_per_pixel: u64,
    interlaced: bool,
}

impl ImageHeader {
    pub(super) fn pixels(&self) -> usize {
        usize::try_from(u64::from(self.width).saturating_mul(u64::from(self.height))).unwrap_or(usize::MAX)
    }

    fn read(reader: &mut Reader<'_>, limits: &Limits) -> Result<ImageHeader> {
        match reader.take(SIGNATURE.len())? {
            SIGNATURE => {}
            other => {
                return Err(Error::malformed(format!("{other:02x?}"), "the signature of a PNG").at(0usize));
            }
        }
        let chunk = Chunk::read(reader)?;
        let at = chunk.at;
        if &chunk.name != b"IHDR" || chunk.data.len() != 13 {
            let found = format!("a first chunk {} of {}", chunk.shown(), counted(chunk.data.len(), "byte"));
            return Err(Error::malformed(found, "IHDR of 13 bytes").at(at));
        }
        let mut fields = Reader::new(chunk.data);
        let (width, height) = (u32_of(&mut fields)?, u32_of(&mut fields)?);
        let (depth, colour) = (fields.u8()?, fields.u8()?);
        let methods = (fields.u8()?, fields.u8()?);
        let interlace = fields.u8()?;
        let (samples, grey) = match (colour, depth) {
            (0, 1 | 2 | 4 | 8 | 16) => (1, true),
            (2, 8 | 16) => (3, false),
            (3, 1 | 2 | 4 | 8) => (1, false),
            (4, 8 | 16) => (2, true),
            (6, 8 | 16) => (4, false),
            _ => {
                let found = format!("colour type {colour} of {}", counted(depth, "bit"));
                return Err(Error::malformed(found, "a pair of colour type and depth that PNG knows").at(at));
            }
        };
        if methods != (0, 0) || interlace > 1 {
            let found = format!("compression {}, filter {}, interlace {interlace}", methods.0, methods.1);
            return Err(Error::malformed(found, "0, 0, and 0 or 1").at(at));
        }
        let sample_type = if depth == 16 { SampleType::U16 } else { SampleType::U8 };
        // A palette decodes to three channels, and to four when it has transparency.
        let decoded = if colour == 3 { 4 } else { samples };
        let size = Size::within((u64::from(width), u64::from(height)), decoded, sample_type, at, limits)?;
        Ok(ImageHeader {
            width: size.width,
            height: size.height,
            grey,
            sample_type,
            palette: colour == 3,
            bits_per_pixel: samples.saturating_mul(u64::from(depth)),
            interlaced: interlace == 1,
        })
    }

    /// Bytes of all rows, each with the byte that names its filter, before compression.
    fn filtered_bytes(&self) -> u64 {
        let pass = |columns: u32, rows: u32| {
            let row = u64::from(columns).saturating_mul(self.bits_per_pixel).div_ceil(8).saturating_add(1);
            if columns == 0 { 0 } else { row.saturating_mul(u64::from(rows)) }
        };
        if !self.interlaced {
            return pass(self.width, self.height);
        }
        let passes = PASSES.iter().map(|&(x, y, dx, dy)| {
            pass(self.width.saturating_sub(x).div_ceil(dx), self.height.saturating_sub(y).div_ceil(dy))
        });
        passes.fold(0, u64::saturating_add)
    }
}

fn u32_of(reader: &mut Reader<'_>) -> Result<u32> {
    Ok((u32::from(reader.u16()?) << 16) | u32::from(reader.u16()?))
}

struct Chunk<'a> {
    at: usize,
    name: [u8; 4],
    data: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// The next chunk, whose CRC is right.
    fn read(reader: &mut Reader<'a>) -> Result<Chunk<'a>> {
        let at = reader.position();
        let len = usize::try_from(u32_of(reader)?).unwrap_or(usize::MAX);
        let mut name = [0; 4];
        name.copy_from_slice(reader.take(4)?);
        let data = reader.take(len)?;
        let mut crc = Crc::new();
        crc.update(&name);
        crc.update(data);
        let chunk = Chunk { at, name, data };
        let stored = u32_of(reader)?;
        if stored != crc.sum() {
            let found = format!("a chunk {} whose CRC-32 is {:08x}", chunk.shown(), crc.sum());
            return Err(Error::malformed(found, format!("{stored:08x}, as stored")).at(at));
        }
        Ok(chunk)
    }

    fn shown(&self) -> String {
        self.name.escape_ascii().to_string()
    }
}

/// A PNG all of whose chunks are whole and where they may be.
pub(super) struct Walked {
    pub(super) image: ImageHeader,
    /// Where the data of the IDAT chunks lie in the file.
    data: Vec<std::ops::Range<usize>>,
}

pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<ImageHeader> {
    let mut reader = Reader::new(bytes);
    ImageHeader::read(&mut reader, limits)
}

/// Reads all chunks up to IEND. What follows it is not the picture's and is not looked at.
pub(super) fn walk(bytes: &[u8], limits: &Limits) -> Result<Walked> {
    let mut reader = Reader::new(bytes);
    let image = ImageHeader::read(&mut reader, limits)?;
    let mut data = Vec::new();
    let mut data_ended = false;
    loop {
        let chunk = Chunk::read(&mut reader)?;
        match &chunk.name {
            b"IDAT" => {
                if data_ended {
                    return Err(
                        Error::malformed("an IDAT chunk after another chunk", "all in a row").at(chunk.at)
                    );
                }
                let start = chunk.at.saturating_add(8);
                data.push(start..start.saturating_add(chunk.data.len()));
                continue;
            }
            b"IEND" => break,
            b"IHDR" => return Err(Error::malformed("a second IHDR chunk", "one").at(chunk.at)),
            b"acTL" | b"fcTL" | b"fdAT" => {
                return Err(unsupported("an animation", "a single picture").at(chunk.at));
            }
            // The decoder reads PLTE; an unknown chunk may be skipped if its first letter is small.
            [first, ..] if &chunk.name != b"PLTE" && first.is_ascii_uppercase() => {
                return Err(
                    unsupported(format!("the chunk {}", chunk.shown()), "chunks that PNG knows").at(chunk.at)
                );
            }
            _ => {}
        }
        data_ended = !data.is_empty();
    }
    if data.is_empty() {
        return Err(Error::malformed("no IDAT chunk", "pixels"));
    }
    Ok(Walked { image, data })
}

impl Walked {
    /// Inflates the data once, keeping nothing: they must have exactly the size of the picture and the right checksum.
    pub(super) fn require_exact_data(&self, bytes: &[u8]) -> Result<()> {
        let expected = self.image.filtered_bytes();
        let mut compressed = Parts { bytes, ranges: &self.data, position: 0 };
        let mut inflate = ZlibDecoder::new(&mut compressed);
        let inflated =
            std::io::copy(&mut (&mut inflate).take(expected.saturating_add(1)), &mut std::io::sink());
        let used = inflate.total_in();
        let stored = self
            .data
            .iter()
            .fold(0u64, |sum, range| sum.saturating_add(u64::try_from(range.len()).unwrap_or(u64::MAX)));
        let wanted =
            format!("{} for {} x {} pixels", counted(expected, "byte"), self.image.width, self.image.height);
        match inflated {
            Err(e) => Err(Error::malformed(format!("pixel data that do not inflate: {e}"), wanted)),
            Ok(len) if len > expected => Err(Error::malformed("more pixel data", wanted)),
            Ok(len) if len < expected => {
                Err(Error::malformed(format!("{} of pixel data", counted(len, "byte")), wanted))
            }
            Ok(_) if used != stored => Err(Error::malformed(
                format!("{} of compressed data", counted(stored, "byte")),
                format!("{used}, where they end"),
            )),
            Ok(_) => Ok(()),
        }
    }
}

/// The IDAT chunks as one stream.
struct Parts<'a> {
    bytes: &'a [u8],
    ranges: &'a [std::ops::Range<usize>],
    position: usize,
}

impl Read for Parts<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        while let Some((range, later)) = self.ranges.split_first() {
            let part = self.bytes.get(range.clone()).unwrap_or_default();
            let left = part.get(self.position..).unwrap_or_default();
            let len = left.len().min(into.len());
            if let (Some(from), Some(to)) = (left.get(..len), into.get_mut(..len))
                && len > 0
            {
                to.copy_from_slice(from);
                self.position = self.position.saturating_add(len);
                return Ok(len);
            }
            if into.is_empty() {
                break;
            }
            self.ranges = later;
            self.position = 0;
        }
        Ok(0)
    }
}

//! The chunks of an OpenEXR file, found by its offset table.

use std::ops::Range;

use exr::compression::Compression;

use super::header::Header;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// A rectangle of pixels and where its data are.
pub(super) struct Chunk {
    /// From the left and the top of the data window.
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    /// In the file.
    pub(super) data: Range<usize>,
}

impl Chunk {
    pub(super) fn decoded_bytes(&self, header: &Header) -> u64 {
        let pixels = u64::from(self.width).saturating_mul(u64::from(self.height));
        pixels.saturating_mul(header.channels.bytes_per_pixel())
    }
}

/// All chunks, row by row from the top; every one where the table says, none overlapping, and long enough for its pixels.
pub(super) fn find(bytes: &[u8], header: &Header) -> Result<Vec<Chunk>> {
    let mut table = Reader::new(bytes);
    table.take(header.end)?;
    let count = header.chunk_count();
    let left = table.rest().len();
    if count.saturating_mul(8) > u64::try_from(left).unwrap_or(u64::MAX) {
        let found = format!("{} after the header", counted(left, "byte"));
        return Err(
            Error::malformed(found, format!("a table of {}", counted(count, "offset"))).at(header.end)
        );
    }
    let (across, down) = header.chunk_grid();
    let mut chunks = Vec::new();
    let places = (0..down).flat_map(|row| (0..across).map(move |column| (column, row)));
    for place in places {
        let at = table.position();
        let offset = table.u64_le()?;
        let mut reader = Reader::new(bytes);
        let skipped = usize::try_from(offset).ok().and_then(|offset| reader.take(offset).ok());
        if skipped.is_none() {
            return Err(Error::malformed(format!("the offset {offset} of a chunk"), "one in the file").at(at));
        }
        chunks.push(read(&mut reader, place, header)?);
    }
    require_apart(&chunks, table.position())?;
    Ok(chunks)
}

/// Reads what stands before the pixels of a chunk: its place and its length.
fn read(reader: &mut Reader<'_>, (column, row): (u32, u32), header: &Header) -> Result<Chunk> {
    let at = reader.position();
    let (chunk_width, chunk_height) = header.chunk_size();
    let (x, y) = (column.saturating_mul(chunk_width), row.saturating_mul(chunk_height));
    let (found, expected): (Vec<i64>, Vec<i64>) = if header.tile.is_some() {
        let found = [reader.i32_le()?, reader.i32_le()?, reader.i32_le()?, reader.i32_le()?];
        (found.map(i64::from).to_vec(), vec![i64::from(column), i64::from(row), 0, 0])
    } else {
        let expected = i64::from(header.top).saturating_add(i64::from(y));
        (vec![i64::from(reader.i32_le()?)], vec![expected])
    };
    if found != expected {
        return Err(
            Error::malformed(format!("a chunk at {found:?}"), format!("the one at {expected:?}")).at(at)
        );
    }
    let len = reader.i32_le()?;
    let start = reader.position();
    let width = chunk_width.min(header.size.width.saturating_sub(x));
    let height = chunk_height.min(header.size.height.saturating_sub(y));
    let mut chunk = Chunk { x, y, width, height, data: start..start };
    let decoded = chunk.decoded_bytes(header);
    let claimed = u64::try_from(len).unwrap_or(0);
    // Data that do not shrink are stored as they are.
    if claimed == 0 || claimed > decoded || claimed.saturating_mul(expansion(header.compression)) < decoded {
        let expected = format!(
            "a length from which {} of pixels can come ({})",
            counted(decoded, "byte"),
            header.compression
        );
        return Err(Error::malformed(format!("a chunk of {}", counted(len, "byte")), expected).at(at));
    }
    reader.take(usize::try_from(len).unwrap_or(usize::MAX))?;
    chunk.data.end = reader.position();
    Ok(chunk)
}

/// What one byte may become at most.
fn expansion(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,                         // two bytes for 128
        Compression::ZIP1 | Compression::ZIP16 => 1032, // deflate
        Compression::PXR24 => 1376,                     // deflate, and three bytes for four
        Compression::PIZ => 512, // a code and its repetition, 9 bits, for 255 times two bytes
        Compression::B44 | Compression::B44A => 11, // three bytes for 16 halves
        // A repetition as in PIZ, or deflate, of codes that each may end a block of 64 floats.
        _ => 1 << 18,
    }
}

fn require_apart(chunks: &[Chunk], table_end: usize) -> Result<()> {
    let mut ranges: Vec<_> = chunks.iter().map(|chunk| (chunk.data.start, chunk.data.end)).collect();
    ranges.sort_unstable();
    let mut end = table_end;
    for (start, next_end) in ranges {
        if start < end {
            let found = format!("a chunk at {start} in what ends at {end}");
            return Err(Error::malformed(found, "chunks after the table that do not overlap").at(start));
        }
        end = next_end;
    }
    Ok(())
}

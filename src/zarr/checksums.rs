//! Checksums of arrays, kept among the sealed attributes once an array is finished: so that a chunk in another one's
//! place is found, which is intact in itself.
//!
//! Every chunk ends with a checksum of what it holds (that of its zstd frame, or of the codec `predictive`), which is
//! compared when it is decoded. So a file is told by the ends of its chunks and, of a shard, its index: hardly anything
//! has to be read.

use std::path::Path;

use super::places::places;
use super::read::DAMAGED;
use super::{Array, Store, shard};
use crate::error::{Error, Result};

/// Bytes of the checksum at the end of a chunk.
const END_BYTES: usize = 4;

/// Digits of a checksum as it is kept.
pub(crate) const DIGITS: usize = 8;

impl Store {
    /// Checksums of an array's files: for each place along the first dimension, [`DIGITS`] hexadecimal digits for all
    /// files there, one after the other.
    ///
    /// # Errors
    /// Where a file is missing, or its index is damaged.
    pub(crate) fn checksums(&self, array: &Array) -> Result<String> {
        let grid = array.grid();
        let rows = grid.first().copied().unwrap_or(0);
        (0..rows).map(|row| Ok(format!("{:08x}", self.checksum(array, row)?))).collect()
    }

    /// The checksum of an array's files at a place along the first dimension.
    ///
    /// # Errors
    /// As [`Store::checksums`].
    pub(crate) fn checksum(&self, array: &Array, row: u64) -> Result<u32> {
        let mut end = array.grid();
        let mut first = vec![0; end.len()];
        (first[0], end[0]) = (row, row + 1);
        places(&first, &end)
            .try_fold(0, |sum, place| of_file(&self.chunk_path(array, &place), array.shard_chunks(), sum))
    }
}

/// Continues a checksum by a file of so many chunks, or of one that is not in a shard.
fn of_file(path: &Path, chunks: Option<usize>, mut sum: u32) -> Result<u32> {
    let file = Store::map_chunk(path)?;
    let bytes = file.as_ref();
    let mut add = |bytes: &[u8]| sum = crc32c::crc32c_append(sum, bytes);
    let end = |bytes: &[u8]| bytes.last_chunk::<END_BYTES>().copied().unwrap_or_default();
    match chunks {
        None => {
            add(&(bytes.len() as u64).to_le_bytes());
            add(&end(bytes));
        }
        Some(chunks) => {
            let damaged = |what| Error::input(format!("{}: {what}", path.display())).hint(DAMAGED);
            for range in shard::chunk_ranges(bytes, chunks).map_err(damaged)? {
                let (length, end) = match range.and_then(|range| bytes.get(range)) {
                    Some(chunk) => (chunk.len() as u64, end(chunk)),
                    None => (u64::MAX, [0; END_BYTES]),
                };
                add(&length.to_le_bytes());
                add(&end);
            }
        }
    }
    Ok(sum)
}

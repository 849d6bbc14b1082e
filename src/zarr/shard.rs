//! The bytes of a shard (codec `sharding_indexed` of Zarr v3, index at the end): put together from encoded
//! chunks so that they can be encoded by many threads and still lie in one order, and taken apart so that they can be
//! decoded by many.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

/// A chunk that lies wholly beyond the array: absent, it reads as the fill value.
const ABSENT: u64 = u64::MAX;

/// Bytes of the index for each chunk: offset and length.
const ENTRY_BYTES: usize = 16;

/// The shard of these chunks, which are in C order of their places; `None` for one beyond the array.
///
/// Layout: the chunks one after another; then for each place offset and length as u64, little-endian; then
/// the crc32c of this index, u32.
pub(crate) fn assemble(chunks: &[Option<Vec<u8>>]) -> Vec<u8> {
    let data: usize = chunks.iter().flatten().map(Vec::len).sum();
    let mut shard = Vec::with_capacity(data + ENTRY_BYTES * chunks.len() + 4);
    let mut index = Vec::with_capacity(ENTRY_BYTES * chunks.len());
    for chunk in chunks {
        let (offset, length) = match chunk {
            Some(bytes) => (shard.len() as u64, bytes.len() as u64),
            None => (ABSENT, ABSENT),
        };
        index.extend(offset.to_le_bytes());
        index.extend(length.to_le_bytes());
        shard.extend_from_slice(chunk.as_deref().unwrap_or_default());
    }
    shard.extend_from_slice(&index);
    shard.extend(crc32c::crc32c(&index).to_le_bytes());
    shard
}

/// Where the chunks of a shard lie in it, in C order of their places; `None` for those that are absent.
///
/// # Errors
/// Says what is wrong with the index.
pub(crate) fn chunk_ranges(shard: &[u8], chunks: usize) -> Result<Vec<Option<Range<usize>>>, String> {
    let data = shard.len().checked_sub(index_bytes(chunks)).ok_or_else(|| {
        format!("got {} bytes, expected at least the index of {chunks} chunks", shard.len())
    })?;
    ranges(&shard[data..], data as u64)
}

/// Whether a shard ends with an intact index, and is as long as that says; of its chunks nothing is read.
pub(super) fn has_index(mut shard: impl Read + Seek, chunks: usize) -> std::io::Result<bool> {
    let end = shard.seek(SeekFrom::End(0))?;
    let Some(data) = end.checked_sub(index_bytes(chunks) as u64) else { return Ok(false) };
    shard.seek(SeekFrom::Start(data))?;
    let mut index = vec![0; index_bytes(chunks)];
    shard.read_exact(&mut index)?;
    Ok(ranges(&index, data).is_ok())
}

/// Bytes of the index of so many chunks, and of its checksum.
fn index_bytes(chunks: usize) -> usize {
    ENTRY_BYTES * chunks + 4
}

/// What an index with its checksum says of so many bytes before it.
fn ranges(index: &[u8], data: u64) -> Result<Vec<Option<Range<usize>>>, String> {
    let (index, checksum) = index.split_at(index.len() - 4);
    if checksum != crc32c::crc32c(index).to_le_bytes() {
        return Err("the index does not have its checksum".to_owned());
    }
    index
        .as_chunks::<ENTRY_BYTES>()
        .0
        .iter()
        .map(|entry| {
            let [offset, length] =
                [0, 8].map(|at| u64::from_le_bytes(std::array::from_fn(|byte| entry[at + byte])));
            if (offset, length) == (ABSENT, ABSENT) {
                return Ok(None);
            }
            let end = offset.checked_add(length).filter(|&end| end <= data);
            let end = end.ok_or_else(|| format!("a chunk at {offset} of {length} bytes in {data}"))?;
            Ok(Some(offset as usize..end as usize))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::io::Cursor;

    use super::*;

    #[test]
    fn a_shard_gives_its_chunks_back_and_a_damaged_index_is_refused() {
        let chunks = [Some(vec![1, 2, 3]), None, Some(vec![]), Some(vec![4; 9])];
        let shard = assemble(&chunks);
        assert!(has_index(Cursor::new(&shard), 4).unwrap());
        let ranges = chunk_ranges(&shard, 4).unwrap();
        let found: Vec<Option<Vec<u8>>> =
            ranges.into_iter().map(|range| range.map(|range| shard[range].to_vec())).collect();
        assert_eq!(found, chunks);
        for end in 0..shard.len() {
            assert!(chunk_ranges(&shard[..end], 4).is_err(), "{end}");
            assert!(!has_index(Cursor::new(&shard[..end]), 4).unwrap(), "{end}");
        }
        for bit in 12 * 8..shard.len() * 8 {
            let mut flipped = shard.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(chunk_ranges(&flipped, 4).is_err(), "{bit}");
            assert!(!has_index(Cursor::new(&flipped), 4).unwrap(), "{bit}");
        }
    }
}

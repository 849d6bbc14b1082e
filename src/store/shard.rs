//! The bytes of a shard (codec `sharding_indexed` of Zarr v3, index at the end), put together from its
//! encoded chunks so that they can be encoded by many threads and still lie in one order.

/// A chunk that lies wholly beyond the array: absent, it reads as the fill value.
const ABSENT: u64 = u64::MAX;

/// The shard of these chunks, which are in C order of their places; `None` for one beyond the array.
///
/// Layout: the chunks one after another; then for each place offset and length as u64, little-endian; then
/// the crc32c of this index, u32.
pub(super) fn assemble(chunks: &[Option<Vec<u8>>]) -> Vec<u8> {
    let data: usize = chunks.iter().flatten().map(Vec::len).sum();
    let mut shard = Vec::with_capacity(data + 16 * chunks.len() + 4);
    let mut index = Vec::with_capacity(16 * chunks.len());
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

//! What the decompressor takes on trust in the data of a chunk, looked at before it does.

use exr::compression::Compression;
use exr::meta::attribute::SampleType as Stored;

use super::chunks::Chunk;
use super::header::Header;
use crate::reader::Reader;
use crate::{Error, Result};

/// Refuses data by which the decompressor would reserve any amount of memory or calculate below zero.
pub(super) fn require(data: &[u8], chunk: &Chunk, header: &Header) -> Result<()> {
    // Data that did not shrink are stored as they are.
    if u64::try_from(data.len()).ok() == Some(chunk.decoded_bytes(header)) {
        return Ok(());
    }
    match header.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => require_dwa_counts(data, chunk, header),
        Compression::B44 | Compression::B44A => require_b44_blocks(data, chunk, header),
        _ => Ok(()),
    }
}

/// The eleven counters at the start of a DWA chunk, by which memory is reserved.
fn require_dwa_counts(data: &[u8], chunk: &Chunk, header: &Header) -> Result<()> {
    let mut reader = Reader::new(data);
    let mut counters = [0u64; 11];
    for counter in &mut counters {
        *counter = reader.u64_le()?;
    }
    let [_, unknown, _, _, _, _, run_lengths, raw, ac, dc, _] = counters;
    let bytes = chunk.decoded_bytes(header);
    let channels = u64::try_from(header.channels.stored.len()).unwrap_or(u64::MAX);
    let blocks = u64::from(chunk.width.div_ceil(8)).saturating_mul(u64::from(chunk.height.div_ceil(8)));
    let blocks = blocks.saturating_mul(channels);
    for (claimed, most) in [
        (unknown, bytes),
        (raw, bytes),
        (run_lengths, bytes.saturating_mul(2)),
        (dc, blocks),
        (ac, blocks.saturating_mul(63)),
    ] {
        if claimed > most {
            return Err(Error::malformed(
                format!("a counter of {claimed} in a DWA chunk"),
                format!("at most {most}"),
            ));
        }
    }
    Ok(())
}

/// Samples of a block of 4 x 4 as B44 rebuilds them: from which sample which other one, in the order of the differences.
const B44_STEPS: [(usize, usize); 15] = [
    (0, 4),
    (4, 8),
    (8, 12),
    (0, 1),
    (4, 5),
    (8, 9),
    (12, 13),
    (1, 2),
    (5, 6),
    (9, 10),
    (13, 14),
    (2, 3),
    (6, 7),
    (10, 11),
    (14, 15),
];

/// Differences in B44 blocks that lead below the least half.
fn require_b44_blocks(data: &[u8], chunk: &Chunk, header: &Header) -> Result<()> {
    let mut reader = Reader::new(data);
    let pixels = u64::from(chunk.width).saturating_mul(u64::from(chunk.height));
    let blocks = u64::from(chunk.width.div_ceil(4)).saturating_mul(u64::from(chunk.height.div_ceil(4)));
    for channel in &header.channels.stored {
        if channel.stored != Stored::F16 {
            reader.take(usize::try_from(pixels.saturating_mul(4)).unwrap_or(usize::MAX))?;
            continue;
        }
        for _ in 0..blocks {
            // A block of one value takes three bytes, and has a shift of more than 12 in the third.
            match reader.rest() {
                [_, _, 52..=u8::MAX, ..] => {
                    reader.take(3)?;
                }
                _ => require_b44_block(reader.take(14)?)?,
            }
        }
    }
    Ok(())
}

/// Of 16 bits the first sample, of 6 bits the shift of the differences, and 15 differences of 6 bits, of which 32 means none.
fn require_b44_block(block: &[u8]) -> Result<()> {
    let bits = block.iter().fold(0u128, |bits, &byte| (bits << 8) | u128::from(byte));
    let field = |from_end: u32, mask: u128| u32::try_from((bits >> from_end) & mask).unwrap_or_default();
    let mut samples = [0u32; 16];
    samples[0] = field(96, 0xFFFF);
    let shift = field(90, 0x3F);
    let none = 0x20u32.checked_shl(shift).unwrap_or_default();
    for ((from, to), from_end) in B44_STEPS.into_iter().zip((0..90u32).rev().step_by(6)) {
        let difference = field(from_end.saturating_sub(5), 0x3F).checked_shl(shift).unwrap_or_default();
        let start = samples.get(from).copied().unwrap_or_default();
        let Some(sample) = start.saturating_add(difference).checked_sub(none) else {
            return Err(Error::malformed("a B44 block that leads below the least half", "halves"));
        };
        if let Some(target) = samples.get_mut(to) {
            *target = sample & 0xFFFF;
        }
    }
    Ok(())
}

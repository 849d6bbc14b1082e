//! The bytes of a strip or tile, unpacked to exactly as many as its samples take.

use std::io::Read;

use flate2::read::ZlibDecoder;
use weezl::BitOrder;
use weezl::LzwStatus;
use weezl::decode::Configuration;

use super::layout::Compression;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// The caller has made sure that `len` bytes can come from so many.
pub(super) fn decompress(data: &[u8], compression: Compression, len: usize) -> Result<Vec<u8>> {
    let unpacked = match compression {
        Compression::None => data.get(..len).unwrap_or(data).to_vec(),
        Compression::Lzw => lzw(data, len)?,
        Compression::Deflate => deflate(data, len)?,
        Compression::PackBits => pack_bits(data, len)?,
    };
    if unpacked.len() != len {
        let found = format!("{} unpacked ({compression:?})", counted(unpacked.len(), "byte"));
        return Err(Error::malformed(found, format!("{len}")));
    }
    Ok(unpacked)
}

fn lzw(data: &[u8], len: usize) -> Result<Vec<u8>> {
    // The code that clears the table, 9 bits; older streams, with their bits in the other order, start otherwise.
    if data.first() != Some(&0x80) {
        return Err(Error::malformed(
            "LZW data that do not start with the clear code",
            "80 as the first byte",
        ));
    }
    let mut decoder =
        Configuration::with_tiff_size_switch(BitOrder::Msb, 8).with_yield_on_full_buffer(true).build();
    let mut out = vec![0; len];
    let mut filled = 0usize;
    let mut rest = data;
    while let Some(free) = out.get_mut(filled..).filter(|free| !free.is_empty()) {
        let step = decoder.decode_bytes(rest, free);
        filled = filled.saturating_add(step.consumed_out);
        rest = rest.get(step.consumed_in..).unwrap_or_default();
        match step.status {
            Err(e) => {
                return Err(Error::malformed(format!("LZW data that do not unpack: {e}"), "data that do"));
            }
            // The decoder's own word for no progress is said at times when there was some.
            Ok(LzwStatus::Done) => break,
            Ok(_) if step.consumed_in == 0 && step.consumed_out == 0 => break,
            Ok(_) => {}
        }
    }
    out.truncate(filled);
    Ok(out)
}

fn deflate(data: &[u8], len: usize) -> Result<Vec<u8>> {
    let mut out = Vec::with_capacity(len);
    // One byte more than there may be: reading as far as the end verifies the checksum.
    let most = u64::try_from(len).unwrap_or(u64::MAX).saturating_add(1);
    match ZlibDecoder::new(data).take(most).read_to_end(&mut out) {
        Ok(_) => Ok(out),
        Err(e) => Err(Error::malformed(format!("data that do not inflate: {e}"), "data that do")),
    }
}

/// TIFF 6.0, section 9.
fn pack_bits(data: &[u8], len: usize) -> Result<Vec<u8>> {
    let mut reader = Reader::new(data);
    let mut out = Vec::with_capacity(len);
    while out.len() < len {
        let code = reader.u8()?;
        match code {
            0..=127 => out.extend_from_slice(reader.take(usize::from(code).saturating_add(1))?),
            128 => {}
            129..=255 => {
                let value = reader.u8()?;
                let count = 257usize.saturating_sub(usize::from(code));
                out.extend(std::iter::repeat_n(value, count));
            }
        }
    }
    Ok(out)
}

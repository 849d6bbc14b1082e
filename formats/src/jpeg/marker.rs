//! Markers and what lies between them (ITU-T T.81, B.1.1).

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

// The second byte of the markers that are known by name; the first is 0xFF.
pub(super) const SOF0: u8 = 0xC0;
pub(super) const SOF1: u8 = 0xC1;
pub(super) const SOF2: u8 = 0xC2;
pub(super) const DHT: u8 = 0xC4;
pub(super) const RST0: u8 = 0xD0;
pub(super) const RST7: u8 = 0xD7;
pub(super) const SOI: u8 = 0xD8;
pub(super) const EOI: u8 = 0xD9;
pub(super) const SOS: u8 = 0xDA;
pub(super) const DQT: u8 = 0xDB;
pub(super) const DRI: u8 = 0xDD;
pub(super) const APP0: u8 = 0xE0;
pub(super) const APP1: u8 = 0xE1;
pub(super) const APP2: u8 = 0xE2;
pub(super) const APP14: u8 = 0xEE;
pub(super) const APP15: u8 = 0xEF;
pub(super) const COM: u8 = 0xFE;

/// The code of the next marker. Any number of fill bytes 0xFF may precede it.
pub(super) fn next(reader: &mut Reader<'_>) -> Result<u8> {
    let at = reader.position();
    let first = reader.u8()?;
    if first != 0xFF {
        return Err(
            Error::malformed(format!("the byte {first:02x}"), "a marker, which starts with ff").at(at)
        );
    }
    loop {
        match reader.u8()? {
            0xFF => {}
            code => return Ok(code),
        }
    }
}

/// The bytes of a marker segment, without its length.
pub(super) fn segment<'a>(reader: &mut Reader<'a>) -> Result<&'a [u8]> {
    let at = reader.position();
    let length = usize::from(reader.u16()?);
    match length.checked_sub(2) {
        Some(rest) => reader.take(rest),
        None => {
            Err(Error::malformed(format!("a segment of {}", counted(length, "byte")), "at least 2").at(at))
        }
    }
}

/// What lies between a scan header and the next marker.
pub(super) struct EntropyCoded {
    /// Without markers; a stuffed zero and its 0xFF count as one.
    pub(super) bytes: u64,
    /// Restart markers.
    pub(super) restarts: u64,
    /// Where every marker stands that ends data: the restart markers, then the one after the scan.
    pub(super) ends: Vec<usize>,
}

/// Steps over a scan's data, to its end at the next marker that is no restart marker.
pub(super) fn entropy_coded(reader: &mut Reader<'_>) -> Result<EntropyCoded> {
    let start = reader.position();
    let cut = || Error::malformed("the end of the data inside a scan", "an EOI marker").at(start);
    let scan = reader.rest();
    let (mut stuffed, mut restarts) = (0u64, 0u64);
    let mut ends = Vec::new();
    for at in memchr::memchr_iter(0xFF, scan) {
        // Each 0xFF but a marker's own is followed by a byte that is none, so no pair is seen twice.
        match scan.get(at.saturating_add(1)) {
            // A stuffed zero: the 0xFF is data.
            Some(0) => stuffed = stuffed.saturating_add(1),
            Some(&code @ RST0..=RST7) => {
                if u64::from(code & 7) != restarts % 8 {
                    let expected = format!("RST{}", restarts % 8);
                    let position = start.saturating_add(at);
                    return Err(Error::malformed(format!("RST{}", code & 7), expected).at(position));
                }
                restarts = restarts.saturating_add(1);
                ends.push(start.saturating_add(at));
            }
            Some(_) => {
                reader.take(at)?;
                ends.push(start.saturating_add(at));
                let all = u64::try_from(at).unwrap_or(u64::MAX);
                let bytes = all.saturating_sub(stuffed).saturating_sub(restarts.saturating_mul(2));
                return Ok(EntropyCoded { bytes, restarts, ends });
            }
            None => return Err(cut()),
        }
    }
    Err(cut())
}

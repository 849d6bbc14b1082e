//! Reading the Huffman codes of a scan (ITU-T T.81, annexes C and F.2).

use super::marker;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// Longest code, bits.
const LONGEST: usize = 16;

/// The codes of one table.
#[derive(Debug, Clone)]
pub(super) struct Table {
    /// Of each length from 1 bit: the first code and how many there are.
    lengths: [(u32, u32); LONGEST],
    /// In the order of the codes.
    symbols: Vec<u8>,
}

/// What a table is for and its number: class 0 is of means (DC), class 1 of the other coefficients (AC).
pub(super) type Slot = (u8, u8);

impl Table {
    /// The tables of a DHT segment.
    pub(super) fn read_all(segment: &[u8]) -> Result<Vec<(Slot, Table)>> {
        let mut fields = Reader::new(segment);
        let mut tables = Vec::new();
        while !fields.rest().is_empty() {
            let slot = fields.u8()?;
            let counts = fields.take(LONGEST)?;
            let mut lengths = [(0, 0); LONGEST];
            let (mut code, mut total) = (0u32, 0usize);
            for (length, &count) in lengths.iter_mut().zip(counts) {
                // At most 255 codes a length, so that 16 doublings stay below 2^32.
                code = code.wrapping_shl(1);
                *length = (code, u32::from(count));
                code = code.wrapping_add(u32::from(count));
                total = total.saturating_add(usize::from(count));
            }
            tables.push(((slot >> 4, slot & 15), Table { lengths, symbols: fields.take(total)?.to_vec() }));
        }
        Ok(tables)
    }
}

/// The bits of a scan. Every read is checked: a scan that ends early is an error, not zeros.
#[derive(Debug)]
pub(super) struct Bits<'a> {
    scan: &'a [u8],
    at: usize,
    held: u32,
    count: u32,
}

impl<'a> Bits<'a> {
    /// `scan` is what lies between the scan's header and the marker that ends it.
    pub(super) fn new(scan: &'a [u8]) -> Self {
        Bits { scan, at: 0, held: 0, count: 0 }
    }

    fn bit(&mut self) -> Result<u32> {
        if self.count == 0 {
            let rest = self.scan.get(self.at..).unwrap_or_default();
            let (byte, length) = match rest {
                [0xFF, 0, ..] => (0xFF, 2),
                [0xFF, ..] | [] => {
                    return Err(Error::malformed("the end of the data inside a block", "all of its codes"));
                }
                [byte, ..] => (*byte, 1),
            };
            self.held = u32::from(byte);
            self.count = 8;
            self.at = self.at.saturating_add(length);
        }
        self.count = self.count.saturating_sub(1);
        Ok(self.held.wrapping_shr(self.count) & 1)
    }

    /// The symbol of the next code.
    pub(super) fn symbol(&mut self, table: &Table) -> Result<u8> {
        let (mut code, mut before) = (0u32, 0u32);
        for &(first, count) in &table.lengths {
            code = code.wrapping_shl(1) | self.bit()?;
            let place = code.wrapping_sub(first);
            if code >= first && place < count {
                let at = usize::try_from(before.saturating_add(place)).unwrap_or(usize::MAX);
                if let Some(&symbol) = table.symbols.get(at) {
                    return Ok(symbol);
                }
            }
            before = before.saturating_add(count);
        }
        Err(Error::malformed(format!("the bits {code:016b}"), "a code of the scan's Huffman table"))
    }

    /// A signed number of `size` bits, at most 15 (T.81, F.2.2.1).
    pub(super) fn number(&mut self, size: u8) -> Result<i32> {
        let mut value = 0i32;
        for _ in 0..size {
            value = value.wrapping_shl(1) | i32::try_from(self.bit()?).unwrap_or_default();
        }
        let half = 1i32.wrapping_shl(u32::from(size).saturating_sub(1));
        let negative = size > 0 && value < half;
        Ok(if negative { value.wrapping_sub(half.wrapping_shl(1)).wrapping_add(1) } else { value })
    }

    /// Steps over the bits that fill the last byte and over the restart marker that must follow.
    pub(super) fn restart(&mut self) -> Result<()> {
        match self.scan.get(self.at..).unwrap_or_default() {
            [0xFF, marker::RST0..=marker::RST7, ..] => {
                self.at = self.at.saturating_add(2);
                self.count = 0;
                Ok(())
            }
            _ => Err(Error::malformed("data after the last block of an interval", "a restart marker")),
        }
    }

    /// Refuses data that no block has asked for.
    pub(super) fn require_end(&self) -> Result<()> {
        match self.scan.len().saturating_sub(self.at) {
            0 => Ok(()),
            more => Err(Error::malformed(
                format!("{} after the last block of a scan", counted(more, "byte")),
                "none",
            )),
        }
    }
}

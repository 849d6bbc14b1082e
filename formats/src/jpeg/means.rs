//! The first scan of the means (DC) of a progressive JPEG, read to its last block (ITU-T T.81, G.1.2.1).
//!
//! A decoder goes on with zeros where such a scan ends early, and later scans hide it: the picture changes its lightness
//! somewhere and decodes without an error.

use std::collections::HashMap;
use std::ops::Range;

use super::huffman::{Bits, Slot, Table};
use crate::words::counted;
use crate::{Error, Result};

/// Most bits of a difference of means.
const MOST_BITS: u8 = 15;

/// Where the means of a scan are, and how many.
#[derive(Debug)]
pub(super) struct Means {
    /// Of each component of the scan: its blocks in a coded unit, and the number of its table of codes.
    pub(super) members: Vec<(u64, u8)>,
    /// Coded units; no more than there are bits of data.
    pub(super) units: u64,
    pub(super) data: Range<usize>,
}

impl Means {
    /// Refuses a scan of fewer means than the frame has blocks.
    pub(super) fn require_all(
        &self,
        bytes: &[u8],
        tables: &HashMap<Slot, Table>,
        restart_interval: u64,
    ) -> Result<()> {
        let table = |&(blocks, number): &(u64, u8)| match tables.get(&(0, number)) {
            Some(table) => Ok((blocks, table)),
            None => {
                Err(Error::malformed(format!("no Huffman table {number} of means"), "it before the scan"))
            }
        };
        let members = self.members.iter().map(table).collect::<Result<Vec<_>>>()?;
        let mut bits = Bits::new(bytes.get(self.data.clone()).unwrap_or_default());
        for unit in 0..self.units {
            if unit > 0 && unit.checked_rem(restart_interval) == Some(0) {
                bits.restart()?;
            }
            for &(blocks, table) in &members {
                for _ in 0..blocks {
                    let size = bits.symbol(table)?;
                    if size > MOST_BITS {
                        return Err(Error::malformed(
                            format!("a mean of {}", counted(size, "bit")),
                            "at most 15",
                        ));
                    }
                    bits.number(size)?;
                }
            }
        }
        Ok(())
    }
}

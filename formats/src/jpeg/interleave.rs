//! One interleaved scan out of several: the same coefficients in the arrangement that every decoder is tried with.
//!
//! A sequential JPEG may hold its components in scans of their own (`cjpeg -scans`, and some cameras). The decoder
//! turns such files into garbage without an error where chroma is subsampled, so they never reach it: the scans are
//! read side by side, a row of coded units at a time, and their blocks are written as one scan. No coefficient
//! changes, so the samples are those of the same picture interleaved. The codes are read to the last bit, so that
//! a scan that is too short or too long is refused.

use std::collections::HashMap;
use std::rc::Rc;

use super::frame::{Grid, Sampling};
use super::huffman::{Bits, Slot, Table};
use super::marker;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// Coefficients in zigzag order, the first being the mean.
type Block = [i16; 64];

/// Largest number of bits of a coefficient in a symbol.
const MAX_SIZE: u8 = 15;

/// Every symbol of the written tables has a code of its own number in these many bits.
const DC_BITS: u32 = 5;
const AC_BITS: u32 = 8;

/// The blocks of one component in a row of coded units, row by row; those beyond the picture too.
struct Strip {
    blocks: Vec<Block>,
    /// Blocks in a row.
    across: usize,
}

/// A component in its scan.
struct Member {
    /// Number in the frame.
    component: usize,
    sampling: Sampling,
    dc: Rc<Table>,
    ac: Rc<Table>,
    predictor: i32,
}

/// A scan that is being read.
struct Scan<'a> {
    members: Vec<Member>,
    bits: Bits<'a>,
    restart_interval: u64,
    /// Coded units since the last restart.
    units: u64,
}

/// A file whose scans are put together.
#[derive(Default)]
struct Parsed<'a> {
    /// Segments that say how colours are meant (JFIF, Adobe), with their markers.
    told: Vec<(u8, &'a [u8])>,
    /// Precision and values of the quantisation table of each component.
    quantisation: HashMap<usize, (u8, &'a [u8])>,
    scans: Vec<Scan<'a>>,
}

/// The same picture with one scan. `bytes` has passed the walk over its markers, and is sequential.
pub(super) fn interleaved(bytes: &[u8], grid: &Grid) -> Result<Vec<u8>> {
    let Parsed { told, quantisation, mut scans } = parse(bytes, grid)?;
    let mut out = vec![0xFF, marker::SOI];
    for (code, data) in told {
        push_segment(&mut out, code, data);
    }
    for (number, _) in (0u8..).zip(&grid.components) {
        let Some((precision, values)) = quantisation.get(&usize::from(number)) else {
            return Err(Error::malformed(format!("no quantisation table for component {number}"), "one"));
        };
        push_segment(&mut out, marker::DQT, &[&[precision << 4 | number], *values].concat());
    }
    let written = grid.reduced();
    push_headers(&mut out, &written);

    let mut writer = Writer { out, held: 0, count: 0 };
    let mut predictors = vec![0; grid.components.len()];
    let (units_across, units_down) = grid.units();
    let mut strips: Vec<Strip> = grid
        .components
        .iter()
        .map(|(_, sampling)| {
            let across = units_across.saturating_mul(usize::from(sampling.horizontal));
            let blocks = vec![[0; 64]; across.saturating_mul(usize::from(sampling.vertical))];
            Strip { blocks, across }
        })
        .collect();
    // A unit that was read is `common` units below each other of those that are written, as far as there are so many.
    let (written_across, written_down) = written.units();
    let mut left = written_down;
    for row in 0..units_down {
        for scan in &mut scans {
            scan.read_row(row, grid, &mut strips)?;
        }
        for inner in 0..usize::from(grid.common.vertical).min(left) {
            for column in 0..written_across {
                let components = strips.iter().zip(&written.components).zip(&mut predictors);
                for ((strip, (_, sampling)), predictor) in components {
                    for block in strip.unit((inner, column), *sampling) {
                        writer.block(block, predictor);
                    }
                }
            }
            left = left.saturating_sub(1);
        }
    }
    scans.iter().try_for_each(|scan| scan.bits.require_end())?;
    Ok(writer.finish())
}

impl Strip {
    /// The blocks of a coded unit.
    fn unit(&self, (row, column): (usize, usize), sampling: Sampling) -> impl Iterator<Item = &Block> {
        let (across, down) = (usize::from(sampling.horizontal), usize::from(sampling.vertical));
        let start = column.saturating_mul(across);
        let rows = self.blocks.chunks(self.across.max(1)).skip(row.saturating_mul(down)).take(down);
        rows.flat_map(move |row| row.iter().skip(start).take(across))
    }

    fn block(&mut self, row: usize, column: usize) -> Option<&mut Block> {
        self.blocks.get_mut(row.checked_mul(self.across)?.checked_add(column)?)
    }
}

/// Reads the tables and finds the data of every scan.
fn parse<'a>(bytes: &'a [u8], grid: &Grid) -> Result<Parsed<'a>> {
    let mut parsed = Parsed::default();
    let mut huffman: HashMap<Slot, Rc<Table>> = HashMap::new();
    let mut tables: HashMap<u8, (u8, &'a [u8])> = HashMap::new();
    let mut restart_interval = 0;
    let mut reader = Reader::new(bytes);
    reader.take(2)?;
    loop {
        let at = reader.position();
        let code = marker::next(&mut reader)?;
        match code {
            marker::EOI => return Ok(parsed),
            marker::DHT => {
                let found = Table::read_all(marker::segment(&mut reader)?).map_err(|e| e.at(at))?;
                huffman.extend(found.into_iter().map(|(slot, table)| (slot, Rc::new(table))));
            }
            marker::DQT => {
                let mut fields = Reader::new(marker::segment(&mut reader)?);
                while !fields.rest().is_empty() {
                    let slot = fields.u8()?;
                    let len = if slot >> 4 == 0 { 64 } else { 128 };
                    tables.insert(slot & 15, (slot >> 4, fields.take(len).map_err(|e| e.at(at))?));
                }
            }
            marker::DRI => {
                restart_interval = u64::from(Reader::new(marker::segment(&mut reader)?).u16()?);
            }
            marker::SOS => {
                let mut fields = Reader::new(marker::segment(&mut reader)?);
                let count = fields.u8()?;
                let mut members = Vec::new();
                for _ in 0..count {
                    let (id, slots) = (fields.u8()?, fields.u8()?);
                    let Some(component) = grid.components.iter().position(|&(known, _)| known == id) else {
                        return Err(Error::malformed(format!("a scan of component {id}"), "one").at(at));
                    };
                    let table = |slot: Slot| {
                        huffman.get(&slot).cloned().ok_or_else(|| {
                            let found = format!("no Huffman table {slot:?} for component {id}");
                            Error::malformed(found, "it before the scan").at(at)
                        })
                    };
                    let sampling = grid.components.get(component).map(|&(_, sampling)| sampling);
                    members.push(Member {
                        component,
                        sampling: sampling.unwrap_or_default(),
                        dc: table((0, slots >> 4))?,
                        ac: table((1, slots & 15))?,
                        predictor: 0,
                    });
                    let slot = grid.quantisation.get(component).copied().unwrap_or_default();
                    if let Some(&table) = tables.get(&slot) {
                        parsed.quantisation.insert(component, table);
                    }
                }
                let start = reader.position();
                marker::entropy_coded(&mut reader)?;
                let data = bytes.get(start..reader.position()).unwrap_or_default();
                parsed.scans.push(Scan { members, bits: Bits::new(data), restart_interval, units: 0 });
            }
            _ => {
                let data = marker::segment(&mut reader)?;
                if matches!(code, marker::APP0 | marker::APP14) {
                    parsed.told.push((code, data));
                }
            }
        }
    }
}

impl Scan<'_> {
    /// Reads the blocks of its components in a row of the frame's coded units.
    fn read_row(&mut self, row: usize, grid: &Grid, strips: &mut [Strip]) -> Result<()> {
        if let [only] = self.members.as_slice() {
            // The coded unit is a block, and those beyond the picture are not there.
            let (component, sampling) = (only.component, only.sampling);
            let (across, down) = grid.blocks(sampling);
            let first = row.saturating_mul(usize::from(sampling.vertical));
            for inner in 0..usize::from(sampling.vertical) {
                if first.saturating_add(inner) >= down {
                    break;
                }
                for column in 0..across {
                    self.next_unit()?;
                    self.read_block(0, strips, component, (inner, column))?;
                }
            }
            if let Some(strip) = strips.get_mut(component) {
                pad(strip, across, down.saturating_sub(first).min(usize::from(sampling.vertical)));
            }
            return Ok(());
        }
        for unit in 0..grid.units().0 {
            self.next_unit()?;
            for member in 0..self.members.len() {
                let Some(&Member { component, sampling, .. }) = self.members.get(member) else { continue };
                let start = unit.saturating_mul(usize::from(sampling.horizontal));
                for inner in 0..usize::from(sampling.vertical) {
                    for column in 0..usize::from(sampling.horizontal) {
                        let place = (inner, start.saturating_add(column));
                        self.read_block(member, strips, component, place)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes the restart marker that may stand before a unit.
    fn next_unit(&mut self) -> Result<()> {
        if self.restart_interval > 0 && self.units == self.restart_interval {
            self.bits.restart()?;
            self.members.iter_mut().for_each(|member| member.predictor = 0);
            self.units = 0;
        }
        self.units = self.units.saturating_add(1);
        Ok(())
    }

    fn read_block(
        &mut self,
        member: usize,
        strips: &mut [Strip],
        component: usize,
        (row, column): (usize, usize),
    ) -> Result<()> {
        let member = self.members.get_mut(member);
        let block = strips.get_mut(component).and_then(|strip| strip.block(row, column));
        let (Some(member), Some(block)) = (member, block) else {
            return Err(Error::malformed("a block outside the picture", "one in it"));
        };
        *block = [0; 64];
        let [mean, others @ ..] = block;
        let size = checked_size(self.bits.symbol(&member.dc)?)?;
        member.predictor = member.predictor.saturating_add(self.bits.number(size)?);
        *mean = coefficient(member.predictor)?;
        let mut others = others.iter_mut();
        while !others.as_slice().is_empty() {
            let symbol = self.bits.symbol(&member.ac)?;
            let (run, size) = (usize::from(symbol >> 4), symbol & 15);
            if size == 0 && run < 15 {
                break;
            }
            let Some(place) = others.nth(run) else {
                return Err(Error::malformed("a run of zeros beyond the end of a block", "64 coefficients"));
            };
            *place = coefficient(self.bits.number(size)?)?;
        }
        Ok(())
    }
}

fn checked_size(size: u8) -> Result<u8> {
    if size <= MAX_SIZE {
        return Ok(size);
    }
    Err(Error::malformed(format!("a difference of means of {}", counted(size, "bit")), "at most 15"))
}

/// So small that the difference of any two has [`MAX_SIZE`] bits; samples of 8 bits need 11.
fn coefficient(value: i32) -> Result<i16> {
    let small = i16::try_from(value).ok().filter(|value| (-0x4000..0x4000).contains(value));
    small.ok_or_else(|| Error::malformed(format!("the coefficient {value}"), "one of at most 15 bits"))
}

/// Blocks beyond the picture go on with the mean of their neighbour.
fn pad(strip: &mut Strip, across: usize, down: usize) {
    let width = strip.across.max(1);
    let flat = |mean: i16| {
        let mut block = [0; 64];
        if let Some(first) = block.first_mut() {
            *first = mean;
        }
        block
    };
    let mean = |block: Option<&Block>| block.and_then(|block| block.first()).copied().unwrap_or_default();
    for row in strip.blocks.chunks_mut(width).take(down) {
        let last = mean(across.checked_sub(1).and_then(|last| row.get(last)));
        row.iter_mut().skip(across).for_each(|block| *block = flat(last));
    }
    for row in down..strip.blocks.len().checked_div(width).unwrap_or(0) {
        for column in 0..width {
            let above = row.checked_sub(1).and_then(|above| strip.block(above, column)).copied();
            if let Some(block) = strip.block(row, column) {
                *block = flat(mean(above.as_ref()));
            }
        }
    }
}

fn push_segment(out: &mut Vec<u8>, code: u8, data: &[u8]) {
    let length = u16::try_from(data.len().saturating_add(2)).unwrap_or(u16::MAX);
    out.extend([0xFF, code]);
    out.extend(length.to_be_bytes());
    out.extend(data);
}

/// The symbols of runs of zeros and sizes, in the order of their codes.
fn ac_symbols() -> impl Iterator<Item = u8> {
    (0u8..=u8::MAX).filter(|symbol| symbol & 15 != 0 || matches!(symbol, 0 | 0xF0))
}

/// Frame, tables and the scan's header.
fn push_headers(out: &mut Vec<u8>, grid: &Grid) {
    let mut frame = vec![8];
    frame.extend(grid.height.to_be_bytes());
    frame.extend(grid.width.to_be_bytes());
    let count = u8::try_from(grid.components.len()).unwrap_or(u8::MAX);
    frame.push(count);
    let mut scan = vec![count];
    for (number, (id, sampling)) in (0u8..).zip(&grid.components) {
        frame.extend([*id, (sampling.horizontal << 4) | sampling.vertical, number]);
        scan.extend([*id, 0]);
    }
    scan.extend([0, 63, 0]);
    let table = |slot: u8, bits: u32, symbols: Vec<u8>| {
        let count = u8::try_from(symbols.len()).unwrap_or(u8::MAX);
        let counts = (1u32..=16).map(|length| if length == bits { count } else { 0 });
        [slot].into_iter().chain(counts).chain(symbols).collect::<Vec<u8>>()
    };
    // Extended sequential, as quantisation tables may have 16 bits.
    push_segment(out, marker::SOF1, &frame);
    push_segment(out, marker::DHT, &table(0, DC_BITS, (0..=MAX_SIZE).collect()));
    push_segment(out, marker::DHT, &table(0x10, AC_BITS, ac_symbols().collect()));
    push_segment(out, marker::SOS, &scan);
}

/// Writes blocks by the tables of [`push_headers`].
struct Writer {
    out: Vec<u8>,
    held: u32,
    count: u32,
}

impl Writer {
    fn bits(&mut self, value: u32, count: u32) {
        for place in (0..count).rev() {
            self.held = self.held.wrapping_shl(1) | (value.wrapping_shr(place) & 1);
            self.count = self.count.saturating_add(1);
            if self.count == 8 {
                let byte = u8::try_from(self.held & 0xFF).unwrap_or_default();
                self.out.push(byte);
                if byte == 0xFF {
                    self.out.push(0);
                }
                (self.held, self.count) = (0, 0);
            }
        }
    }

    /// The bits of a number and how many they are (T.81, F.1.2.1).
    fn sized(value: i32) -> (u32, u32) {
        let magnitude = value.unsigned_abs();
        let size = 32u32.saturating_sub(magnitude.leading_zeros());
        let bits = if value < 0 { value.wrapping_sub(1) } else { value };
        let mask = 1u32.wrapping_shl(size).wrapping_sub(1);
        (u32::from_ne_bytes(bits.to_ne_bytes()) & mask, size)
    }

    fn ac_symbol(&mut self, symbol: u32) {
        // The number among the symbols that there are: 15 sizes a run, and two without a size.
        let (run, size) = (symbol >> 4, symbol & 15);
        let code = run.saturating_mul(15).saturating_add(size);
        self.bits(if symbol >= 0xF0 { code.saturating_add(1) } else { code }, AC_BITS);
    }

    fn block(&mut self, [mean, others @ ..]: &Block, predictor: &mut i32) {
        let (bits, size) = Self::sized(i32::from(*mean).saturating_sub(*predictor));
        *predictor = i32::from(*mean);
        self.bits(size, DC_BITS);
        self.bits(bits, size);
        let mut run = 0u32;
        for &value in others {
            if value == 0 {
                run = run.saturating_add(1);
                continue;
            }
            while run > 15 {
                self.ac_symbol(0xF0);
                run = run.saturating_sub(16);
            }
            let (bits, size) = Self::sized(i32::from(value));
            self.ac_symbol((run << 4) | size);
            self.bits(bits, size);
            run = 0;
        }
        if run > 0 {
            self.ac_symbol(0);
        }
    }

    fn finish(mut self) -> Vec<u8> {
        while self.count > 0 {
            self.bits(1, 1);
        }
        self.out.extend([0xFF, marker::EOI]);
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_coefficients_are_those_that_are_written() {
        assert_eq!(checked_size(15).unwrap(), 15);
        assert!(checked_size(16).is_err() && checked_size(255).is_err());
        for value in [-0x4000, -1, 0, 0x3FFF] {
            assert_eq!(i32::from(coefficient(value).unwrap()), value);
        }
        for value in [-0x4001, 0x4000, i32::MIN, i32::MAX] {
            assert!(coefficient(value).is_err(), "{value}");
        }
    }
}

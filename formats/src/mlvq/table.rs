//! The two kinds of tables of a database.

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Result};

/// Both kinds are padded to whole words of this size, and always have room for one bit more.
const WORD_BYTES: usize = 4;

/// Whole words that hold `bits`, in bytes.
fn padded_bytes(bits: usize) -> Option<usize> {
    bits.checked_div(8 * WORD_BYTES)?.checked_add(1)?.checked_mul(WORD_BYTES)
}

fn too_large(rows: usize, columns: usize, at: usize) -> Error {
    let found = format!("a table of {rows} x {columns} values");
    Error::malformed(found, "no more values than the file has bits").at(at)
}

/// Whole numbers, row-major: numbers of functions one level below.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct IntTable {
    columns: usize,
    values: Vec<u32>,
}

impl IntTable {
    /// Reads a table whose values must be `first .. first + count`, and counts them from 0.
    ///
    /// A value is packed, least significant bit first, in as many bits as the largest less the smallest needs. A table
    /// of one value takes no bits at all, so that its size is held against the rest of the file.
    pub(super) fn read(
        reader: &mut Reader<'_>,
        rows: usize,
        columns: usize,
        first: i32,
        count: usize,
    ) -> Result<IntTable> {
        let at = reader.position();
        let (min, max) = (reader.i32_le()?, reader.i32_le()?);
        let wrong_range = || {
            let expected = format!("from {first} and less than {first} + {count}");
            Error::malformed(format!("a table of values {min} to {max}"), expected).at(at)
        };
        let base = min.checked_sub(first).and_then(|base| u32::try_from(base).ok());
        let span = i64::from(max).checked_sub(i64::from(min)).and_then(|span| u32::try_from(span).ok());
        let (Some(base), Some(span)) = (base, span) else { return Err(wrong_range()) };
        let largest = base.checked_add(span).and_then(|largest| usize::try_from(largest).ok());
        if largest.is_none_or(|largest| largest >= count) {
            return Err(wrong_range());
        }
        let width = u32::BITS.saturating_sub(span.leading_zeros());
        let values = rows.checked_mul(columns).ok_or_else(|| too_large(rows, columns, at))?;
        if values > reader.rest().len().saturating_mul(8) {
            return Err(too_large(rows, columns, at));
        }
        let bits = usize::try_from(width).ok().and_then(|width| values.checked_mul(width));
        let size = bits.and_then(padded_bytes).ok_or_else(|| too_large(rows, columns, at))?;
        let packed = reader.take(size)?;
        let values = unpack(packed, width, values)
            .map(|value| if value <= span { base.checked_add(value) } else { None })
            .collect::<Option<Vec<u32>>>()
            .ok_or_else(|| Error::malformed("a value above the table's largest", max.to_string()).at(at))?;
        Ok(IntTable { columns, values })
    }

    pub(super) fn values(&self) -> &[u32] {
        &self.values
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.values.chunks_exact(self.columns)
    }

    /// The value at a place that exists: every number that a table holds is checked when it is read.
    pub(super) fn get(&self, row: usize, column: usize) -> usize {
        let place = row.saturating_mul(self.columns).saturating_add(column);
        self.values.get(place).map_or(0, |&value| usize::try_from(value).unwrap_or(0))
    }
}

/// The first `count` numbers of `width` bits each, from the least significant bit of each byte upwards.
fn unpack(packed: &[u8], width: u32, count: usize) -> impl Iterator<Item = u32> {
    let mask = (1u64 << width.min(32)).saturating_sub(1);
    let mut bytes = packed.iter();
    let (mut held, mut held_bits) = (0u64, 0u32);
    (0..count).map(move |_| {
        while held_bits < width {
            held |= u64::from(bytes.next().copied().unwrap_or(0)) << held_bits;
            held_bits = held_bits.saturating_add(8);
        }
        let value = held & mask;
        held >>= width;
        held_bits = held_bits.saturating_sub(width);
        u32::try_from(value).unwrap_or(u32::MAX)
    })
}

/// Real numbers in one byte each, row-major.
///
/// Byte q stands for min + q (max - min) / 256. The maximum would be 256 and wraps to 0, so that a zero byte may be
/// either end of the range; [`FloatTable::zeros`] lists them, and until they are resolved they stand for the minimum.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FloatTable {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) min: f32,
    pub(super) max: f32,
    pub(super) values: Vec<f32>,
    /// Places of the zero bytes, ascending; none if minimum and maximum are one.
    pub(super) zeros: Vec<usize>,
}

impl FloatTable {
    pub(super) fn read(reader: &mut Reader<'_>, rows: usize, columns: usize) -> Result<FloatTable> {
        let at = reader.position();
        let (min, max) = (reader.f32_le()?, reader.f32_le()?);
        if !min.is_finite() || !max.is_finite() || min > max {
            let found = format!("a table of values {min} to {max}");
            return Err(Error::malformed(found, "two finite numbers in order").at(at));
        }
        let (found_rows, found_columns) = (reader.i32_le()?, reader.i32_le()?);
        if usize::try_from(found_rows) != Ok(rows) || usize::try_from(found_columns) != Ok(columns) {
            return Err(Error::malformed(
                format!("a table of {found_rows} x {found_columns} values"),
                format!("{rows} x {columns}, as the header says"),
            )
            .at(at));
        }
        let count = rows.checked_mul(columns).ok_or_else(|| too_large(rows, columns, at))?;
        let size = count.checked_mul(8).and_then(padded_bytes).ok_or_else(|| too_large(rows, columns, at))?;
        let bytes = reader.take(size)?.get(..count).unwrap_or(&[]);
        let step = (f64::from(max) - f64::from(min)) / 256.0;
        // Through f64, as a product in f32 would round twice.
        let values = bytes.iter().map(|&q| (f64::from(min) + f64::from(q) * step) as f32).collect();
        let zeros = if min < max {
            bytes.iter().enumerate().filter(|&(_, &q)| q == 0).map(|(place, _)| place).collect()
        } else {
            Vec::new()
        };
        Ok(FloatTable { rows, columns, min, max, values, zeros })
    }

    /// The value at a place; 0 where there is none.
    pub(super) fn get(&self, row: usize, column: usize) -> f32 {
        let place = row.saturating_mul(self.columns).saturating_add(column);
        self.values.get(place).copied().unwrap_or(0.0)
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.columns)
    }

    /// Resolves the zero byte at `place`.
    pub(super) fn set(&mut self, place: usize, to_max: bool) {
        let value = if to_max { self.max } else { self.min };
        if let Some(slot) = self.values.get_mut(place) {
            *slot = value;
        }
    }

    /// Row and column of a place.
    pub(super) fn position(&self, place: usize) -> (usize, usize) {
        let row = place.checked_div(self.columns).unwrap_or(0);
        (row, place.checked_rem(self.columns).unwrap_or(0))
    }

    pub(super) fn is_zero_byte(&self, place: usize) -> bool {
        self.zeros.binary_search(&place).is_ok()
    }
}

/// All tables have been read: nothing may follow.
pub(super) fn require_end(reader: &Reader<'_>) -> Result<()> {
    match reader.rest().len() {
        0 => Ok(()),
        more => Err(Error::new(
            ErrorKind::Malformed,
            format!("{} after the last table", counted(more, "byte")),
            "the end of the file",
        )
        .at(reader.position())),
    }
}

//! One scan line of a Radiance picture in any of its three codings.

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// Lengths for which the component-wise coding exists.
const COMPONENT_WISE: std::ops::RangeInclusive<usize> = 8..=0x7FFF;

/// Reads `len` pixels (red, green, blue, exponent) into `line`, whose content is replaced.
pub(super) fn read(reader: &mut Reader<'_>, len: usize, line: &mut Vec<[u8; 4]>) -> Result<()> {
    line.clear();
    if COMPONENT_WISE.contains(&len)
        && let &[2, 2, high @ 0..=127, low, ..] = reader.rest()
    {
        let at = reader.position();
        let stored = usize::from(u16::from_be_bytes([high, low]));
        if stored != len {
            return Err(Error::malformed(
                format!("a scan line of {}", counted(stored, "pixel")),
                format!("{len}"),
            )
            .at(at));
        }
        reader.take(4)?;
        return components(reader, len, line);
    }
    pixels(reader, len, line)
}

/// Each component by itself: a byte above 128 repeats the next one, another byte counts those that follow.
fn components(reader: &mut Reader<'_>, len: usize, line: &mut Vec<[u8; 4]>) -> Result<()> {
    line.resize(len, [0; 4]);
    for component in 0..4 {
        let mut left = line.iter_mut().filter_map(|pixel| pixel.get_mut(component));
        let mut missing = len;
        while missing > 0 {
            let at = reader.position();
            let code = reader.u8()?;
            let count = usize::from(if code > 128 { code & 127 } else { code });
            let Some(after) = missing.checked_sub(count).filter(|_| count > 0) else {
                let found = format!("a run of {}", counted(count, "value"));
                return Err(
                    Error::malformed(found, format!("1 to {missing}, the rest of the scan line")).at(at)
                );
            };
            missing = after;
            if code > 128 {
                let value = reader.u8()?;
                left.by_ref().take(count).for_each(|target| *target = value);
            } else {
                let values = reader.take(count)?;
                // The values first: the end of these must not use up a place.
                values.iter().zip(left.by_ref()).for_each(|(&value, target)| *target = value);
            }
        }
    }
    Ok(())
}

/// Pixel after pixel; mantissas of 1, 1, 1 repeat the pixel before, and in a row of such each counts 256 times as much.
fn pixels(reader: &mut Reader<'_>, len: usize, line: &mut Vec<[u8; 4]>) -> Result<()> {
    let mut shift = 0u32;
    while line.len() < len {
        let at = reader.position();
        let mut pixel = [0; 4];
        pixel.copy_from_slice(reader.take(4)?);
        let [1, 1, 1, low] = pixel else {
            line.push(pixel);
            shift = 0;
            continue;
        };
        let Some(&before) = line.last() else {
            return Err(Error::malformed("a repetition", "a pixel before it in the scan line").at(at));
        };
        let count = usize::from(low).checked_shl(shift).filter(|&count| count >> shift == usize::from(low));
        let missing = len.saturating_sub(line.len());
        let Some(count) = count.filter(|&count| count <= missing) else {
            let found = format!("{low} * 2^{}", counted(shift, "repetition"));
            return Err(
                Error::malformed(found, format!("at most {missing}, the rest of the scan line")).at(at)
            );
        };
        line.resize(line.len().saturating_add(count), before);
        shift = shift.saturating_add(8);
    }
    Ok(())
}

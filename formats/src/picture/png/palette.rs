//! Colours of a palette, put in the place of their numbers.

use super::chunks::ImageHeader;
use crate::picture::alpha::not_opaque;
use crate::{Error, Result};

/// Red, green and blue of every pixel. `rows` holds the numbers as stored, packed to whole bytes a row; of `palette`
/// each three bytes are a colour, and of `alpha` each byte is how opaque one is (those beyond its end are).
pub(super) fn expand(image: &ImageHeader, rows: &[u8], palette: &[u8], alpha: &[u8]) -> Result<Vec<u8>> {
    let (colours, _) = palette.as_chunks::<3>();
    let width = usize::try_from(image.width).unwrap_or(usize::MAX);
    let bits = usize::try_from(image.bits_per_pixel).unwrap_or(8).clamp(1, 8);
    let mut out = Vec::with_capacity(image.pixels().saturating_mul(3));
    for (y, row) in rows.chunks_exact(width.saturating_mul(bits).div_ceil(8).max(1)).enumerate() {
        let numbers = row.iter().flat_map(|&byte| {
            (0..8).step_by(bits).map(move |shift| usize::from((byte << shift) >> 8usize.saturating_sub(bits)))
        });
        for (x, number) in numbers.take(width).enumerate() {
            let Some(colour) = colours.get(number) else {
                let found = format!("the colour number {number} at column {x}, row {y}");
                return Err(Error::malformed(found, format!("one of the {} of the palette", colours.len())));
            };
            if alpha.get(number).is_some_and(|&opaque| opaque != u8::MAX) {
                return Err(not_opaque(y.saturating_mul(width).saturating_add(x)));
            }
            out.extend_from_slice(colour);
        }
    }
    Ok(out)
}

//! Alpha channels: dropped where they say nothing, refused where they say something.

use super::size::unsupported;
use crate::Result;

/// Removes the last of `stored` interleaved channels, all of whose samples must be `opaque`.
pub(super) fn without_alpha<T: Copy + PartialEq>(samples: &[T], stored: usize, opaque: T) -> Result<Vec<T>> {
    let colours = stored.saturating_sub(1);
    let mut kept =
        Vec::with_capacity(samples.len().saturating_sub(samples.len().checked_div(stored).unwrap_or(0)));
    for (number, pixel) in samples.chunks_exact(stored.max(1)).enumerate() {
        let (colour, alpha) = pixel.split_at(colours);
        if alpha.first() != Some(&opaque) {
            return Err(not_opaque(number));
        }
        kept.extend_from_slice(colour);
    }
    Ok(kept)
}

/// The error for the first pixel, counted along the rows from the top, that is not opaque.
pub(super) fn not_opaque(pixel: usize) -> crate::Error {
    unsupported(
        format!("an alpha channel that is not opaque at pixel {pixel}"),
        "an opaque picture (what lies behind the pixel is not in the file)",
    )
}

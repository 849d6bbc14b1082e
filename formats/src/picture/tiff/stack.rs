//! Pictures behind one another that share one directory: programs for microscopes write stacks so, and a reader that
//! knows nothing of it takes the first picture for all.
//!
//! Told by the `ImageDescription` of ImageJ (`images=5`) and tifffile (`{"shape": [5, 64, 64]}`), by `ImageDepth` (SGI's
//! volumes), by MetaMorph's tag 33629, and by a strip of twice the bytes that its rows take.

use super::directory::{Directory, tag};
use super::layout::{Compression, Layout};
use crate::picture::size::unsupported;
use crate::{Error, Result};

/// Refuses a directory that says that it stands for several pictures. `file` is the length of the file in bytes.
pub(super) fn require_single(directory: &Directory<'_>, layout: &Layout, file: usize) -> Result<()> {
    let planes = directory.count(tag::METAMORPH_PLANES).max(directory.number(tag::IMAGE_DEPTH, Some(1))?);
    let described = described(directory, layout).filter(|_| holds_two(layout, file));
    match planes.max(described.unwrap_or(1)) {
        0 | 1 => Ok(()),
        number => Err(refused(&number.to_string()).at(directory.at)),
    }
}

/// Refuses uncompressed strips with bytes for more than their rows; they lie within the file. (The last one may be as
/// long as the others.)
pub(super) fn require_short_strips(layout: &Layout) -> Result<()> {
    let longest = layout.chunks().map(|chunk| layout.decoded_bytes(&chunk)).max().unwrap_or(0);
    let long = layout.chunks().find(|chunk| chunk.len >= longest.saturating_mul(2));
    match long.filter(|_| layout.compression == Compression::None) {
        Some(chunk) => Err(refused("several").at(chunk.offset)),
        None => Ok(()),
    }
}

fn refused(number: &str) -> Error {
    unsupported(
        format!("a stack of {number} pictures in one directory"),
        "one picture; save each picture of the stack in a file of its own (tifffile, or ImageJ's Image Sequence)",
    )
}

/// Pictures that the `ImageDescription` speaks of.
fn described(directory: &Directory<'_>, layout: &Layout) -> Option<u64> {
    let text = String::from_utf8_lossy(directory.bytes_of(tag::IMAGE_DESCRIPTION)?);
    if text.starts_with("ImageJ=") {
        let images = text.lines().find_map(|line| line.strip_prefix("images="))?;
        return images.trim().parse().ok();
    }
    let (before, shape) = text.split_once("shape")?;
    // A dictionary of tifffile, or its older `shape=(5, 64, 64)`; not any sentence with the word in it.
    if !before.is_empty() && !before.starts_with('{') {
        return None;
    }
    let (_, list) = shape.split_once(['[', '('])?;
    let (list, _) = list.split_once([']', ')'])?;
    let sides = list.split(',').filter(|side| !side.trim().is_empty());
    let samples = sides
        .map(|side| side.trim().parse::<u64>().ok())
        .try_fold(1u64, |product, side| Some(product.saturating_mul(side?)))?;
    samples.checked_div(u64::try_from(layout.size.samples()).ok()?)
}

/// Whether the file has room for a second picture. The description stays where a picture was saved out of a stack.
fn holds_two(layout: &Layout, file: usize) -> bool {
    let picture = layout.size.samples().saturating_mul(layout.sample_type.bytes());
    let first = layout.chunks().map(|chunk| chunk.offset).min().unwrap_or(0);
    let left = u64::try_from(file).unwrap_or(u64::MAX).saturating_sub(first);
    let two = u64::try_from(picture.saturating_mul(2)).unwrap_or(u64::MAX);
    layout.compression == Compression::None && left >= two
}

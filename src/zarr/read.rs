//! Reading arrays: boxes of them, out of chunks of known size.
//!
//! Nothing is allocated that the files do not hold: every chunk of a box must be there before the box is, and a chunk
//! is decompressed to exactly the size that the layout gives it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{SampleType, Samples};
use rayon::prelude::*;
use zstd::bulk::Decompressor;

use super::array::{Array, Layout, Named};
use super::places::{advance, places};
use super::{Store, sample_type_of, shard};
use crate::disk::mapped::MappedFile;
use crate::error::{Error, Result};

/// Largest number of bytes that are read at once.
const LIMIT_BYTES: u64 = 1 << 34;

/// Chunks that are decoded before they are copied together.
const BATCH: usize = 64;

/// What to do about a damaged chunk.
pub(crate) const DAMAGED: &str = "the store is damaged: if what it was made of is still there, delete this file and \
                                  run the command that made it again, which writes what is missing";

/// A chunk of a box: where it lies in the array, and its bytes.
struct Piece {
    origin: Vec<u64>,
    file: usize,
    /// None for a chunk that is absent from its shard: all zero.
    bytes: Option<Range<usize>>,
}

/// A file that a box touches, and where its first element lies in the array.
struct Touched {
    corner: Vec<u64>,
    path: PathBuf,
    file: MappedFile,
}

impl Store {
    /// Maps the file of a chunk or a shard.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Missing`] where it is not there, [`crate::ErrorKind::Input`] where it is no file.
    pub(crate) fn map_chunk(path: &Path) -> Result<MappedFile> {
        MappedFile::open(path).map_err(|error| match error.kind() {
            _ if super::metadata::is_absent(&error) => {
                Error::missing(format!("{}: this part of the store has not been written", path.display()))
                    .hint("run the command that makes this store again; it goes on where it stopped")
            }
            std::io::ErrorKind::InvalidInput => {
                Error::input(format!("{}: {error}", path.display())).hint(DAMAGED)
            }
            _ => Error::io("read", path, error),
        })
    }

    /// Reads a box of an array: offset and extent in each dimension.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Missing`] where a part of it has not been written, [`crate::ErrorKind::Input`] where one is
    /// damaged; both name the file.
    pub(crate) fn read_box<T: Named>(&self, array: &Array, start: &[u64], extent: &[u64]) -> Result<Vec<T>> {
        let refused =
            |what: String| Error::input(format!("{}: {}: {what}", self.path().display(), array.name));
        let shape = &array.shape;
        let within =
            start.iter().zip(extent).zip(shape).all(|((&start, &extent), &length)| {
                start.checked_add(extent).is_some_and(|end| end <= length)
            });
        if start.len() != shape.len() || extent.len() != shape.len() || !within {
            return Err(refused(format!(
                "got shape {shape:?}, expected it to hold {extent:?} from {start:?} on"
            )));
        }
        let bytes = extent.iter().try_fold(size_of::<T>() as u64, |product, &n| product.checked_mul(n));
        let Some(bytes) = bytes.filter(|&bytes| bytes <= LIMIT_BYTES) else {
            return Err(refused(format!("a box of {extent:?} elements is too large")));
        };
        if *array.data_type() != T::data_type() || !array.is_plain {
            let (found, expected) = (array.data_type(), T::data_type());
            return Err(refused(format!("got elements of type {found}, expected {expected}")));
        }
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let files = self.files_of(array, start, extent)?;
        let pieces = pieces_of(array, start, extent, &files)?;
        let mut elements = vec![T::default(); bytes as usize / size_of::<T>()];
        let count = array.chunk.iter().product::<u64>() as usize;
        let decode = |decompressor: &mut Option<Decompressor<'static>>, piece: &Piece| -> Result<Vec<T>> {
            let mut chunk = vec![T::default(); count];
            if let Some(range) = &piece.bytes {
                let Touched { path, file, .. } = &files[piece.file];
                let bytes = file.as_ref().get(range.clone()).unwrap_or_default();
                decompress(decompressor, bytes, bytemuck::cast_slice_mut(&mut chunk)).map_err(|what| {
                    let place = if array.shard.is_some() {
                        format!(", chunk at {:?}", piece.origin)
                    } else {
                        String::new()
                    };
                    Error::input(format!("{}{place}: {what}", path.display())).hint(DAMAGED)
                })?;
            }
            Ok(chunk)
        };
        for batch in pieces.chunks(BATCH) {
            let decoded: Vec<Vec<T>> = match batch {
                [piece] => vec![decode(&mut None, piece)?],
                _ => batch
                    .par_iter()
                    .map_init(|| None, |with, piece| decode(with, piece))
                    .collect::<Result<_>>()?,
            };
            for (piece, chunk) in batch.iter().zip(&decoded) {
                copy(&array.chunk, &piece.origin, chunk, start, extent, &mut elements);
            }
        }
        Ok(elements)
    }

    /// The files that a box touches, in C order.
    fn files_of(&self, array: &Array, start: &[u64], extent: &[u64]) -> Result<Vec<Touched>> {
        let outer = array.outer();
        let first: Vec<u64> = start.iter().zip(outer).map(|(&at, &side)| at / side).collect();
        let end: Vec<u64> =
            start.iter().zip(extent).zip(outer).map(|((&at, &n), &side)| (at + n).div_ceil(side)).collect();
        let touched = |place: Vec<u64>| {
            let path = self.chunk_path(array, &place);
            let corner = place.iter().zip(outer).map(|(&at, &side)| at * side).collect();
            Ok(Touched { corner, file: Self::map_chunk(&path)?, path })
        };
        let files = places(&first, &end).map(touched).collect::<Result<_>>();
        self.expect_unchanged()?;
        files
    }

    /// Reads a whole array of this layout.
    pub(crate) fn read_array<T: Named>(&self, name: &str, layout: &Layout<'_>) -> Result<Vec<T>> {
        let array = self.open_array(name, layout)?;
        self.read_box(&array, &vec![0; array.shape.len()], &array.shape)
    }

    /// Reads a whole array of a shape that is known but for what is 0, whatever its dimensions are called; returns the
    /// shape found.
    pub fn read<T: Named>(&self, name: &str, shape: &[usize]) -> Result<(Vec<usize>, Vec<T>)> {
        let claimed = self.claimed_shape(name, shape.len())?;
        let known =
            shape.iter().zip(claimed).map(|(&known, claimed)| if known == 0 { claimed } else { known });
        let shape: Vec<usize> = known.collect();
        let elements = self.read_array(name, &Layout::small::<T>(&[], &shape))?;
        Ok((shape, elements))
    }

    /// Reads samples of a range along the first dimension.
    pub(crate) fn read_samples(&self, array: &Array, range: Range<u64>) -> Result<Samples> {
        let (mut start, mut extent) = (vec![0; array.shape.len()], array.shape.clone());
        if let (Some(start), Some(extent)) = (start.first_mut(), extent.first_mut()) {
            (*start, *extent) = (range.start, range.end.saturating_sub(range.start));
        }
        Ok(match sample_type_of(array.data_type()) {
            Some(SampleType::U8) => Samples::U8(self.read_box(array, &start, &extent)?),
            Some(SampleType::U16) => Samples::U16(self.read_box(array, &start, &extent)?),
            Some(SampleType::F16) => Samples::F16(self.read_box(array, &start, &extent)?),
            Some(SampleType::F32) => Samples::F32(self.read_box(array, &start, &extent)?),
            None => return Err(Error::internal(format!("{} holds no samples", array.name))),
        })
    }
}

/// The chunks of a box, in the order of the files.
fn pieces_of(array: &Array, start: &[u64], extent: &[u64], files: &[Touched]) -> Result<Vec<Piece>> {
    let outer = array.outer();
    let end: Vec<u64> = start.iter().zip(extent).map(|(&at, &n)| at + n).collect();
    let mut pieces = Vec::new();
    for (number, Touched { corner, path, file }) in files.iter().enumerate() {
        let Some(chunks) = array.shard_chunks() else {
            let bytes = Some(0..file.as_ref().len());
            pieces.push(Piece { origin: corner.clone(), file: number, bytes });
            continue;
        };
        let damaged = |what: String| Error::input(format!("{}: {what}", path.display())).hint(DAMAGED);
        let ranges = shard::chunk_ranges(file.as_ref(), chunks).map_err(damaged)?;
        // Chunks of the shard that the box touches, counted from the shard's corner.
        let inner = |axis: usize, at: u64| at.saturating_sub(corner[axis]).min(outer[axis]);
        let axes = 0..corner.len();
        let first: Vec<u64> = axes.clone().map(|axis| inner(axis, start[axis]) / array.chunk[axis]).collect();
        let last: Vec<u64> =
            axes.clone().map(|axis| inner(axis, end[axis]).div_ceil(array.chunk[axis])).collect();
        for at in places(&first, &last) {
            let number_in_shard =
                axes.clone().fold(0, |number, axis| number * (outer[axis] / array.chunk[axis]) + at[axis]);
            let origin = axes.clone().map(|axis| corner[axis] + at[axis] * array.chunk[axis]).collect();
            let bytes = ranges.get(number_in_shard as usize).cloned().flatten();
            pieces.push(Piece { origin, file: number, bytes });
        }
    }
    Ok(pieces)
}

/// Decompresses to exactly as many bytes as `out` has.
fn decompress(
    decompressor: &mut Option<Decompressor<'static>>,
    bytes: &[u8],
    out: &mut [u8],
) -> std::result::Result<(), String> {
    let decompressor = match decompressor {
        Some(decompressor) => decompressor,
        none => none.insert(Decompressor::new().map_err(|error| format!("zstd: {error}"))?),
    };
    match decompressor.decompress_to_buffer(bytes, out) {
        Ok(found) if found == out.len() => Ok(()),
        Ok(found) => Err(format!("got a chunk of {found} bytes, expected {}", out.len())),
        Err(error) => Err(format!("zstd: {error}")),
    }
}

/// Copies the part of a chunk that lies in a box into it.
fn copy<T: Copy>(
    chunk_shape: &[u64],
    origin: &[u64],
    chunk: &[T],
    start: &[u64],
    extent: &[u64],
    elements: &mut [T],
) {
    let axes = 0..origin.len();
    let first: Vec<u64> = axes.clone().map(|axis| start[axis].max(origin[axis])).collect();
    let end: Vec<u64> =
        axes.clone().map(|axis| (start[axis] + extent[axis]).min(origin[axis] + chunk_shape[axis])).collect();
    let Some(last) = origin.len().checked_sub(1) else { return };
    let run = (end[last] - first[last]) as usize;
    // Runs along the last axis.
    let mut rows_end = end.clone();
    rows_end[last] = first[last] + 1;
    let offset = |at: &[u64], corner: &[u64], shape: &[u64]| {
        axes.clone().fold(0, |sum, axis| sum * shape[axis] + at[axis] - corner[axis]) as usize
    };
    let mut at = first.clone();
    loop {
        let from = offset(&at, origin, chunk_shape);
        let to = offset(&at, start, extent);
        elements[to..to + run].copy_from_slice(&chunk[from..from + run]);
        if !advance(&mut at, &first, &rows_end) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::ErrorKind;
    use std::fs;

    #[test]
    fn a_box_lies_in_its_array_and_has_its_type() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::at(folder.path());
        let layout = Layout::small::<u16>(&["y", "x"], &[4, 6]);
        let elements: Vec<u16> = (0..24).collect();
        store.write("a", &layout, &elements).unwrap();
        let array = store.open_array("a", &layout).unwrap();
        assert_eq!(store.read_box::<u16>(&array, &[1, 2], &[2, 3]).unwrap(), [8, 9, 10, 14, 15, 16]);
        assert_eq!(store.read_box::<u16>(&array, &[4, 0], &[0, 6]).unwrap(), [0; 0]);
        for (start, extent) in [
            (&[0, 0][..], &[4, 7][..]),
            (&[1, 0], &[4, 6]),
            (&[u64::MAX, 0], &[2, 1]),
            (&[0], &[4]),
            (&[0, 0], &[4]),
            (&[0, 0, 0], &[4, 6, 0]),
        ] {
            let error = store.read_box::<u16>(&array, start, extent).unwrap_err();
            assert!(error.to_string().contains("expected it to hold"), "{error}");
        }
        let error = store.read_box::<i16>(&array, &[0, 0], &[4, 6]).unwrap_err();
        assert!(error.to_string().contains("got elements of type uint16"), "{error}");
        let layout = Layout::small::<u16>(&["y", "x"], &[1 << 20, 1 << 20]);
        let array = store.create_array("large", &layout).unwrap();
        let error = store.read_box::<u16>(&array, &[0, 0], array.shape()).unwrap_err();
        assert!(error.to_string().contains("is too large"), "{error}");
    }

    #[test]
    fn a_chunk_is_a_file_of_the_size_that_its_layout_gives() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::at(folder.path());
        let layout = Layout::small::<u16>(&["x"], &[6]);
        store.write("a", &layout, &[1u16; 6]).unwrap();
        let chunk = folder.path().join("a/c/0");
        let told = || {
            let error = store.read_array::<u16>("a", &layout).unwrap_err();
            (error.kind(), error.to_string(), error.guidance().unwrap_or_default().to_owned())
        };
        fs::write(&chunk, zstd::bulk::compress(&[1u8; 10], 3).unwrap()).unwrap();
        let (kind, text, _) = told();
        assert_eq!(kind, ErrorKind::Input);
        assert!(text.contains("got a chunk of 10 bytes, expected 12"), "{text}");
        fs::remove_file(&chunk).unwrap();
        let missing = |(kind, text, advice): (ErrorKind, String, String)| {
            assert_eq!(kind, ErrorKind::Missing, "{text}");
            assert!(text.contains("has not been written") && advice.contains("goes on"), "{text}: {advice}");
        };
        missing(told());
        fs::create_dir(&chunk).unwrap();
        let (kind, text, advice) = told();
        assert_eq!((kind, advice.as_str()), (ErrorKind::Input, DAMAGED), "{text}");
        // A file where the folder of the chunks should be.
        fs::remove_dir_all(folder.path().join("a/c")).unwrap();
        fs::write(folder.path().join("a/c"), "").unwrap();
        missing(told());
    }
}

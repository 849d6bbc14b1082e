//! Reading a window of one view: the chunks that it touches, decoded by many threads straight from the mapped
//! shards, and cut to the window.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use btfkit_formats::{SampleType, Samples, f16};
use rayon::prelude::*;

use super::{CHUNK_SIDE, Measurement, SampleArray};
use crate::disk::mapped::MappedFile;
use crate::error::{Error, Result};
use crate::shape::{Size, Window};
use crate::words::counted;
use crate::zarr::codec::{Chunk, ChunkCodec};
use crate::zarr::{DAMAGED, Store, shard};

/// A shard, and where its chunks lie in it.
struct Shard {
    file: MappedFile,
    chunks: Vec<Option<Range<usize>>>,
}

impl Measurement {
    /// Samples of a window under one view, [y, x, light, channel].
    ///
    /// # Errors
    /// [`crate::ErrorKind::Missing`] where a shard of it has not been written, [`crate::ErrorKind::Input`] where one is
    /// damaged.
    pub fn read_reflectance(&self, view: usize, window: Window) -> Result<Samples> {
        let bytes = self.read_windows(SampleArray::Reflectance, self.description.chunk(), view, &[window])?;
        Ok(match self.description.sample_type {
            SampleType::U8 => Samples::U8(bytes),
            SampleType::U16 => Samples::U16(cast(&bytes)),
            SampleType::F16 => Samples::F16(cast::<f16>(&bytes)),
            SampleType::F32 => Samples::F32(cast(&bytes)),
        })
    }

    /// L* codes of a window under one view, [y, x, light].
    ///
    /// # Errors
    /// As [`Measurement::read_reflectance`].
    pub fn read_luminance(&self, view: usize, window: Window) -> Result<Vec<u8>> {
        self.read_luminance_of(view, &[window])
    }

    /// L* codes of some windows under one view, one window after another, each [y, x, light].
    ///
    /// # Errors
    /// As [`Measurement::read_reflectance`].
    pub(crate) fn read_luminance_of(&self, view: usize, windows: &[Window]) -> Result<Vec<u8>> {
        self.read_windows(SampleArray::Luminance, self.description.code_chunk(), view, windows)
    }

    /// Bytes of some windows of an array, texel by texel; a shard that several lie in is opened once.
    fn read_windows(
        &self,
        array: SampleArray,
        chunk: Chunk,
        view: usize,
        windows: &[Window],
    ) -> Result<Vec<u8>> {
        let beyond = windows.iter().find(|window| !window.fits(self.description.size));
        if let Some(window) = beyond.or(windows.first().filter(|_| view >= self.description.views.len())) {
            return Err(Error::input(format!(
                "{}: asked for {window} of view {view}, there are {} of {}",
                self.path().display(),
                counted(self.description.views.len(), "view"),
                self.description.size
            )));
        }
        let texel_bytes = chunk.bytes() / (CHUNK_SIDE * CHUNK_SIDE);
        // Opened first: what is not there is not made room for.
        let shards = self.open_shards(array, view, windows)?;
        let texels: usize = windows.iter().map(|window| window.size.texels()).sum();
        let mut bytes = vec![0; texels * texel_bytes];
        // Bands of the windows that lie in one row of chunks each; every band is one thread's.
        let mut bands = Vec::new();
        let mut rest = bytes.as_mut_slice();
        for window in windows {
            let mut y = window.y;
            while y < window.y + window.size.height {
                let end = ((y / CHUNK_SIDE + 1) * CHUNK_SIDE).min(window.y + window.size.height);
                let (band, later) = rest.split_at_mut((end - y) * window.size.width * texel_bytes);
                bands.push((window, y..end, band));
                (rest, y) = (later, end);
            }
        }
        let read_band = |codec: &mut Option<(ChunkCodec, Vec<u8>)>,
                         (window, rows, band): (&Window, Range<usize>, &mut [u8])|
         -> Result<()> {
            let (codec, texels) = match codec {
                Some(codec) => codec,
                none => none.insert((ChunkCodec::new(self.codec, chunk)?, vec![0; chunk.bytes()])),
            };
            let row_bytes = window.size.width * texel_bytes;
            let mut x = window.x;
            while x < window.x + window.size.width {
                let end = ((x / CHUNK_SIDE + 1) * CHUNK_SIDE).min(window.x + window.size.width);
                self.decode(&shards, array, view, [rows.start, x], codec, texels)?;
                let columns = (end - x) * texel_bytes;
                for (number, row) in rows.clone().enumerate() {
                    let from = (row % CHUNK_SIDE * CHUNK_SIDE + x % CHUNK_SIDE) * texel_bytes;
                    let to = number * row_bytes + (x - window.x) * texel_bytes;
                    band[to..to + columns].copy_from_slice(&texels[from..from + columns]);
                }
                x = end;
            }
            Ok(())
        };
        bands.into_par_iter().try_for_each_init(|| None, read_band)?;
        Ok(bytes)
    }

    /// Decodes the chunk that holds a texel.
    fn decode(
        &self,
        shards: &[([usize; 2], Shard)],
        array: SampleArray,
        view: usize,
        [y, x]: [usize; 2],
        codec: &mut ChunkCodec,
        texels: &mut [u8],
    ) -> Result<()> {
        let damaged = |what: &str| {
            let window = Window { y, x, size: Size::new(1, 1) };
            Error::input(format!(
                "{}: chunk at row {}, column {}: {what}",
                self.shard_path(array, view, window).display(),
                y / CHUNK_SIDE * CHUNK_SIDE,
                x / CHUNK_SIDE * CHUNK_SIDE
            ))
            .hint(DAMAGED)
        };
        let place = [y / self.side, x / self.side];
        let shard = shards.iter().find(|(at, _)| *at == place).map(|(_, shard)| shard);
        let shard = shard.ok_or_else(|| Error::internal("a shard that was not opened"))?;
        let across = self.side / CHUNK_SIDE;
        let number = y % self.side / CHUNK_SIDE * across + x % self.side / CHUNK_SIDE;
        let range = shard.chunks.get(number).cloned().flatten().ok_or_else(|| damaged("it is absent"))?;
        let bytes = shard.file.as_ref().get(range).ok_or_else(|| damaged("it lies beyond the file"))?;
        codec.decode(bytes, texels).map_err(|error| damaged(&error.to_string()))
    }

    /// Checks that a shard holds every chunk that lies in the plane.
    fn expect_chunks(
        &self,
        path: &Path,
        chunks: &[Option<Range<usize>>],
        [sy, sx]: [usize; 2],
    ) -> Result<()> {
        let across = self.side / CHUNK_SIDE;
        let Size { height, width } = self.description.size;
        let inside = |place: usize| {
            let (y, x) =
                (sy * self.side + place / across * CHUNK_SIDE, sx * self.side + place % across * CHUNK_SIDE);
            y < height && x < width
        };
        match (0..across * across)
            .find(|&place| inside(place) && chunks.get(place).is_none_or(Option::is_none))
        {
            None => Ok(()),
            Some(place) => {
                let what = format!("{}: its chunk number {place} is absent", path.display());
                Err(Error::input(what).hint(DAMAGED))
            }
        }
    }

    /// Maps the shards that windows touch.
    fn open_shards(
        &self,
        array: SampleArray,
        view: usize,
        windows: &[Window],
    ) -> Result<Vec<([usize; 2], Shard)>> {
        let places = |start: usize, length: usize| start / self.side..(start + length).div_ceil(self.side);
        let across = self.side / CHUNK_SIDE;
        let touched: BTreeSet<[usize; 2]> = windows
            .iter()
            .flat_map(|window| {
                let columns = places(window.x, window.size.width);
                places(window.y, window.size.height)
                    .flat_map(move |sy| columns.clone().map(move |sx| [sy, sx]))
            })
            .collect();
        let shards = touched
            .into_iter()
            .map(|[sy, sx]| {
                let corner = Window { y: sy * self.side, x: sx * self.side, size: Size::new(1, 1) };
                let path = self.shard_path(array, view, corner);
                let file = Store::map_chunk(&path)?;
                let chunks = shard::chunk_ranges(file.as_ref(), across * across)
                    .map_err(|what| Error::input(format!("{}: {what}", path.display())).hint(DAMAGED))?;
                self.expect_chunks(&path, &chunks, [sy, sx])?;
                Ok(([sy, sx], Shard { file, chunks }))
            })
            .collect::<Result<_>>();
        self.store.expect_unchanged()?;
        shards
    }
}

/// Bytes as values; a vector of bytes may lie at an odd address, so they are copied.
fn cast<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(bytes: &[u8]) -> Vec<T> {
    bytemuck::pod_collect_to_vec(bytes)
}

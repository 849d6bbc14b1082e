//! The enlarged index store: I_S [y, x] in square shards, normals beside it on request.

use std::path::Path;

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use crate::error::{Error, Result};
use crate::shape::{Size, Window};
use crate::store::{Array, Layout, Named, Store};

/// The attribute `kind` of an enlarged index store.
pub const KIND: &str = "enlarged";

/// Side of a shard in texels: the index is written in rows of shards.
pub const SHARD_SIDE: usize = 512;

/// Side of a chunk in texels.
pub const CHUNK_SIDE: usize = 128;

/// An enlarged index store.
pub struct Enlarged {
    store: Store,
    size: Size,
    wide: bool,
    index: Array,
    normals: Option<Array>,
}

/// What an enlarged index is, for its attributes.
#[derive(Clone, Debug)]
pub struct Description {
    /// Rows and columns.
    pub size: Size,
    /// Number of clusters that it refers to.
    pub clusters: usize,
    /// Whether the synthesised normals are kept.
    pub keep_normals: bool,
}

impl Enlarged {
    /// Starts an enlarged index, or goes on with one that the same recipe began.
    ///
    /// `model` is the model's place; its name is kept, to find it beside the result.
    pub fn create(path: &Path, description: &Description, recipe: &Value, model: &Path) -> Result<Self> {
        let store = Store::at(path);
        let model_name = model.file_name().map(|name| name.to_string_lossy());
        store.begin_by_recipe(KIND, recipe, json!({"model_name": model_name}))?;
        let wide = description.clusters > 256;
        let index = if wide {
            create::<u16>(&store, description.size)
        } else {
            create::<u8>(&store, description.size)
        }?;
        let normals =
            description.keep_normals.then(|| create_normals(&store, description.size)).transpose()?;
        Ok(Self { store, size: description.size, wide, index, normals })
    }

    /// Opens an enlarged index for reading.
    pub fn open(path: &Path) -> Result<Self> {
        let store = Store::at(path);
        let attributes = store.expect(KIND)?;
        let index = store.open_array("index")?;
        let &[height, width] = index.shape() else {
            return Err(Error::input(format!(
                "{}: index: got shape {:?}, expected [y, x]",
                path.display(),
                index.shape()
            )));
        };
        let keeps = attributes.get("recipe").and_then(|r| r.get("keep_normals")).and_then(Value::as_bool);
        let normals = (keeps == Some(true)).then(|| store.open_array("normals")).transpose()?;
        let wide = *index.data_type() == u16::data_type();
        Ok(Self { store, size: Size::new(height as usize, width as usize), wide, index, normals })
    }

    /// Our attributes.
    pub fn attributes(&self) -> Result<Map<String, Value>> {
        self.store.expect(KIND)
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Whether the synthesised normals were kept.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// Number of rows of shards, each [`SHARD_SIDE`] texels high (the last may be cut off).
    pub fn shard_rows(&self) -> usize {
        self.size.height.div_ceil(SHARD_SIDE)
    }

    /// Whether a row of shards has been written.
    pub fn has_shard_row(&self, shard_row: usize) -> bool {
        (0..self.size.width.div_ceil(SHARD_SIDE)).all(|sx| {
            let (sy, sx) = (shard_row as u64, sx as u64);
            self.store.has_chunk(&self.index, &[sy, sx])
                && self.normals.as_ref().is_none_or(|normals| self.store.has_chunk(normals, &[sy, sx, 0]))
        })
    }

    /// Whether all rows of shards have been written.
    pub fn is_whole(&self) -> bool {
        (0..self.shard_rows()).all(|row| self.has_shard_row(row))
    }

    /// Writes a row of shards: `index` [rows, width], `normals` [rows, width, 3] where they are kept. Shards are
    /// packed on all threads of the pool.
    pub fn write_shard_row(&self, shard_row: usize, index: &[u16], normals: &[f32]) -> Result<()> {
        let write = |sx: usize| {
            let place = [shard_row as u64, sx as u64];
            if let Some(array) = &self.normals {
                let shard = self.cut(normals, sx, 3);
                self.store.write_chunk(array, &[place[0], place[1], 0], shard)?;
            }
            let shard = self.cut(index, sx, 1);
            if self.wide {
                return self.store.write_chunk(&self.index, &place, shard);
            }
            let narrow: Vec<u8> = shard.iter().map(|&cluster| cluster as u8).collect();
            self.store.write_chunk(&self.index, &place, narrow)
        };
        (0..self.size.width.div_ceil(SHARD_SIDE)).into_par_iter().try_for_each(write)
    }

    /// One shard of a row of shards, padded by zeros to its full size.
    fn cut<T: Copy + Default>(&self, rows: &[T], shard_column: usize, elements: usize) -> Vec<T> {
        let width = self.size.width;
        let x0 = shard_column * SHARD_SIDE;
        let columns = SHARD_SIDE.min(width - x0);
        let mut shard = vec![T::default(); SHARD_SIDE * SHARD_SIDE * elements];
        for (row, to) in
            rows.chunks_exact(width * elements).zip(shard.chunks_exact_mut(SHARD_SIDE * elements))
        {
            to[..columns * elements].copy_from_slice(&row[x0 * elements..(x0 + columns) * elements]);
        }
        shard
    }

    /// Clusters of a window, row by row.
    pub fn read(&self, window: Window) -> Result<Vec<u16>> {
        let start = [window.y as u64, window.x as u64];
        let extent = [window.size.height as u64, window.size.width as u64];
        if self.wide {
            return self.store.read_box::<u16>(&self.index, &start, &extent);
        }
        Ok(self.store.read_box::<u8>(&self.index, &start, &extent)?.into_iter().map(u16::from).collect())
    }

    /// Synthesised normals of a window, where they were kept.
    pub fn read_normals(&self, window: Window) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(array) = &self.normals else { return Ok(None) };
        let start = [window.y as u64, window.x as u64, 0];
        let extent = [window.size.height as u64, window.size.width as u64, 3];
        let values = self.store.read_box::<f32>(array, &start, &extent)?;
        Ok(Some(values.chunks_exact(3).map(|n| [n[0], n[1], n[2]]).collect()))
    }
}

fn create<T: Named>(store: &Store, size: Size) -> Result<Array> {
    let layout = Layout {
        codecs: None,
        shape: vec![size.height as u64, size.width as u64],
        chunk: vec![CHUNK_SIDE as u64; 2],
        shard: Some(vec![SHARD_SIDE as u64; 2]),
        data_type: T::data_type(),
        names: &["y", "x"],
        attributes: Map::new(),
    };
    store.create_array("index", &layout)
}

fn create_normals(store: &Store, size: Size) -> Result<Array> {
    let mut attributes = Map::new();
    attributes.insert("frame".to_owned(), json!("x right, y up, z out of the surface"));
    let layout = Layout {
        codecs: None,
        shape: vec![size.height as u64, size.width as u64, 3],
        chunk: vec![CHUNK_SIDE as u64, CHUNK_SIDE as u64, 3],
        shard: Some(vec![SHARD_SIDE as u64, SHARD_SIDE as u64, 3]),
        data_type: f32::data_type(),
        names: &["y", "x", "xyz"],
        attributes,
    };
    store.create_array("normals", &layout)
}

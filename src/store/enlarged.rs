//! The enlarged index store: the cluster of every texel, I_S [y, x], in square shards; beside it, where the method
//! knows it, the tile's texel that each texel is, and normals on request.

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::error::{Error, Result};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::model::Stage;
use crate::store::model_place;
use crate::store::{Array, Layout, Lock, Named, Store};

/// The attribute `kind` of an enlarged index store.
pub const KIND: &str = "enlarged";

/// Side of a shard in texels: what is written at once.
pub const SHARD_SIDE: usize = 512;

/// Side of a chunk in texels.
pub const CHUNK_SIDE: usize = 128;

/// Chunks of a shard.
const SHARD_CHUNKS: usize = (SHARD_SIDE / CHUNK_SIDE).pow(2);

/// Longest side of an index, as of every [`Size`] that is given as text.
const MOST_SIDE: u64 = 1 << 24;

/// How an index was enlarged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Nearest normals of a random field, chosen by (25): the paper's. Recipes that name no method mean it.
    #[default]
    Paper,
    /// Source positions that continue their neighbours, from coarse to fine.
    Coherent,
    /// The tile again and again.
    Repeat,
    /// Tiles of one border, laid at random.
    Tiles,
    /// Patches of the tile at random places, stitched on a grid.
    Roller,
    /// Image quilting.
    Quilt,
}

impl Method {
    /// The stages of a model that it depends on.
    pub fn stages(self) -> &'static [Stage] {
        match self {
            Self::Paper => &[Stage::Cluster, Stage::Fit],
            Self::Coherent => &[Stage::Cluster, Stage::Appearance],
            Self::Repeat | Self::Tiles | Self::Roller | Self::Quilt => &[Stage::Cluster],
        }
    }
}

/// An enlarged index store.
pub struct Enlarged {
    store: Store,
    size: Size,
    wide: bool,
    index: Array,
    source: Option<Array>,
    normals: Option<Array>,
    _lock: Option<Lock>,
}

/// What an enlarged index is, for its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Rows and columns.
    pub size: Size,
    /// Number of clusters that it refers to.
    pub clusters: usize,
    /// Size of the tile, where the source of each texel is kept.
    pub source: Option<Size>,
    /// Whether normals are kept.
    pub keep_normals: bool,
}

/// Texels of a window, row by row; what is not kept is empty.
#[derive(Clone, Copy, Debug)]
pub struct Texels<'a> {
    /// Clusters.
    pub index: &'a [u16],
    /// Texels of the tile, row * width + column.
    pub source: &'a [u32],
    /// Normals, three components each.
    pub normals: &'a [f32],
}

impl Enlarged {
    /// Starts an enlarged index, or goes on with one that the same recipe began.
    ///
    /// `model` is the model's place; its name and the way to it are kept, to find it again.
    pub fn create(
        path: &Path,
        description: &Description,
        recipe: &Value,
        model: &Path,
        context: &Context<'_>,
    ) -> Result<Self> {
        let store = Store::at(path);
        let model_name = model.file_name().map(|name| name.to_string_lossy());
        let lock = store.begin_by_recipe(KIND, recipe, json!({"model_name": model_name}), context)?;
        model_place::note(path, model)?;
        let Description { size, clusters, .. } = *description;
        let wide = clusters > 256;
        let index = if wide {
            create::<u16>(&store, "index", size, Map::new())
        } else {
            create::<u8>(&store, "index", size, Map::new())
        }?;
        let of_tile = |tile: Size| {
            let mut attributes = Map::new();
            attributes.insert("meaning".to_owned(), json!("row * width + column of the tile's texel"));
            attributes.insert("tile".to_owned(), json!([tile.height, tile.width]));
            create::<u32>(&store, "source", size, attributes)
        };
        let source = description.source.map(of_tile).transpose()?;
        let normals = description.keep_normals.then(|| create_normals(&store, size)).transpose()?;
        Ok(Self { store, size, wide, index, source, normals, _lock: Some(lock) })
    }

    /// Opens an enlarged index for reading.
    pub fn open(path: &Path) -> Result<Self> {
        let store = Store::at(path);
        let attributes = store.expect(KIND)?;
        let index = store.open_array("index")?;
        let (&[height, width], true) =
            (index.shape(), index.shape().iter().all(|n| (1..=MOST_SIDE).contains(n)))
        else {
            return Err(Error::input(format!(
                "{}: index: got shape {:?}, expected [y, x], each from 1 to {MOST_SIDE}",
                path.display(),
                index.shape()
            )));
        };
        let keeps = |name: &str| attributes.get("recipe").and_then(|r| r.get(name)?.as_bool()) == Some(true);
        let source = keeps("source").then(|| store.open_array("source")).transpose()?;
        let normals = keeps("keep_normals").then(|| store.open_array("normals")).transpose()?;
        for (name, array) in [("source", &source), ("normals", &normals)] {
            let shape = array.as_ref().map_or(index.shape(), |array| array.shape());
            if !shape.starts_with(index.shape()) {
                return Err(Error::input(format!(
                    "{}: {name}: got shape {shape:?}, expected the {height} rows and {width} columns of the index",
                    path.display()
                )));
            }
        }
        let wide = *index.data_type() == u16::data_type();
        Ok(Self {
            store,
            size: Size::new(height as usize, width as usize),
            wide,
            index,
            source,
            normals,
            _lock: None,
        })
    }

    /// Our attributes.
    pub fn attributes(&self) -> Result<Map<String, Value>> {
        self.store.expect(KIND)
    }

    /// How it was enlarged.
    ///
    /// # Errors
    /// A method that this program does not know.
    pub fn method(&self) -> Result<Method> {
        let attributes = self.attributes()?;
        let Some(name) = attributes.get("recipe").and_then(|recipe| recipe.get("rule")) else {
            return Ok(Method::default());
        };
        serde_json::from_value(name.clone())
            .map_err(|error| Error::input(format!("{}: recipe: {error}", self.store.path().display())))
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Whether normals were kept.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// Whether the source of each texel was kept.
    pub fn has_source(&self) -> bool {
        self.source.is_some()
    }

    /// Rows and columns of shards, each [`SHARD_SIDE`] texels a side (the last may be cut off).
    pub fn shards(&self) -> Size {
        Size::new(self.size.height.div_ceil(SHARD_SIDE), self.size.width.div_ceil(SHARD_SIDE))
    }

    /// Whether a shard has been written, and was not cut off since.
    pub fn has_shard(&self, shard_row: usize, shard_column: usize) -> bool {
        let place = [shard_row as u64, shard_column as u64];
        let has = |array: &Option<Array>, place: &[u64]| {
            array.as_ref().is_none_or(|array| self.store.has_shard(array, place, SHARD_CHUNKS))
        };
        self.store.has_shard(&self.index, &place, SHARD_CHUNKS)
            && has(&self.source, &place)
            && has(&self.normals, &[place[0], place[1], 0])
    }

    /// Whether all shards have been written.
    pub fn is_whole(&self) -> bool {
        let Size { height, width } = self.shards();
        (0..height * width).all(|n| self.has_shard(n / width, n % width))
    }

    /// Writes the shards of a window that begins and ends at borders of shards, on all threads of the pool.
    pub fn write(&self, window: Window, texels: Texels<'_>) -> Result<()> {
        let across = window.size.width.div_ceil(SHARD_SIDE);
        let write = |n: usize| {
            let (row, column) = (n / across, n % across);
            let place = [(window.y / SHARD_SIDE + row) as u64, (window.x / SHARD_SIDE + column) as u64];
            let part = Part { width: window.size.width, top: row * SHARD_SIDE, left: column * SHARD_SIDE };
            if let Some(array) = &self.normals {
                let shard = part.cut(texels.normals, 3);
                self.store.write_chunk(array, &[place[0], place[1], 0], shard)?;
            }
            if let Some(array) = &self.source {
                self.store.write_chunk(array, &place, part.cut(texels.source, 1))?;
            }
            let shard = part.cut(texels.index, 1);
            if self.wide {
                return self.store.write_chunk(&self.index, &place, shard);
            }
            let narrow: Vec<u8> = shard.iter().map(|&cluster| cluster as u8).collect();
            self.store.write_chunk(&self.index, &place, narrow)
        };
        (0..window.size.height.div_ceil(SHARD_SIDE) * across).into_par_iter().try_for_each(write)
    }

    /// Clusters of a window, row by row.
    pub fn read(&self, window: Window) -> Result<Vec<u16>> {
        let [start, extent] = bounds(window);
        if self.wide {
            return self.store.read_box::<u16>(&self.index, &start, &extent);
        }
        Ok(self.store.read_box::<u8>(&self.index, &start, &extent)?.into_iter().map(u16::from).collect())
    }

    /// Source texels of a window, `row * width + column` in the tile, where they were kept. Not checked against the tile.
    pub fn read_source(&self, window: Window) -> Result<Option<Vec<u32>>> {
        let [start, extent] = bounds(window);
        self.source.as_ref().map(|array| self.store.read_box::<u32>(array, &start, &extent)).transpose()
    }

    /// Normals of a window, where they were kept.
    pub fn read_normals(&self, window: Window) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(array) = &self.normals else { return Ok(None) };
        let start = [window.y as u64, window.x as u64, 0];
        let extent = [window.size.height as u64, window.size.width as u64, 3];
        let values = self.store.read_box::<f32>(array, &start, &extent)?;
        Ok(Some(values.chunks_exact(3).map(|n| [n[0], n[1], n[2]]).collect()))
    }
}

/// Where a shard lies in the texels of a window.
struct Part {
    /// Texels of a row of the window.
    width: usize,
    top: usize,
    left: usize,
}

impl Part {
    /// The shard, padded by zeros to its full size.
    fn cut<T: Copy + Default>(&self, texels: &[T], elements: usize) -> Vec<T> {
        let columns = SHARD_SIDE.min(self.width - self.left) * elements;
        let mut shard = vec![T::default(); SHARD_SIDE * SHARD_SIDE * elements];
        let rows = texels.chunks_exact(self.width * elements).skip(self.top);
        for (row, to) in rows.zip(shard.chunks_exact_mut(SHARD_SIDE * elements)) {
            to[..columns].copy_from_slice(&row[self.left * elements..][..columns]);
        }
        shard
    }
}

fn bounds(window: Window) -> [[u64; 2]; 2] {
    [[window.y as u64, window.x as u64], [window.size.height as u64, window.size.width as u64]]
}

fn create<T: Named>(store: &Store, name: &str, size: Size, attributes: Map<String, Value>) -> Result<Array> {
    let layout = Layout {
        codecs: None,
        shape: vec![size.height as u64, size.width as u64],
        chunk: vec![CHUNK_SIDE as u64; 2],
        shard: Some(vec![SHARD_SIDE as u64; 2]),
        data_type: T::data_type(),
        names: &["y", "x"],
        attributes,
    };
    store.create_array(name, &layout)
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

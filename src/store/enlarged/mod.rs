//! The enlarged index store: the cluster of every texel, I_S [y, x], in square shards; beside it, where the method
//! knows it, the tile's texel that each texel is, and normals on request.

mod facts;
pub mod state;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use crate::disk::lock::Lock;
use crate::disk::output::expect_outside_stores;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::model::{NARROW, is_unit};
use crate::store::origin;
use crate::zarr::checksums::DIGITS;
use crate::zarr::{Array, DAMAGED, Layout, Named, Store};
pub use facts::{EnlargeRecipe, Method};
use facts::{Facts, MOST_CLUSTERS};

/// The attribute `kind` of an enlarged index store.
pub const KIND: &str = "enlarged";

/// Side of a shard in texels: what is written at once.
pub(crate) const SHARD_SIDE: usize = 512;

/// Side of a chunk in texels.
pub(crate) const CHUNK_SIDE: usize = 128;

/// The attribute of a finished index that holds the checksums of its shards.
const CHECKSUMS: &str = "checksums";

/// An enlarged index store.
pub struct Enlarged {
    store: Store,
    facts: Facts,
    size: Size,
    wide: bool,
    index: Array,
    source: Option<Array>,
    normals: Option<Array>,
    /// Of one that is being written.
    _lock: Option<Lock>,
}

/// What an enlarged index is, for its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Rows and columns.
    pub size: Size,
    /// Number of clusters that it refers to.
    pub clusters: usize,
    /// Size of the tile.
    pub tile: Size,
    /// Whether the source of each texel is kept.
    pub keep_source: bool,
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
        expect_outside_stores(path)?;
        let mut store = Store::at(path);
        let model_name = model.file_name().map(|name| name.to_string_lossy());
        let Description { size, clusters, tile, keep_source, keep_normals } = *description;
        let more = json!({
            "model_name": model_name, "clusters": clusters, "tile": [tile.height, tile.width],
        });
        let lock = store.begin_by_recipe(KIND, recipe, more, context)?;
        origin::note(path, origin::MODEL, model, None)?;
        let facts = Facts::read(&store)?;
        let index = store.create_array("index", &index_layout(size, clusters > NARROW))?;
        let source =
            keep_source.then(|| store.create_array("source", &source_layout(size, tile))).transpose()?;
        let normals =
            keep_normals.then(|| store.create_array("normals", &normals_layout(size))).transpose()?;
        let wide = clusters > NARROW;
        Ok(Self { store, facts, size, wide, index, source, normals, _lock: Some(lock) })
    }

    /// Opens an enlarged index for reading.
    ///
    /// # Errors
    /// Where attributes or metadata are not those of an enlarged index, or do not fit together.
    pub fn open(path: &Path) -> Result<Self> {
        let (store, _) = Store::open(path, KIND)?;
        let mut facts = Facts::read(&store)?;
        let recipe = &facts.recipe;
        let size = Size::new(recipe.size[0], recipe.size[1]);
        if facts.clusters.is_none() {
            let document = store.array_document("index")?;
            let wide = document.get("data_type").and_then(Value::as_str) == Some("uint16");
            facts.clusters = Some(if wide { MOST_CLUSTERS } else { NARROW });
        }
        if recipe.source == Some(true) && facts.tile.is_none() {
            let document = store.array_document("source")?;
            let tile = document.get("attributes").and_then(|attributes| attributes.get("tile"));
            facts.tile = serde_json::from_value(tile.cloned().unwrap_or_default()).ok();
        }
        let wide = facts.clusters.is_some_and(|clusters| clusters > NARROW);
        let index = store.open_array("index", &index_layout(size, wide))?;
        let source = match (recipe.source == Some(true), facts.tile) {
            (false, _) => None,
            (true, Some([height, width])) => {
                Some(store.open_array("source", &source_layout(size, Size::new(height, width)))?)
            }
            (true, None) => {
                let what = format!("{}: source: attribute tile: none", path.display());
                return Err(Error::input(what).hint("enlarge anew, under another name"));
            }
        };
        let normals =
            recipe.keep_normals.then(|| store.open_array("normals", &normals_layout(size))).transpose()?;
        Ok(Self { store, facts, size, wide, index, source, normals, _lock: None })
    }

    /// Declares it finished, if all shards are there: its root then holds checksums, and the metadata of all arrays for
    /// other programs.
    ///
    /// # Errors
    /// Those of reading and writing, and where a shard's index is damaged.
    pub fn finish(&self, context: &Context<'_>) -> Result<()> {
        if !self.is_whole() {
            return Ok(());
        }
        let sums: Map<String, Value> = self
            .arrays()
            .map(|array| Ok((array.name().to_owned(), json!(self.store.checksums(array)?))))
            .collect::<Result<_>>()?;
        let _lock = self.store.lock("", context)?;
        let mut attributes = self.store.expect(KIND)?;
        attributes.insert(CHECKSUMS.to_owned(), Value::Object(sums));
        let names: Vec<String> = self.arrays().map(|array| array.name().to_owned()).collect();
        self.store.write_finished(attributes, &names)
    }

    /// The arrays that there are.
    fn arrays(&self) -> impl Iterator<Item = &Array> {
        std::iter::once(&self.index).chain(&self.source).chain(&self.normals)
    }

    /// Whether it was declared finished: then its shards have checksums.
    ///
    /// # Errors
    /// Those of reading the attributes.
    pub(crate) fn is_finished(&self) -> Result<bool> {
        Ok(self.attributes()?.contains_key(CHECKSUMS))
    }

    /// Whether the root holds the metadata of all arrays as they are.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn is_consolidated(&self) -> Result<bool> {
        let names: Vec<String> = self.arrays().map(|array| array.name().to_owned()).collect();
        self.store.is_consolidated(&names)
    }

    /// The folders of rows of shards that are not those that were written, though each shard may be intact; none where
    /// no checksums are kept.
    ///
    /// # Errors
    /// Where a shard is missing, or its index is damaged.
    pub fn exchanged(&self, shard_row: usize) -> Result<Vec<PathBuf>> {
        let attributes = self.attributes()?;
        let Some(kept) = attributes.get(CHECKSUMS) else { return Ok(Vec::new()) };
        let mut folders = Vec::new();
        for array in self.arrays() {
            let kept = kept.get(array.name()).and_then(Value::as_str).unwrap_or_default();
            let found = format!("{:08x}", self.store.checksum(array, shard_row as u64)?);
            if kept.get(shard_row * DIGITS..(shard_row + 1) * DIGITS) != Some(found.as_str()) {
                folders.push(self.store.path().join(array.name()).join("c").join(shard_row.to_string()));
            }
        }
        Ok(folders)
    }

    /// Our attributes.
    pub fn attributes(&self) -> Result<Map<String, Value>> {
        self.store.expect(KIND)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// Version of its layout.
    pub fn format(&self) -> u64 {
        self.store.format()
    }

    /// Digest of the recipe that made it.
    pub(crate) fn digest(&self) -> &str {
        &self.facts.digest
    }

    /// What made it.
    pub fn recipe(&self) -> &EnlargeRecipe {
        &self.facts.recipe
    }

    /// Version of the program that began it.
    pub fn version(&self) -> &str {
        &self.facts.version
    }

    /// Name of the model that it was enlarged from.
    pub(crate) fn model_name(&self) -> Option<&str> {
        self.facts.model_name.as_deref()
    }

    /// Number of clusters of the model, or the most that the index can tell apart where it is not known.
    pub fn clusters(&self) -> usize {
        self.facts.clusters.unwrap_or(MOST_CLUSTERS)
    }

    /// Rows and columns of the tile, where they are known.
    pub fn tile(&self) -> Option<Size> {
        self.facts.tile.map(|[height, width]| Size::new(height, width))
    }

    /// How it was enlarged.
    pub fn method(&self) -> Method {
        self.facts.recipe.rule
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Whether normals were kept.
    pub(crate) fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// Whether the source of each texel was kept.
    pub(crate) fn has_source(&self) -> bool {
        self.source.is_some()
    }

    /// Rows and columns of shards, each [`SHARD_SIDE`] texels a side (the last may be cut off).
    pub fn shards(&self) -> Size {
        Size::new(self.size.height.div_ceil(SHARD_SIDE), self.size.width.div_ceil(SHARD_SIDE))
    }

    /// Whether a shard has been written, and was not cut off since.
    pub(crate) fn has_shard(&self, shard_row: usize, shard_column: usize) -> bool {
        let place = [shard_row as u64, shard_column as u64];
        let has = |array: &Option<Array>, place: &[u64]| {
            array.as_ref().is_none_or(|array| self.store.has_shard(array, place))
        };
        self.store.has_shard(&self.index, &place)
            && has(&self.source, &place)
            && has(&self.normals, &[place[0], place[1], 0])
    }

    /// Rows and columns of the shards of the index that lie on the disk, in order: whatever size is claimed, no others
    /// are looked for.
    pub(crate) fn shards_found(&self) -> Vec<[usize; 2]> {
        let Size { height, width } = self.shards();
        let listed = |folder: &Path, end: usize| -> Vec<usize> {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let numbers = entries.filter_map(|entry| entry.file_name().to_string_lossy().parse().ok());
            let mut numbers: Vec<usize> = numbers.filter(|&number| number < end).collect();
            numbers.sort_unstable();
            numbers
        };
        let folder = self.store.path().join("index").join("c");
        let of_row =
            |row: usize| listed(&folder.join(row.to_string()), width).into_iter().map(move |c| [row, c]);
        listed(&folder, height).into_iter().flat_map(of_row).collect()
    }

    /// Number of shards that have been written.
    pub fn shards_done(&self) -> usize {
        self.shards_found().into_iter().filter(|&[row, column]| self.has_shard(row, column)).count()
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
    ///
    /// # Errors
    /// Those of reading, and a cluster beyond the last.
    pub fn read(&self, window: Window) -> Result<Vec<u16>> {
        let [start, extent] = bounds(window);
        let index = if self.wide {
            self.store.read_box::<u16>(&self.index, &start, &extent)?
        } else {
            self.store.read_box::<u8>(&self.index, &start, &extent)?.into_iter().map(u16::from).collect()
        };
        let clusters = self.clusters();
        match index.iter().position(|&cluster| usize::from(cluster) >= clusters) {
            None => Ok(index),
            Some(at) => {
                Err(self.beyond("index", window, at, &format!("cluster {} of {clusters}", index[at])))
            }
        }
    }

    /// Source texels of a window, `row * width + column` in the tile, where they were kept.
    ///
    /// # Errors
    /// Those of reading, and a texel beyond the tile.
    pub fn read_source(&self, window: Window) -> Result<Option<Vec<u32>>> {
        let Some(array) = &self.source else { return Ok(None) };
        let [start, extent] = bounds(window);
        let source = self.store.read_box::<u32>(array, &start, &extent)?;
        let texels = self.tile().map_or(usize::MAX, Size::texels);
        match source.iter().position(|&texel| texel as usize >= texels) {
            None => Ok(Some(source)),
            Some(at) => {
                let what = format!("got texel {}, the tile has {texels}", source[at]);
                Err(self.beyond("source", window, at, &what))
            }
        }
    }

    /// Normals of a window, where they were kept.
    ///
    /// # Errors
    /// Those of reading, and what is no unit vector.
    pub fn read_normals(&self, window: Window) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(array) = &self.normals else { return Ok(None) };
        let start = [window.y as u64, window.x as u64, 0];
        let extent = [window.size.height as u64, window.size.width as u64, 3];
        let values = self.store.read_box::<f32>(array, &start, &extent)?;
        let normals = values.as_chunks::<3>().0;
        match normals.iter().position(|normal| !is_unit(normal)) {
            None => Ok(Some(normals.to_vec())),
            Some(at) => {
                Err(self.beyond("normals", window, at, &format!("got {:?}, no unit vector", normals[at])))
            }
        }
    }

    /// What is wrong with a texel of a window.
    fn beyond(&self, array: &str, window: Window, at: usize, what: &str) -> Error {
        let (y, x) = (window.y + at / window.size.width, window.x + at % window.size.width);
        let shard = self.store.path().join(array).join("c");
        let shard = shard.join((y / SHARD_SIDE).to_string()).join((x / SHARD_SIDE).to_string());
        Error::input(format!("{}: {array}: {what}, at row {y}, column {x}", shard.display())).hint(DAMAGED)
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

/// A layout [y, x] in shards.
fn plane_layout<T: Named>(size: Size) -> Layout<'static> {
    Layout {
        codecs: None,
        shape: vec![size.height as u64, size.width as u64],
        chunk: vec![CHUNK_SIDE as u64; 2],
        shard: Some(vec![SHARD_SIDE as u64; 2]),
        data_type: T::data_type(),
        names: &["y", "x"],
        attributes: Map::new(),
    }
}

fn index_layout(size: Size, wide: bool) -> Layout<'static> {
    if wide { plane_layout::<u16>(size) } else { plane_layout::<u8>(size) }
}

fn source_layout(size: Size, tile: Size) -> Layout<'static> {
    plane_layout::<u32>(size)
        .with("meaning", "row * width + column of the tile's texel")
        .with("tile", vec![tile.height, tile.width])
}

fn normals_layout(size: Size) -> Layout<'static> {
    let mut layout = plane_layout::<f32>(size).with("frame", "x right, y up, z out of the surface");
    layout.names = &["y", "x", "xyz"];
    for lengths in [&mut layout.shape, &mut layout.chunk].into_iter().chain(&mut layout.shard) {
        lengths.push(3);
    }
    layout
}

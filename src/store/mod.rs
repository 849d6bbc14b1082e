//! What lies on disk: Zarr v3 groups of arrays with attributes of ours (see `docs/design.md`, section 3).
//!
//! [`Store`] is a group with its arrays; [`measurement`], [`model`] and [`enlarged`] say which arrays.

pub mod appearance;
pub mod codec;
pub mod enlarge_state;
pub mod enlarged;
pub mod field;
pub mod gather;
mod lock;
pub mod mapped;
pub mod measurement;
pub mod model;
pub(crate) mod model_place;
pub mod output;
pub mod passes;
mod shard;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use btfkit_formats::{SampleType, Samples, f16};
use serde_json::{Map, Value, json};
use zarrs::array::codec::{ShardingCodecOptions, SubchunkWriteOrder, ZstdCodec};
use zarrs::array::{
    ArrayBuilder, ArrayMetadataOptions, ArraySubset, CodecOptions, CodecSpecificOptions, DataType, Element,
    ElementOwned, FillValue, data_type,
};

use crate::error::{Error, Kind, Result};
use crate::run::{Context, recipe};
pub use codec::Chain;
use codec::Codecs;
pub use lock::Lock;
pub(crate) use lock::is_lock;
use mapped::MappedStorage;
use output::Existing;

/// Version of the layout on disk, attribute `btfkit.format`.
pub const FORMAT: u64 = 1;

/// Level of the zstd codec: after level 1 measured data hardly packs better, only slower.
const ZSTD_LEVEL: i32 = 1;

/// Name of the lock that whoever writes a store by a recipe shares with others who do.
const WRITING: &str = "-writing";

/// Largest number of bytes that a small array is read or written with at once.
const WHOLE_ARRAY_LIMIT_BYTES: u64 = 1 << 34;

/// A Zarr array of a [`Store`].
pub type Array = zarrs::array::Array<MappedStorage>;

/// Shape, type and chunking of an array that is to be written.
pub struct Layout<'a> {
    /// Extent of each dimension.
    pub shape: Vec<u64>,
    /// What is decoded at once.
    pub chunk: Vec<u64>,
    /// What is written at once; a chunk of its own file where absent.
    pub shard: Option<Vec<u64>>,
    /// Element type.
    pub data_type: DataType,
    /// How chunks are packed; zstd where absent.
    pub codecs: Option<Codecs>,
    /// Names of the dimensions.
    pub names: &'a [&'a str],
    /// Attributes of the array (units and the like).
    pub attributes: Map<String, Value>,
}

impl<'a> Layout<'a> {
    /// An array of elements of type `T` in as few chunks as keep each below 16 MiB,
    /// cut along the first dimension only.
    pub fn small<T: Named>(names: &'a [&'a str], shape: &[usize]) -> Self {
        const CHUNK_LIMIT_BYTES: u64 = 16 << 20;
        let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
        let slice_bytes = shape.iter().skip(1).product::<u64>().max(1) * size_of::<T>() as u64;
        let mut chunk: Vec<u64> = shape.iter().map(|&n| n.max(1)).collect();
        if let Some(first) = chunk.first_mut() {
            *first = (*first).min((CHUNK_LIMIT_BYTES / slice_bytes).max(1));
        }
        Self {
            shape,
            chunk,
            shard: None,
            data_type: T::data_type(),
            codecs: None,
            names,
            attributes: Map::new(),
        }
    }
}

/// Element types that our stores hold.
pub trait Named: Element + ElementOwned + Default + Copy {
    /// The Zarr data type.
    fn data_type() -> DataType;
}

macro_rules! named {
    ($($type:ty => $name:ident),*) => {$(
        impl Named for $type {
            fn data_type() -> DataType { data_type::$name() }
        }
    )*};
}
named!(i8 => int8, u8 => uint8, i16 => int16, u16 => uint16, u32 => uint32, i32 => int32, f16 => float16, f32 => float32, f64 => float64);

/// The Zarr data type of samples.
fn data_type_of(sample_type: SampleType) -> DataType {
    match sample_type {
        SampleType::U8 => u8::data_type(),
        SampleType::U16 => u16::data_type(),
        SampleType::F16 => f16::data_type(),
        SampleType::F32 => f32::data_type(),
    }
}

/// The type of an array's elements, if it is one that samples come in.
fn sample_type_of(array: &Array) -> Option<SampleType> {
    [SampleType::U8, SampleType::U16, SampleType::F16, SampleType::F32]
        .into_iter()
        .find(|&sample_type| data_type_of(sample_type) == *array.data_type())
}

/// The names of the channels of an array whose last dimension is the channel.
fn channel_names(array: &Array) -> std::result::Result<Vec<String>, String> {
    let names = array.attributes().get("channels").cloned().unwrap_or_default();
    let names: Vec<String> =
        serde_json::from_value(names).map_err(|error| format!("attribute channels: {error}"))?;
    let extent = array.shape().last().copied();
    if extent == Some(names.len() as u64) {
        Ok(names)
    } else {
        Err(format!("got shape {:?} and channels named {names:?}", array.shape()))
    }
}

/// A Zarr v3 group in a directory.
#[derive(Clone)]
pub struct Store {
    path: PathBuf,
    storage: Arc<MappedStorage>,
}

impl Store {
    /// The store at `path`, whether or not there is one yet.
    pub fn at(path: &Path) -> Self {
        Self { path: path.to_owned(), storage: Arc::new(MappedStorage::new(path)) }
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes what killed writers left.
    pub fn sweep(&self) -> Result<()> {
        self.storage.sweep()
    }

    /// Waits until no other process holds the lock `name` of this store.
    pub fn lock(&self, name: &str, context: &Context<'_>) -> Result<Lock> {
        Lock::wait(&self.path, name, context)
    }

    /// Whether an array and all of its chunks (or shards) are there.
    pub fn is_whole(&self, name: &str) -> bool {
        let Ok(array) = self.open_array(name) else { return false };
        let grid = array.chunk_grid_shape().to_vec();
        let total: u64 = grid.iter().product();
        (0..total).all(|number| {
            let mut rest = number;
            let mut indices: Vec<u64> = grid.iter().rev().map(|&n| (rest % n, rest /= n).0).collect();
            indices.reverse();
            self.has_chunk(&array, &indices)
        })
    }

    /// Our attributes (key `btfkit`) of the root group; `None` where there is no store.
    ///
    /// # Errors
    /// Where there is something that is not a store of ours.
    pub fn attributes(&self) -> Result<Option<Map<String, Value>>> {
        let file = self.path.join("zarr.json");
        let text = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                // What a killed writer left of its first file is no obstacle.
                let is_leftover = |entry: std::io::Result<std::fs::DirEntry>| {
                    entry.is_ok_and(|e| mapped::is_temporary(&e.path()) || is_lock(&e.path()))
                };
                let occupied =
                    std::fs::read_dir(&self.path).is_ok_and(|mut entries| !entries.all(is_leftover));
                if occupied {
                    return Err(self.occupied());
                }
                return Ok(None);
            }
            Err(_) if self.path.is_file() => return Err(self.occupied()),
            Err(error) => return Err(Error::io("read", &file, error)),
        };
        let damaged = |what: String| Error::input(format!("{}: {what}", file.display()));
        let metadata: Value = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        let ours = metadata.pointer("/attributes/btfkit").and_then(Value::as_object).ok_or_else(|| {
            damaged("a Zarr group without the attribute btfkit: not a store of this program".into())
        })?;
        match ours.get("format").and_then(Value::as_u64) {
            Some(FORMAT) => Ok(Some(ours.clone())),
            format => Err(damaged(format!("got layout format {format:?}, expected {FORMAT}"))),
        }
    }

    /// Our attributes of a group within the store; `None` where it is not there.
    pub(crate) fn group(&self, group: &str) -> Result<Option<Map<String, Value>>> {
        let file = self.path.join(group).join("zarr.json");
        let text = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::io("read", &file, error)),
        };
        let metadata: Value = serde_json::from_str(&text).map_err(|error| self.damaged(group, &error))?;
        Ok(metadata.pointer("/attributes/btfkit").and_then(Value::as_object).cloned())
    }

    /// Begins a store of this kind with these attributes, unless there is one; returns those that hold.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn begin(
        &self,
        kind: &str,
        attributes: Map<String, Value>,
        context: &Context<'_>,
    ) -> Result<Map<String, Value>> {
        // Looked at before the lock, which makes a file: none in a folder that is not ours.
        self.attributes()?;
        let _lock = self.lock("", context)?;
        if self.attributes()?.is_none() {
            let own = [
                ("kind", json!(kind)),
                ("format", json!(FORMAT)),
                ("version", json!(env!("CARGO_PKG_VERSION"))),
            ];
            let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
            self.write_group("", own.chain(attributes).collect())?;
        }
        self.expect(kind)
    }

    /// Begins a store of this kind, or goes on with the one that the same recipe began; `more` are
    /// attributes beside the recipe. Where results may be replaced, another recipe's store of the same kind is removed.
    ///
    /// Returns a lock that keeps others from removing this one; it is to be held while the store is written.
    ///
    /// # Errors
    /// [`Kind::Recipe`] where another recipe's store lies there.
    pub fn begin_by_recipe(
        &self,
        kind: &str,
        recipe: &Value,
        more: Value,
        context: &Context<'_>,
    ) -> Result<Lock> {
        mapped::Temporary::sweep_beside(&self.path);
        if context.existing == Existing::Replace {
            self.remove_another(kind, recipe, context)?;
        }
        let mut attributes = Map::new();
        attributes.insert("recipe".to_owned(), recipe.clone());
        attributes.insert("digest".to_owned(), json!(recipe::digest(recipe)));
        if let Value::Object(more) = more {
            attributes.extend(more);
        }
        recipe::expect_same(&self.path, &self.begin(kind, attributes, context)?, recipe)?;
        let lock = Lock::share(&self.path, WRITING, context)?;
        // It may have been removed between.
        recipe::expect_same(&self.path, &self.expect(kind)?, recipe)?;
        self.sweep()?;
        Ok(lock)
    }

    /// Removes another recipe's store of this kind, once nobody writes it any more.
    fn remove_another(&self, kind: &str, recipe: &Value, context: &Context<'_>) -> Result<()> {
        let is_another = || -> Result<bool> {
            if self.attributes()?.is_none() {
                return Ok(false);
            }
            Ok(recipe::expect_same(&self.path, &self.expect(kind)?, recipe).is_err())
        };
        if !is_another()? {
            return Ok(());
        }
        let _lock = self.lock(WRITING, context)?;
        if !is_another()? {
            return Ok(());
        }
        // Moved away first: at no time is there a store with a part of its shards that looks like an unfinished one.
        let old = mapped::temporary_name(&self.path);
        let failed = |error| Error::io("remove", &self.path, error);
        std::fs::rename(&self.path, &old).map_err(failed)?;
        std::fs::remove_dir_all(&old).map_err(failed)
    }

    fn occupied(&self) -> Error {
        Error::input(format!("{} exists and is not a Zarr store (no zarr.json in it)", self.path.display()))
            .hint("choose another name for the result")
    }

    /// The attributes of a store that must exist and be of this kind.
    pub fn expect(&self, kind: &str) -> Result<Map<String, Value>> {
        let found = self.attributes()?.ok_or_else(|| {
            Error::missing(format!("{}: no store here, expected {}", self.path.display(), with_article(kind)))
        })?;
        match found.get("kind").and_then(Value::as_str) {
            Some(name) if name == kind => Ok(found),
            name => Err(Error::input(format!(
                "{}: got a store of kind {}, expected {}",
                self.path.display(),
                name.unwrap_or("unknown"),
                with_article(kind)
            ))),
        }
    }

    /// Writes the group's metadata with our attributes; `group` is "" for the root.
    pub fn write_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
        let mut metadata = json!({"zarr_format": 3, "node_type": "group", "attributes": {}});
        if !attributes.is_empty() {
            metadata["attributes"]["btfkit"] = Value::Object(attributes);
        }
        let text =
            serde_json::to_vec_pretty(&metadata).map_err(|error| Error::internal(error.to_string()))?;
        let file = self.path.join(group).join("zarr.json");
        mapped::write_file(&file, &text)
    }

    /// Removes an array; nothing where there is none.
    pub(crate) fn remove(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        match std::fs::remove_dir_all(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(Error::io("remove", &path, error))
            }
            _ => Ok(()),
        }
    }

    /// Makes an array ready to be written chunk by chunk; its metadata is written, its data is not touched.
    pub fn create_array(&self, name: &str, layout: &Layout<'_>) -> Result<Array> {
        let failed = |error: &dyn std::fmt::Display| Error::internal(format!("array {name}: {error}"));
        let outer = layout.shard.clone().unwrap_or_else(|| layout.chunk.clone());
        let zero = FillValue::new(vec![0; layout.data_type.fixed_size().unwrap_or(1)]);
        let mut builder = ArrayBuilder::new(layout.shape.clone(), outer, layout.data_type.clone(), zero);
        match &layout.codecs {
            Some(codecs) => {
                builder
                    .array_to_array_codecs(codecs.array_to_array.clone())
                    .array_to_bytes_codec(codecs.array_to_bytes.clone())
                    .bytes_to_bytes_codecs(codecs.bytes_to_bytes.clone());
            }
            None => {
                // The frame's own checksum: zarrs does not verify a crc32c codec when it reads a part of a shard.
                builder.bytes_to_bytes_codecs(vec![Arc::new(ZstdCodec::new(ZSTD_LEVEL, true))]);
            }
        }
        builder
            .dimension_names(Some(layout.names.iter().copied()))
            .attributes(layout.attributes.clone())
            .codec_specific_options(CodecSpecificOptions::default().with_option(
                ShardingCodecOptions::default().with_subchunk_write_order(SubchunkWriteOrder::C),
            ));
        if layout.shard.is_some() {
            builder.subchunk_shape(layout.chunk.clone());
        }
        let array =
            builder.build(self.storage.clone(), &format!("/{name}")).map_err(|error| failed(&error))?;
        array
            .store_metadata_opt(&ArrayMetadataOptions::default().with_include_zarrs_metadata(false))
            .map_err(|error| write_error(&error.into()))?;
        Ok(array)
    }

    /// The member `codecs` of an array's metadata.
    fn array_codecs(&self, name: &str) -> Result<Value> {
        let file = self.path.join(name).join("zarr.json");
        let text = std::fs::read_to_string(&file).map_err(|error| Error::io("read", &file, error))?;
        let metadata: Value = serde_json::from_str(&text).map_err(|error| self.damaged(name, &error))?;
        Ok(metadata.get("codecs").cloned().unwrap_or_default())
    }

    /// Opens an array for reading.
    pub fn open_array(&self, name: &str) -> Result<Array> {
        if !self.path.join(name).join("zarr.json").exists() {
            return Err(Error::missing(format!("{}: no array {name} in this store", self.path.display())));
        }
        Array::open(self.storage.clone(), &format!("/{name}")).map_err(|error| self.damaged(name, &error))
    }

    /// Writes a whole array of chunks without shards.
    pub fn write<T: Named>(&self, name: &str, layout: &Layout<'_>, elements: &[T]) -> Result<()> {
        let array = self.create_array(name, layout)?;
        let rows = layout.chunk.first().copied().unwrap_or(1);
        let total = layout.shape.first().copied().unwrap_or(0);
        let slice: usize = layout.shape.iter().skip(1).product::<u64>() as usize;
        for (number, start) in (0..total).step_by(rows.max(1) as usize).enumerate() {
            let end = (start + rows).min(total);
            // A chunk at the border is stored whole; what lies beyond the shape is never read.
            let mut chunk = elements[start as usize * slice..end as usize * slice].to_vec();
            chunk.resize(rows as usize * slice, T::default());
            let mut indices = vec![0; layout.shape.len()];
            indices[0] = number as u64;
            if slice > 0 {
                self.write_chunk(&array, &indices, chunk)?;
            }
        }
        Ok(())
    }

    /// Writes a whole array of samples whose last dimension is the channel.
    pub(crate) fn write_samples(
        &self,
        name: &str,
        names: &[&str],
        shape: &[usize],
        channels: &[String],
        samples: &Samples,
    ) -> Result<()> {
        let write = |mut layout: Layout<'_>, write: &dyn Fn(&Layout<'_>) -> Result<()>| {
            layout.attributes.insert("channels".to_owned(), json!(channels));
            write(&layout)
        };
        match samples {
            Samples::U8(list) => write(Layout::small::<u8>(names, shape), &|l| self.write(name, l, list)),
            Samples::U16(list) => write(Layout::small::<u16>(names, shape), &|l| self.write(name, l, list)),
            Samples::F16(list) => write(Layout::small::<f16>(names, shape), &|l| self.write(name, l, list)),
            Samples::F32(list) => write(Layout::small::<f32>(names, shape), &|l| self.write(name, l, list)),
        }
    }

    /// Reads samples of a range along the first dimension: the array's shape, the names of its channels, and
    /// the samples.
    pub(crate) fn read_samples_of(
        &self,
        name: &str,
        range: Range<u64>,
    ) -> Result<(Vec<usize>, Vec<String>, Samples)> {
        let array = self.open_array(name)?;
        let sample_type = sample_type_of(&array).ok_or_else(|| {
            self.damaged(name, &format!("got elements of type {}, expected samples", array.data_type()))
        })?;
        let shape: Vec<usize> = array.shape().iter().map(|&n| n as usize).collect();
        let channels = channel_names(&array).map_err(|error| self.damaged(name, &error))?;
        let (mut start, mut extent) = (vec![0; shape.len()], array.shape().to_vec());
        if let (Some(start), Some(extent)) = (start.first_mut(), extent.first_mut()) {
            (*start, *extent) = (range.start, range.end.saturating_sub(range.start));
        }
        let samples = self.read_samples(&array, sample_type, &start, &extent)?;
        Ok((shape, channels, samples))
    }

    /// Extent of a chunk of an array along its first dimension.
    pub(crate) fn chunk_rows(&self, name: &str) -> Result<usize> {
        let array = self.open_array(name)?;
        let chunk = array.chunk_shape(&vec![0; array.dimensionality()]);
        let chunk = chunk.map_err(|error| self.damaged(name, &error))?;
        Ok(chunk.first().map_or(1, |rows| rows.get() as usize))
    }

    /// Encodes and writes one chunk (or shard) of an array, all-zero ones too.
    pub fn write_chunk<T: Named>(&self, array: &Array, indices: &[u64], elements: Vec<T>) -> Result<()> {
        // One thread: a shard's bytes must not depend on which of its chunks was encoded first.
        let options = CodecOptions::default().with_store_empty_chunks(true).with_concurrent_target(1);
        array.store_chunk_opt(indices, elements, &options).map_err(|error| write_error(&error))
    }

    /// Writes a shard that is encoded already.
    pub(crate) fn write_encoded(&self, array: &Array, indices: &[u64], bytes: &[u8]) -> Result<()> {
        mapped::write_file(&self.chunk_path(array, indices), bytes)
    }

    /// The file of a chunk (or shard).
    pub fn chunk_path(&self, array: &Array, indices: &[u64]) -> PathBuf {
        self.storage.path(&array.chunk_key(indices))
    }

    /// Reads a box of samples; see [`Store::read_box`].
    pub(crate) fn read_samples(
        &self,
        array: &Array,
        sample_type: SampleType,
        start: &[u64],
        extent: &[u64],
    ) -> Result<Samples> {
        Ok(match sample_type {
            SampleType::U8 => Samples::U8(self.read_box(array, start, extent)?),
            SampleType::U16 => Samples::U16(self.read_box(array, start, extent)?),
            SampleType::F16 => Samples::F16(self.read_box(array, start, extent)?),
            SampleType::F32 => Samples::F32(self.read_box(array, start, extent)?),
        })
    }

    /// Whether a chunk (or shard) has been written.
    pub fn has_chunk(&self, array: &Array, indices: &[u64]) -> bool {
        self.chunk_path(array, indices).is_file()
    }

    /// Whether a shard of so many chunks is there and not cut off: its index is intact, its chunks are not looked at.
    pub fn has_shard(&self, array: &Array, indices: &[u64], chunks: usize) -> bool {
        let path = self.chunk_path(array, indices);
        path.is_file()
            && std::fs::File::open(path).and_then(|file| shard::has_index(file, chunks)).unwrap_or(false)
    }

    /// Reads a box of an array: offset and extent in each dimension.
    ///
    /// # Errors
    /// [`Kind::Missing`] where a shard of it has not been written, [`Kind::Input`] where it is damaged.
    pub fn read_box<T: Named>(&self, array: &Array, start: &[u64], extent: &[u64]) -> Result<Vec<T>> {
        let name = array.path().as_str().trim_start_matches('/').to_owned();
        let within =
            start.iter().zip(extent).zip(array.shape()).all(|((&start, &extent), &length)| {
                start.checked_add(extent).is_some_and(|end| end <= length)
            });
        if start.len() != array.dimensionality() || extent.len() != start.len() || !within {
            return Err(Error::input(format!(
                "{}: {name}: got shape {:?}, expected it to hold {extent:?} from {start:?} on",
                self.path.display(),
                array.shape()
            )));
        }
        let bytes = extent.iter().try_fold(size_of::<T>() as u64, |product, &n| product.checked_mul(n));
        if bytes.is_none_or(|bytes| bytes > WHOLE_ARRAY_LIMIT_BYTES) {
            return Err(Error::input(format!(
                "{}: {name}: a box of {extent:?} elements is too large",
                self.path.display()
            )));
        }
        if *array.data_type() != T::data_type() {
            return Err(Error::input(format!(
                "{}: {name}: got elements of type {}, expected {}",
                self.path.display(),
                array.data_type(),
                T::data_type()
            )));
        }
        let subset = ArraySubset::new_with_start_shape(start.to_vec(), extent.to_vec())
            .map_err(|error| Error::internal(error.to_string()))?;
        let chunks = array.chunks_in_array_subset(&subset).map_err(|error| self.damaged(&name, &error))?;
        if let Some(chunks) = chunks {
            for indices in &chunks.indices() {
                if !self.has_chunk(array, &indices) {
                    return Err(Error::missing(format!(
                        "{}: {name}: shard {indices:?} has not been written",
                        self.path.display()
                    ))
                    .hint("run the command that makes this store again; it goes on where it stopped"));
                }
            }
        }
        array
            .retrieve_array_subset_opt::<Vec<T>>(&subset, &CodecOptions::default())
            .map_err(|error| self.damaged(&name, &error))
    }

    /// Reads a whole array whose shape must be `shape` (0 stands for any extent); returns the shape found.
    pub fn read<T: Named>(&self, name: &str, shape: &[usize]) -> Result<(Vec<usize>, Vec<T>)> {
        let array = self.open_array(name)?;
        let found: Vec<usize> = array.shape().iter().map(|&n| n as usize).collect();
        let fits = found.len() == shape.len() && found.iter().zip(shape).all(|(&f, &s)| s == 0 || f == s);
        if !fits {
            return Err(Error::input(format!(
                "{}: {name}: got shape {found:?}, expected {shape:?} (0 stands for any)",
                self.path.display()
            )));
        }
        let start = vec![0; found.len()];
        let elements = self.read_box(&array, &start, array.shape())?;
        Ok((found, elements))
    }

    fn damaged(&self, name: &str, error: &dyn std::fmt::Display) -> Error {
        Error::input(format!("{}: array {name}: {error}", self.path.display())).hint(
            "the store is damaged: delete what the message names and run the command that made it again",
        )
    }
}

fn write_error(error: &zarrs::array::ArrayError) -> Error {
    let mut failed = Error::new(Kind::Io, error.to_string());
    if error.to_string().contains("No space left") {
        failed = failed.hint("free some space and run the same command again");
    }
    failed
}

/// A kind of store as a sentence names it.
fn with_article(kind: &str) -> String {
    if kind == enlarged::KIND { "an enlarged index".to_owned() } else { format!("a {kind}") }
}

//! Arrays of a store: what their metadata must say, and their chunks.
//!
//! A [`Layout`] is all that an array's `zarr.json` can hold. It follows from what the store says of itself, so that
//! the file is compared with it, not believed; and zarrs never sees a file that it has not written.

use std::path::PathBuf;
use std::sync::Arc;

use btfkit_formats::f16;
use bytemuck::{AnyBitPattern, NoUninit};
use serde_json::{Map, Value, json};
use zarrs::array::codec::{ShardingCodecOptions, SubchunkWriteOrder, ZstdCodec};
use zarrs::array::{
    ArrayBuilder, ArrayMetadataOptions, CodecOptions, CodecSpecificOptions, DataType, Element, ElementOwned,
    FillValue, data_type,
};

use zarrs_storage::StorageError;

use super::codec::{self, Codecs};
use super::metadata::{self, may_be_ignored, read_object, shown};
use super::storage::MappedStorage;
use super::{Store, ZSTD_LEVEL};
use crate::disk::temporary;
use crate::error::{Error, ErrorKind, Result, advice};

/// Most bytes of a chunk that is not in a shard.
const CHUNK_LIMIT_BYTES: u64 = 16 << 20;

/// Shape, type and chunking of an array.
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
    /// Names of the dimensions; any where empty.
    pub names: &'a [&'a str],
    /// Attributes of the array (units and the like).
    pub attributes: Map<String, Value>,
}

impl<'a> Layout<'a> {
    /// An array of elements of type `T` in as few chunks as keep each below 16 MiB,
    /// cut along the first dimension only.
    pub fn small<T: Named>(names: &'a [&'a str], shape: &[usize]) -> Self {
        Self::small_of(T::data_type(), size_of::<T>(), names, shape)
    }

    /// The same of elements of a type that is known at run time.
    pub(crate) fn small_of(data_type: DataType, bytes: usize, names: &'a [&'a str], shape: &[usize]) -> Self {
        let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
        let slice = shape.iter().skip(1).fold(1u64, |product, &n| product.saturating_mul(n));
        let slice_bytes = slice.max(1).saturating_mul(bytes as u64);
        let mut chunk: Vec<u64> = shape.iter().map(|&n| n.max(1)).collect();
        if let Some(first) = chunk.first_mut() {
            *first = (*first).min((CHUNK_LIMIT_BYTES / slice_bytes).max(1));
        }
        Self { shape, chunk, shard: None, data_type, codecs: None, names, attributes: Map::new() }
    }

    /// With an attribute more.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.attributes.insert(name.to_owned(), value.into());
        self
    }

    /// Whether the numbers of elements and bytes can be counted.
    fn is_countable(&self) -> bool {
        let limit = 1u64 << 60;
        let product = |list: &[u64]| {
            list.iter()
                .try_fold(16u64, |product, &n| product.checked_mul(n.max(1)))
                .is_some_and(|n| n <= limit)
        };
        product(&self.shape) && product(&self.chunk) && self.shard.as_deref().is_none_or(product)
    }
}

/// Element types that our stores hold.
pub trait Named: Element + ElementOwned + Default + Copy + AnyBitPattern + NoUninit + Send + Sync {
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

/// An array of a [`Store`] whose metadata are as its layout says.
pub struct Array {
    pub(super) name: String,
    pub(super) shape: Vec<u64>,
    pub(super) chunk: Vec<u64>,
    pub(super) shard: Option<Vec<u64>>,
    /// Whether chunks are plain zstd.
    pub(super) is_plain: bool,
    inner: zarrs::array::Array<MappedStorage>,
}

impl Array {
    /// Its name in the store.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Extent of each dimension.
    pub fn shape(&self) -> &[u64] {
        &self.shape
    }

    /// Type of its elements.
    pub fn data_type(&self) -> &DataType {
        self.inner.data_type()
    }

    /// What is written at once.
    pub(super) fn outer(&self) -> &[u64] {
        self.shard.as_deref().unwrap_or(&self.chunk)
    }

    /// Files along each dimension.
    pub(crate) fn grid(&self) -> Vec<u64> {
        self.shape.iter().zip(self.outer()).map(|(&n, &side)| n.div_ceil(side)).collect()
    }

    /// Chunks of a shard.
    pub(super) fn shard_chunks(&self) -> Option<usize> {
        let shard = self.shard.as_ref()?;
        Some(shard.iter().zip(&self.chunk).map(|(&outer, &inner)| outer / inner).product::<u64>() as usize)
    }

    /// The metadata that the file must hold.
    fn metadata(&self) -> Result<Value> {
        let options = ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
        serde_json::to_value(self.inner.metadata_opt(&options))
            .map_err(|error| Error::internal(error.to_string()))
    }
}

impl Store {
    /// An array of this layout, without a look at the disk.
    fn build(&self, name: &str, layout: &Layout<'_>) -> Result<Array> {
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
        let names = (!layout.names.is_empty()).then(|| layout.names.iter().copied());
        builder.dimension_names(names).attributes(layout.attributes.clone()).codec_specific_options(
            CodecSpecificOptions::default().with_option(
                ShardingCodecOptions::default().with_subchunk_write_order(SubchunkWriteOrder::C),
            ),
        );
        if layout.shard.is_some() {
            builder.subchunk_shape(layout.chunk.clone());
        }
        let inner =
            builder.build(self.storage.clone(), &format!("/{name}")).map_err(|error| failed(&error))?;
        Ok(Array {
            name: name.to_owned(),
            shape: layout.shape.clone(),
            chunk: layout.chunk.clone(),
            shard: layout.shard.clone(),
            is_plain: layout.codecs.is_none(),
            inner,
        })
    }

    /// Makes an array ready to be written chunk by chunk; its metadata is written, its data is not touched.
    pub(crate) fn create_array(&self, name: &str, layout: &Layout<'_>) -> Result<Array> {
        let array = self.build(name, layout)?;
        let options = ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
        array.inner.store_metadata_opt(&options).map_err(|error| write_error(&error.into()))?;
        Ok(array)
    }

    /// The metadata file of an array or a group within the store.
    pub(crate) fn metadata_path(&self, name: &str) -> PathBuf {
        self.path().join(name).join("zarr.json")
    }

    /// What an array's `zarr.json` holds.
    ///
    /// # Errors
    /// [`ErrorKind::Missing`] where there is none.
    pub(crate) fn array_document(&self, name: &str) -> Result<Map<String, Value>> {
        let file = self.metadata_path(name);
        let document = read_object(&file)
            .map_err(|error| if error.kind() == ErrorKind::Io { error } else { error.hint(MAKE_AGAIN) })
            .and_then(|document| {
                document.ok_or_else(|| {
                    Error::missing(format!("{}: no array {name} in this store", self.path().display()))
                        .hint("run the command that makes this store again; it goes on where it stopped")
                })
            });
        self.unless_made_anew(document)
    }

    /// The shape that an array claims, of so many dimensions; nothing else of it is checked.
    pub(crate) fn claimed_shape(&self, name: &str, dimensions: usize) -> Result<Vec<usize>> {
        const LONGEST: u64 = 1 << 32;
        let document = self.array_document(name)?;
        let found = document.get("shape").unwrap_or(&Value::Null);
        let list = found.as_array().filter(|list| list.len() == dimensions);
        let extents = list.and_then(|list| {
            list.iter().map(|n| n.as_u64().filter(|&n| n <= LONGEST).map(|n| n as usize)).collect()
        });
        extents.ok_or_else(|| {
            self.unlike(name, &format!("shape: got {}, expected {dimensions} lengths", shown(found)))
        })
    }

    /// Opens an array for reading.
    ///
    /// # Errors
    /// [`ErrorKind::Missing`] where there is none, [`ErrorKind::Input`] where its metadata are not those of the layout.
    pub(crate) fn open_array(&self, name: &str, layout: &Layout<'_>) -> Result<Array> {
        let document = self.array_document(name);
        self.unless_made_anew(document.and_then(|document| self.check_document(name, layout, &document)))
    }

    /// Checks a document against the layout of an array.
    pub(crate) fn check_document(
        &self,
        name: &str,
        layout: &Layout<'_>,
        document: &Map<String, Value>,
    ) -> Result<Array> {
        if !layout.is_countable() {
            return Err(self.unlike(name, &format!("a shape of {:?} is too large", layout.shape)));
        }
        let array = self.build(name, layout)?;
        let expected = array.metadata()?;
        let strict = !layout.names.is_empty() && self.format > metadata::OLDEST_FORMAT;
        difference(document, &expected, strict).map_err(|what| self.unlike(name, &what))?;
        Ok(array)
    }

    fn unlike(&self, name: &str, what: &str) -> Error {
        Error::input(format!("{}: {what}", self.metadata_path(name).display())).hint(MAKE_AGAIN)
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

    /// Encodes and writes one chunk (or shard) of an array, all-zero ones too.
    pub(crate) fn write_chunk<T: Named>(
        &self,
        array: &Array,
        indices: &[u64],
        elements: Vec<T>,
    ) -> Result<()> {
        // One thread: a shard's bytes must not depend on which of its chunks was encoded first.
        let options = CodecOptions::default().with_store_empty_chunks(true).with_concurrent_target(1);
        array.inner.store_chunk_opt(indices, elements, &options).map_err(|error| write_error(&error))
    }

    /// Writes a shard that is encoded already.
    pub(crate) fn write_encoded(&self, array: &Array, indices: &[u64], bytes: &[u8]) -> Result<()> {
        temporary::write_file(&self.chunk_path(array, indices), bytes)
    }

    /// The file of a chunk (or shard).
    pub(crate) fn chunk_path(&self, array: &Array, indices: &[u64]) -> PathBuf {
        self.storage.path(&array.inner.chunk_key(indices))
    }
}

/// What to do about metadata that are not those that were written.
const MAKE_AGAIN: &str = "run the command that makes this store again: it writes this file anew";

/// The first difference of a document from what it must be. Attributes beside the expected ones are free; names of
/// dimensions count where `strict` is given.
fn difference(found: &Map<String, Value>, expected: &Value, strict: bool) -> std::result::Result<(), String> {
    let Value::Object(expected) = expected else { return Err("no metadata to compare with".to_owned()) };
    let null = Value::Null;
    let unequal = |name: &str, found: &Value, expected: &Value| {
        format!("{name}: got {}, expected {}", shown(found), shown(expected))
    };
    for (name, value) in expected {
        let got = found.get(name).unwrap_or(&null);
        match name.as_str() {
            "attributes" => {}
            "dimension_names" if !strict => {}
            "codecs" => {
                if codec::plainly(got) != codec::plainly(value) {
                    let advice = "was it written by another program? Then make it anew with this one";
                    return Err(format!("{}; {advice}", unequal("codecs", got, value)));
                }
            }
            _ if got == value => {}
            _ => return Err(unequal(name, got, value)),
        }
    }
    let attributes = found.get("attributes").and_then(Value::as_object);
    for (name, value) in expected.get("attributes").and_then(Value::as_object).into_iter().flatten() {
        let got = attributes.and_then(|attributes| attributes.get(name)).unwrap_or(&null);
        if got != value {
            return Err(unequal(&format!("attribute {name}"), got, value));
        }
    }
    let free = ["attributes", "dimension_names"];
    for (name, value) in found {
        let empty = name == "storage_transformers" && *value == json!([]);
        if !expected.contains_key(name) && !free.contains(&name.as_str()) && !empty && !may_be_ignored(value)
        {
            return Err(format!("member {}, which no array here has", json!(name)));
        }
    }
    match found.get("attributes") {
        None | Some(Value::Object(_)) => Ok(()),
        Some(other) => Err(format!("attributes: got {}, expected an object", shown(other))),
    }
}

/// An error of writing through zarrs; the storage has put the path and the system's own words into it.
fn write_error(error: &zarrs::array::ArrayError) -> Error {
    use zarrs::array::{ArrayError, CodecError};
    let refused = match error {
        ArrayError::StorageError(StorageError::IOError(refused))
        | ArrayError::CodecError(
            CodecError::IOError(refused) | CodecError::StorageError(StorageError::IOError(refused)),
        ) => Some(refused),
        _ => None,
    };
    let failed = Error::new(ErrorKind::Io, error.to_string());
    match refused.and_then(|refused| advice(refused, false)) {
        Some(advice) => failed.hint(advice),
        None => failed,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_document_is_compared_member_by_member() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::at(folder.path());
        let layout = |names| Layout::small::<u16>(names, &[4, 6]);
        let with_units = layout(&["y", "x"]).with("units", "rad");
        store.write("a", &with_units, &[0u16; 24]).unwrap();
        let whole = store.array_document("a").unwrap();
        let changed = |name: &str, value: Value| {
            let mut document = whole.clone();
            document.insert(name.to_owned(), value);
            document
        };
        store.check_document("a", &with_units, &whole).map(drop).unwrap();
        for (name, value, words) in [
            ("shape", json!([4, 7]), "shape: got [4,7], expected [4,6]"),
            ("data_type", json!("uint32"), "data_type: got"),
            ("fill_value", json!(1), "fill_value: got 1"),
            ("chunk_grid", json!(null), "chunk_grid: got null"),
            ("codecs", json!([]), "codecs: got []"),
            ("dimension_names", json!(["x", "y"]), "dimension_names: got"),
            ("attributes", json!({"units": "degree"}), "attribute units: got \"degree\""),
            ("attributes", json!({}), "attribute units: got null"),
            ("more", json!({}), "member \"more\""),
            ("storage_transformers", json!([1]), "member \"storage_transformers\""),
        ] {
            let error = store.check_document("a", &with_units, &changed(name, value)).map(drop).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
        let error = store.check_document("a", &layout(&["y", "x"]), &changed("attributes", json!([])));
        assert!(error.map(drop).unwrap_err().to_string().contains("expected an object"));
        // What others may add, and names where any will do.
        for (name, value) in [
            ("attributes", json!({"units": "rad", "note": 1})),
            ("more", json!({"must_understand": false})),
            ("storage_transformers", json!([])),
        ] {
            store.check_document("a", &with_units, &changed(name, value)).map(drop).unwrap();
        }
        let document = changed("dimension_names", json!(["p", "q"]));
        store.check_document("a", &layout(&[]), &document).map(drop).unwrap();
    }

    #[test]
    fn shapes_are_claims() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::at(folder.path());
        store.write("a", &Layout::small::<u16>(&[], &[4, 6]), &[0u16; 24]).unwrap();
        let whole = store.array_document("a").unwrap();
        assert_eq!(store.claimed_shape("a", 2).unwrap(), [4, 6]);
        let lengths = "expected 2 lengths";
        for (shape, words) in [
            (json!([4]), lengths),
            (json!([4, 6, 1]), lengths),
            (json!([4, -6]), lengths),
            (json!([1u64 << 33, 1]), lengths),
            (json!(null), lengths),
            (json!([1u64 << 31, 1u64 << 31]), "is too large"),
        ] {
            let mut document = whole.clone();
            document.insert("shape".to_owned(), shape);
            let text = Value::Object(document).to_string();
            std::fs::write(store.metadata_path("a"), text).unwrap();
            let error = store.read::<u16>("a", &[0, 0]).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn what_the_system_refuses_keeps_its_advice_through_zarrs() {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        let error = write_error(&StorageError::IOError(Arc::new(full)).into());
        assert_eq!(error.kind(), ErrorKind::Io);
        assert!(error.guidance().unwrap().contains("space"), "{error}");
    }
}

//! What lies on disk: Zarr v3 groups of arrays with attributes of ours (see `docs/reference/stores.md`).
//!
//! [`Store`] is a group with its arrays; [`measurement`], [`model`] and [`enlarged`] say which arrays.

pub mod appearance;
mod array;
pub(crate) mod checksums;
pub mod codec;
mod consolidated;
mod directions;
pub mod enlarge_state;
pub mod enlarged;
pub mod field;
pub mod gather;
mod lock;
pub mod mapped;
pub mod measurement;
pub mod metadata;
pub mod model;
pub(crate) mod origin;
pub mod output;
pub mod passes;
mod places;
mod read;
pub mod recognise;
mod shard;
pub mod tile_report;

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use btfkit_formats::{SampleType, f16};
use serde_json::{Map, Value, json};
use zarrs::array::DataType;

use crate::error::{Error, Result};
use crate::run::{Context, recipe};
pub use array::{Array, Layout, Named};
pub use codec::Chain;
pub use lock::Lock;
pub(crate) use lock::is_lock;
use mapped::MappedStorage;
pub use metadata::FORMAT;
use output::Existing;
pub(crate) use read::DAMAGED;

/// Level of the zstd codec: after level 1 measured data hardly packs better, only slower.
const ZSTD_LEVEL: i32 = 1;

/// Name of the lock that whoever writes a store by a recipe shares with others who do.
const WRITING: &str = "-writing";

/// The Zarr data type of samples.
fn data_type_of(sample_type: SampleType) -> DataType {
    match sample_type {
        SampleType::U8 => u8::data_type(),
        SampleType::U16 => u16::data_type(),
        SampleType::F16 => f16::data_type(),
        SampleType::F32 => f32::data_type(),
    }
}

/// The types that samples come in.
const SAMPLE_TYPES: [SampleType; 4] = [SampleType::U8, SampleType::U16, SampleType::F16, SampleType::F32];

/// The type of samples that is this Zarr data type, if one is.
fn sample_type_of(data_type: &DataType) -> Option<SampleType> {
    SAMPLE_TYPES.into_iter().find(|&sample_type| data_type_of(sample_type) == *data_type)
}

/// A Zarr v3 group in a directory.
#[derive(Clone)]
pub struct Store {
    path: PathBuf,
    storage: Arc<MappedStorage>,
    /// Version of its layout.
    format: u64,
    /// Our attributes of the root as they were read last, and of which file: they are asked for at every array.
    known: Arc<Mutex<Option<Known>>>,
}

/// Attributes of a file as they were read.
type Known = (Stamp, Map<String, Value>);

/// What tells a file from the one that was at its place before: files are replaced, never written over.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Stamp {
    device: u64,
    inode: u64,
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let data = std::fs::metadata(path).ok()?;
        let (device, inode, length) = (data.dev(), data.ino(), data.len());
        Some(Self { device, inode, length, modified: data.modified().ok() })
    }
}

impl Store {
    /// The store at `path`, whether or not there is one yet.
    pub fn at(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            storage: Arc::new(MappedStorage::new(path)),
            format: FORMAT,
            known: Arc::default(),
        }
    }

    /// Opens a store of this kind, and its attributes.
    ///
    /// # Errors
    /// As [`Store::expect`].
    pub fn open(path: &Path, kind: &str) -> Result<(Self, Map<String, Value>)> {
        let mut store = Self::at(path);
        let attributes = store.expect(kind)?;
        store.format = attributes.get("format").and_then(Value::as_u64).unwrap_or(FORMAT);
        Ok((store, attributes))
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Version of its layout.
    pub fn format(&self) -> u64 {
        self.format
    }

    /// Removes what killed writers left.
    pub fn sweep(&self) -> Result<()> {
        self.storage.sweep()
    }

    /// Waits until no other process holds the lock `name` of this store.
    pub fn lock(&self, name: &str, context: &Context<'_>) -> Result<Lock> {
        Lock::wait(&self.path, name, context)
    }

    /// Whether all chunks (or shards) of an array are there.
    pub fn has_all(&self, array: &Array) -> bool {
        let grid = array.grid();
        places::places(&vec![0; grid.len()], &grid).all(|place| self.has_chunk(array, &place))
    }

    /// Our attributes (key `btfkit`) of the root group; `None` where there is none, or not ours.
    ///
    /// # Errors
    /// Where the root group is damaged, or was changed.
    fn attributes(&self) -> Result<Option<Map<String, Value>>> {
        let stamp = Stamp::of(&self.metadata_path(""));
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, ours)) = known.as_ref()
            && Some(*of) == stamp
        {
            return Ok(Some(ours.clone()));
        }
        let found = self.root()?.and_then(|mut attributes| attributes.remove("btfkit"));
        let ours = match found {
            None => return Ok(None),
            Some(Value::Object(ours)) => metadata::check_ours(&ours, true).map(|()| ours),
            Some(other) => {
                Err(format!("attribute btfkit: got {}, expected an object", metadata::shown(&other)))
            }
        };
        let ours = ours.map_err(|what| self.changed("", &what))?;
        *known = stamp.map(|stamp| (stamp, ours.clone()));
        Ok(Some(ours))
    }

    /// All attributes of the root group; `None` where there is none.
    fn root(&self) -> Result<Option<Map<String, Value>>> {
        let Some(document) = metadata::read_object(&self.metadata_path(""))? else { return Ok(None) };
        if document.get("node_type") == Some(&json!("array")) {
            return Ok(Some(Map::new()));
        }
        metadata::group_attributes(&document).map(Some).map_err(|what| self.changed("", &what))
    }

    /// Our attributes of a group within the store, without their seal; `None` where it is not there.
    pub(crate) fn group(&self, group: &str) -> Result<Option<Map<String, Value>>> {
        let Some(document) = metadata::read_object(&self.metadata_path(group))? else { return Ok(None) };
        let read = || {
            let mut attributes = metadata::group_attributes(&document)?;
            let Some(Value::Object(mut ours)) = attributes.remove("btfkit") else { return Ok(None) };
            metadata::check_ours(&ours, false)?;
            ours.remove("seal");
            Ok(Some(ours))
        };
        read().map_err(|what: String| self.changed(group, &what))
    }

    fn changed(&self, group: &str, what: &str) -> Error {
        Error::input(format!("{}: {what}", self.metadata_path(group).display())).hint(
            "what is changed by hand cannot be trusted: undo the change, or make this store anew under another name",
        )
    }

    /// Begins a store of this kind with these attributes, unless there is one; returns those that hold.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn begin(
        &mut self,
        kind: &str,
        attributes: Map<String, Value>,
        context: &Context<'_>,
    ) -> Result<Map<String, Value>> {
        // Looked at before the lock, which makes a file: none in a folder that is not ours.
        self.expect_ours_or_nothing()?;
        let _lock = self.lock("", context)?;
        self.expect_ours_or_nothing()?;
        if self.attributes()?.is_none() {
            let own = [
                ("kind", json!(kind)),
                ("format", json!(FORMAT)),
                ("version", json!(env!("CARGO_PKG_VERSION"))),
            ];
            let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
            self.write_group("", own.chain(attributes).collect())?;
        }
        let found = self.expect(kind)?;
        self.format = found.get("format").and_then(Value::as_u64).unwrap_or(FORMAT);
        Ok(found)
    }

    /// Begins a store of this kind, or goes on with the one that the same recipe began; `more` are
    /// attributes beside the recipe. Where results may be replaced, another recipe's store of the same kind is removed.
    ///
    /// Returns a lock that keeps others from removing this one; it is to be held while the store is written.
    ///
    /// # Errors
    /// [`crate::Kind::Recipe`] where another recipe's store lies there.
    pub fn begin_by_recipe(
        &mut self,
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
        let found = self.begin(kind, attributes, context)?;
        recipe::expect_same(&self.path, &found, recipe)?;
        let lock = Lock::share(&self.path, WRITING, context)?;
        // It may have been removed between.
        recipe::expect_same(&self.path, &self.expect(kind)?, recipe)?;
        self.sweep()?;
        Ok(lock)
    }

    /// Removes another recipe's store of this kind, or a damaged one, once nobody writes it any more.
    fn remove_another(&self, kind: &str, recipe: &Value, context: &Context<'_>) -> Result<()> {
        let is_another = || -> Result<bool> {
            match self.attributes() {
                Ok(None) => Ok(false),
                Ok(Some(_)) => Ok(recipe::expect_same(&self.path, &self.expect(kind)?, recipe).is_err()),
                Err(_) if self.claimed_kind().as_deref() == Some(kind) => Ok(true),
                Err(error) => Err(error),
            }
        };
        if !is_another()? {
            return Ok(());
        }
        let _lock = self.lock(WRITING, context)?;
        if !is_another()? {
            return Ok(());
        }
        mapped::remove_folder(&self.path, |path| {
            let is = |name: &str| path.file_name().is_some_and(|file| file == name);
            // Chunks lie in a folder `c` of their array.
            is(metadata::FILE)
                || path.components().any(|part| part.as_os_str() == "c")
                || [enlarge_state::NAME, origin::MODEL, origin::MEASUREMENT].into_iter().any(is)
        })
    }

    /// The kind that a root names, however damaged its other attributes are.
    fn claimed_kind(&self) -> Option<String> {
        let document = metadata::read_object(&self.metadata_path("")).ok()??;
        let kind = document.get("attributes")?.get("btfkit")?.get("kind")?;
        kind.as_str().map(str::to_owned)
    }

    fn expect_ours_or_nothing(&self) -> Result<()> {
        let occupied = match self.attributes()? {
            Some(_) => false,
            None => self.metadata_path("").exists() || recognise::other(&self.path)?.is_some(),
        };
        if !occupied {
            return Ok(());
        }
        Err(Error::input(format!("{} exists and is not a Zarr store of this program", self.path.display()))
            .hint("choose another name for the result"))
    }

    /// The attributes of a store that must exist and be of this kind.
    ///
    /// # Errors
    /// [`crate::Kind::Missing`] where there is nothing; [`crate::Kind::Input`] where there is something else, or a store
    /// whose attributes were changed: says what it is, and what to do.
    pub fn expect(&self, kind: &str) -> Result<Map<String, Value>> {
        self.expect_one_of(&[kind])
    }

    /// The attributes of a store that must exist and be of one of these kinds.
    ///
    /// # Errors
    /// As [`Store::expect`].
    pub fn expect_one_of(&self, kinds: &[&str]) -> Result<Map<String, Value>> {
        recognise::expect_readable(&self.path)?;
        let Some(found) = self.attributes()? else {
            let other = match self.metadata_path("").exists() {
                true => Some(recognise::foreign(&self.path)?),
                false => recognise::other(&self.path)?,
            };
            return Err(match other {
                Some(other) => other.unexpected(&self.path, kinds),
                None => {
                    let expected = recognise::one_of(kinds);
                    Error::missing(format!("{}: no store here, expected {expected}", self.path.display()))
                        .hint(recognise::how_made(kinds))
                }
            });
        };
        let kind = found.get("kind").unwrap_or(&Value::Null);
        if kinds.iter().any(|expected| kind == expected) {
            return Ok(found);
        }
        Err(recognise::another_kind(&self.path, kind, kinds))
    }

    /// Writes the group's metadata with our attributes, sealed; `group` is "" for the root.
    pub fn write_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
        self.write_group_with(group, attributes, Map::new())
    }

    /// Writes a group's metadata: our attributes, sealed, and members beside the attributes. Attributes of others stay.
    fn write_group_with(
        &self,
        group: &str,
        mut ours: Map<String, Value>,
        members: Map<String, Value>,
    ) -> Result<()> {
        let file = self.metadata_path(group);
        let found = metadata::read_object(&file)?;
        let mut attributes =
            found.and_then(|document| metadata::group_attributes(&document).ok()).unwrap_or_default();
        attributes.remove("btfkit");
        if !ours.is_empty() {
            ours.insert("seal".to_owned(), json!(metadata::seal(&ours)));
            attributes.insert("btfkit".to_owned(), Value::Object(ours));
        }
        if members.contains_key(consolidated::MEMBER) {
            consolidated::name_coordinates(&members, &mut attributes);
        }
        let mut document = Map::new();
        document.insert("zarr_format".to_owned(), json!(3));
        document.insert("node_type".to_owned(), json!("group"));
        document.insert("attributes".to_owned(), Value::Object(attributes));
        document.extend(members);
        metadata::write_object(&file, document)
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

    /// Whether a chunk (or shard) has been written.
    pub fn has_chunk(&self, array: &Array, indices: &[u64]) -> bool {
        self.chunk_path(array, indices).is_file()
    }

    /// Whether a shard is there and not cut off: its index is intact, its chunks are not looked at.
    pub fn has_shard(&self, array: &Array, indices: &[u64]) -> bool {
        let path = self.chunk_path(array, indices);
        let chunks = array.shard_chunks().unwrap_or(0);
        path.is_file() && mapped::open(&path).and_then(|file| shard::has_index(file, chunks)).unwrap_or(false)
    }
}

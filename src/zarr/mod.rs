//! Zarr v3: groups of arrays in a directory, written and read so that nothing on disk is trusted. Which arrays there
//! are, and what they mean, is said in [`crate::store`].

mod array;
pub(crate) mod checksums;
pub mod codec;
mod consolidated;
pub mod metadata;
pub(crate) mod places;
mod read;
pub(crate) mod shard;
pub mod storage;

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use btfkit_formats::{SampleType, f16};
use serde_json::{Map, Value, json};
use zarrs::array::DataType;

use crate::disk::mapped;
use crate::error::{BEGIN_AGAIN, Error, Result};
pub use array::{Array, Layout, Named};
pub use codec::Chain;
pub use metadata::FORMAT;
pub(crate) use read::DAMAGED;
use storage::MappedStorage;

/// Level of the zstd codec: after level 1 measured data hardly packs better, only slower.
const ZSTD_LEVEL: i32 = 1;

/// The Zarr data type of samples.
pub(crate) fn data_type_of(sample_type: SampleType) -> DataType {
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
pub(crate) fn sample_type_of(data_type: &DataType) -> Option<SampleType> {
    SAMPLE_TYPES.into_iter().find(|&sample_type| data_type_of(sample_type) == *data_type)
}

/// The type of samples of this name, if one has it.
pub(crate) fn samples_named(name: &str) -> Option<SampleType> {
    SAMPLE_TYPES.into_iter().find(|samples| samples.name() == name)
}

/// A Zarr v3 group in a directory.
#[derive(Clone)]
pub struct Store {
    path: PathBuf,
    storage: Arc<MappedStorage>,
    /// Version of its layout.
    pub(crate) format: u64,
    /// Our attributes of the root as they were read last, and of which file: they are asked for at every array.
    known: Arc<Mutex<Option<Known>>>,
    /// Digests of the recipes of what has been read of it, by the name of the stage; "" is the store itself.
    seen: Arc<Mutex<BTreeMap<String, String>>>,
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
            seen: Arc::default(),
        }
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
    pub(crate) fn sweep(&self) -> Result<()> {
        self.storage.sweep()
    }

    /// Whether all chunks (or shards) of an array are there.
    pub(crate) fn has_all(&self, array: &Array) -> bool {
        let grid = array.grid();
        places::places(&vec![0; grid.len()], &grid).all(|place| self.has_chunk(array, &place))
    }

    /// Our attributes (key `btfkit`) of the root group; `None` where there is none, or not ours.
    ///
    /// # Errors
    /// Where the root group is damaged, or was changed.
    pub(crate) fn attributes(&self) -> Result<Option<Map<String, Value>>> {
        self.with_attributes(Map::clone)
    }

    /// What `of` finds in them.
    fn with_attributes<T>(&self, of: impl FnOnce(&Map<String, Value>) -> T) -> Result<Option<T>> {
        let stamp = Stamp::of(&self.metadata_path(""));
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((file, ours)) = known.as_ref()
            && Some(*file) == stamp
        {
            return Ok(Some(of(ours)));
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
        let result = of(&ours);
        *known = stamp.map(|stamp| (stamp, ours));
        Ok(Some(result))
    }

    /// Takes note of what is read: of a stage ("" for the store itself) that was made by the recipe of this digest.
    pub(crate) fn see(&self, stage: &str, digest: &str) {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.entry(stage.to_owned()).or_insert_with(|| digest.to_owned());
    }

    /// Forgets a stage that this process itself makes anew.
    pub(crate) fn forget(&self, stage: &str) {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).remove(stage);
    }

    /// Refuses a store of which something was made anew by another recipe since it was first [seen](Self::see): what was
    /// read of it would be mixed. To be asked when a file of it has been opened; one that is removed or replaced later
    /// stays as it was.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Input`], and those of reading the attributes.
    pub(crate) fn expect_unchanged(&self) -> Result<()> {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if seen.is_empty() {
            return Ok(());
        }
        let same = |ours: &Map<String, Value>| {
            seen.iter().all(|(stage, digest)| {
                let of_stage = || ours.get("stages")?.get(stage)?.get("digest");
                let found = if stage.is_empty() { ours.get("digest") } else { of_stage() };
                found.and_then(Value::as_str) == Some(digest)
            })
        };
        if self.with_attributes(same)? == Some(true) {
            return Ok(());
        }
        Err(Error::input(format!("{} was made anew while it was read", self.path.display()))
            .hint(BEGIN_AGAIN))
    }

    /// A result of reading; where that failed since the store was made anew, this is said instead.
    pub(crate) fn unless_made_anew<T>(&self, result: Result<T>) -> Result<T> {
        match result {
            Ok(found) => Ok(found),
            Err(error) => self.expect_unchanged().and(Err(error)),
        }
    }

    /// All attributes of the root group; `None` where there is none.
    pub(crate) fn root(&self) -> Result<Option<Map<String, Value>>> {
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

    /// Writes the group's metadata with our attributes, sealed; `group` is "" for the root.
    pub(crate) fn write_group(&self, group: &str, attributes: Map<String, Value>) -> Result<()> {
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
    pub(crate) fn has_chunk(&self, array: &Array, indices: &[u64]) -> bool {
        self.chunk_path(array, indices).is_file()
    }

    /// Whether a shard is there and not cut off: its index is intact, its chunks are not looked at.
    pub(crate) fn has_shard(&self, array: &Array, indices: &[u64]) -> bool {
        let path = self.chunk_path(array, indices);
        let chunks = array.shard_chunks().unwrap_or(0);
        path.is_file() && mapped::open(&path).and_then(|file| shard::has_index(file, chunks)).unwrap_or(false)
    }
}

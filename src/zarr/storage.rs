//! A directory tree as the storage of Zarr arrays: reads are slices of a memory map, writes are whole or not at all.
//!
//! zarrs' own file store writes in place, so that a kill leaves a torn shard which a later run takes for done.
#![allow(clippy::disallowed_methods)] // they are wrapped here

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use zarrs_storage::byte_range::{ByteRange, ByteRangeIterator};
use zarrs_storage::{
    ListableStorageTraits, MaybeBytesIterator, OffsetBytesIterator, ReadableStorageTraits, StorageError,
    StoreKey, StoreKeys, StoreKeysPrefixes, StorePrefix, WritableStorageTraits,
};

use crate::disk::mapped::MappedFile;
use crate::disk::temporary::{is_temporary, sweep, write_atomically};
use crate::error::Result;

/// A directory tree as a Zarr storage.
#[derive(Debug)]
pub struct MappedStorage {
    root: PathBuf,
}

impl MappedStorage {
    /// The storage under `root`, which need not exist yet.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// The file that a key lies in.
    pub fn path(&self, key: &StoreKey) -> PathBuf {
        self.root.join(key.as_str())
    }

    /// Removes what killed writers left behind: temporary files that nobody holds.
    pub(crate) fn sweep(&self) -> Result<()> {
        sweep(&self.root)
    }
}

/// Maps a file as shared bytes.
fn map_file(path: &Path) -> io::Result<Bytes> {
    Ok(Bytes::from_owner(MappedFile::open(path)?))
}

fn storage_error(path: &Path, action: &str, error: &io::Error) -> StorageError {
    let described = io::Error::new(error.kind(), format!("cannot {action} {}: {error}", path.display()));
    StorageError::IOError(Arc::new(described))
}

impl ReadableStorageTraits for MappedStorage {
    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        byte_ranges: ByteRangeIterator<'a>,
    ) -> std::result::Result<MaybeBytesIterator<'a>, StorageError> {
        let path = self.path(key);
        let bytes = match map_file(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(storage_error(&path, "read", &error)),
        };
        Ok(Some(Box::new(byte_ranges.map(move |range| slice(&bytes, range)))))
    }

    fn size_key(&self, key: &StoreKey) -> std::result::Result<Option<u64>, StorageError> {
        let path = self.path(key);
        match fs::metadata(&path) {
            Ok(data) => Ok(Some(data.len())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(storage_error(&path, "read", &error)),
        }
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

/// The bytes of a range, or an error where the file is shorter than the range.
fn slice(bytes: &Bytes, range: ByteRange) -> std::result::Result<Bytes, StorageError> {
    let length = bytes.len() as u64;
    let bounds = match range {
        ByteRange::FromStart(offset, None) => Some((offset, length)),
        ByteRange::FromStart(offset, Some(count)) => offset.checked_add(count).map(|end| (offset, end)),
        ByteRange::Suffix(count) => length.checked_sub(count).map(|start| (start, length)),
    };
    match bounds {
        Some((start, end)) if start <= end && end <= length => Ok(bytes.slice(start as usize..end as usize)),
        _ => Err(StorageError::Other(format!("got a file of {length} bytes, expected it to hold {range}"))),
    }
}

impl WritableStorageTraits for MappedStorage {
    fn set(&self, key: &StoreKey, value: Bytes) -> std::result::Result<(), StorageError> {
        let path = self.path(key);
        // What is finished is found done where nothing can be written, too.
        let same_length = fs::metadata(&path).is_ok_and(|data| data.len() == value.len() as u64);
        if same_length && map_file(&path).is_ok_and(|found| found == value) {
            return Ok(());
        }
        write_atomically(&path, &value).map_err(|error| storage_error(&path, "write", &error))
    }

    fn set_partial_many(
        &self,
        _: &StoreKey,
        _: OffsetBytesIterator<'_>,
    ) -> std::result::Result<(), StorageError> {
        Err(StorageError::Unsupported("this storage writes whole values only".to_owned()))
    }

    fn erase(&self, key: &StoreKey) -> std::result::Result<(), StorageError> {
        let path = self.path(key);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(storage_error(&path, "remove", &error))
            }
            _ => Ok(()),
        }
    }

    fn erase_prefix(&self, prefix: &StorePrefix) -> std::result::Result<(), StorageError> {
        let path = self.root.join(prefix.as_str());
        match fs::remove_dir_all(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(storage_error(&path, "remove", &error))
            }
            _ => Ok(()),
        }
    }

    fn supports_set_partial(&self) -> bool {
        false
    }
}

impl ListableStorageTraits for MappedStorage {
    fn list(&self) -> std::result::Result<StoreKeys, StorageError> {
        self.list_prefix(&StorePrefix::root())
    }

    fn list_prefix(&self, prefix: &StorePrefix) -> std::result::Result<StoreKeys, StorageError> {
        let mut keys = Vec::new();
        let mut prefixes = vec![prefix.clone()];
        while let Some(prefix) = prefixes.pop() {
            let found = self.list_dir(&prefix)?;
            keys.extend_from_slice(found.keys());
            prefixes.extend_from_slice(found.prefixes());
        }
        keys.sort();
        Ok(keys)
    }

    fn list_dir(&self, prefix: &StorePrefix) -> std::result::Result<StoreKeysPrefixes, StorageError> {
        let folder = self.root.join(prefix.as_str());
        let (mut keys, mut prefixes) = (StoreKeys::new(), Vec::new());
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(StoreKeysPrefixes::new(keys, prefixes));
            }
            Err(error) => return Err(storage_error(&folder, "list", &error)),
        };
        for entry in entries {
            let entry = entry.map_err(|error| storage_error(&folder, "list", &error))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if is_temporary(Path::new(&name)) {
                continue;
            }
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                prefixes.push(StorePrefix::new(format!("{}{name}/", prefix.as_str()))?);
            } else {
                keys.push(StoreKey::new(format!("{}{name}", prefix.as_str()))?);
            }
        }
        keys.sort();
        prefixes.sort();
        Ok(StoreKeysPrefixes::new(keys, prefixes))
    }

    fn size_prefix(&self, prefix: &StorePrefix) -> std::result::Result<u64, StorageError> {
        let keys = self.list_prefix(prefix)?;
        keys.iter().map(|key| Ok(self.size_key(key)?.unwrap_or(0))).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_value_appears_whole_and_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let storage = MappedStorage::new(folder.path());
        let key = StoreKey::new("a/b/c").unwrap();
        storage.set(&key, Bytes::from_static(b"twelve bytes")).unwrap();
        assert_eq!(storage.get(&key).unwrap().unwrap(), "twelve bytes");
        assert_eq!(storage.get_partial(&key, ByteRange::Suffix(5)).unwrap().unwrap(), "bytes");
        assert_eq!(fs::read_dir(folder.path().join("a/b")).unwrap().count(), 1);
        assert_eq!(storage.list().unwrap(), [key]);
    }

    #[test]
    fn a_range_beyond_the_file_is_an_error_and_a_missing_key_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let storage = MappedStorage::new(folder.path());
        let key = StoreKey::new("short").unwrap();
        assert!(storage.get(&key).unwrap().is_none());
        storage.set(&key, Bytes::from_static(b"abc")).unwrap();
        assert!(storage.get_partial(&key, ByteRange::FromStart(1, Some(3))).is_err());
        assert!(storage.get_partial(&key, ByteRange::Suffix(4)).is_err());
    }
}

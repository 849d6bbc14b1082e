//! How far an enlargement is: the state of its field after a number of whole rows of shards, in a file of the output,
//! which a finished output has no longer.
//!
//! | bytes | |
//! | --- | --- |
//! | 16 | `btfkit enlarge 1` |
//! | 32 | SHA-256 of all that follows |
//! | 64 | digest of the recipe, hexadecimal |
//! | 8 | rows of shards that are done, little endian |
//! | rest | state of the field |

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::disk::mapped::MappedFile;
use crate::disk::temporary;
use crate::error::{Error, Result};

const MAGIC: &[u8; 16] = b"btfkit enlarge 1";
pub(crate) const NAME: &str = "enlarge-state";
const DIGEST_LENGTH: usize = 64;

/// How far an enlargement is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EnlargeState {
    /// Rows of shards that are written.
    pub shard_rows: usize,
    /// State of the field after their rows.
    pub field: Vec<u8>,
}

fn place(output: &Path) -> PathBuf {
    output.join(NAME)
}

impl EnlargeState {
    /// That of the output at `output`, if it has begun and is not finished; `digest` is that of the recipe.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] where it is another recipe's; when the file is damaged.
    pub(crate) fn read(output: &Path, digest: &str) -> Result<Option<Self>> {
        let file = place(output);
        match MappedFile::open(&file) {
            Ok(bytes) => Self::parse(bytes.as_ref(), &file, digest).map(Some),
            Err(error) if error.kind() == std::io::ErrorKind::InvalidInput => {
                Err(Error::input(format!("{}: {error}", file.display())))
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::io("read", &file, error)),
        }
    }

    /// Replaces what is there at once.
    pub(crate) fn write(&self, output: &Path, digest: &str) -> Result<()> {
        temporary::write_file(&place(output), &self.to_bytes(digest))
    }

    /// Removes it: the output is finished.
    pub(crate) fn remove(output: &Path) -> Result<()> {
        let file = place(output);
        match std::fs::remove_file(&file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(Error::io("remove", &file, error))
            }
            _ => Ok(()),
        }
    }

    fn to_bytes(&self, digest: &str) -> Vec<u8> {
        let mut body = digest.as_bytes().to_vec();
        body.extend((self.shard_rows as u64).to_le_bytes());
        body.extend(&self.field);
        let mut bytes = MAGIC.to_vec();
        bytes.extend(Sha256::digest(&body));
        bytes.extend(body);
        bytes
    }

    fn parse(bytes: &[u8], file: &Path, digest: &str) -> Result<Self> {
        let damaged = |what: String| {
            Error::input(format!("{}: {what}", file.display()))
                .hint("delete this file: the same command then begins again, with the same result")
        };
        let rest = bytes
            .strip_prefix(MAGIC)
            .ok_or_else(|| damaged("got another beginning, expected `btfkit enlarge 1`".to_owned()))?;
        let ends = || damaged(format!("ends after {} bytes", bytes.len()));
        let (checksum, body) = rest.split_at_checked(32).ok_or_else(ends)?;
        if Sha256::digest(body)[..] != *checksum {
            return Err(damaged("its checksum is another: the file is damaged".to_owned()));
        }
        let (found, body) = body.split_at_checked(DIGEST_LENGTH).ok_or_else(ends)?;
        if found != digest.as_bytes() {
            return Err(Error::recipe(format!("{}: the state of another recipe", file.display()))
                .hint("delete this file: the same command then begins again"));
        }
        let (rows, field) = body.split_first_chunk().ok_or_else(ends)?;
        Ok(Self { shard_rows: u64::from_le_bytes(*rows) as usize, field: field.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::ErrorKind;

    fn digest(text: &str) -> String {
        crate::run::recipe::digest_bytes(text.as_bytes())
    }

    #[test]
    fn a_state_comes_back_and_that_of_another_recipe_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let state = EnlargeState { shard_rows: 300, field: (0..200).collect() };
        assert_eq!(EnlargeState::read(folder.path(), &digest("a")).unwrap(), None);
        state.write(folder.path(), &digest("a")).unwrap();
        assert_eq!(EnlargeState::read(folder.path(), &digest("a")).unwrap(), Some(state));
        assert_eq!(EnlargeState::read(folder.path(), &digest("b")).unwrap_err().kind(), ErrorKind::Recipe);
        EnlargeState::remove(folder.path()).unwrap();
        EnlargeState::remove(folder.path()).unwrap();
        assert_eq!(EnlargeState::read(folder.path(), &digest("a")).unwrap(), None);
    }

    #[test]
    fn cut_and_changed_files_are_refused() {
        let state = EnlargeState { shard_rows: 3, field: vec![7; 40] };
        let whole = state.to_bytes(&digest("a"));
        let parse = |bytes: &[u8]| EnlargeState::parse(bytes, Path::new("f"), &digest("a"));
        assert_eq!(parse(&whole).unwrap(), state);
        for length in 0..whole.len() {
            assert!(parse(&whole[..length]).is_err(), "cut after {length}");
        }
        for bit in 0..whole.len() * 8 {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(parse(&bytes).is_err(), "bit {bit}");
        }
    }
}

//! The walk over the chunks of a file.

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, Result};

/// The first eight bytes.
pub(super) const SIGNATURE: &[u8] = b"BIG\0\0\0\0\0";

/// Chunks, and so everything in them, start at multiples of this.
const ALIGNMENT: u64 = 8;

/// Id of the chunk by which document and library differ.
const TELLING_ID: u64 = 5;

/// One chunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub(super) id: u64,
    /// Where its id stands in the file.
    pub(super) at: usize,
    /// Where its data start in the file.
    pub(super) data_at: usize,
    pub(super) data: &'a [u8],
}

impl Chunk<'_> {
    /// The only number of a chunk that holds one.
    pub(super) fn number(&self) -> Result<u64> {
        match self.data.as_chunks() {
            ([one], []) => Ok(u64::from_le_bytes(*one)),
            _ => Err(self.wrong_size("8")),
        }
    }

    /// All numbers of a chunk.
    pub(super) fn numbers(&self) -> impl ExactSizeIterator<Item = u64> {
        self.data.as_chunks().0.iter().map(|&one| u64::from_le_bytes(one))
    }

    /// Text up to the zeros that pad it, for people: at most a few lines.
    pub(super) fn text(&self) -> String {
        let end = self.data.iter().position(|&byte| byte == 0).unwrap_or(self.data.len());
        let text = self.data.get(..end.min(MAX_TEXT_BYTES)).unwrap_or(&[]);
        String::from_utf8_lossy(text).into_owned()
    }

    pub(super) fn wrong_size(&self, expected: &'static str) -> Error {
        let found = format!("a chunk {} of {}", self.id, counted(self.data.len(), "byte"));
        Error::malformed(found, expected).at(self.at)
    }
}

/// More of a text is not passed on.
const MAX_TEXT_BYTES: usize = 1024;

/// All chunks of a file, in its order.
pub(super) struct Chunks<'a> {
    list: Vec<Chunk<'a>>,
}

impl<'a> Chunks<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Chunks<'a>> {
        let mut reader = Reader::new(bytes);
        if reader.take(SIGNATURE.len())? != SIGNATURE {
            return Err(Error::malformed("other first bytes", "the signature of a BIG file").at(0usize));
        }
        let mut list = Vec::new();
        while !reader.rest().is_empty() {
            let at = reader.position();
            let (id, length) = (reader.u64_le()?, reader.u64_le()?);
            let left = reader.rest().len();
            let size = usize::try_from(length).ok().filter(|&size| size <= left);
            let Some(size) = size else {
                let expected = format!("at most the {left} that are left");
                return Err(Error::malformed(
                    format!("a chunk {id} of {}", counted(length, "byte")),
                    expected,
                )
                .at(at));
            };
            if length.checked_rem(ALIGNMENT) != Some(0) {
                let found = format!("a chunk {id} of {}", counted(length, "byte"));
                return Err(Error::malformed(found, "a multiple of 8").at(at));
            }
            let data_at = reader.position();
            list.push(Chunk { id, at, data_at, data: reader.take(size)? });
        }
        Ok(Chunks { list })
    }

    pub(super) fn all(&self, id: u64) -> impl Iterator<Item = &Chunk<'a>> {
        self.list.iter().filter(move |chunk| chunk.id == id)
    }

    /// The chunk of an id that a file may have once.
    pub(super) fn one(&self, id: u64) -> Result<Option<&Chunk<'a>>> {
        let mut all = self.all(id);
        let first = all.next();
        match all.next() {
            Some(second) => Err(Error::malformed(format!("a second chunk {id}"), "one").at(second.at)),
            None => Ok(first),
        }
    }

    /// The number of a chunk, or what its absence means.
    pub(super) fn number(&self, id: u64, default: u64) -> Result<u64> {
        self.one(id)?.map_or(Ok(default), Chunk::number)
    }

    /// Whether the file is in the library's dialect.
    pub(super) fn is_library(&self) -> Result<bool> {
        Ok(self.one(TELLING_ID)?.is_some_and(|chunk| chunk.data.len() == 32))
    }
}

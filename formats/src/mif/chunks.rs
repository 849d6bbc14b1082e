//! The walk over the chunks of a file.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::reader::Reader;
use crate::utia::Number;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result, request};

/// Type of the first chunk.
pub(super) const SIGNATURE: &[u8] = b"MIF FILE";

const VERSION: u64 = 1;

const IMAGE: u64 = 0;
const XML: u64 = 1;
/// Space of a chunk that was removed.
const FREE: u64 = u64::MAX;
/// Length of free space that goes on to the end of the file.
const TO_THE_END: u64 = u64::MAX;

/// One image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Image {
    /// Where its chunk starts in the file.
    pub(super) at: usize,
    pub(super) number: Number,
    /// Rows, columns, planes.
    size: [u64; 3],
    /// Where its samples start, and their bytes.
    data: (usize, usize),
}

impl Image {
    pub(super) fn size(&self) -> [u64; 3] {
        self.size
    }

    /// Where its samples lie in the file: row, column, plane.
    pub(super) fn samples(&self) -> Option<Range<usize>> {
        let (start, length) = self.data;
        Some(start..start.checked_add(length)?)
    }
}

/// What is in a file.
pub(super) struct Chunks<'a> {
    pub(super) images: BTreeMap<u64, Image>,
    /// The text, and where it starts.
    pub(super) xml: Option<(&'a [u8], usize)>,
}

impl<'a> Chunks<'a> {
    pub(super) fn read(bytes: &'a [u8], limits: &Limits) -> Result<Chunks<'a>> {
        let mut reader = Reader::new(bytes);
        read_signature(&mut reader)?;
        let mut chunks = Chunks { images: BTreeMap::new(), xml: None };
        while !reader.rest().is_empty() {
            let at = reader.position();
            let (kind, length) = (reader.u64_le()?, reader.u64_le()?);
            if (kind, length) == (FREE, TO_THE_END) {
                break;
            }
            let left = reader.rest().len();
            let Some(size) = usize::try_from(length).ok().filter(|&size| size <= left) else {
                let expected = format!("at most the {left} that are left");
                return Err(
                    Error::malformed(format!("a chunk of {}", counted(length, "byte")), expected).at(at)
                );
            };
            let data_at = reader.position();
            let data = reader.take(size)?;
            match kind {
                IMAGE => chunks.add_image(data, at, data_at, limits)?,
                XML if chunks.xml.is_some() => {
                    return Err(Error::malformed("a second chunk of XML", "one").at(at));
                }
                XML => chunks.xml = Some((data, data_at)),
                // Free space, and types of later versions.
                _ => {}
            }
        }
        Ok(chunks)
    }

    fn add_image(&mut self, data: &[u8], at: usize, data_at: usize, limits: &Limits) -> Result<()> {
        let here = |error: Error| error.at(at);
        let mut head = Reader::new(data);
        let index = head.u64_le().map_err(here)?;
        let _flags = head.u64_le().map_err(here)?; // none is defined
        let id = head.u64_le().map_err(here)?;
        let size = [head.u64_le().map_err(here)?, head.u64_le().map_err(here)?, head.u64_le().map_err(here)?];
        let Some(number) = Number::from_library_id(id) else {
            return Err(Error::malformed(format!("data type {id}"), "1 to 11").at(at));
        };
        let [height, width, planes] = size;
        request::plane(width, height, planes, limits).map_err(here)?;
        let samples = head.rest();
        let expected = [height, width, planes]
            .iter()
            .try_fold(u64::try_from(number.bytes()).unwrap_or(u64::MAX), |bytes, &side| {
                bytes.checked_mul(side)
            });
        if expected.is_none() || u64::try_from(samples.len()).ok() != expected {
            let found =
                format!("an image of {width} x {height} x {planes} in {}", counted(samples.len(), "byte"));
            let wanted =
                expected.map_or_else(|| "what a file can hold".to_owned(), |bytes| bytes.to_string());
            return Err(Error::malformed(found, wanted).at(at));
        }
        let start = data_at.saturating_add(head.position());
        let image = Image { at, number, size, data: (start, samples.len()) };
        if self.images.insert(index, image).is_some() {
            return Err(Error::malformed(format!("image {index} a second time"), "once").at(at));
        }
        if u64::try_from(self.images.len()).is_ok_and(|count| count > limits.max_entries) {
            let expected = format!("at most {} (max_entries)", limits.max_entries);
            return Err(Error::new(
                ErrorKind::Limit,
                format!("{} or more", counted(self.images.len(), "image")),
                expected,
            )
            .at(at));
        }
        Ok(())
    }
}

/// The first chunk: signature, length 8, version.
fn read_signature(reader: &mut Reader<'_>) -> Result<()> {
    if reader.take(SIGNATURE.len())? != SIGNATURE {
        return Err(Error::malformed("other first bytes", "the signature of a MIF file").at(0usize));
    }
    let length = reader.u64_le()?;
    if length != 8 {
        return Err(Error::malformed(format!("a first chunk of {}", counted(length, "byte")), "8").at(0usize));
    }
    match reader.u64_le()? {
        VERSION => Ok(()),
        other => Err(Error::new(ErrorKind::Unsupported, format!("version {other}"), "1").at(0usize)),
    }
}

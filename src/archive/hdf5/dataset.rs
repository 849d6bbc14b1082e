//! A file and its datasets, looked at from outside before any data are touched.
//!
//! HDF5 lets a file declare more than it holds: datasets of any extent without data, names that lead to
//! other files, data that lie in other files, filters that are programs of their own. All of it is refused
//! here, so that what is read afterwards is bounded by the file.

use std::ops::Range;
use std::path::{Path, PathBuf};

use btfkit_formats::{Limits, SampleType, f16};
use hdf5::dataset::Layout;
use hdf5::filters::Filter;
use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{
    Dataset, H5Type, Hyperslab, IndexType, IterationOrder, LinkType, LocationType, Selection, SliceOrIndex,
};
use ndarray::IxDyn;

use crate::error::{Error, Result};
use crate::words::counted;

/// Links of the root group that are looked at.
const MAX_LINKS: usize = 4096;

/// Names that an error lists.
const NAMED_LINKS: usize = 20;

/// Bytes that filters may add to a chunk that does not compress, beside a hundredth of it: headers and a checksum.
const CHUNK_OVERHEAD_BYTES: u64 = 64;

/// An open file and the names in its root group.
pub(super) struct File {
    file: hdf5::File,
    path: PathBuf,
    bytes: u64,
    links: Vec<(String, LinkType)>,
}

impl File {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let bytes = std::fs::metadata(path).map_err(|error| Error::io("read", path, error))?.len();
        let file = hdf5::File::open(path).map_err(|error| refused(path, &error))?;
        let mut links = Vec::new();
        file.find_link(IndexType::Name, IterationOrder::Native, |name, link| {
            links.push((name.to_owned(), link.link_type));
            Ok((links.len() == MAX_LINKS).then_some(()))
        })
        .map_err(|error| refused(path, &error))?;
        Ok(Self { file, path: path.to_owned(), bytes, links })
    }

    /// Whether the root group has this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.links.iter().any(|(known, _)| known == name)
    }

    /// The names in the root group, as far as an error should list them.
    pub(super) fn names(&self) -> String {
        let mut names: Vec<&str> =
            self.links.iter().take(NAMED_LINKS).map(|(name, _)| name.as_str()).collect();
        if self.links.len() > NAMED_LINKS {
            names.push("...");
        }
        if names.is_empty() { "an empty root group".to_owned() } else { names.join(", ") }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn root(&self) -> &hdf5::Group {
        &self.file
    }

    /// An error about this file.
    pub(super) fn error(&self, what: impl std::fmt::Display) -> Error {
        Error::input(format!("{}: {what}", self.path.display()))
    }

    /// Opens a dataset of the root group and checks how its data lie.
    pub(super) fn table(&self, name: &'static str, limits: &Limits) -> Result<Table> {
        let wrong = |what: String| self.error(format!("{name}: {what}"));
        let link = self.links.iter().find(|(known, _)| known == name);
        let &(_, link) =
            link.ok_or_else(|| self.error(format!("no dataset {name}, got {}", self.names())))?;
        if link != LinkType::Hard {
            return Err(wrong(
                "a link to another name or another file, expected the data in this file".to_owned(),
            ));
        }
        let library = |error: hdf5::Error| wrong(error.to_string());
        if self.file.loc_type_by_name(name).map_err(library)? != LocationType::Dataset {
            return Err(wrong("not a dataset".to_owned()));
        }
        let dataset = self.file.dataset(name).map_err(library)?;
        let properties = dataset.dcpl().map_err(library)?;
        if let Some(external) = properties.get_external().map_err(library)?.first() {
            let file = &external.name;
            return Err(wrong(format!("its data lie in the file {file:?}, expected them in this file")));
        }
        let filters = properties.get_filters().map_err(library)?;
        if let Some(filter) = filters.iter().find_map(foreign_filter) {
            return Err(wrong(format!("packed by {filter}, expected deflate, shuffle and fletcher32 only"))
                .hint("write the dataset anew without it, or with gzip"));
        }
        let table = Table {
            kind: dataset.dtype().and_then(|kind| kind.to_descriptor()).map_err(library)?,
            shape: dataset.space().map_err(library)?.shape(),
            dataset,
            name,
            path: self.path.clone(),
        };
        let elements = table.shape.iter().try_fold(1u64, |n, &extent| n.checked_mul(extent as u64));
        let bytes = elements.and_then(|n| n.checked_mul(table.kind.size() as u64));
        let bytes = bytes.filter(|&bytes| bytes > 0).ok_or_else(|| {
            wrong(format!("got the shape {:?}, expected one that can be held", table.shape))
        })?;
        match properties.get_layout().map_err(library)? {
            Layout::Compact => table.expect_stored(bytes, self.bytes)?,
            Layout::Contiguous => {
                table.expect_stored(bytes, self.bytes)?;
                let end = table.dataset.offset().and_then(|start| start.checked_add(bytes));
                if end.is_none_or(|end| end > self.bytes) {
                    return Err(wrong(format!("{} of data reach beyond the file", counted(bytes, "byte"))));
                }
            }
            Layout::Chunked => {
                let chunk = properties.get_chunk().map_err(library)?.unwrap_or_default();
                table.expect_chunks(&chunk, self.bytes, limits)?;
            }
            Layout::Virtual => {
                return Err(wrong("a view of other datasets, expected the data in this file".to_owned()));
            }
        }
        Ok(table)
    }
}

/// What the C library says about a file as a whole.
fn refused(path: &Path, error: &hdf5::Error) -> Error {
    Error::input(format!("{}: {error}", path.display())).hint(
        "expected an HDF5 file that is whole; where files cannot be locked, set HDF5_USE_FILE_LOCKING=FALSE",
    )
}

/// A filter that is not undone here, by its registered name.
fn foreign_filter(filter: &Filter) -> Option<String> {
    let name = match filter {
        Filter::Deflate(_) | Filter::Shuffle | Filter::Fletcher32 => return None,
        Filter::SZip(..) => "szip",
        Filter::NBit => "n-bit",
        Filter::ScaleOffset(_) => "scale-offset",
        Filter::User(id, _) => match id {
            307 => "bzip2",
            32000 => "LZF",
            32001 => "Blosc",
            32004 => "LZ4",
            32008 => "bitshuffle",
            32013 => "ZFP",
            32015 => "Zstandard",
            32026 => "Blosc2",
            id => return Some(format!("the user-defined filter {id}")),
        },
    };
    Some(format!("the filter {name}"))
}

/// A dataset whose data are in the file, all of them.
pub(super) struct Table {
    dataset: Dataset,
    kind: TypeDescriptor,
    shape: Vec<usize>,
    name: &'static str,
    path: PathBuf,
}

impl Table {
    /// Extents.
    pub(super) fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The dataset itself, for its attributes.
    pub(super) fn location(&self) -> &hdf5::Location {
        &self.dataset
    }

    /// An error about this dataset.
    pub(super) fn error(&self, what: impl std::fmt::Display) -> Error {
        Error::input(format!("{}: {}: {what}", self.path.display(), self.name))
    }

    /// The extents, which must be `N` and each within its limit.
    pub(super) fn extents<const N: usize>(&self, limits: [(&str, u64); N]) -> Result<[usize; N]> {
        let extents: [usize; N] = self.shape.as_slice().try_into().map_err(|_| {
            let names = limits.map(|(name, _)| name).join(", ");
            self.error(format!("got the shape {:?}, expected [{names}]", self.shape))
        })?;
        for (&extent, (name, limit)) in extents.iter().zip(limits) {
            if extent as u64 > limit {
                return Err(self.error(format!("got {extent} along {name}, expected at most {limit}")));
            }
        }
        Ok(extents)
    }

    /// The type that samples are read as.
    pub(super) fn sample_type(&self) -> Result<SampleType> {
        match self.kind {
            TypeDescriptor::Unsigned(IntSize::U1) => Ok(SampleType::U8),
            TypeDescriptor::Unsigned(IntSize::U2) => Ok(SampleType::U16),
            TypeDescriptor::Float(FloatSize::U4) => Ok(SampleType::F32),
            // Not every float of two bytes is an IEEE half.
            TypeDescriptor::Float(FloatSize::U2) if self.dataset.dtype().is_ok_and(|d| d.is::<f16>()) => {
                Ok(SampleType::F16)
            }
            _ => Err(self.error(format!(
                "got samples of type {}, expected uint8, uint16, float16 or float32",
                self.kind
            ))),
        }
    }

    /// What to know of integers that have fewer bits than their type: the sensor's, perhaps.
    pub(super) fn fewer_bits(&self) -> Option<String> {
        let stored = self.dataset.dtype().ok()?;
        let is_swapped = matches!(stored.byte_order(), hdf5::datatype::ByteOrder::BigEndian);
        let all = match self.kind {
            TypeDescriptor::Unsigned(IntSize::U1) => stored.is::<u8>(),
            TypeDescriptor::Unsigned(IntSize::U2) => is_swapped || stored.is::<u16>(),
            _ => true,
        };
        (!all).then(|| {
            format!(
                "the precision of {}, which is less than all bits of its type, is not applied: the largest number of \
                 the type is taken for white",
                self.name
            )
        })
    }

    /// All elements of a dataset of 32-bit or 64-bit floats.
    pub(super) fn read_floats(&self) -> Result<Vec<f64>> {
        match self.kind {
            TypeDescriptor::Float(FloatSize::U4 | FloatSize::U8) => {
                self.read(&self.shape.iter().map(|&extent| 0..extent).collect::<Vec<_>>())
            }
            _ => Err(self.error(format!("got numbers of type {}, expected float32 or float64", self.kind))),
        }
    }

    /// The elements of a box, converted to `T`, last dimension fastest.
    pub(super) fn read<T: H5Type>(&self, window: &[Range<usize>]) -> Result<Vec<T>> {
        let selection: Vec<SliceOrIndex> = window.iter().cloned().map(SliceOrIndex::from).collect();
        let read = self.dataset.read_slice::<T, _, IxDyn>(Selection::from(Hyperslab::from(selection)));
        let (elements, _) = read.map_err(|error| self.error(error))?.into_raw_vec_and_offset();
        Ok(elements)
    }

    fn expect_stored(&self, bytes: u64, file_bytes: u64) -> Result<()> {
        let stored = self.dataset.storage_size();
        if stored == bytes && stored <= file_bytes {
            return Ok(());
        }
        Err(self.error(format!(
            "got {} of data in a file of {file_bytes}, expected {bytes} for the shape {:?}",
            counted(stored, "byte"),
            self.shape
        )))
    }

    /// That every chunk is there, and that none can unpack to much more than it should: deflate makes up to a
    /// thousand bytes of one, so that stored chunks larger than plain ones are no honest ones.
    fn expect_chunks(&self, chunk: &[usize], file_bytes: u64, limits: &Limits) -> Result<()> {
        let wrong = |what: String| self.error(what);
        if chunk.len() != self.shape.len() || chunk.contains(&0) {
            return Err(wrong(format!("got chunks {chunk:?} of the shape {:?}", self.shape)));
        }
        let chunk_bytes = chunk.iter().try_fold(self.kind.size() as u64, |n, &c| n.checked_mul(c as u64));
        let chunk_bytes = chunk_bytes.filter(|&bytes| bytes <= limits.max_entry_bytes).ok_or_else(|| {
            wrong(format!(
                "got chunks {chunk:?}, expected at most {} each",
                counted(limits.max_entry_bytes, "byte")
            ))
        })?;
        let count = self.shape.iter().zip(chunk).map(|(&extent, &c)| extent.div_ceil(c) as u64);
        // Counting asks the library to walk through all of them: not for more than a file can hold.
        let count = count.fold(1u64, u64::saturating_mul);
        if count > file_bytes {
            return Err(wrong(format!(
                "got {} in a file of {}",
                counted(count, "chunk"),
                counted(file_bytes, "byte")
            )));
        }
        let found =
            self.dataset.num_chunks().ok_or_else(|| wrong("its chunks cannot be counted".to_owned()))?;
        if found as u64 != count {
            return Err(wrong(format!(
                "got {}, expected {count} for the shape {:?}",
                counted(found, "chunk"),
                self.shape
            )));
        }
        let stored = self.dataset.storage_size();
        let honest = count.saturating_mul(chunk_bytes + chunk_bytes / 100 + CHUNK_OVERHEAD_BYTES);
        if stored > honest.min(file_bytes) {
            return Err(wrong(format!(
                "got {} in {} of {} each",
                counted(stored, "byte"),
                counted(count, "chunk"),
                counted(chunk_bytes, "byte")
            )));
        }
        Ok(())
    }
}

/// Rows or columns as [`Contents`] counts them.
pub(super) fn side(extent: usize, table: &Table) -> Result<u32> {
    u32::try_from(extent).map_err(|_| table.error(format!("got {extent} rows or columns")))
}

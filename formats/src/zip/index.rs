//! Reading: the list of entries, and the bytes of one.

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Range;

use flate2::{Decompress, FlushDecompress, Status};
use rawzip::extra_fields::ExtraFieldId;
use rawzip::{CompressionMethod, ZipArchive, ZipFileHeaderRecord, ZipSliceArchive};

use super::{cp437, crc32, name, translate};
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result};

/// Deflate cannot expand one byte to more than 1032 (a match of 258 bytes in two bits).
const MAX_DEFLATE_RATIO: u64 = 1032;

/// How an entry's bytes are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// As they are.
    Stored,
    /// Compressed by raw deflate (RFC 1951).
    Deflated,
}

/// One file of a zip, as its central directory describes it. Directories are not entries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZipEntry {
    name: String,
    compressed: Range<usize>,
    uncompressed_bytes: u64,
    method: Method,
    crc32: u32,
}

impl ZipEntry {
    /// Path inside the archive, as written there.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the compressed bytes lie in the archive; no two entries overlap.
    pub fn compressed_range(&self) -> Range<usize> {
        self.compressed.clone()
    }

    /// Size after decompression, bytes: at most [`Limits::max_entry_bytes`], and verified by
    /// [`ZipIndex::read`].
    pub fn uncompressed_bytes(&self) -> u64 {
        self.uncompressed_bytes
    }

    /// How the bytes are held.
    pub fn method(&self) -> Method {
        self.method
    }

    /// CRC-32 of the uncompressed bytes, as claimed; verified by [`ZipIndex::read`].
    pub fn crc32(&self) -> u32 {
        self.crc32
    }
}

/// The entries of a zip. It does not borrow the archive, so that it can live beside a memory map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZipIndex {
    entries: Vec<ZipEntry>,
}

impl ZipIndex {
    /// Reads the central directory and every local header of `bytes`, the whole archive.
    ///
    /// # Errors
    ///
    /// - [`ErrorKind::Malformed`]: not a zip; cut; the two headers of an entry disagree; the number of
    ///   entries is not the one declared; a name twice, not UTF-8 though it says so, absolute or climbing by `..`;
    ///   entries that overlap; a size that no compression method reaches.
    /// - [`ErrorKind::Unsupported`]: an encrypted entry, a symbolic link, or a method other than stored and deflate.
    /// - [`ErrorKind::Limit`]: more entries, or a larger one, than `limits` allows.
    pub fn open(bytes: &[u8], limits: &Limits) -> Result<ZipIndex> {
        ZipIndex::open_mapped(bytes, limits, &mut |_| ())
    }

    /// The same for a memory map: `looked_at` is told of every range of an entry's header and data whose header
    /// has been looked at, so that its pages can be given back. A header lies beside every image, and so listing
    /// would else bring a good part of an archive into memory.
    ///
    /// # Errors
    ///
    /// As [`ZipIndex::open`].
    pub fn open_mapped(
        bytes: &[u8],
        limits: &Limits,
        looked_at: &mut dyn FnMut(Range<usize>),
    ) -> Result<ZipIndex> {
        let archive = ZipArchive::from_slice(bytes)
            .map_err(|e| translate(e, "a zip archive with its directory at the end"))?;
        let declared = archive.entries_hint();
        let mut entries = Vec::new();
        let mut records = archive.entries();
        // Counted, not believed: the declared number is only compared in the end.
        let mut count = 0u64;
        while let Some(record) = next_record(&mut records)? {
            count = count.saturating_add(1);
            if count > limits.max_entries {
                let expected = format!("at most {} (max_entries)", limits.max_entries);
                return Err(Error::new(
                    ErrorKind::Limit,
                    format!("{} or more", counted(count, "zip entry")),
                    expected,
                ));
            }
            if !record.is_dir() {
                let entry = read_entry(&archive, &record, limits)?;
                let start = usize::try_from(record.local_header_offset()).unwrap_or(entry.compressed.start);
                looked_at(start..entry.compressed.end);
                entries.push(entry);
            }
        }
        if count != declared {
            return Err(Error::malformed(
                format!("{} in the directory", counted(count, "entry")),
                format!("{declared}, as its end record says"),
            )
            .at(archive.eocd_offset()));
        }
        refuse_duplicates(&entries)?;
        refuse_overlaps(&entries)?;
        Ok(ZipIndex { entries })
    }

    /// All files of the archive, in the order of its directory.
    pub fn entries(&self) -> &[ZipEntry] {
        &self.entries
    }

    /// The uncompressed bytes of entry number `entry`; `bytes` is the archive given to
    /// [`ZipIndex::open`]. A stored entry is borrowed, a deflated one inflated.
    ///
    /// # Errors
    ///
    /// - [`ErrorKind::Malformed`]: bad deflate data, data after its end, a size or CRC-32 that is not the
    ///   declared one, or an archive shorter than when it was opened.
    /// - [`ErrorKind::Argument`]: no such entry.
    pub fn read<'a>(&self, bytes: &'a [u8], entry: usize) -> Result<Cow<'a, [u8]>> {
        let Some(entry) = self.entries.get(entry) else {
            let count = self.entries.len();
            return Err(Error::new(
                ErrorKind::Argument,
                format!("entry number {entry}"),
                format!("less than {count}"),
            ));
        };
        entry.read(bytes).map_err(|e| e.in_entry(&entry.name))
    }
}

impl ZipEntry {
    fn read<'a>(&self, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>> {
        let Some(compressed) = bytes.get(self.compressed_range()) else {
            return Err(Error::malformed(
                format!("an archive of {}", counted(bytes.len(), "byte")),
                format!("at least {}, as when it was opened", self.compressed.end),
            ));
        };
        let data = match self.method {
            Method::Stored => Cow::Borrowed(compressed),
            Method::Deflated => Cow::Owned(self.inflate(compressed)?),
        };
        let found = crc32(&data);
        if found != self.crc32 {
            return Err(Error::malformed(
                format!("data of CRC-32 {found:08x}"),
                format!("{:08x}, as the directory says", self.crc32),
            )
            .at(self.compressed.start));
        }
        Ok(data)
    }

    fn inflate(&self, compressed: &[u8]) -> Result<Vec<u8>> {
        let wrong = |found: String| {
            let expected = format!("deflate data of exactly {}", counted(self.uncompressed_bytes, "byte"));
            Error::malformed(found, expected).at(self.compressed.start)
        };
        // One byte more than declared, so that a stream that goes on is seen to go on.
        let capacity = usize::try_from(self.uncompressed_bytes).ok().and_then(|size| size.checked_add(1));
        let mut data = Vec::new();
        if capacity.is_none_or(|capacity| data.try_reserve_exact(capacity).is_err()) {
            return Err(Error::new(
                ErrorKind::Limit,
                format!("an entry of {}", counted(self.uncompressed_bytes, "byte")),
                "one that fits in memory",
            ));
        }
        let mut inflater = Decompress::new(false);
        let status = inflater
            .decompress_vec(compressed, &mut data, FlushDecompress::Finish)
            .map_err(|e| wrong(e.to_string()))?;
        if inflater.total_out() > self.uncompressed_bytes {
            return Err(wrong("more".into()));
        }
        if status != Status::StreamEnd {
            return Err(wrong(format!("data that stop after {}", inflater.total_out())));
        }
        if inflater.total_out() < self.uncompressed_bytes {
            return Err(wrong(format!("{}", inflater.total_out())));
        }
        let consumed = inflater.total_in();
        if u64::try_from(compressed.len()).ok() != Some(consumed) {
            return Err(wrong(format!(
                "{} of which {consumed} are used",
                counted(compressed.len(), "compressed byte")
            )));
        }
        Ok(data)
    }
}

fn next_record<'a>(records: &mut rawzip::ZipSliceEntries<'a>) -> Result<Option<ZipFileHeaderRecord<'a>>> {
    records.next_entry().map_err(|e| translate(e, "an entry of the zip's central directory"))
}

/// Checks one record of the central directory against `limits` and against its local header.
fn read_entry(
    archive: &ZipSliceArchive<&[u8]>,
    record: &ZipFileHeaderRecord<'_>,
    limits: &Limits,
) -> Result<ZipEntry> {
    let raw_name = record.file_path();
    let entry_name: Cow<'_, str> = match (unicode_path(record), std::str::from_utf8(raw_name.as_bytes())) {
        (Some(name), _) | (None, Ok(name)) => Cow::Borrowed(name),
        (None, Err(_)) if !record.flags().is_utf8() => Cow::Owned(cp437::decode(raw_name.as_bytes())),
        (None, Err(_)) => {
            let found = format!("the entry name {}", raw_name.as_bytes().escape_ascii());
            return Err(Error::malformed(found, "UTF-8").at(record.central_directory_offset()));
        }
    };
    check_entry(archive, record, &entry_name, limits).map_err(|e| e.in_entry(&entry_name))
}

/// The name in the extra field "Unicode Path" (APPNOTE 4.6.9): version 1, the CRC-32 of the name that it replaces, then
/// UTF-8. Where it is of another version or of another name, that of the header counts.
fn unicode_path<'a>(record: &'a ZipFileHeaderRecord<'_>) -> Option<&'a str> {
    let mut fields = record.extra_fields();
    let (_, data) = fields.find(|(id, _)| *id == ExtraFieldId::INFO_ZIP_UNICODE_PATH)?;
    let (crc, name) = data.strip_prefix(&[1])?.split_first_chunk()?;
    let fits = u32::from_le_bytes(*crc) == crc32(record.file_path().as_bytes());
    std::str::from_utf8(name).ok().filter(|name| fits && !name.is_empty())
}

fn check_entry(
    archive: &ZipSliceArchive<&[u8]>,
    record: &ZipFileHeaderRecord<'_>,
    entry_name: &str,
    limits: &Limits,
) -> Result<ZipEntry> {
    let unsupported = |found: String, expected: &'static str| {
        Error::new(ErrorKind::Unsupported, found, expected).at(record.central_directory_offset())
    };
    if let Some(reason) = name::unsafe_reason(entry_name) {
        return Err(Error::malformed(reason, "a relative name").at(record.central_directory_offset()));
    }
    if record.mode().is_symlink() {
        return Err(unsupported("a symbolic link".into(), "a file: a link could lead out of the archive"));
    }
    let flags = record.flags();
    if flags.is_encrypted() || flags.has_strong_encryption() || flags.is_masked() {
        return Err(unsupported("an encrypted entry".into(), "one that is not encrypted"));
    }
    let method = match record.compression_method() {
        CompressionMethod::STORE => Method::Stored,
        CompressionMethod::DEFLATE => Method::Deflated,
        other => {
            let found = format!("compression method {}", other.as_u16());
            return Err(unsupported(found, "0 (stored) or 8 (deflate)"));
        }
    };
    let uncompressed_bytes = record.uncompressed_size_hint();
    let compressed_bytes = record.compressed_size_hint();
    if uncompressed_bytes > limits.max_entry_bytes {
        let expected = format!("at most {} (max_entry_bytes)", limits.max_entry_bytes);
        let found = format!("an entry of {}", counted(uncompressed_bytes, "byte"));
        return Err(Error::new(ErrorKind::Limit, found, expected));
    }
    let most = match method {
        Method::Stored => compressed_bytes,
        Method::Deflated => compressed_bytes.saturating_mul(MAX_DEFLATE_RATIO),
    };
    if uncompressed_bytes > most || (method == Method::Stored && uncompressed_bytes != compressed_bytes) {
        return Err(Error::malformed(
            format!(
                "{} declared for {compressed_bytes} of {method:?} data",
                counted(uncompressed_bytes, "byte")
            ),
            format!("at most {most}, all that they can hold"),
        )
        .at(record.central_directory_offset()));
    }

    let local = archive.get_entry(record.wayfinder()).map_err(|e| {
        translate(e, "a local header and all data of the entry").at(record.local_header_offset())
    })?;
    let header = local.local_header();
    if header.file_path().as_bytes() != record.file_path().as_bytes() {
        return Err(Error::malformed(
            format!("the local name {}", header.file_path().as_bytes().escape_ascii()),
            "the name in the directory",
        )
        .at(record.local_header_offset()));
    }
    if header.compression_method() != record.compression_method() {
        return Err(Error::malformed("another compression method", "the one in the directory")
            .at(record.local_header_offset()));
    }
    let (start, end) = local.compressed_data_range();
    let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
    let Some((start, end)) = range.filter(|&(start, end)| start <= end) else {
        return Err(Error::malformed(format!("data at {start}..{end}"), "a range inside the archive"));
    };
    let directory = usize::try_from(archive.directory_offset()).unwrap_or(usize::MAX);
    if end > directory {
        return Err(Error::malformed(
            format!("data at {start}..{end}"),
            format!("an end before the directory at {directory}"),
        )
        .at(record.central_directory_offset()));
    }
    let crc32 = record.crc32();
    Ok(ZipEntry { name: entry_name.into(), compressed: start..end, uncompressed_bytes, method, crc32 })
}

fn refuse_duplicates(entries: &[ZipEntry]) -> Result<()> {
    let mut names = HashSet::new();
    match entries.iter().find(|entry| !names.insert(entry.name.as_str())) {
        Some(entry) => Err(Error::malformed("two entries of this name", "one").in_entry(&entry.name)),
        None => Ok(()),
    }
}

/// Overlapping data is how a small zip claims to hold the same bytes many times over.
fn refuse_overlaps(entries: &[ZipEntry]) -> Result<()> {
    let mut by_start: Vec<&ZipEntry> = entries.iter().collect();
    by_start.sort_by_key(|entry| (entry.compressed.start, entry.compressed.end));
    for pair in by_start.windows(2) {
        let [first, second] = pair else { continue };
        if second.compressed.start < first.compressed.end {
            return Err(Error::malformed(
                format!("data that overlap those of {:?}", first.name),
                "data of its own",
            )
            .at(second.compressed.start)
            .in_entry(&second.name));
        }
    }
    Ok(())
}

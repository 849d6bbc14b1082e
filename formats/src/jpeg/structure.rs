//! The walk over the markers of a JPEG (ITU-T T.81, annex B).

use std::collections::HashMap;

use super::Header;
use super::frame::{Arrangement, Frame, Scanned};
use super::huffman::{Slot, Table};
use super::marker;
use crate::picture::exif;
use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Limits, Result};

/// A file that is whole.
pub(super) struct Walked {
    pub(super) header: Header,
    pub(super) arrangement: Arrangement,
    /// Bytes up to the end marker, with it.
    pub(super) length: usize,
    /// Where the names of all Adobe segments stand. Decoders judge by them in ways of their own; `rgb` is what counts.
    pub(super) adobe: Vec<usize>,
    /// Three components that are red, green and blue and not YCbCr, as libjpeg and all that is built on it have it.
    pub(super) rgb: bool,
    /// Where the marker stands behind each interval of data, of all scans.
    pub(super) data_ends: Vec<usize>,
    /// Where the id R of the first component stands, in the frame header and in those of scans.
    pub(super) red_ids: Vec<usize>,
}

/// Reads as far as the frame header.
pub(super) fn header(bytes: &[u8], limits: &Limits) -> Result<Header> {
    let mut reader = Reader::new(bytes);
    start(&mut reader)?;
    let mut orientation = 1;
    loop {
        let at = reader.position();
        match marker::next(&mut reader)? {
            code @ (marker::SOF0 | marker::SOF1 | marker::SOF2) => {
                let header = Frame::read(&mut reader, code == marker::SOF2, limits)?.header;
                return Ok(Header { orientation, ..header });
            }
            marker::APP1 => orientation = read_orientation(&mut reader, orientation)?,
            marker::EOI | marker::SOS => {
                return Err(Error::malformed("the end of the headers", "a frame header (SOF)").at(at));
            }
            code => skip(&mut reader, code, at)?,
        }
    }
}

/// Reads the whole file, up to its EOI marker. What follows it (previews, films, notes of the camera) is not the
/// picture's and is not looked at.
pub(super) fn walk(bytes: &[u8], limits: &Limits) -> Result<Walked> {
    let mut reader = Reader::new(bytes);
    start(&mut reader)?;
    let mut frame: Option<Frame> = None;
    let mut restart_interval = 0;
    let mut scans = 0u32;
    let mut orientation = 1;
    let (mut is_jfif, mut adobe, mut transform) = (false, Vec::new(), None);
    let (mut red_ids, mut data_ends) = (Vec::new(), Vec::new());
    let mut tables: HashMap<Slot, Table> = HashMap::new();
    loop {
        let at = reader.position();
        match marker::next(&mut reader)? {
            code @ (marker::SOF0 | marker::SOF1 | marker::SOF2) => {
                if frame.is_some() {
                    return Err(Error::malformed("a second frame header", "one").at(at));
                }
                let read = Frame::read(&mut reader, code == marker::SOF2, limits)?;
                red_ids.extend(read.sampling_at.checked_sub(1).filter(|_| read.ids().eq(*b"RGB")));
                frame = Some(read);
            }
            marker::DHT => {
                let found = Table::read_all(marker::segment(&mut reader)?).map_err(|e| e.at(at))?;
                tables.extend(found);
            }
            marker::DRI => restart_interval = read_restart_interval(&mut reader)?,
            marker::APP1 if frame.is_none() => orientation = read_orientation(&mut reader, orientation)?,
            // What the colours are is settled where the first scan begins.
            marker::APP0 if scans == 0 => is_jfif |= is_jfif_segment(marker::segment(&mut reader)?),
            marker::APP14 => {
                let name = reader.position().saturating_add(2);
                let segment = marker::segment(&mut reader)?;
                if segment.starts_with(b"Adobe") {
                    adobe.push(name);
                    transform = segment.get(11).copied().filter(|_| scans == 0).or(transform);
                }
            }
            marker::SOS => {
                scans = scans.saturating_add(1);
                if scans > limits.max_scans_per_image {
                    let expected = format!("at most {} (max_scans_per_image)", limits.max_scans_per_image);
                    return Err(Error::new(
                        ErrorKind::Limit,
                        format!("{} or more", counted(scans, "scan")),
                        expected,
                    )
                    .at(at));
                }
                let Some(frame) = frame.as_mut() else {
                    return Err(Error::malformed("a scan", "a frame header (SOF) before it").at(at));
                };
                let header_at = reader.position();
                let Scanned { ends, means } = frame.read_scan(&mut reader, restart_interval)?;
                data_ends.extend(ends);
                if let Some(means) = means {
                    let all = means.require_all(bytes, &tables, restart_interval);
                    all.map_err(|error| error.at(header_at))?;
                }
                if !red_ids.is_empty() {
                    // Components of a scan stand in the order of the frame.
                    let first = header_at.saturating_add(3);
                    red_ids.extend(Some(first).filter(|&at| bytes.get(at) == Some(&b'R')));
                }
            }
            marker::EOI => {
                let Some(frame) = frame else {
                    return Err(Error::malformed("the end of the image", "a frame header (SOF)").at(at));
                };
                frame.require_complete(at)?;
                return Ok(Walked {
                    header: Header { orientation, ..frame.header },
                    arrangement: frame.arrangement(),
                    length: reader.position(),
                    adobe,
                    rgb: frame.header.channels == 3 && is_rgb(is_jfif, transform, frame.ids()),
                    data_ends,
                    red_ids,
                });
            }
            code => skip(&mut reader, code, at)?,
        }
    }
}

fn start(reader: &mut Reader<'_>) -> Result<()> {
    match reader.take(2)? {
        [0xFF, marker::SOI] => Ok(()),
        other => Err(Error::malformed(format!("{other:02x?}"), "a JPEG, which starts with ff d8").at(0usize)),
    }
}

/// Steps over a segment that only the decoder reads; refuses every other marker.
fn skip(reader: &mut Reader<'_>, code: u8, at: usize) -> Result<()> {
    match code {
        marker::DHT | marker::DQT | marker::COM | marker::APP0..=marker::APP15 => {
            marker::segment(reader)?;
            Ok(())
        }
        0xC3..=0xCF => {
            let found = format!("the marker ff{code:02x} (lossless, hierarchical or arithmetic coding)");
            Err(Error::new(ErrorKind::Unsupported, found, "a baseline or progressive Huffman JPEG").at(at))
        }
        0xDC => {
            let found = "the number of rows after the first scan (DNL)";
            Err(Error::new(ErrorKind::Unsupported, found, "it in the frame header").at(at))
        }
        _ => Err(Error::malformed(format!("the marker ff{code:02x}"), "a marker that may stand here").at(at)),
    }
}

/// Whether three components are red, green and blue: a file that is JFIF is YCbCr (T.871, 6.1) whatever stands in it,
/// else an Adobe segment says it, else the components' ids do. (Other ids and transforms are taken for YCbCr.)
fn is_rgb(is_jfif: bool, adobe_transform: Option<u8>, ids: impl Iterator<Item = u8>) -> bool {
    match adobe_transform {
        _ if is_jfif => false,
        Some(transform) => transform == 0,
        None => ids.eq(*b"RGB"),
    }
}

/// As libjpeg knows one: the name, and room for what it must hold.
fn is_jfif_segment(segment: &[u8]) -> bool {
    segment.starts_with(b"JFIF\0") && segment.len() >= 14
}

/// The orientation in a segment of Exif or XMP data; the first one that is found counts.
fn read_orientation(reader: &mut Reader<'_>, before: u8) -> Result<u8> {
    let segment = marker::segment(reader)?;
    Ok(if before == 1 { exif::orientation_of_segment(segment) } else { before })
}

fn read_restart_interval(reader: &mut Reader<'_>) -> Result<u64> {
    let at = reader.position();
    match marker::segment(reader)? {
        [high, low] => Ok(u64::from(u16::from_be_bytes([*high, *low]))),
        other => {
            Err(Error::malformed(format!("a restart interval of {}", counted(other.len(), "byte")), "2")
                .at(at))
        }
    }
}

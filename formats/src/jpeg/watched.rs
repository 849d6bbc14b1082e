//! The decoder held against the ends of a picture's data: it goes on with zeros where data are missing, and says
//! nothing of data that are left over.

use std::cell::Cell;

use zune_jpeg::zune_core::bytestream::{ZByteIoError, ZByteReaderTrait, ZSeekFrom};

use super::marker;
use super::structure::Walked;
use crate::Error;
use crate::words::counted;

/// Bits that are all set, which is never a code of a Huffman table (T.81, annex C). Where data are missing, the decoder
/// comes upon them instead of the zeros that it would go on with, which are the codes of something.
const NO_CODE: [u8; 2] = [0xFF, 0];

/// How often before a restart marker: as many bits as a coefficient and a code have at most.
const AT_RESTART: usize = 4;

/// How often at the end of a scan, where bits that refine coefficients may be read before a code.
const AT_END: usize = 16;

/// A picture with [`NO_CODE`] where its data end, and where the last of them do.
pub(super) struct Marked {
    pub(super) bytes: Vec<u8>,
    end: usize,
}

impl Marked {
    /// `picture` ends with its end marker. Its walk found the data's ends `later` bytes further to the front.
    pub(super) fn new(picture: &[u8], walked: &Walked, later: usize) -> Marked {
        let mut bytes = Vec::with_capacity(picture.len().saturating_add(2 * AT_END));
        let (mut copied, mut end, mut scans) = (0, 0, 0usize);
        for at in &walked.data_ends {
            let at = at.saturating_add(later);
            bytes.extend_from_slice(picture.get(copied..at).unwrap_or_default());
            copied = at;
            end = bytes.len();
            let restart = matches!(picture.get(at.saturating_add(1)), Some(&(marker::RST0..=marker::RST7)));
            scans = scans.saturating_add(usize::from(!restart));
            let times = match restart {
                true => AT_RESTART,
                // Behind the first of several scans the decoder wants the marker at once.
                false if scans == 1 && walked.header.progressive => 0,
                false => AT_END,
            };
            bytes.extend(NO_CODE.iter().cycle().take(times.saturating_mul(2)));
        }
        bytes.extend_from_slice(picture.get(copied..).unwrap_or_default());
        Marked { bytes, end }
    }

    /// A picture whose data have been read to their last bit.
    pub(super) fn exact(bytes: Vec<u8>) -> Marked {
        Marked { bytes, end: 0 }
    }

    /// With this byte at a place before all data.
    pub(super) fn with(mut self, at: usize, byte: u8) -> Marked {
        if let Some(place) = self.bytes.get_mut(at) {
            *place = byte;
        }
        self
    }

    /// Refuses data that the decoder left unread. Fewer than 16 bytes may have been in its buffers, and bytes that are
    /// all 0 or all 0xFF fill up a file.
    pub(super) fn require_all_read(&self, refilled: usize) -> crate::Result<()> {
        let left = self.bytes.get(refilled.saturating_add(READ_AHEAD)..self.end).unwrap_or_default();
        if left.iter().all(|&byte| byte == 0) || left.iter().all(|&byte| byte == 0xFF) {
            return Ok(());
        }
        let found = format!("{} of data after the last block", counted(left.len(), "byte"));
        Err(Error::malformed(found, "none; the frame header states fewer rows than the data hold"))
    }
}

/// Where a byte 0xFF is among the next four, the decoder reads these anew, one by one, with the zeros behind each.
const READ_AHEAD: usize = 4;

/// A reader that tells how far bits were taken.
pub(super) struct Watched<'a> {
    bytes: &'a [u8],
    position: usize,
    /// The end of the last four bytes that were read at once, as bits are.
    refilled: &'a Cell<usize>,
}

impl<'a> Watched<'a> {
    pub(super) fn new(bytes: &'a [u8], refilled: &'a Cell<usize>) -> Self {
        Watched { bytes, position: 0, refilled }
    }

    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.position..).unwrap_or_default()
    }
}

impl ZByteReaderTrait for Watched<'_> {
    #[inline(always)]
    fn read_byte_no_error(&mut self) -> u8 {
        let byte = self.bytes.get(self.position).copied().unwrap_or_default();
        self.position = self.position.saturating_add(1);
        byte
    }

    #[inline(always)]
    fn read_exact_bytes(&mut self, buf: &mut [u8]) -> Result<(), ZByteIoError> {
        self.peek_exact_bytes(buf)?;
        self.position = self.position.saturating_add(buf.len());
        if buf.len() == READ_AHEAD {
            self.refilled.set(self.position);
        }
        Ok(())
    }

    fn read_bytes(&mut self, buf: &mut [u8]) -> Result<usize, ZByteIoError> {
        let length = self.peek_bytes(buf)?;
        self.position = self.position.saturating_add(length);
        Ok(length)
    }

    fn peek_bytes(&mut self, buf: &mut [u8]) -> Result<usize, ZByteIoError> {
        let length = buf.len().min(self.rest().len());
        for (to, from) in buf.iter_mut().zip(self.rest()) {
            *to = *from;
        }
        Ok(length)
    }

    #[inline(always)]
    fn peek_exact_bytes(&mut self, buf: &mut [u8]) -> Result<(), ZByteIoError> {
        let Some(found) = self.rest().get(..buf.len()) else {
            return Err(ZByteIoError::NotEnoughBytes(self.rest().len(), buf.len()));
        };
        buf.copy_from_slice(found);
        Ok(())
    }

    fn z_seek(&mut self, from: ZSeekFrom) -> Result<u64, ZByteIoError> {
        let place = match from {
            ZSeekFrom::Start(place) => usize::try_from(place).ok(),
            ZSeekFrom::End(by) => {
                isize::try_from(by).ok().and_then(|by| self.bytes.len().checked_add_signed(by))
            }
            ZSeekFrom::Current(by) => {
                isize::try_from(by).ok().and_then(|by| self.position.checked_add_signed(by))
            }
        };
        self.position = place.ok_or(ZByteIoError::SeekError("a place before the start"))?;
        self.z_position()
    }

    #[inline(always)]
    fn is_eof(&mut self) -> Result<bool, ZByteIoError> {
        Ok(self.position >= self.bytes.len())
    }

    fn z_position(&mut self) -> Result<u64, ZByteIoError> {
        u64::try_from(self.position).map_err(ZByteIoError::from)
    }

    fn read_remaining(&mut self, sink: &mut Vec<u8>) -> Result<usize, ZByteIoError> {
        let rest = self.rest();
        sink.extend_from_slice(rest);
        self.position = self.bytes.len().max(self.position);
        Ok(rest.len())
    }
}

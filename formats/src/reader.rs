//! A cursor over a byte slice whose every read is checked.

use crate::words::counted;
use crate::{Error, Result};

/// Reads fields one after another, big-endian unless the name says `le`; errors name the byte where the missing field starts.
#[derive(Debug, Clone)]
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Reader { bytes, position: 0 }
    }

    pub(crate) fn position(&self) -> usize {
        self.position
    }

    /// What has not been read yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.position..).unwrap_or(&[])
    }

    /// The next `len` bytes.
    pub(crate) fn take(&mut self, len: usize) -> Result<&'a [u8]> {
        let end = self.position.checked_add(len);
        let taken = end.and_then(|end| self.bytes.get(self.position..end));
        let (Some(taken), Some(end)) = (taken, end) else {
            let left = self.rest().len();
            return Err(Error::malformed(
                format!("the end of the data after {}", counted(left, "more byte")),
                counted(len, "more byte").to_string(),
            )
            .at(self.position));
        };
        self.position = end;
        Ok(taken)
    }

    pub(crate) fn u8(&mut self) -> Result<u8> {
        let byte = self.take(1)?;
        Ok(byte.first().copied().unwrap_or_default())
    }

    pub(crate) fn u16(&mut self) -> Result<u16> {
        let pair = self.take(2)?;
        Ok(pair.iter().fold(0, |value, &byte| (value << 8) | u16::from(byte)))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(crate) fn u32_le(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(crate) fn i32_le(&mut self) -> Result<i32> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(crate) fn u64_le(&mut self) -> Result<u64> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    pub(crate) fn f32_le(&mut self) -> Result<f32> {
        Ok(f32::from_le_bytes(self.array()?))
    }
}

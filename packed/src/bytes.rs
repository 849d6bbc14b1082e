//! Little-endian numbers out of bytes and into them.

use crate::error::{Error, Result};

/// Reads bytes from the front.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes that were read.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// Bytes that are left.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(taken) = rest.get(..count) else {
            let found = format!("the end of the file after {} bytes", rest.len());
            return Err(Error::new(found, format!("{count} bytes more")).at(self.at));
        };
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(crate) fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub(crate) fn u16(&mut self) -> Result<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32> {
        self.array().map(f32::from_le_bytes)
    }

    /// UTF-8 of so many bytes.
    pub(crate) fn text(&mut self, length: usize) -> Result<String> {
        let at = self.at;
        let bytes = self.take(length)?;
        let text = std::str::from_utf8(bytes);
        text.map(str::to_owned).map_err(|_| Error::new("bytes that are no UTF-8", "a text").at(at))
    }
}

/// Appends a text with its length in one byte.
///
/// # Errors
/// Where it has more than 255 bytes.
pub(crate) fn push_short(bytes: &mut Vec<u8>, text: &str) -> Result<()> {
    let long = |_| Error::new(format!("a name of {} bytes", text.len()), "at most 255");
    bytes.push(u8::try_from(text.len()).map_err(long)?);
    bytes.extend(text.as_bytes());
    Ok(())
}

/// Appends a text with its length in two bytes.
///
/// # Errors
/// Where it has more than 65535 bytes.
pub(crate) fn push_long(bytes: &mut Vec<u8>, text: &str) -> Result<()> {
    let long = |_| Error::new(format!("a text of {} bytes", text.len()), "at most 65535");
    bytes.extend(u16::try_from(text.len()).map_err(long)?.to_le_bytes());
    bytes.extend(text.as_bytes());
    Ok(())
}

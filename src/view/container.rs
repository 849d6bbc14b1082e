//! Arrays for the page: a header that lists them, and their values.
//!
//! | bytes | |
//! | --- | --- |
//! | 4 | length n of the header, u32 |
//! | n | the header, JSON: what it says of the material, and `arrays`: name to `type`, `shape` and `offset` |
//! | rest | the arrays one after another, each at a multiple of 8 behind the header |
//!
//! All of it is little-endian and compressed by gzip.

use std::io::Write;

use bytemuck::Pod;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Map, Value, json};

use crate::error::{Error, Result};

/// Where every array begins.
const ALIGNMENT: usize = 8;

/// Arrays and what is said of them.
#[derive(Default)]
pub(super) struct Container {
    header: Map<String, Value>,
    arrays: Map<String, Value>,
    bytes: Vec<u8>,
}

/// A type of elements that the page knows by its name.
pub(super) trait Element: Pod {
    const NAME: &'static str;
}

macro_rules! elements {
    ($($element:ty),*) => { $(impl Element for $element { const NAME: &'static str = stringify!($element); })* };
}

elements!(i8, u8, i16, u16, i32, u32, f64);

impl Container {
    /// Says something of the material.
    pub(super) fn say(&mut self, name: &str, value: Value) {
        self.header.insert(name.to_owned(), value);
    }

    /// Adds an array.
    pub(super) fn put<T: Element>(&mut self, name: &str, shape: &[usize], values: &[T]) {
        self.bytes.resize(self.bytes.len().next_multiple_of(ALIGNMENT), 0);
        let array = json!({"type": T::NAME, "shape": shape, "offset": self.bytes.len()});
        self.arrays.insert(name.to_owned(), array);
        self.bytes.extend_from_slice(bytemuck::cast_slice(values));
    }

    /// All of it as the page reads it.
    ///
    /// # Errors
    /// Where there is no memory.
    pub(super) fn packed(mut self) -> Result<Vec<u8>> {
        self.header.insert("arrays".to_owned(), Value::Object(self.arrays));
        let mut header = Value::Object(self.header).to_string().into_bytes();
        // Spaces are nothing to JSON; with the length before it the header ends where arrays may begin.
        let end = (size_of::<u32>() + header.len()).next_multiple_of(ALIGNMENT);
        header.resize(end - size_of::<u32>(), b' ');
        let failed = |error: std::io::Error| Error::internal(error.to_string());
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&(header.len() as u32).to_le_bytes()).map_err(failed)?;
        encoder.write_all(&header).map_err(failed)?;
        encoder.write_all(&self.bytes).map_err(failed)?;
        encoder.finish().map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::io::Read;

    use super::*;

    #[test]
    fn arrays_begin_where_the_header_says() {
        let mut container = Container::default();
        container.say("name", json!("a \u{2028} name"));
        container.put("bytes", &[3], &[1u8, 2, 3]);
        container.put("words", &[2], &[258u16, 7]);
        let packed = container.packed().unwrap();
        let mut bytes = Vec::new();
        flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!((4 + length) % ALIGNMENT, 0);
        let offset = header["arrays"]["words"]["offset"].as_u64().unwrap() as usize;
        assert_eq!(bytes[4 + length + offset..], [2, 1, 7, 0]);
    }
}

//! Attributes: text of fixed length, and numbers.
//!
//! Text of variable length is not read: it lies in a heap that bears no checksum, with a length there and another in the
//! attribute, and what the C library does where they disagree is not to be relied on.

use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenAscii};
use hdf5::{Attribute, Location};
use serde_json::Value;

use crate::error::{Error, Result};
use crate::words::counted;

/// Longest text of one attribute, bytes: HDF5 keeps small attributes in a header of at most 64 KiB.
pub(super) const MAX_TEXT_BYTES: usize = 60_000;

/// Longest text of an attribute with several, bytes each.
const MAX_NAME_BYTES: usize = 256;

/// Most texts of an attribute with several.
const MAX_NAMES: usize = 1024;

/// Attributes of a file or a dataset, with errors that say where they are from.
pub(super) struct Attributes<'a> {
    location: &'a Location,
    /// Path, and the dataset if it is one's.
    place: String,
}

impl<'a> Attributes<'a> {
    pub(super) fn of(location: &'a Location, place: String) -> Self {
        Self { location, place }
    }

    fn error(&self, name: &str, what: impl std::fmt::Display) -> Error {
        Error::input(format!("{}: attribute {name}: {what}", self.place))
    }

    fn open(&self, name: &str) -> Result<(Attribute, TypeDescriptor)> {
        let attribute = self.location.attr(name).map_err(|error| self.error(name, error))?;
        let kind = attribute.dtype().and_then(|kind| kind.to_descriptor());
        Ok((attribute, kind.map_err(|error| self.error(name, error))?))
    }

    /// Names of all attributes.
    pub(super) fn names(&self) -> Result<Vec<String>> {
        self.location
            .attr_names()
            .map_err(|error| Error::input(format!("{}: attributes: {error}", self.place)))
    }

    /// A number or a text; nothing where it is of a type that is not read.
    pub(super) fn value(&self, name: &str) -> Result<Option<Value>> {
        let (attribute, kind) = self.open(name)?;
        let value = match kind {
            TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => {
                attribute.read_scalar::<i64>().map(Value::from)
            }
            TypeDescriptor::Float(_) => attribute.read_scalar::<f64>().map(Value::from),
            TypeDescriptor::FixedAscii(_) | TypeDescriptor::FixedUnicode(_) => {
                return self.text(name).map(|text| Some(text.into()));
            }
            _ => return Ok(None),
        };
        value.map(Some).map_err(|error| self.error(name, error))
    }

    /// The same, of an attribute that must be of a type that is read.
    pub(super) fn required(&self, name: &str) -> Result<Value> {
        match self.value(name)? {
            Some(value) => Ok(value),
            None => Err(self.no_text(name, &self.open(name)?.1, MAX_TEXT_BYTES)),
        }
    }

    /// One text.
    pub(super) fn text(&self, name: &str) -> Result<String> {
        let (attribute, kind) = self.open(name)?;
        let fail = |error: hdf5::Error| self.error(name, error);
        let bytes = match kind {
            TypeDescriptor::FixedUnicode(n) if n <= MAX_TEXT_BYTES => {
                let text = attribute.read_scalar::<FixedUnicode<MAX_TEXT_BYTES>>().map_err(fail)?;
                text.as_bytes().to_vec()
            }
            TypeDescriptor::FixedAscii(n) if n <= MAX_TEXT_BYTES => {
                let text = attribute.read_scalar::<FixedAscii<MAX_TEXT_BYTES>>().map_err(fail)?;
                text.as_bytes().to_vec()
            }
            _ => return Err(self.no_text(name, &kind, MAX_TEXT_BYTES)),
        };
        String::from_utf8(bytes).map_err(|error| self.error(name, error))
    }

    /// A list of texts.
    pub(super) fn texts(&self, name: &str) -> Result<Vec<String>> {
        let (attribute, kind) = self.open(name)?;
        let fail = |error: hdf5::Error| self.error(name, error);
        let shape = attribute.space().map_err(fail)?.shape();
        if shape.len() != 1 || shape.iter().any(|&n| n > MAX_NAMES) {
            return Err(
                self.error(name, format!("got the shape {shape:?}, expected up to {MAX_NAMES} names"))
            );
        }
        let texts: Vec<Vec<u8>> = match kind {
            TypeDescriptor::FixedUnicode(n) if n <= MAX_NAME_BYTES => {
                let texts = attribute.read_raw::<FixedUnicode<MAX_NAME_BYTES>>().map_err(fail)?;
                texts.iter().map(|text| text.as_bytes().to_vec()).collect()
            }
            TypeDescriptor::FixedAscii(n) if n <= MAX_NAME_BYTES => {
                let texts = attribute.read_raw::<FixedAscii<MAX_NAME_BYTES>>().map_err(fail)?;
                texts.iter().map(|text| text.as_bytes().to_vec()).collect()
            }
            _ => return Err(self.no_text(name, &kind, MAX_NAME_BYTES)),
        };
        let utf8 = |bytes| String::from_utf8(bytes).map_err(|error| self.error(name, error));
        texts.into_iter().map(utf8).collect()
    }

    fn no_text(&self, name: &str, kind: &TypeDescriptor, limit: usize) -> Error {
        self.error(
            name,
            format!("got the type {kind}, expected text of a fixed length up to {}", counted(limit, "byte")),
        )
        .hint("in h5py: attrs[name] = numpy.bytes_(text.encode())")
    }
}

/// Writes an attribute: text as text, numbers as numbers, everything else as JSON text.
pub(super) fn write(location: &Location, name: &str, value: &Value) -> std::result::Result<(), hdf5::Error> {
    match value {
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(number), _) => location.new_attr::<i64>().create(name)?.write_scalar(&number),
            (None, number) => {
                location.new_attr::<f64>().create(name)?.write_scalar(&number.unwrap_or(f64::NAN))
            }
        },
        Value::String(text) => write_text(location, name, text),
        other => write_text(location, name, &other.to_string()),
    }
}

fn write_text(location: &Location, name: &str, text: &str) -> std::result::Result<(), hdf5::Error> {
    let held: FixedUnicode<MAX_TEXT_BYTES> = text.parse().map_err(|_| {
        hdf5::Error::from(format!(
            "attribute {name} has {}, expected at most {MAX_TEXT_BYTES}",
            counted(text.len(), "byte")
        ))
    })?;
    let kind = TypeDescriptor::FixedUnicode(text.len().max(1));
    location.new_attr_builder().empty_as(&kind).create(name)?.write_scalar(&held)
}

/// Writes a list of texts.
pub(super) fn write_texts(
    location: &Location,
    name: &str,
    texts: &[impl AsRef<str>],
) -> std::result::Result<(), hdf5::Error> {
    let held: std::result::Result<Vec<FixedUnicode<MAX_NAME_BYTES>>, _> =
        texts.iter().map(|text| text.as_ref().parse()).collect();
    let held = held.map_err(|_| {
        hdf5::Error::from(format!("attribute {name} has a name of more than {MAX_NAME_BYTES} bytes"))
    })?;
    let longest = texts.iter().map(|text| text.as_ref().len()).max().unwrap_or(0).max(1);
    let kind = TypeDescriptor::FixedUnicode(longest);
    location.new_attr_builder().empty_as(&kind).shape(texts.len()).create(name)?.write_raw(&held[..])
}

/// Names the dimensions of a dataset. HDF5's dimension scales want these texts to be of variable length, and other
/// readers fall over others; they are not read here.
pub(super) fn write_labels(location: &Location, names: &[&str]) -> std::result::Result<(), hdf5::Error> {
    let names: std::result::Result<Vec<VarLenAscii>, _> = names.iter().map(VarLenAscii::from_ascii).collect();
    let names = names.map_err(|error| hdf5::Error::from(error.to_string()))?;
    location.new_attr::<VarLenAscii>().shape(names.len()).create("DIMENSION_LABELS")?.write_raw(&names[..])
}

//! The header: magic bytes, version, and a Python dictionary of three keys.

use crate::reader::Reader;
use crate::words::counted;
use crate::{Error, ErrorKind, Result};

const MAGIC: &[u8] = b"\x93NUMPY";

/// Longest dictionary, bytes; numpy itself reads no more than 10 000 unless told to.
const MAX_DICTIONARY: usize = 10_000;

/// Most axes of an array; numpy has at most 64.
const MAX_AXES: usize = 64;

/// Data starts at a multiple of this.
const ALIGNMENT: usize = 64;

/// Type of one element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    U8,
    U16,
    F16,
    F32,
    F64,
}

impl Scalar {
    pub(super) fn bytes(self) -> usize {
        match self {
            Scalar::U8 => 1,
            Scalar::U16 | Scalar::F16 => 2,
            Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// As in numpy's type strings.
    pub(super) fn code(self) -> &'static str {
        match self {
            Scalar::U8 => "u1",
            Scalar::U16 => "u2",
            Scalar::F16 => "f2",
            Scalar::F32 => "f4",
            Scalar::F64 => "f8",
        }
    }
}

/// What the header says, and where the data starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) scalar: Scalar,
    pub(super) big_endian: bool,
    pub(super) shape: Vec<u64>,
    /// Bytes before the data.
    pub(super) length: usize,
}

impl Header {
    /// Reads the header of an array in C order; nothing is said of the data yet.
    pub(super) fn read(bytes: &[u8]) -> Result<Header> {
        let mut reader = Reader::new(bytes);
        if reader.take(MAGIC.len())? != MAGIC {
            return Err(
                Error::malformed("other bytes", "\\x93NUMPY, the start of an array of numpy").at(0usize)
            );
        }
        let (major, minor) = (reader.u8()?, reader.u8()?);
        let length = match (major, minor) {
            (1, 0) => u64::from(reader.u16()?.swap_bytes()),
            (2 | 3, 0) => u64::from(reader.u32_le()?),
            _ => {
                let found = format!("version {major}.{minor} of the format");
                return Err(Error::new(ErrorKind::Unsupported, found, "1.0, 2.0 or 3.0").at(MAGIC.len()));
            }
        };
        let start = reader.position();
        let length =
            usize::try_from(length).ok().filter(|&length| length <= MAX_DICTIONARY).ok_or_else(|| {
                let found = format!("a header of {}", counted(length, "byte"));
                Error::new(ErrorKind::Limit, found, "at most 10000 bytes, as numpy reads").at(start)
            })?;
        let dictionary = reader.take(length)?;
        let mut parser = Parser { bytes: dictionary, at: 0, start };
        let header = parser.dictionary()?;
        Ok(Header { length: reader.position(), ..header })
    }

    /// Number of elements; `None` if it does not fit.
    pub(super) fn elements(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |product, &side| product.checked_mul(side))
    }

    /// The bytes of the data, which must be all that follows the header.
    pub(super) fn data<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8]> {
        let data = bytes.get(self.length..).unwrap_or(&[]);
        let expected = self.elements().and_then(|n| n.checked_mul(u64::try_from(self.scalar.bytes()).ok()?));
        if expected.is_none() || expected != u64::try_from(data.len()).ok() {
            let found = format!(
                "{} of data for the shape {:?} of {}",
                counted(data.len(), "byte"),
                self.shape,
                self.scalar.code()
            );
            let expected =
                expected.map_or("a shape that fits into memory".to_owned(), |n| counted(n, "byte"));
            return Err(Error::malformed(found, expected).at(self.length));
        }
        Ok(data)
    }
}

/// Header of version 1.0 of a little-endian array in C order. It is aligned as numpy's own.
pub(super) fn write(shape: &[u64], scalar: Scalar) -> Vec<u8> {
    let order = if scalar.bytes() == 1 { '|' } else { '<' };
    let sides: Vec<String> = shape.iter().map(|side| format!("{side},")).collect();
    let text = format!(
        "{{'descr': '{order}{}', 'fortran_order': False, 'shape': ({}), }}",
        scalar.code(),
        sides.join(" ")
    );
    // Magic, version and length take 10 bytes, the line feed one.
    let unpadded = text.len().saturating_add(11);
    let padding = unpadded.next_multiple_of(ALIGNMENT).saturating_sub(unpadded);
    // An array of few axes: far below 65536.
    let length = u16::try_from(text.len().saturating_add(padding).saturating_add(1)).unwrap_or(u16::MAX);
    let mut header = Vec::from(MAGIC);
    header.extend([1, 0]);
    header.extend(length.to_le_bytes());
    header.extend(text.bytes());
    header.extend(std::iter::repeat_n(b' ', padding));
    header.push(b'\n');
    header
}

/// Elements of `N` bytes, of either byte order.
pub(super) fn elements<const N: usize, T>(
    data: &[u8],
    big_endian: bool,
    little: impl Fn([u8; N]) -> T,
    big: impl Fn([u8; N]) -> T,
) -> Vec<T> {
    let (elements, _) = data.as_chunks();
    if big_endian {
        elements.iter().copied().map(big).collect()
    } else {
        elements.iter().copied().map(little).collect()
    }
}

/// Reads the dictionary: strings without escapes, True and False, and a tuple of whole numbers. Nothing nests.
struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Where the dictionary is in the file.
    start: usize,
}

impl<'a> Parser<'a> {
    fn dictionary(&mut self) -> Result<Header> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        self.expect(b'{', "{, the start of a dictionary")?;
        while !self.skip(b'}') {
            let at = self.at;
            let key = self.string()?;
            self.expect(b':', ": after a key")?;
            let twice = match key {
                "descr" => descr.replace(self.descr()?).is_some(),
                "fortran_order" => fortran.replace(self.order()?).is_some(),
                "shape" => shape.replace(self.tuple()?).is_some(),
                _ => return Err(self.wrong(at, "descr, fortran_order and shape")),
            };
            if twice {
                return Err(self.wrong(at, "every key once"));
            }
            if !self.skip(b',') {
                self.expect(b'}', ", or } after a value")?;
                break;
            }
        }
        self.skip_spaces();
        if self.at < self.bytes.len() {
            return Err(self.wrong(self.at, "nothing but spaces after the dictionary"));
        }
        let (Some((scalar, big_endian)), Some(fortran), Some(shape)) = (descr, fortran, shape) else {
            return Err(self.wrong(self.at, "the keys descr, fortran_order and shape"));
        };
        if fortran {
            let expected = "C order, the last axis fastest (numpy.ascontiguousarray makes it)";
            return Err(
                Error::new(ErrorKind::Unsupported, "an array in Fortran order", expected).at(self.start)
            );
        }
        Ok(Header { scalar, big_endian, shape, length: 0 })
    }

    fn descr(&mut self) -> Result<(Scalar, bool)> {
        self.skip_spaces();
        let at = self.at;
        let text = if self.peek() == Some(b'[') { "a structured type" } else { self.string()? };
        let (order, code) = text.split_at_checked(1).unwrap_or((text, ""));
        let known = [Scalar::U8, Scalar::U16, Scalar::F16, Scalar::F32, Scalar::F64];
        let scalar = known.into_iter().find(|scalar| scalar.code() == code);
        match (scalar, order) {
            (Some(scalar), "<" | ">") => Ok((scalar, order == ">")),
            (Some(Scalar::U8), "|") => Ok((Scalar::U8, false)),
            _ => {
                let expected = "uint8, uint16, float16, float32 or float64 of either byte order";
                let at = self.start.saturating_add(at);
                Err(Error::new(ErrorKind::Unsupported, format!("the type {text:?}"), expected).at(at))
            }
        }
    }

    fn order(&mut self) -> Result<bool> {
        self.skip_spaces();
        let at = self.at;
        let rest = self.bytes.get(at..).unwrap_or(&[]);
        let (word, value) = if rest.starts_with(b"True") { ("True", true) } else { ("False", false) };
        if !rest.starts_with(word.as_bytes()) {
            return Err(self.wrong(at, "True or False"));
        }
        self.at = at.saturating_add(word.len());
        Ok(value)
    }

    fn tuple(&mut self) -> Result<Vec<u64>> {
        let mut sides = Vec::new();
        self.expect(b'(', "(, the start of a shape")?;
        while !self.skip(b')') {
            self.skip_spaces();
            let at = self.at;
            let digits = self.while_next(|byte| byte.is_ascii_digit());
            let side = std::str::from_utf8(digits).ok().and_then(|digits| digits.parse().ok());
            let side = side.filter(|_| sides.len() < MAX_AXES);
            sides.push(side.ok_or_else(|| self.wrong(at, "at most 64 whole numbers of at most 64 bits"))?);
            if !self.skip(b',') {
                self.expect(b')', ", or ) after a number")?;
                break;
            }
        }
        Ok(sides)
    }

    fn string(&mut self) -> Result<&'a str> {
        self.skip_spaces();
        let at = self.at;
        let quote = self.peek().filter(|byte| matches!(byte, b'\'' | b'"'));
        let quote = quote.ok_or_else(|| self.wrong(at, "a string"))?;
        self.at = at.saturating_add(1);
        let text = self.while_next(|byte| byte != quote && byte != b'\\');
        match std::str::from_utf8(text) {
            Ok(text) if self.peek() == Some(quote) => {
                self.at = self.at.saturating_add(1);
                Ok(text)
            }
            _ => Err(self.wrong(at, "a string without escapes")),
        }
    }

    fn expect(&mut self, byte: u8, expected: &'static str) -> Result<()> {
        if self.skip(byte) { Ok(()) } else { Err(self.wrong(self.at, expected)) }
    }

    /// Steps over spaces, and over this byte if it is the next one; whether it was.
    fn skip(&mut self, byte: u8) -> bool {
        self.skip_spaces();
        let found = self.peek() == Some(byte);
        self.at = self.at.saturating_add(usize::from(found));
        found
    }

    fn skip_spaces(&mut self) {
        self.while_next(|byte| byte.is_ascii_whitespace());
    }

    fn while_next(&mut self, wanted: impl Fn(u8) -> bool) -> &'a [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        let length = rest.iter().position(|&byte| !wanted(byte)).unwrap_or(rest.len());
        self.at = self.at.saturating_add(length);
        rest.get(..length).unwrap_or(&[])
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn wrong(&self, at: usize, expected: &'static str) -> Error {
        let rest = self.bytes.get(at..).unwrap_or(&[]);
        let shown = String::from_utf8_lossy(rest.get(..20).unwrap_or(rest)).into_owned();
        Error::malformed(format!("{shown:?} in the header"), expected).at(self.start.saturating_add(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of version 1.0 with this dictionary and no data.
    fn file(dictionary: &str) -> Vec<u8> {
        let length = u16::try_from(dictionary.len()).unwrap().to_le_bytes();
        [MAGIC, &[1, 0], &length, dictionary.as_bytes()].concat()
    }

    fn read(dictionary: &str) -> Result<Header> {
        Header::read(&file(dictionary))
    }

    #[test]
    fn dictionaries_in_any_order_and_spacing() {
        let header = read("{'descr': '>f2', 'fortran_order': False, 'shape': (3, 4,), }   \n").unwrap();
        assert_eq!((header.scalar, header.big_endian, header.shape), (Scalar::F16, true, vec![3, 4]));
        let header = read("{\"shape\":(),\"descr\":\"|u1\",\"fortran_order\":False}").unwrap();
        assert_eq!(
            (header.scalar, header.shape.as_slice(), header.elements()),
            (Scalar::U8, &[][..], Some(1))
        );
        assert_eq!(read("{'descr': '<f8', 'fortran_order': False, 'shape': (7)}").unwrap().shape, [7]);
    }

    #[test]
    fn versions_two_and_three_have_longer_lengths() {
        let text = "{'descr': '<u2', 'fortran_order': False, 'shape': (2, 3), }\n";
        for version in [2, 3] {
            let mut bytes = [MAGIC, &[version, 0]].concat();
            bytes.extend(u32::try_from(text.len()).unwrap().to_le_bytes());
            bytes.extend(text.bytes());
            let header = Header::read(&bytes).unwrap();
            assert_eq!((header.shape, header.length), (vec![2, 3], bytes.len()));
        }
        let error = Header::read(&[MAGIC, &[4, 0, 0, 0]].concat()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let rest = "'fortran_order': False, 'shape': (2, 3), }";
        for (dictionary, reason, at) in [
            ("".to_owned(), "{, the start", 10),
            (format!("{{'descr': '<f4', {rest} x"), "nothing but spaces", 70),
            (format!("{{{rest}"), "the keys", 53),
            (format!("{{'descr': '<f4', 'descr': '<f4', {rest}"), "every key once", 27),
            (format!("{{'other': '<f4', {rest}"), "descr, fortran_order", 11),
            (format!("{{'descr' '<f4', {rest}"), ": after", 19),
            ("{'descr': '<f4', 'fortran_order': 0".to_owned(), "True or False", 44),
            ("{'shape': (-1,)".to_owned(), "whole numbers", 21),
            ("{'shape': (99999999999999999999,)".to_owned(), "64 bits", 21),
            (format!("{{'shape': ({})", "1,".repeat(65)), "at most 64", 149),
            ("{'descr': '<f4".to_owned(), "without escapes", 20),
            ("{'de\\x73cr': '<f4'".to_owned(), "without escapes", 11),
        ] {
            let error = read(&dictionary).unwrap_err();
            assert!(error.to_string().contains(reason), "{dictionary}: {error}");
            assert_eq!(
                (error.kind(), error.offset()),
                (ErrorKind::Malformed, Some(at)),
                "{dictionary}: {error}"
            );
        }
    }

    #[test]
    fn what_is_not_read_is_refused_with_a_reason() {
        for (descr, order, reason) in [
            ("'<f4'", "True", "ascontiguousarray"),
            ("'<i4'", "False", "<i4"),
            ("'|O'", "False", "|O"),
            ("'|f4'", "False", "|f4"),
            ("''", "False", "the type \"\""),
            ("[('a', '<f4')]", "False", "structured"),
        ] {
            let error = read(&format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': (1,), }}"))
                .unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Unsupported);
            assert!(error.to_string().contains(reason), "{error}");
        }
    }

    #[test]
    fn a_claimed_length_is_not_believed() {
        let mut bytes = [MAGIC, &[2, 0]].concat();
        bytes.extend(u32::MAX.to_le_bytes());
        assert_eq!(Header::read(&bytes).unwrap_err().kind(), ErrorKind::Limit);
        let error = Header::read(&[MAGIC, &[1, 0, 0x10, 0x27]].concat()).unwrap_err();
        assert_eq!((error.kind(), error.offset()), (ErrorKind::Malformed, Some(10)));
    }

    #[test]
    fn written_headers_are_aligned_and_read_back() {
        for shape in [&[][..], &[5], &[81, 81, 256, 256, 3], &[u64::MAX; 5]] {
            for scalar in [Scalar::U8, Scalar::U16, Scalar::F16, Scalar::F32, Scalar::F64] {
                let bytes = write(shape, scalar);
                assert_eq!((bytes.len() % 64, bytes.last()), (0, Some(&b'\n')));
                let header = Header::read(&bytes).unwrap();
                assert_eq!(
                    (header.shape.as_slice(), header.scalar, header.big_endian),
                    (shape, scalar, false)
                );
                assert_eq!(header.length, bytes.len());
            }
        }
    }
}

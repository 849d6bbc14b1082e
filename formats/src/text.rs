//! Text files as people's programs write them: UTF-8, or UTF-16 with a mark.

use std::borrow::Cow;

use crate::{Error, ErrorKind, Result};

/// What DOS programs put behind the last character.
const DOS_END: u8 = 0x1A;

/// The bytes of a text as UTF-8 without a byte order mark: those given, or UTF-16 (PowerShell, Notepad's "Unicode")
/// rewritten if its mark says so. The ^Z with which DOS programs end a text is left out. What is not UTF-8 inside an
/// unmarked text is left to the reader.
///
/// # Errors
/// [`ErrorKind::Unsupported`]: UTF-32, or UTF-16 without its mark (told by a zero byte among the first four).
/// [`ErrorKind::Malformed`]: UTF-16 that is cut or has half a pair.
///
/// ```
/// use btfkit_formats::text::utf8;
///
/// assert_eq!(*utf8(b"\xFF\xFEa\0b\0").unwrap(), *b"ab");
/// assert_eq!(*utf8(b"\xEF\xBB\xBFab").unwrap(), *b"ab");
/// assert!(utf8(b"a\0b\0").is_err());
/// ```
pub fn utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>> {
    let refused = |found: &str| {
        Err(Error::new(ErrorKind::Unsupported, found, "UTF-8; save the text in that encoding").at(0usize))
    };
    match bytes {
        [0xFF, 0xFE, 0, 0, ..] | [0, 0, 0xFE, 0xFF, ..] => refused("a text in UTF-32"),
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [first, second, ..] if *first == 0 || *second == 0 => refused("a text in UTF-16 without its mark"),
        _ => {
            let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
            let length =
                text.iter().rposition(|&byte| byte != DOS_END).map_or(0, |last| last.saturating_add(1));
            Ok(Cow::Borrowed(text.get(..length).unwrap_or(text)))
        }
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<Cow<'static, [u8]>> {
    let (pairs, rest) = bytes.as_chunks::<2>();
    let text: std::result::Result<String, _> =
        char::decode_utf16(pairs.iter().map(|&pair| unit(pair))).collect();
    match text {
        Ok(text) if rest.is_empty() => Ok(Cow::Owned(text.into_bytes())),
        _ => Err(Error::malformed("UTF-16 with half a character", "a whole text")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_says_what_the_text_is() {
        let text = "2\r\nphoto ä 𝄞.png 0 0 1\r\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xEF\xBB\xBF", text.as_bytes()].concat(),
            [b"\xFF\xFE", little.as_slice()].concat(),
            [b"\xFE\xFF", big.as_slice()].concat(),
        ] {
            assert_eq!(&*utf8(&bytes).unwrap(), text.as_bytes());
        }
        for (bytes, words) in [
            (little, "without its mark"),
            (big.clone(), "without its mark"),
            (b"\xFF\xFE\0\0a\0\0\0".to_vec(), "UTF-32"),
            ([b"\xFE\xFF", &big[..5]].concat(), "half"),
            (b"\xFF\xFE\x34\xD8".to_vec(), "half"),
        ] {
            let error = utf8(&bytes).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
        assert_eq!(&*utf8(b"ab\x1A\x1A").unwrap(), b"ab");
        assert_eq!(&*utf8(b"\xEF\xBB\xBFab\x1A").unwrap(), b"ab");
        assert_eq!(&*utf8(&vec![DOS_END; 8 << 20]).unwrap(), b"");
        // The last byte of a character is none.
        assert_eq!(&*utf8(b"\xFF\xFEa\0\x05\x1A").unwrap(), "a\u{1A05}".as_bytes());
        // A name in another encoding is the reader's to judge.
        assert_eq!(&*utf8(b"\xFCx").unwrap(), b"\xFCx");
        assert!(utf8(b"").unwrap().is_empty());
    }
}

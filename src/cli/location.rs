//! Arguments that are URLs. `file:` ones become paths; those of other places are refused, since they would be taken for
//! names of folders, and made.

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::{OsStrExt, OsStringExt};

use btfkit::error::{Error, Result};

/// Places that users have stores and archives at, and that are no file system.
const ELSEWHERE: [&str; 12] = [
    "s3://",
    "gs://",
    "gcs://",
    "az://",
    "abfs://",
    "abfss://",
    "http://",
    "https://",
    "ftp://",
    "sftp://",
    "hdfs://",
    "webdav://",
];

/// The arguments of the program, with paths in place of `file:` URLs.
///
/// # Errors
/// [`btfkit::ErrorKind::Usage`] for a URL that names no file on this machine.
pub(super) fn arguments(given: impl Iterator<Item = OsString>) -> Result<Vec<OsString>> {
    given.map(|word| of_word(&word)).collect()
}

/// A word, or the value in `--option=value`.
fn of_word(word: &OsStr) -> Result<OsString> {
    let bytes = word.as_bytes();
    let value = match bytes.iter().position(|&byte| byte == b'=') {
        Some(at) if bytes.starts_with(b"--") => at + 1,
        _ => 0,
    };
    let (option, url) = bytes.split_at(value);
    let begins = |scheme: &str| {
        url.get(..scheme.len()).is_some_and(|head| head.eq_ignore_ascii_case(scheme.as_bytes()))
    };
    let shown = || String::from_utf8_lossy(url).into_owned();
    if ELSEWHERE.into_iter().any(begins) {
        return Err(Error::usage(format!("{}: got a URL, expected a file or a folder", shown()))
            .hint("copy what lies there to a disk, or mount it as a file system, and name the path"));
    }
    if !begins("file://") {
        return Ok(word.to_owned());
    }
    let refused = |what: &str| {
        Err(Error::usage(format!("{}: {what}", shown()))
            .hint("name the path itself, or write file:///PATH, with %25 for %"))
    };
    let rest = &url["file://".len()..];
    let path = rest.strip_prefix(b"localhost").unwrap_or(rest);
    if path.first() != Some(&b'/') {
        return refused("got a URL of another machine, expected one that begins with file:///");
    }
    match decoded(path) {
        Some(path) => Ok(OsString::from_vec([option, &path].concat())),
        None => refused("got % without two hexadecimal digits of a byte above 0 behind it"),
    }
}

/// A path whose bytes may be written as %XX; none where one is not, or is 0.
fn decoded(path: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path;
    while let [first, after @ ..] = rest {
        let (byte, left) = match (first, after) {
            (b'%', [high, low, left @ ..]) => {
                let digit = |byte: &u8| char::from(*byte).to_digit(16);
                ((digit(high)? * 16 + digit(low)?) as u8, left)
            }
            (b'%', _) => return None,
            (&byte, left) => (byte, left),
        };
        bytes.push(Some(byte).filter(|&byte| byte != 0)?);
        rest = left;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn read(word: &str) -> std::result::Result<String, String> {
        let words = arguments(std::iter::once(OsString::from(word)));
        words.map(|words| words[0].to_string_lossy().into_owned()).map_err(|error| error.to_string())
    }

    #[test]
    fn urls_of_files_are_paths_and_others_are_refused() {
        for (word, path) in [
            ("file:///a/b.zarr", "/a/b.zarr"),
            ("FILE://localhost/a%20b%25.zarr", "/a b%.zarr"),
            ("--out=file:///a/%C3%A9.png", "--out=/a/é.png"),
            ("a=file:///b", "a=file:///b"),
            ("--comment=see s3://bucket", "--comment=see s3://bucket"),
            ("s3:/a", "s3:/a"),
            ("file.zarr", "file.zarr"),
            ("file:/a", "file:/a"),
            ("", ""),
        ] {
            assert_eq!(read(word).as_deref(), Ok(path), "{word}");
        }
        for word in ["file://host/a", "file://a", "file:///a%", "file:///a%2", "file:///a%zz", "file:///a%00"]
        {
            assert!(read(word).is_err(), "{word}");
        }
        for word in ["s3://bucket/a.zarr", "S3://b", "--against=gs://b/a.zarr", "https://example.org/a.zip"] {
            assert!(read(word).unwrap_err().contains("got a URL, expected a file or a folder"), "{word}");
        }
    }
}

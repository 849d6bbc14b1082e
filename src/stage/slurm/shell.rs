//! Words of a shell: whatever a name holds, the shell reads just that name.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

/// A word as bash reads it back byte by byte: in single quotes unless it is plain.
///
/// Quotes within become `'\''`. A name of a file holds no zero byte, which no shell can hold either.
pub(super) fn quoted(word: impl AsRef<OsStr>) -> Vec<u8> {
    let bytes = word.as_ref().as_bytes();
    let is_plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"/._-+=:,@%".contains(byte);
    if !bytes.is_empty() && bytes.iter().all(is_plain) {
        return bytes.to_vec();
    }
    let mut quoted = vec![b'\''];
    for &byte in bytes {
        match byte {
            b'\'' => quoted.extend_from_slice(b"'\\''"),
            _ => quoted.push(byte),
        }
    }
    quoted.push(b'\'');
    quoted
}

/// A line that sets a variable.
pub(super) fn variable(name: &str, value: impl AsRef<OsStr>) -> Vec<u8> {
    [format!("{name}=").as_bytes(), &quoted(value), b"\n"].concat()
}

/// A list on one line.
pub(super) fn short_list<W: AsRef<OsStr>>(name: &str, words: impl IntoIterator<Item = W>) -> Vec<u8> {
    let words: Vec<Vec<u8>> = words.into_iter().map(quoted).collect();
    [format!("{name}=(").as_bytes(), &words.join(&b' '), b")\n"].concat()
}

/// A list with one word a line.
pub(super) fn long_list<W: AsRef<OsStr>>(name: &str, words: impl IntoIterator<Item = W>) -> Vec<u8> {
    let mut list = format!("{name}=(\n").into_bytes();
    for word in words {
        list.extend_from_slice(b"    ");
        list.extend(quoted(word));
        list.push(b'\n');
    }
    list.extend_from_slice(b")\n");
    list
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::process::Command;

    use super::*;

    /// What bash makes of a list: its words.
    fn read_by_bash(script: &[u8]) -> Vec<Vec<u8>> {
        let mut whole = script.to_vec();
        whole.extend_from_slice(b"\nprintf '%s\\0' \"${words[@]}\"\n");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("script");
        std::fs::write(&path, whole).unwrap();
        let output = Command::new("bash").arg(&path).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        let mut words: Vec<Vec<u8>> = output.stdout.split(|&byte| byte == 0).map(<[u8]>::to_vec).collect();
        words.pop();
        words
    }

    /// Words of random bytes, most of them those that mean something to a shell.
    fn drawn(number: u64) -> Vec<u8> {
        const TELLING: &[u8] = b"'\"\\$`!*?[]{}()<>|&;#~ \t\n\r-=a0\xff\xc3\x01";
        let mut state = number.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut draw = |below: u64| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) % below
        };
        let length = draw(40);
        (0..length)
            .map(|_| match draw(4) {
                0 => draw(255) as u8 + 1,
                _ => TELLING[draw(TELLING.len() as u64) as usize],
            })
            .collect()
    }

    #[test]
    fn bash_reads_every_word_as_it_was() {
        let words: Vec<Vec<u8>> = (0..2000).map(drawn).collect();
        let list: Vec<&OsStr> = words.iter().map(|word| OsStr::from_bytes(word)).collect();
        assert!(read_by_bash(&short_list("words", &list)) == words);
        assert!(read_by_bash(&long_list("words", &list)) == words);
        for word in &list {
            let script = [variable("one", word), b"words=(\"$one\")".to_vec()].concat();
            if word.len() % 8 == 0 {
                assert_eq!(read_by_bash(&script), [word.as_bytes()]);
            }
        }
    }

    #[test]
    fn words_that_shells_are_known_to_change_stay_as_they_are() {
        let words = [
            "a b",
            "it's",
            "\"",
            "$HOME",
            "`id`",
            "line\nbreak",
            "tail\n",
            "*",
            "~",
            "!!",
            "#",
            "-n",
            "",
            "\\",
            "a\\'b",
            "(",
            ")",
            ";&|<>",
            "\t",
            "é",
            "\r",
        ];
        let read = read_by_bash(&long_list("words", words));
        assert_eq!(read, words.map(|word| word.as_bytes().to_vec()));
        assert_eq!(quoted("/data/wood-4k.zarr"), b"/data/wood-4k.zarr");
    }
}

//! Which entry names are safe to read and to write.

/// The reason why `name` must not be read from an archive, if there is one.
///
/// A backslash counts as a separator, as it is one where some archives are made or unpacked.
pub(crate) fn unsafe_reason(name: &str) -> Option<&'static str> {
    let mut parts = name.split(['/', '\\']);
    if name.is_empty() {
        Some("an empty name")
    } else if name.contains('\0') {
        Some("a name with a NUL character")
    } else if name.starts_with(['/', '\\']) {
        Some("an absolute name")
    } else if has_drive(name) {
        Some("a name with a drive letter")
    } else if parts.any(|part| part == "..") {
        Some("a name that climbs out of the archive by `..`")
    } else {
        None
    }
}

/// The reason why `name` must not be written, if there is one. Stricter than reading: what is written
/// is the same after any reader's normalisation.
pub(super) fn unwritable_reason(name: &str) -> Option<&'static str> {
    unsafe_reason(name).or_else(|| {
        if name.contains('\\') {
            Some("a name with a backslash")
        } else if name.split('/').any(|part| part.is_empty() || part == ".") {
            Some("a name with an empty part or a part `.`")
        } else if name.len() > usize::from(u16::MAX) {
            Some("a name of more than 65535 bytes")
        } else {
            None
        }
    })
}

fn has_drive(name: &str) -> bool {
    matches!(name.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_archive_are_unsafe() {
        for name in ["", "/a", "\\a", "../a", "a/../../b", "a\\..\\b", "..", "a/..", "C:/a", "c:a", "a\0b"] {
            assert!(unsafe_reason(name).is_some(), "{name:?}");
            assert!(unwritable_reason(name).is_some(), "{name:?}");
        }
    }

    #[test]
    fn ordinary_names_are_safe() {
        for name in ["a", "a/b c.jpg", "..a/b..", "tv000_pv000/00000 tl000.jpg", "ä/ö", "ab:c"] {
            assert_eq!(unsafe_reason(name), None, "{name:?}");
            assert_eq!(unwritable_reason(name), None, "{name:?}");
        }
    }

    #[test]
    fn writing_is_stricter_than_reading() {
        let long = "x".repeat(65536);
        for name in ["./a", "a//b", "a/", "a\\b", &long] {
            assert_eq!(unsafe_reason(name), None, "{name:?}");
            assert!(unwritable_reason(name).is_some(), "{name:?}");
        }
    }
}

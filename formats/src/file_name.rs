//! Names of image files, as folders, zips and lists give them.

use std::collections::HashMap;

use crate::zip::unsafe_reason;

/// Extensions of pictures, without regard to case: JPEG, PNG, TIFF, Radiance, OpenEXR.
pub(crate) const PICTURE_EXTENSIONS: [&str; 7] = ["jpg", "jpeg", "png", "tif", "tiff", "hdr", "exr"];

/// What follows the last `/` or `\`.
pub(crate) fn base(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// The path without its extension, if that is a picture's. The `._` companions that one system leaves beside
/// its files, with the extension of the file, are no pictures.
pub(crate) fn picture_stem(path: &str) -> Option<&str> {
    let (stem, extension) = path.rsplit_once('.')?;
    let known = PICTURE_EXTENSIONS.iter().any(|known| known.eq_ignore_ascii_case(extension));
    (known && !base(path).starts_with("._")).then_some(stem)
}

/// A file that a list names, as a path inside the list's own folder with `/` between its parts. A safe
/// relative path stays; of any other (absolute, with a drive, climbing by `..`: written on another machine)
/// only the last part does. `None` if nothing usable is left. So a list never reaches out of its folder.
pub(crate) fn inside_folder(path: &str) -> Option<String> {
    let kept = if unsafe_reason(path).is_none() { path } else { base(path) };
    let parts: Vec<&str> = kept.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").collect();
    let joined = parts.join("/");
    (unsafe_reason(&joined).is_none() && !kept.ends_with(['/', '\\'])).then_some(joined)
}

/// All parts of a path that a list names, separated by `/`: without a drive, and what `..` climbs out of. They are
/// compared with the ends of paths that are there, and lead nowhere.
pub(crate) fn parts_of(path: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    for part in path.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => kept.clear(),
            drive
                if kept.is_empty()
                    && matches!(drive.as_bytes(), [letter, b':'] if letter.is_ascii_alphabetic()) => {}
            other => kept.push(other),
        }
    }
    kept.join("/")
}

/// Whether one name comes before another where runs of digits count as numbers, however many zeros they begin with.
pub fn natural_order(a: &str, b: &str) -> std::cmp::Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let ((a_text, a_rest), (b_text, b_rest)) = (until(a, true), until(b, true));
        let ((a_digits, a_left), (b_digits, b_left)) = (until(a_rest, false), until(b_rest, false));
        let number = |digits: &str| digits.trim_start_matches('0').to_owned();
        let (a_number, b_number) = (number(a_digits), number(b_digits));
        let order = a_text
            .cmp(b_text)
            .then_with(|| a_digits.is_empty().cmp(&b_digits.is_empty()).reverse())
            .then_with(|| a_number.len().cmp(&b_number.len()))
            .then_with(|| a_number.cmp(&b_number));
        if order.is_ne() || (a_left.is_empty() && b_left.is_empty()) {
            return order;
        }
        (a, b) = (a_left, b_left);
    }
}

/// What comes before the first digit (or before the first character that is none), and the rest.
fn until(text: &str, digit: bool) -> (&str, &str) {
    let at = text.find(|c: char| c.is_ascii_digit() == digit).unwrap_or(text.len());
    text.split_at_checked(at).unwrap_or((text, ""))
}

/// The first name that was there before: its positions, earlier and later.
pub(crate) fn repeated<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<(usize, usize)> {
    let mut seen = HashMap::new();
    names.into_iter().enumerate().find_map(|(at, name)| Some((seen.insert(name, at)?, at)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_by_extension() {
        assert_eq!(picture_stem("a/b.c.Tiff"), Some("a/b.c"));
        assert_eq!(picture_stem("a.HDR"), Some("a"));
        for name in ["a", "jpg", "a.jpg.txt", "__MACOSX/b/._a.jpg", "a.jpg/b"] {
            assert_eq!(picture_stem(name), None, "{name:?}");
        }
    }

    #[test]
    fn lists_stay_in_their_folder() {
        let inside = |path| inside_folder(path).unwrap_or_default();
        for (path, kept) in [
            ("a b.png", "a b.png"),
            ("./x\\.\\a.png", "x/a.png"),
            ("x//a.png", "x/a.png"),
            ("/home/me/a.png", "a.png"),
            ("C:\\scans\\a.png", "a.png"),
            ("x/../../a.png", "a.png"),
            ("\\\\host\\share\\a.png", "a.png"),
        ] {
            assert_eq!(inside(path), kept, "{path:?}");
        }
        for path in ["", ".", "..", "/", "/x/..", "x/", "a\0.png", "c:a.png"] {
            assert_eq!(inside_folder(path), None, "{path:?}");
        }
    }

    #[test]
    fn the_folders_of_a_foreign_path_are_kept_to_compare() {
        for (path, parts) in [
            ("a.png", "a.png"),
            ("C:\\x\\jpeg-exports\\a.png", "x/jpeg-exports/a.png"),
            ("/home/me/./a.png", "home/me/a.png"),
            ("x/../../y/a.png", "y/a.png"),
            ("\\\\host\\share\\a.png", "host/share/a.png"),
        ] {
            assert_eq!(parts_of(path), parts, "{path:?}");
        }
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let sorted = ["a", "a1", "a02b", "a2c", "a10", "a10.5", "a10.10", "b1", "é"];
        for (at, first) in sorted.iter().enumerate() {
            for (later, second) in sorted.iter().enumerate() {
                let found = natural_order(first, second);
                assert_eq!(found, at.cmp(&later), "{first} {second}");
            }
        }
        assert!(natural_order("a", "a0").is_lt() && natural_order("a0", "a").is_gt());
        assert!(natural_order("p1.png", "p001.png").is_eq());
        assert!(natural_order("99999999999999999999999", "100000000000000000000000").is_lt());
    }

    #[test]
    fn repetition_is_found() {
        assert_eq!(repeated(["a", "b", "c", "b", "a"]), Some((1, 3)));
        assert_eq!(repeated(["a", "A"]), None);
    }
}

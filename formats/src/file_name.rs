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
    fn repetition_is_found() {
        assert_eq!(repeated(["a", "b", "c", "b", "a"]), Some((1, 3)));
        assert_eq!(repeated(["a", "A"]), None);
    }
}

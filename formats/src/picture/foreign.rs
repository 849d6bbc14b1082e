//! Names of formats that are known and not read, so that an error can say what a file is and what to do with it.

/// What to do with pictures, camera raws, packed archives, and the rest.
const PICTURE: &str = "convert it to PNG, TIFF or OpenEXR";
const RAW: &str = "convert it to a TIFF of 16 bits, the same way for all pictures";
const PACKED: &str = "unpack it to a folder, or pack it as a zip";
const OTHER: &str = "it does not hold one picture for each view and light";

/// How a file begins, what it is, and the way out.
const STARTS: [(usize, &[u8], &str, &str); 41] = [
    (8, b"WEBP", "a WebP picture", PICTURE),
    (4, b"ftypavif", "an AVIF picture", PICTURE),
    (4, b"ftypavis", "an AVIF sequence", PICTURE),
    (4, b"ftyphe", "a HEIC picture", PICTURE),
    (4, b"ftypmif1", "a HEIC or AVIF picture", PICTURE),
    (4, b"ftypmsf1", "a HEIC sequence", PICTURE),
    (4, b"ftypcrx", "a Canon raw file (CR3)", RAW),
    (4, b"ftyp", "a film (MP4, MOV)", "save its frames as PNGs"),
    (0, b"\x1A\x45\xDF\xA3", "a film (MKV, WebM)", "save its frames as PNGs"),
    (0, b"\xFF\x0A", "a JPEG XL picture", PICTURE),
    (0, b"\0\0\0\x0CJXL ", "a JPEG XL picture", PICTURE),
    (0, b"\0\0\0\x0CjP  ", "a JPEG 2000 picture", PICTURE),
    (0, b"\xFF\x4F\xFF\x51", "a JPEG 2000 picture", PICTURE),
    (0, b"8BPS", "a Photoshop document", PICTURE),
    (0, b"gimp xcf", "a GIMP document", PICTURE),
    (0, b"GIF8", "a GIF picture", PICTURE),
    (0, b"BM", "a BMP picture", PICTURE),
    (0, b"DDS ", "a DDS texture", PICTURE),
    (0, b"\xABKTX", "a KTX texture", PICTURE),
    (0, b"PF\n", "a PFM picture", PICTURE),
    (0, b"P5\n", "a PGM picture", PICTURE),
    (0, b"P6\n", "a PPM picture", PICTURE),
    (0, b"SIMPLE  =", "a FITS file", PICTURE),
    (0, b"FUJIFILMCCD-RAW", "a Fujifilm raw file", RAW),
    (0, b"IIRO", "an Olympus raw file", RAW),
    (0, b"IIRS", "an Olympus raw file", RAW),
    (0, b"MMOR", "an Olympus raw file", RAW),
    (0, b"IIU\0", "a Panasonic raw file", RAW),
    (8, b"CR\x02", "a Canon raw file (CR2)", RAW),
    (0, b"FOVb", "a Sigma raw file", RAW),
    (0, b"\0MRM", "a Minolta raw file", RAW),
    (0, b"7z\xBC\xAF\x27\x1C", "a 7z archive", PACKED),
    (0, b"Rar!\x1A\x07", "a RAR archive", PACKED),
    (0, b"\x1F\x8B", "a gzip file (tar.gz?)", PACKED),
    (0, b"BZh", "a bzip2 file (tar.bz2?)", PACKED),
    (0, b"\xFD7zXZ\0", "an xz file (tar.xz?)", PACKED),
    (257, b"ustar", "a tar archive", PACKED),
    (0, b"MATLAB 5.0", "a MATLAB file", "save its arrays as .npy, or its images as pictures"),
    (
        0,
        b"#HSH",
        "a map of hemispherical harmonics (HSH)",
        "it is a fit and not the photographs: import those",
    ),
    (0, b"PTM_1.", "a polynomial texture map (PTM)", "it is a fit and not the photographs: import those"),
    (0, b"\x5A\0\0\0\x5A\0\0\0\xB4\0\0\0", "a BRDF of the MERL database", OTHER),
];

/// Endings of raw files that begin as a TIFF does.
const RAW_ENDINGS: [(&str, &str); 8] = [
    ("nef", "a Nikon raw file"),
    ("nrw", "a Nikon raw file"),
    ("cr2", "a Canon raw file (CR2)"),
    ("dng", "a raw file (DNG)"),
    ("arw", "a Sony raw file"),
    ("pef", "a Pentax raw file"),
    ("3fr", "a Hasselblad raw file"),
    ("iiq", "a Phase One raw file"),
];

/// What a file is, by its first bytes or its name, and what to do about it; `None` if it is nothing known,
/// or a picture that is read.
///
/// ```
/// use btfkit_formats::picture::foreign;
///
/// let (what, way_out) = foreign("a.webp", b"RIFF\x10\0\0\0WEBPVP8 ").unwrap();
/// assert_eq!(what, "a WebP picture");
/// assert!(way_out.contains("PNG"));
/// assert_eq!(foreign("a.jpg", b"\xFF\xD8\xFF\xE0"), None);
/// ```
pub fn foreign(name: &str, bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    let tiff = bytes.starts_with(b"II*\0") || bytes.starts_with(b"MM\0*");
    let raw = RAW_ENDINGS.iter().find(|(known, _)| tiff && known.eq_ignore_ascii_case(ending));
    let by_start =
        STARTS.iter().find(|(at, start, ..)| bytes.get(*at..).is_some_and(|rest| rest.starts_with(start)));
    by_start.map(|&(_, _, what, way_out)| (what, way_out)).or(raw.map(|&(_, what)| (what, RAW)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_start_is_told_and_none_hides_another() {
        for (at, start, what, _) in STARTS {
            let bytes = [&vec![1; at], start, &[1; 300]].concat();
            assert_eq!(foreign("x", &bytes).map(|(what, _)| what), Some(what));
            assert_eq!(crate::picture::recognise(&bytes), None, "{what}");
        }
        for (ending, what) in RAW_ENDINGS {
            let name = format!("a/b.{}", ending.to_uppercase());
            assert_eq!(foreign(&name, b"II*\0\x08\0\0\0").map(|(what, _)| what), Some(what));
            assert_eq!(foreign(&name, b"text"), None);
        }
        assert_eq!(foreign("a.tif", b"II*\0\x08\0\0\0"), None);
    }
}

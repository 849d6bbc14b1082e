//! Formats told apart, and what is alike in all of them.

use std::fs;
use std::path::Path;

use btfkit_formats::jpeg::Chroma;
use btfkit_formats::picture::{Format, check, decode, header, recognise};
use btfkit_formats::{ErrorKind, Limits, SampleType, Samples, jpeg};

use crate::picture_files::{all, exrs, pngs, tiffs};
use crate::support::{jpeg_of, options};

#[test]
fn a_format_is_told_by_its_first_bytes() {
    for (files, format) in [(pngs(), Format::Png), (tiffs(), Format::Tiff), (exrs(), Format::Exr)] {
        for (name, bytes) in files {
            assert_eq!(recognise(&bytes), Some(format), "{name}");
        }
    }
    assert_eq!(recognise(&jpeg_of(3, 3, 1, &options(50, false, Chroma::Full))), Some(Format::Jpeg));
    assert_eq!(recognise(b"#?RADIANCE\n"), Some(Format::Hdr));
    assert_eq!(recognise(b"#?RGBE\n"), Some(Format::Hdr));
    for other in
        [b"".as_slice(), b"\xFF\xD8", b"GIF89a", b"II\x2A", b"\x89PNG", b"#?RGB", b"BM", b"PK\x03\x04"]
    {
        assert_eq!(recognise(other), None, "{other:?}");
        let error = decode(other, &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    }
}

#[test]
fn a_jpeg_is_what_its_own_module_reads() {
    let limits = Limits::default();
    for channels in [1, 3] {
        let bytes = jpeg_of(10, 7, channels, &options(80, true, Chroma::Half));
        let picture = decode(&bytes, &limits).unwrap();
        assert_eq!(picture.samples, Samples::U8(jpeg::decode(&bytes, &limits).unwrap().samples));
        assert_eq!(picture.channels.join(""), if channels == 1 { "Y" } else { "RGB" });
        let header = header(&bytes, &limits).unwrap();
        assert_eq!((header.width, header.height, header.sample_type), (10, 7, SampleType::U8));
        assert!(!header.linear);
    }
}

#[test]
fn a_header_is_read_without_what_follows_it() {
    for (name, whole) in all() {
        // A TIFF's directory may lie at its end.
        if name.starts_with("tiff") {
            continue;
        }
        let shorter = &whole[..whole.len() - 1];
        assert_eq!(
            header(shorter, &Limits::default()).unwrap(),
            header(&whole, &Limits::default()).unwrap(),
            "{name}"
        );
    }
}

/// Every PNG of two published sets, where they lie beside the checkout.
#[test]
fn published_pngs_are_read() {
    let mut read = 0;
    for set in ["uw-photometric", "textures"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(set);
        let mut folders = vec![folder];
        while let Some(folder) = folders.pop() {
            let Ok(entries) = fs::read_dir(&folder) else { continue };
            for path in entries.map(|entry| entry.unwrap().path()) {
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|ending| ending == "png") {
                    let bytes = fs::read(&path).unwrap();
                    let picture =
                        decode(&bytes, &Limits::default()).unwrap_or_else(|e| panic!("{path:?}: {e}"));
                    let checked = check(&bytes, &Limits::default()).unwrap();
                    assert_eq!((checked.width, checked.height), (picture.width, picture.height));
                    assert!(picture.samples.to_f32().iter().any(|&sample| sample > 0.0), "{path:?} is black");
                    read += 1;
                }
            }
        }
    }
    println!("{read} published PNGs read");
}

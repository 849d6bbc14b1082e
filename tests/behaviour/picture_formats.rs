//! Formats of pictures: what `btf image` writes is read back by the crate `image` and by our own readers alike, and
//! endings, sizes and memory are refused before any work.

use std::path::{Path, PathBuf};

use btfkit_formats::picture::{self, exr::Compression};
use btfkit_formats::{Limits, Samples};
use image::{DynamicImage, ImageEncoder, ImageFormat};

use crate::fixture::{btf, fail, fixture, succeed};

fn image_of(source: &Path, out: &Path, more: &[&str]) -> std::process::Command {
    let mut command = btf();
    command.arg("image").arg(source).args(["--light", "20,45", "--view", "30,100"]).args(more);
    command.arg("--out").arg(out);
    command
}

/// The 16-bit samples of a picture by the crate `image`; those of 8 bits times 257.
fn opinion(bytes: &[u8], format: ImageFormat) -> (u32, u32, Vec<u16>) {
    let picture = image::load_from_memory_with_format(bytes, format).unwrap();
    let wide = match &picture {
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageLuma8(_) | DynamicImage::ImageRgb16(_) => {
            picture.to_rgb16()
        }
        other => panic!("{:?}", other.color()),
    };
    (picture.width(), picture.height(), wide.into_raw())
}

/// The same by our own reader.
fn ours(bytes: &[u8]) -> (u32, u32, Vec<u16>) {
    let picture = picture::decode(bytes, &Limits::default()).unwrap();
    let wide = match picture.samples {
        Samples::U8(samples) => samples.into_iter().map(|sample| u16::from(sample) * 257).collect(),
        Samples::U16(samples) => samples,
        other => panic!("{:?}", other.sample_type()),
    };
    (picture.width, picture.height, wide)
}

#[test]
fn every_format_shows_the_same_picture_to_other_readers_and_to_ours() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        succeed(&mut image_of(&fixture().measurement(), &out, more));
        let bytes = std::fs::read(&out).unwrap();
        // The same bytes again, with other threads.
        succeed(image_of(&fixture().measurement(), &out, more).args(["--threads", "1"]));
        assert!(bytes == std::fs::read(&out).unwrap(), "{name}");
        bytes
    };
    let png = opinion(&made("a.png", &[]), ImageFormat::Png);
    assert_eq!((png.0, png.1), (56, 48));
    let wide = opinion(&made("w.png", &["--bits", "16"]), ImageFormat::Png);
    for (narrow, wide) in png.2.iter().zip(&wide.2) {
        assert!(narrow.abs_diff(*wide) <= 129, "{narrow} {wide}");
    }
    assert!(wide.2.iter().any(|sample| sample % 257 != 0), "the 16 bits hold no more than 8");
    for (name, more, format, expected) in [
        ("a.tif", &[][..], ImageFormat::Tiff, &png),
        ("a.TIFF", &[][..], ImageFormat::Tiff, &png),
        ("w.tif", &["--bits", "16"][..], ImageFormat::Tiff, &wide),
        ("a.webp", &[][..], ImageFormat::WebP, &png),
    ] {
        let bytes = made(name, more);
        assert!(&opinion(&bytes, format) == expected, "{name}");
        if format == ImageFormat::Tiff {
            assert!(&ours(&bytes) == expected, "{name}");
        }
    }
    assert!(ours(&made("a.png", &[])) == png && ours(&made("w.png", &["--bits", "16"])) == wide);
    // With loss, less of it at a higher quality.
    let mean_error = |name: &str, more: &[&str]| {
        let bytes = made(name, more);
        let (decoded, by_us) = (opinion(&bytes, ImageFormat::Jpeg), ours(&bytes));
        assert!(decoded == by_us && (decoded.0, decoded.1) == (56, 48), "{name}");
        let sum: u64 = decoded.2.iter().zip(&png.2).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        sum as f64 / 257.0 / png.2.len() as f64
    };
    let errors = [
        mean_error("a.jpg", &["--quality", "100"]),
        mean_error("b.jpeg", &[]),
        mean_error("c.jpg", &["--quality", "10"]),
    ];
    assert!(errors[0] < 1.0 && errors[0] < errors[1] && errors[1] < errors[2], "{errors:?}");
}

#[test]
fn files_hold_no_metadata() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.jpg", "a.webp", "a.tif", "a.png"] {
        let out = folder.path().join(name);
        succeed(&mut image_of(&fixture().measurement(), &out, &[]));
        let bytes = std::fs::read(&out).unwrap();
        for mark in
            ["Exif", "btf", "image-rs", "20", "ICC_PROFILE", "xmp"].iter().filter(|mark| mark.len() > 2)
        {
            assert!(!bytes.windows(mark.len()).any(|part| part == mark.as_bytes()), "{name}: {mark}");
        }
    }
}

#[test]
fn our_readers_agree_with_the_crate_on_what_it_writes() {
    let (width, height) = (37u32, 23u32);
    let sample = |n: u32| ((n * 2_654_435_761) >> 13) as u16;
    let count = width * height * 3;
    let wide: Vec<u16> = (0..count).map(sample).collect();
    let narrow: Vec<u8> = wide.iter().map(|sample| (sample >> 8) as u8).collect();
    let pictures = [
        DynamicImage::ImageRgb8(image::RgbImage::from_raw(width, height, narrow.clone()).unwrap()),
        DynamicImage::ImageRgb16(image::ImageBuffer::from_raw(width, height, wide).unwrap()),
        DynamicImage::ImageLuma8(image::GrayImage::from_raw(width * 3, height, narrow.clone()).unwrap()),
    ];
    for picture in &pictures {
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, format).unwrap();
            let read = picture::decode(bytes.get_ref(), &Limits::default()).unwrap();
            let found: Vec<u8> = match read.samples {
                Samples::U8(samples) => samples,
                Samples::U16(samples) => samples.iter().flat_map(|sample| sample.to_ne_bytes()).collect(),
                other => panic!("{:?}", other.sample_type()),
            };
            assert!(found == picture.as_bytes(), "{format:?} {:?}", picture.color());
        }
    }
    // Lossy: both decode the same file to the same samples.
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 80);
    encoder.write_image(&narrow, width, height, image::ExtendedColorType::Rgb8).unwrap();
    assert!(ours(&bytes) == opinion(&bytes, ImageFormat::Jpeg));
    // Floats.
    let values: Vec<f32> = (0..count).map(|n| f32::from(sample(n)) / 9000.0 + 0.01).collect();
    let floats = image::Rgb32FImage::from_raw(width, height, values.clone()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    DynamicImage::ImageRgb32F(floats).write_to(&mut bytes, ImageFormat::OpenExr).unwrap();
    let read = picture::decode(bytes.get_ref(), &Limits::default()).unwrap();
    // OpenEXR sorts channels by name.
    assert_eq!(in_rgb(&read), values);
    // Radiance, of which the crate writes RGBE with run lengths.
    let pixels: Vec<image::Rgb<f32>> =
        values.chunks_exact(3).map(|p| image::Rgb([p[0], p[1], p[2]])).collect();
    let mut bytes = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&pixels, width as usize, height as usize).unwrap();
    let read = picture::decode(&bytes, &Limits::default()).unwrap();
    let theirs = image::load_from_memory_with_format(&bytes, ImageFormat::Hdr).unwrap().to_rgb32f();
    let Samples::F32(found) = &read.samples else { panic!("not floats") };
    for (a, b) in found.iter().zip(theirs.as_raw()) {
        // Two readings of a mantissa: at its lower end, or at its middle.
        assert!((a - b).abs() <= 0.01 * a.abs().max(0.1), "{a} {b}");
    }
}

/// Samples as R, G, B, whatever the order in the file.
fn in_rgb(picture: &picture::Picture) -> Vec<f32> {
    let Samples::F32(samples) = &picture.samples else { panic!("not floats") };
    let place = |name: &str| picture.channels.iter().position(|channel| channel == name).unwrap();
    let [r, g, b] = ["R", "G", "B"].map(place);
    samples.chunks_exact(3).flat_map(|pixel| [pixel[r], pixel[g], pixel[b]]).collect()
}

#[test]
fn the_crate_reads_what_our_writers_write() {
    let samples: Vec<f32> = (0..11 * 7 * 3).map(|n| n as f32 / 50.0).collect();
    let written = picture::Picture {
        width: 11,
        height: 7,
        channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
        samples: Samples::F32(samples.clone()),
    };
    let bytes = picture::exr::encode(&written, Compression::Zip).unwrap();
    let read = image::load_from_memory_with_format(&bytes, ImageFormat::OpenExr).unwrap();
    assert_eq!(read.to_rgb32f().into_raw(), samples);
    // And the linear values of a picture of ours.
    let folder = tempfile::tempdir().unwrap();
    let [exr, png] = ["a.exr", "a.png"].map(|name| folder.path().join(name));
    for out in [&exr, &png] {
        succeed(&mut image_of(&fixture().measurement(), out, &[]));
    }
    let values = image::load_from_memory_with_format(&std::fs::read(&exr).unwrap(), ImageFormat::OpenExr);
    let codes: Vec<u8> = values.unwrap().to_rgb32f().into_raw().iter().map(|&value| srgb(value)).collect();
    let (_, _, expected) = opinion(&std::fs::read(&png).unwrap(), ImageFormat::Png);
    assert!(codes.iter().zip(&expected).all(|(a, b)| u16::from(*a) * 257 == *b));
}

fn srgb(value: f32) -> u8 {
    btfkit::color::srgb_encode_u8(f64::from(value))
}

#[test]
fn a_name_that_no_format_has_is_refused_by_every_command_with_the_list() {
    let folder = tempfile::tempdir().unwrap();
    let [model, store] = [fixture().model(), fixture().measurement()];
    let commands = |out: &str| {
        let out: PathBuf = folder.path().join(out);
        let mut all = Vec::new();
        for (arguments, option) in [
            (
                vec!["judge", fixture().enlarged().to_str().unwrap(), "--against", store.to_str().unwrap()],
                "--picture",
            ),
            (vec!["curve", store.to_str().unwrap(), model.to_str().unwrap()], "--picture"),
            (vec!["check", store.to_str().unwrap()], "--picture"),
            (vec!["compare", model.to_str().unwrap(), store.to_str().unwrap()], "--picture"),
        ] {
            let mut command = btf();
            command.args(arguments).arg(option).arg(&out);
            all.push(command);
        }
        all
    };
    for name in ["sheet.exr", "sheet.gif", "sheet", "sheet.png.bak"] {
        for mut command in commands(name) {
            let told = fail(&mut command, 2);
            assert!(
                told.contains(".png, .jpg, .jpeg, .webp, .tif, .tiff") && !told.contains(".exr,"),
                "{told}"
            );
        }
    }
    let told = fail(&mut image_of(&store, &folder.path().join("a.bmp"), &[]), 2);
    assert!(told.contains(".png, .jpg, .jpeg, .webp, .tif, .tiff, .exr"), "{told}");
    for (name, more, expected) in [
        ("a.png", ["--quality", "50"], "it is that of a JPEG"),
        ("a.jpg", ["--bits", "16"], "only PNG and TIFF"),
        ("a.webp", ["--bits", "16"], "only PNG and TIFF"),
        ("a.exr", ["--bits", "16"], "holds linear floats"),
    ] {
        let told = fail(&mut image_of(&store, &folder.path().join(name), &more), 2);
        assert!(told.contains(expected), "{told}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    // Another format than PNG works for a sheet.
    let sheet = folder.path().join("sheet.webp");
    succeed(btf().arg("compare").args([&model, &store]).arg("--picture").arg(&sheet));
    assert!(image::load_from_memory_with_format(&std::fs::read(sheet).unwrap(), ImageFormat::WebP).is_ok());
}

#[test]
fn sizes_beyond_a_format_or_the_memory_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let plane = |name: &str, window: &str, memory: &str| {
        image_of(
            &fixture().model(),
            &folder.path().join(name),
            &["--plane", "--window", window, "--memory", memory],
        )
    };
    for (name, window, expected) in [
        ("a.jpg", "0,0,65536,1", "at most 65535 pixels a side"),
        ("a.jpg", "0,0,1,65536", "at most 65535 pixels a side"),
        ("a.webp", "0,0,16384,8", "at most 16383 pixels a side"),
        ("a.tif", "0,0,40000,40000", "a TIFF holds at most"),
    ] {
        let told = fail(&mut plane(name, window, "2GiB"), 2);
        assert!(told.contains(expected) && told.contains("--window"), "{told}");
    }
    for name in ["a.jpg", "a.webp", "a.tif"] {
        let told = fail(&mut plane(name, "0,0,8000,8000", "64MiB"), 2);
        assert!(told.contains("in memory") && told.contains("64 MiB are allowed"), "{told}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    // The largest that a format takes.
    let out = folder.path().join("wide.webp");
    succeed(&mut plane("wide.webp", "0,0,16383,2", "2GiB"));
    let (width, height, _) = opinion(&std::fs::read(out).unwrap(), ImageFormat::WebP);
    assert_eq!((width, height), (16_383, 2));
}

//! OpenEXR: types, compressions, windows, channels and their order; and what is written.

use btfkit_formats::picture::exr::{Compression, encode};
use btfkit_formats::picture::{Picture, check, decode, header};
use btfkit_formats::{ErrorKind, Limits, SampleType, Samples, f16};
use exr::prelude::{self as openexr, WritableImage};

use crate::picture_files::{exr_by_crate, exr_layer, exr_methods, exr_picture};

fn read(bytes: &[u8]) -> Picture {
    decode(bytes, &Limits::default()).unwrap()
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let (a, b) = (a.samples.to_f32(), b.samples.to_f32());
    a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn every_compression_is_read_in_scan_lines_and_tiles() {
    for (width, height) in [(1, 1), (37, 21), (5, 300), (70, 40)] {
        for half in [true, false] {
            let mut picture = exr_picture(width, height, &["R", "G", "B"], half);
            for method in exr_methods() {
                for tile in [None, Some((16, 16)), Some((64, 9))] {
                    let read = read(&exr_by_crate(&picture, method, tile));
                    let error = largest_difference(&read, &picture);
                    let lossless = method.is_lossless_for(if half {
                        openexr::SampleType::F16
                    } else {
                        openexr::SampleType::F32
                    });
                    let allowed = if lossless { 0.0 } else { 0.06 };
                    assert!(
                        error <= allowed,
                        "{method:?}, {tile:?}, {width} x {height}, half {half}: {error}"
                    );
                    picture.samples = if lossless { read.samples } else { picture.samples };
                }
            }
        }
    }
}

#[test]
fn lines_may_be_stored_from_the_bottom_up() {
    let picture = exr_picture(20, 50, &["Y"], true);
    for blocks in [openexr::Blocks::ScanLines, openexr::Blocks::Tiles(openexr::Vec2(8, 8))] {
        let bytes = exr_layer(&picture, openexr::Compression::ZIP16, blocks, openexr::LineOrder::Decreasing);
        assert_eq!(read(&bytes), picture);
    }
}

#[test]
fn channels_come_in_a_stable_order() {
    for (names, expected) in [
        (vec!["B", "G", "R"], "R G B"),
        (vec!["Z", "Y", "X"], "X Y Z"),
        (vec!["NIR", "R", "B", "G"], "R G B NIR"),
        (vec!["1000nm", "450nm", "450.5", "B", "G", "R"], "R G B 450nm 450.5 1000nm"),
        (
            vec!["S0.700,000000nm", "S0.450,250000nm", "S0.1000,000000nm"],
            "S0.450,250000nm S0.700,000000nm S0.1000,000000nm",
        ),
        (vec!["T.700,0nm", "T.400,0nm", "R", "G", "B"], "R G B T.400,0nm T.700,0nm"),
        (vec!["u", "c", "5"], "5 c u"),
    ] {
        let picture = exr_picture(5, 4, &names, true);
        let read = read(&encode(&picture, Compression::Zip).unwrap());
        assert_eq!(read.channels.join(" "), expected);
        // The samples followed their names.
        let (Samples::F16(before), Samples::F16(after)) = (&picture.samples, &read.samples) else {
            unreachable!()
        };
        for (number, name) in read.channels.iter().enumerate() {
            let source = names.iter().position(|other| other == name).unwrap();
            let of = |list: &[f16], at: usize| -> Vec<f16> {
                list.iter().skip(at).step_by(names.len()).copied().collect()
            };
            assert_eq!(of(before, source), of(after, number), "{name}");
        }
    }
}

#[test]
fn a_single_layer_is_the_picture() {
    for (names, layer, channels) in [
        (
            vec!["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"],
            "ViewLayer.Combined",
            "R G B",
        ),
        (vec!["Background.Y"], "Background", "Y"),
        (vec!["a.450.5nm", "a.700nm"], "a", "450.5nm 700nm"),
    ] {
        let bytes = encode(&exr_picture(3, 3, &names, true), Compression::Zip).unwrap();
        let header = header(&bytes, &Limits::default()).unwrap();
        assert_eq!(header.remarks, [format!("the layer {layer:?} is the picture")]);
        assert_eq!(header.channels.join(" "), channels);
        assert_eq!(decode(&bytes, &Limits::default()).unwrap().channels.join(" "), channels);
    }
}

#[test]
fn beside_colours_only_channels_of_light_are_read() {
    for (names, read_as, left) in [
        (vec!["R", "G", "B", "Z"], "R G B", "Z"),
        (
            vec!["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "velocity.X", "Z"],
            "R G B",
            "N.X, N.Y, N.Z, Z, velocity.X",
        ),
        (vec!["R", "G", "B", "X", "Y", "Z", "depth"], "R G B", "X, Y, Z, depth"),
        (vec!["R", "G", "B", "450nm", "nir", "id"], "R G B 450nm nir", "id"),
        (vec!["Y", "Z"], "Y", "Z"),
        (vec!["X", "Y", "Z", "ID"], "X Y Z", "ID"),
        (vec!["a.R", "a.G", "a.B", "a.A", "b.A", "b.Z"], "R G B", "b.A, b.Z"),
    ] {
        // Depth in floats leaves colours halves, and what is left out may be anything.
        let (half, far) = (f16::from_f32(0.5), vec![1e30f32, f32::NAN]);
        let channels = names.iter().map(|&name| {
            let kept = read_as.split(' ').chain(["A"]).any(|kept| kept == name.trim_start_matches("a."));
            let one = if name.trim_start_matches("a.") == "A" { f16::ONE } else { half };
            match kept {
                true => (name, openexr::FlatSamples::F16(vec![one, one])),
                false => (name, openexr::FlatSamples::F32(far.clone())),
            }
        });
        let bytes = of_channels(2, 1, channels.collect());
        let header = check(&bytes, &Limits::default()).unwrap();
        assert_eq!(header.channels.join(" "), read_as);
        let told = format!("the channels {left}, which are no colours, are left out");
        assert_eq!(header.remarks.last(), Some(&told));
        let picture = read(&bytes);
        assert_eq!(picture.samples, Samples::F16(vec![half; 2 * picture.channels.len()]));
    }
    let error = header(
        &of_channels(
            1,
            1,
            ["Y", "RY", "BY"].map(|name| (name, openexr::FlatSamples::F16(vec![f16::ONE]))).into(),
        ),
        &Limits::default(),
    )
    .unwrap_err();
    assert!(error.to_string().contains("chroma"), "{error}");
}

#[test]
fn a_display_window_that_is_another_is_told() {
    let remarks = |shown| {
        let bytes = crate::picture_files::exr_with_attributes(["R", "G", "B"], None, shown);
        header(&bytes, &Limits::default()).unwrap().remarks
    };
    assert_eq!(remarks(None), remarks(Some(2)));
    let [only] = remarks(Some(9)).try_into().unwrap();
    assert_eq!(only, "the data window [0, 0, 1, 0] is the picture, and not the display window [0, 0, 8, 0]");
}

#[test]
fn bands_of_renderers_are_wavelengths_and_no_layers() {
    let names = ["670.00-700.00nm", "400.00-430.00nm", "430.00-460.00nm"];
    let bytes = encode(&exr_picture(3, 3, &names, true), Compression::None).unwrap();
    let header = header(&bytes, &Limits::default()).unwrap();
    assert_eq!(
        (header.remarks, header.channels.join(" ")),
        (Vec::new(), "400.00-430.00nm 430.00-460.00nm 670.00-700.00nm".to_owned())
    );
}

#[test]
fn several_layers_are_refused() {
    for names in [
        vec!["left.R", "left.G", "right.B"],
        vec!["R", "G", "B", "direct.R", "direct.G", "direct.B"],
        vec!["R", "G", "B", "S1.450,0nm"],
        vec!["S0.450,0nm", "S1.450,0nm"],
        vec!["S1.450,0nm", "S1.500,0nm"],
    ] {
        let bytes = encode(&exr_picture(3, 3, &names, true), Compression::None).unwrap();
        let error = decode(&bytes, &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().contains("layers"), "{error}");
    }
}

/// A layer of the given channels, `width * height` values each.
fn of_channels(width: usize, height: usize, channels: Vec<(&str, openexr::FlatSamples)>) -> Vec<u8> {
    let list = channels.into_iter().map(|(name, samples)| openexr::AnyChannel::new(name, samples)).collect();
    let encoding = openexr::Encoding::FAST_LOSSLESS;
    let attributes = openexr::LayerAttributes::default();
    let layer = openexr::Layer::new((width, height), attributes, encoding, openexr::AnyChannels::sort(list));
    let mut out = std::io::Cursor::new(Vec::new());
    openexr::Image::from_layer(layer).write().non_parallel().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn mixed_types_become_floats_and_whole_numbers_only_exactly() {
    use openexr::FlatSamples::{F16, F32, U32};
    let halves = F16(vec![f16::from_f32(0.1), f16::from_f32(-2.0)]);
    let floats = F32(vec![0.1, f32::MAX]);
    let mixed = read(&of_channels(2, 1, vec![("G", floats.clone()), ("R", halves.clone())]));
    assert_eq!(mixed.samples, Samples::F32(vec![f16::from_f32(0.1).to_f32(), 0.1, -2.0, f32::MAX]));

    let numbers = read(&of_channels(2, 1, vec![("R", halves), ("id", U32(vec![1 << 24, 1 << 31]))]));
    assert_eq!(
        numbers.samples,
        Samples::F32(vec![f16::from_f32(0.1).to_f32(), 16_777_216.0, -2.0, 2_147_483_648.0])
    );
    let error = decode(&of_channels(2, 1, vec![("id", U32(vec![5, (1 << 24) + 1]))]), &Limits::default())
        .unwrap_err();
    assert!(error.to_string().contains("16777217"), "{error}");
}

#[test]
fn opaque_alpha_is_dropped_and_other_alpha_refused() {
    use openexr::FlatSamples::{F16, F32};
    let half = f16::from_f32(0.5);
    let alpha = |last: f32| ("A", F32(vec![1.0, last]));
    let bytes = of_channels(2, 1, vec![alpha(1.0), ("Y", F16(vec![half, half]))]);
    let picture = read(&bytes);
    assert_eq!(
        (picture.channels.concat().as_str(), &picture.samples),
        ("Y", &Samples::F16(vec![half, half]))
    );
    assert_eq!(header(&bytes, &Limits::default()).unwrap().sample_type, SampleType::F16);
    let error =
        decode(&of_channels(2, 1, vec![alpha(0.5), ("Y", F16(vec![half, half]))]), &Limits::default())
            .unwrap_err();
    assert!(error.to_string().contains("pixel 1"), "{error}");
    let only = of_channels(2, 1, vec![alpha(1.0)]);
    assert_eq!(decode(&only, &Limits::default()).unwrap_err().kind(), ErrorKind::Unsupported);
}

#[test]
fn the_data_window_is_the_picture_wherever_it_lies() {
    let picture = exr_picture(10, 40, &["R", "G", "B"], true);
    let Samples::F16(list) = &picture.samples else { unreachable!() };
    for position in [(0, 0), (-5, -33), (7, 1000)] {
        for display in [(10, 40), (3, 3), (500, 500)] {
            for tiled in [false, true] {
                let channels = ["R", "G", "B"].iter().enumerate().map(|(number, &name)| {
                    let samples = list.iter().skip(number).step_by(3).copied().collect();
                    openexr::AnyChannel::new(name, openexr::FlatSamples::F16(samples))
                });
                let blocks = if tiled {
                    openexr::Blocks::Tiles(openexr::Vec2(16, 16))
                } else {
                    openexr::Blocks::ScanLines
                };
                let encoding = openexr::Encoding {
                    compression: openexr::Compression::ZIP16,
                    blocks,
                    line_order: openexr::LineOrder::Increasing,
                };
                let attributes =
                    openexr::LayerAttributes::default().with_position(openexr::Vec2(position.0, position.1));
                let layer = openexr::Layer::new(
                    (10, 40),
                    attributes,
                    encoding,
                    openexr::AnyChannels::sort(channels.collect()),
                );
                let mut image = openexr::Image::from_layer(layer);
                image.attributes.display_window = openexr::IntegerBounds::from_dimensions(display);
                let mut out = std::io::Cursor::new(Vec::new());
                image.write().non_parallel().to_buffered(&mut out).unwrap();
                assert_eq!(read(&out.into_inner()), picture, "{position:?}, {display:?}, tiled {tiled}");
            }
        }
    }
}

#[test]
fn several_parts_and_levels_of_detail_are_refused() {
    let layer = |name: &str| {
        openexr::Layer::new(
            (2, 2),
            openexr::LayerAttributes::named(name),
            openexr::Encoding::UNCOMPRESSED,
            openexr::AnyChannels::sort(
                [openexr::AnyChannel::new("Y", openexr::FlatSamples::F32(vec![0.0; 4]))]
                    .into_iter()
                    .collect(),
            ),
        )
    };
    let attributes = openexr::ImageAttributes::new(openexr::IntegerBounds::from_dimensions((2, 2)));
    let image = openexr::Image::empty(attributes).with_layer(layer("one")).with_layer(layer("two"));
    let mut out = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut out).unwrap();
    let error = decode(&out.into_inner(), &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("several parts"), "{error}");

    let mut tiled = exr_by_crate(&exr_picture(9, 9, &["Y"], true), openexr::Compression::RLE, Some((8, 8)));
    let name = b"tiles\0tiledesc\0";
    let at = tiled.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    tiled[at + 8] = 1;
    let error = decode(&tiled, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("levels of detail"), "{error}");
}

#[test]
fn what_is_written_is_read_again_to_the_bit() {
    let odd = [0x0001u16, 0x8000, 0x7BFF, 0x7C00, 0xFC00, 0x7E01, 0x03FF, 0x3C00];
    let halves = Samples::F16(odd.iter().map(|&bits| f16::from_bits(bits)).collect());
    let floats = Samples::F32(vec![0.0, -0.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::INFINITY, 0.1, -7.25]);
    for samples in [halves, floats] {
        for compression in [Compression::None, Compression::Zip] {
            let picture = Picture {
                width: 2,
                height: 2,
                channels: vec!["450nm".into(), "550.5nm".into()],
                samples: samples.clone(),
            };
            let bytes = encode(&picture, compression).unwrap();
            assert_eq!(bytes, encode(&picture, compression).unwrap(), "the same bytes every time");
            let read = read(&bytes);
            let bits = |samples: &Samples| -> Vec<u32> {
                match samples {
                    Samples::F16(list) => list.iter().map(|s| u32::from(s.to_bits())).collect(),
                    other => other.to_f32().iter().map(|s| s.to_bits()).collect(),
                }
            };
            assert_eq!(read.channels, picture.channels);
            assert_eq!(bits(&read.samples), bits(&picture.samples));
        }
    }
}

#[test]
fn what_an_exr_cannot_hold_is_refused() {
    let picture = |names: &[&str], samples| Picture {
        width: 2,
        height: 1,
        channels: names.iter().map(|&name| name.to_owned()).collect(),
        samples,
    };
    let long = "x".repeat(256);
    for bad in [
        picture(&["R"], Samples::U8(vec![0; 2])),
        picture(&["R"], Samples::F32(vec![0.0; 3])),
        picture(&[], Samples::F32(vec![])),
        picture(&["R", "R"], Samples::F32(vec![0.0; 4])),
        picture(&[""], Samples::F32(vec![0.0; 2])),
        picture(&["a\0b"], Samples::F32(vec![0.0; 2])),
        picture(&["µ"], Samples::F32(vec![0.0; 2])),
        picture(&[&long], Samples::F32(vec![0.0; 2])),
    ] {
        assert_eq!(
            encode(&bad, Compression::Zip).unwrap_err().kind(),
            ErrorKind::Argument,
            "{:?}",
            bad.channels
        );
    }
}

//! Bonn containers: every signature, scalar size, orientation and header is read for what it says.

use btfkit_formats::bonn::{Archive, BonnKind, OpenOptions, RowOrder, recognise};
use btfkit_formats::{ErrorKind, Images, Limits, SampleType, Samples};

use crate::bonn_support::{Btf, directions, names, put_scalars, put_u32s};

pub(crate) fn open(bytes: &[u8]) -> Archive {
    Archive::open(bytes, &OpenOptions::default(), &Limits::default()).unwrap()
}

fn refusal(bytes: &[u8]) -> btfkit_formats::Error {
    Archive::open(bytes, &OpenOptions::default(), &Limits::default()).unwrap_err()
}

fn remark<'a>(archive: &'a Archive, key: &str) -> Option<&'a str> {
    let remarks = &archive.contents().remarks;
    remarks.iter().find(|(name, _)| name.starts_with(key)).map(|(_, value)| value.as_str())
}

/// All images of all views, and some of them, are what the function says.
fn check_images(name: &str, bytes: &[u8], btf: &Btf, value: impl Fn([usize; 3], usize) -> f64) {
    let archive = open(bytes);
    let lights = btf.lights.len();
    let image = btf.pixels() * btf.channels.len();
    for view in 0..btf.views.len() {
        let expected = btf.images(view, &value);
        for range in [0..lights, 1..lights, 0..1, 2..2] {
            let read = archive.read_images(bytes, view, range.clone()).unwrap();
            assert_eq!(read.sample_type(), archive.contents().sample_type, "{name}");
            let expected = &expected[range.start * image..range.end * image];
            assert!(read.to_f32() == expected, "{name}, view {view}, lights {range:?}");
        }
    }
}

#[test]
fn every_signature_scalar_and_orientation_is_read() {
    for btf in [Btf::small(), Btf::medium()] {
        for size in [2, 4, 8] {
            for transposed in [false, true] {
                let name = |signature: &str| format!("{signature}, {size} bytes, transposed {transposed}");
                for (signature, rotations) in [("!DFMF08FCR", true), ("!DFMF08FC", false)] {
                    let mut bytes = btf.head(signature, rotations);
                    bytes.extend(btf.dfmf(size, 0, transposed));
                    check_images(&name(signature), &bytes, &btf, |at, c| btf.dfmf_value(at, c));
                    assert_eq!(recognise(&bytes), Some(BonnKind::Dfmf));
                }
                let fmf = |at, c| {
                    if transposed { btf.transposed_fmf_value(at, c) } else { btf.fmf_value(at, c) }
                };
                for (signature, rotations) in [("!FMF06FCR", true), ("!FMF06FC", false)] {
                    let mut bytes = btf.head(signature, rotations);
                    bytes.extend(btf.fmf(size, transposed));
                    check_images(&name(signature), &bytes, &btf, fmf);
                    assert_eq!(recognise(&bytes), Some(BonnKind::Fmf));
                }
                for (signature, rotations) in [("!FMF12FCER", true), ("!FMF12FCE", false)] {
                    let mut bytes = btf.head(signature, rotations);
                    bytes.push(0);
                    bytes.extend(btf.fmf(size, transposed));
                    check_images(&name(signature), &bytes, &btf, fmf);
                    assert_eq!(recognise(&bytes), Some(BonnKind::FmfExtended));
                }
                for (signature, rotations) in [("!PVF06FCR", true), ("!PVF06FC", false)] {
                    let mut bytes = btf.head(signature, rotations);
                    bytes.extend(btf.pvf(size, transposed));
                    check_images(&name(signature), &bytes, &btf, |at, c| {
                        if transposed { btf.transposed_pvf_value(at, c) } else { btf.pvf_value(at, c) }
                    });
                    assert_eq!(recognise(&bytes), Some(BonnKind::Pvf));
                }
            }
        }
    }
}

#[test]
fn contents_say_what_the_header_says() {
    let btf = Btf { rotations: vec![[0.5; 9], [1.5; 9]], xml: b"<btf/>".to_vec(), ..Btf::small() };
    let mut bytes = btf.head("!DFMF08FCR", true);
    bytes.extend(btf.dfmf(2, 11, true));
    let archive = open(&bytes);
    let contents = archive.contents();
    assert_eq!(contents.format, "Bonn DFMF, f16, rank 2");
    assert_eq!((contents.width, contents.height), (4, 2));
    assert_eq!(contents.channels, names(&["R", "G", "B"]));
    assert_eq!(contents.sample_type, SampleType::F16);
    assert_eq!((contents.linear, contents.cosine_included), (true, true));
    let angles = |list: &[btfkit_formats::Direction]| -> Vec<(f32, f32)> {
        list.iter().map(|d| (d.theta_rad as f32, d.phi_rad as f32)).collect()
    };
    assert_eq!((angles(&contents.views), angles(&contents.lights)), (btf.views.clone(), btf.lights.clone()));
    assert_eq!(archive.rotations(), btf.rotations);
    for (key, value) in [
        ("signature", "!DFMF08FCR"),
        ("header version", "4"),
        ("measurement setup", "dome"),
        ("light source", "flash"),
        ("pixels per millimetre", "12.5"),
        ("RGB scale factors", "1, 1, 1"),
        ("XML", "6 bytes"),
        ("local frames", "2"),
        ("colour model", "11 (log Y, U / Y, V / Y)"),
        ("orientation", "transposed: pixels on the left"),
    ] {
        assert_eq!(remark(&archive, key), Some(value), "{key}");
    }
    assert_eq!(remark(&archive, "image sensor"), None);
}

#[test]
fn headers_of_every_version_are_read() {
    for version in 1..=4 {
        for cosine in [0, 1] {
            let btf = Btf { version, cosine, ..Btf::small() };
            let mut bytes = btf.head("!FMF06FCR", true);
            bytes.extend(btf.fmf(4, false));
            check_images(&format!("version {version}"), &bytes, &btf, |at, c| btf.fmf_value(at, c));
            let archive = open(&bytes);
            assert_eq!(archive.contents().cosine_included, version > 1 && cosine == 1);
            let unsure = archive.contents().assumptions.iter().any(|text| text.contains("too old to say"));
            assert_eq!(unsure, version == 1);
        }
    }
    for version in [0, 5] {
        let btf = Btf { version, ..Btf::small() };
        let mut bytes = btf.head("!FMF06FCR", true);
        bytes.extend(btf.fmf(4, false));
        assert_eq!(refusal(&bytes).kind(), ErrorKind::Unsupported);
    }
}

#[test]
fn the_older_form_of_pvf_is_read() {
    for signature in ["!PVF06FC", "!PVF06FCR"] {
        let btf = Btf::medium();
        let mut bytes = signature.as_bytes().to_vec();
        let views = btf.views.len() as u32;
        put_u32s(&mut bytes, &[301_074, btf.rank as u32, btf.width, btf.height, views]);
        btf.put_directions(&mut bytes);
        bytes.extend(btf.pvf_slots(4, false));
        check_images(signature, &bytes, &btf, |at, c| btf.pvf_value(at, c));
        let archive = open(&bytes);
        assert!(archive.contents().assumptions.iter().any(|text| text.contains("too old to say")));
        assert_eq!(remark(&archive, "header"), Some("legacy"));
        bytes[signature.len() + 16] += 1;
        assert!(refusal(&bytes).to_string().contains("3 slots for 2 views"));
    }
}

#[test]
fn an_r_that_belongs_to_the_header_size_is_told_from_the_signature() {
    // 291 bytes and 47 of XML are 0x152, whose low byte is the letter R.
    let btf = Btf { xml: vec![b'x'; 47], ..Btf::small() };
    for signature in ["!FMF06FC", "!PVF06FC", "!DFMF08FC", "!FMF12FCE"] {
        let mut bytes = btf.head(signature, false);
        assert_eq!(bytes[signature.len()], b'R');
        match signature {
            "!PVF06FC" => bytes.extend(btf.pvf(2, false)),
            "!DFMF08FC" => bytes.extend(btf.dfmf(2, 0, false)),
            "!FMF12FCE" => bytes.extend([&[0], &*btf.fmf(2, false)].concat()),
            _ => bytes.extend(btf.fmf(2, false)),
        }
        let archive = open(&bytes);
        assert_eq!(remark(&archive, "signature"), Some(signature));
        assert!(archive.read_images(&bytes, 1, 0..3).is_ok());
        // With the letter R besides: two of them.
        let marked = format!("{signature}R");
        let both = [btf.head(&marked, true), bytes[btf.head(signature, false).len()..].to_vec()].concat();
        assert_eq!(remark(&open(&both), "signature"), Some(marked.as_str()));
    }
}

#[test]
fn extension_headers_are_read() {
    let btf = Btf::small();
    let log = |at, c| f64::from((btf.fmf_value(at, c) as f32).exp() - 1e-5);
    let head = btf.head("!FMF12FCER", true);
    let height_map = [[3u32.to_le_bytes(), 2u32.to_le_bytes()].concat(), vec![0; 12]].concat();
    for (version, flag, map) in [(1u8, 0, None), (1, 1, None), (2, 1, None), (2, 0, Some(&height_map))] {
        let mut bytes = head.clone();
        bytes.push(version);
        put_u32s(&mut bytes, &[flag]);
        match map {
            Some(map) => bytes.extend(map),
            None if version == 2 => put_u32s(&mut bytes, &[0, 7]),
            None => {}
        }
        bytes.extend(btf.fmf(4, false));
        let archive = open(&bytes);
        assert_eq!(remark(&archive, "height map"), map.map(|_| "3 x 2"));
        assert_eq!(remark(&archive, "reduction of the dynamic range").is_some(), flag == 1);
        let read = archive.read_images(&bytes, 1, 0..3).unwrap().to_f32();
        let expected =
            if flag == 1 { btf.images(1, log) } else { btf.images(1, |at, c| btf.fmf_value(at, c)) };
        for (read, expected) in read.iter().zip(expected) {
            assert!((read - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{read} {expected}");
        }
    }
    let mut bytes = head;
    bytes.push(3);
    bytes.extend(btf.fmf(4, false));
    assert_eq!(refusal(&bytes).kind(), ErrorKind::Unsupported);
}

#[test]
fn spectral_channels_keep_their_wavelengths() {
    let channels = names(&["400", "412.5", "425", "1000.25"]);
    let btf = Btf { channels: channels.clone(), ..Btf::medium() };
    let mut bytes = btf.head("!DFMF08FCR", true);
    bytes.extend(btf.dfmf(2, 0, false));
    check_images("four wavelengths", &bytes, &btf, |at, c| btf.dfmf_value(at, c));
    assert_eq!(open(&bytes).contents().channels, channels);
}

#[test]
fn rows_are_turned_on_request() {
    let btf = Btf::medium();
    let mut factored = btf.head("!FMF06FCR", true);
    factored.extend(btf.fmf(2, false));
    let sparse = btf.bdi(2, |pixel| pixel % 3 != 0);
    let options = |rows| {
        let mut options = OpenOptions::default();
        options.rows = rows;
        options
    };
    for bytes in [factored, sparse] {
        let read = |rows| {
            let archive = Archive::open(&bytes, &options(rows), &Limits::default()).unwrap();
            let row = archive.contents().assumptions[0].clone();
            (row, archive.read_images(&bytes, 1, 0..6).unwrap().to_f32())
        };
        let (top, plain) = read(RowOrder::TopFirst);
        let (bottom, turned) = read(RowOrder::BottomFirst);
        assert!(top.contains("top") && bottom.contains("bottom"));
        let row = btf.width as usize * 3;
        for (plain, turned) in plain.chunks(5 * row).zip(turned.chunks(5 * row)) {
            assert!(plain.chunks(row).eq(turned.chunks(row).rev()) && plain != turned);
        }
    }
}

#[test]
fn orientation_that_the_sizes_leave_open_is_an_assumption() {
    let assumed = |btf: &Btf, payload: Vec<u8>, signature: &str| {
        let bytes = [btf.head(signature, true), payload].concat();
        let archive = open(&bytes);
        let said = archive.contents().assumptions.iter().any(|text| text.contains("usual orientation"));
        (said, archive.read_images(&bytes, 1, 0..btf.lights.len()).unwrap().to_f32())
    };
    // Six pairs, six pixels; for PVF three lights, three pixels.
    let six = Btf { width: 3, ..Btf::small() };
    let three = Btf { width: 3, height: 1, ..Btf::small() };
    let expected = (true, six.images(1, |at, c| six.dfmf_value(at, c)));
    assert_eq!(assumed(&six, six.dfmf(4, 0, false), "!DFMF08FCR"), expected);
    let expected = (true, six.images(1, |at, c| six.fmf_value(at, c)));
    assert_eq!(assumed(&six, six.fmf(4, false), "!FMF06FCR"), expected);
    let expected = (true, three.images(1, |at, c| three.pvf_value(at, c)));
    assert_eq!(assumed(&three, three.pvf(4, false), "!PVF06FCR"), expected);
    assert!(!assumed(&Btf::small(), Btf::small().fmf(4, false), "!FMF06FCR").0);
}

#[test]
fn light_lists_that_differ_are_told() {
    let btf = Btf::small();
    let whole = [btf.head("!FMF06FCR", true), btf.fmf(4, false)].concat();
    let said = |bytes: &[u8]| open(bytes).contents().assumptions.iter().any(|t| t.contains("view 1"));
    assert!(!said(&whole));
    // Views start after the signature, 291 bytes and their number; a view is 12 bytes and its lights.
    let second_view = 9 + 291 + 4 + 12 + 3 * 8;
    let mut other_phi = whole.clone();
    other_phi[second_view + 12 + 4..][..4].copy_from_slice(&0.7f32.to_le_bytes());
    assert!(said(&other_phi));
    let mut other_number = whole;
    other_number[second_view + 8] = 2;
    assert_eq!(refusal(&other_number).kind(), ErrorKind::Unsupported);
}

#[test]
fn uncompressed_files_are_read_full_and_sparse() {
    let btf = Btf { rotations: vec![[2.0; 9]], ..Btf::medium() };
    let full = btf.bdi(0, |pixel| pixel != 7);
    check_images("full", &full, &btf, |at, c| btf.dfmf_value(at, c));
    assert_eq!(open(&full).contents().format, "Bonn BDI, f16, full");
    assert_eq!(remark(&open(&full), "pixels marked as missing"), Some("1, read as stored"));
    // 115 pixels of which 57 are stored: three chunks of 23, the last of 11.
    let present = |pixel: usize| pixel % 2 == 1;
    let sparse = btf.bdi(2, present);
    check_images("sparse", &sparse, &btf, |at, c| if present(at[2]) { btf.dfmf_value(at, c) } else { 0.0 });
    let archive = open(&sparse);
    assert_eq!(archive.contents().format, "Bonn BDI, f16, sparse");
    assert_eq!(remark(&archive, "pixels marked as missing"), Some("58, read as 0"));
    assert_eq!((archive.kind(), archive.rotations().len()), (BonnKind::Bdi, 1));
    assert!(archive.contents().assumptions.iter().any(|text| text.contains("mask")));
    let error = refusal(&btf.bdi(1, |_| true));
    assert!(error.kind() == ErrorKind::Unsupported && error.to_string().contains("bzip2"), "{error}");
    assert_eq!(refusal(&btf.bdi(3, |_| true)).kind(), ErrorKind::Malformed);
    assert!(refusal(&btf.bdi(2, |_| false)).to_string().contains("excludes all"));
}

/// A grey FMF file of one pixel and one pair, whose sample is the product of two scalars.
fn product(size: u8, left: f64, right: f64) -> Vec<u8> {
    let btf = Btf {
        channels: names(&["Y"]),
        views: directions(1),
        lights: directions(1),
        width: 1,
        height: 1,
        ..Btf::small()
    };
    let mut bytes = btf.head("!FMF06FCR", true);
    put_u32s(&mut bytes, &[1]);
    bytes.push(size);
    put_u32s(&mut bytes, &[1, 1, 1]);
    put_scalars(&mut bytes, size, &[1.0, left, right]);
    bytes
}

#[test]
fn sums_beyond_the_range_of_half_precision_become_its_ends() {
    for (left, right, expected) in
        [(300.0, 300.0, 65504.0), (300.0, -300.0, -65504.0), (2.0, 3.0, 6.0), (2.0, 32752.0, 65504.0)]
    {
        let bytes = product(2, left, right);
        let Samples::F16(samples) = open(&bytes).read_images(&bytes, 0, 0..1).unwrap() else { panic!() };
        assert_eq!(samples[0].to_f64(), expected);
        let bytes = product(8, left, right);
        let Samples::F32(samples) = open(&bytes).read_images(&bytes, 0, 0..1).unwrap() else { panic!() };
        assert_eq!(f64::from(samples[0]), left * right);
    }
}

#[test]
fn sums_that_are_not_finite_are_errors() {
    for (size, value) in [(2, f64::INFINITY), (4, f64::NAN), (8, 1e300)] {
        let bytes = product(size, value, 1.0);
        let error = open(&bytes).read_images(&bytes, 0, 0..1).unwrap_err();
        assert!(error.kind() == ErrorKind::Malformed && error.to_string().contains("not finite"), "{error}");
    }
    let btf = Btf::small();
    let mut bytes = btf.bdi(0, |_| true);
    let end = bytes.len();
    bytes[end - 2..].copy_from_slice(&[0, 0x7c]);
    assert!(open(&bytes).read_images(&bytes, 0, 0..3).is_ok());
    assert_eq!(open(&bytes).read_images(&bytes, 1, 0..3).unwrap_err().kind(), ErrorKind::Malformed);
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let btf = Btf::small();
    let bytes = [btf.head("!FMF06FCR", true), btf.fmf(2, false)].concat();
    let archive = open(&bytes);
    let kind = |bytes: &[u8], view, lights| archive.read_images(bytes, view, lights).unwrap_err().kind();
    assert_eq!(kind(&bytes, 2, 0..1), ErrorKind::Argument);
    assert_eq!(kind(&bytes, 0, 0..4), ErrorKind::Argument);
    #[allow(clippy::reversed_empty_ranges)] // it is what is tested
    let backwards = 2..1;
    assert_eq!(kind(&bytes, 0, backwards), ErrorKind::Argument);
    assert_eq!(kind(&bytes[1..], 0, 0..1), ErrorKind::Argument);
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 2 * 3 * 8;
    let archive = Archive::open(&bytes, &OpenOptions::default(), &limits).unwrap();
    assert!(archive.read_images(&bytes, 0, 0..1).is_ok());
    assert_eq!(archive.read_images(&bytes, 0, 0..2).unwrap_err().kind(), ErrorKind::Limit);
}

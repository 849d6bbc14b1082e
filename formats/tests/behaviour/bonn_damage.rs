//! Bonn containers cut, flipped and made up: refused or read, never a panic or a large allocation.

use btfkit_formats::bonn::{Archive, OpenOptions};
use btfkit_formats::{ErrorKind, Images, Limits};

use crate::bonn_support::{Btf, directions, put_u32s};

/// Bytes from the signature `!FMF06FCR` to the number of views, in version 4 with channels R, G, B.
const HEADER: usize = 9 + 291;

/// A file of every kind.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let btf = Btf {
        rotations: vec![[1.0; 9]],
        xml: b"<a/>".to_vec(),
        lights: directions(2),
        width: 3,
        ..Btf::small()
    };
    let file =
        |signature: &str, payload: Vec<u8>| [btf.head(signature, signature.ends_with('R')), payload].concat();
    let mut extension = vec![2, 1, 0, 0, 0];
    put_u32s(&mut extension, &[2, 1, 0]);
    let mut legacy = b"!PVF06FC".to_vec();
    put_u32s(&mut legacy, &[301_074, 2, btf.width, btf.height, 2]);
    btf.put_directions(&mut legacy);
    legacy.extend(btf.pvf_slots(2, false));
    vec![
        ("DFMF", file("!DFMF08FCR", btf.dfmf(2, 11, false))),
        ("DFMF without rotations", file("!DFMF08FC", btf.dfmf(4, 3, true))),
        ("FMF", file("!FMF06FCR", btf.fmf(2, false))),
        ("FMF with extension", file("!FMF12FCER", [extension, btf.fmf(8, true)].concat())),
        ("PVF", file("!PVF06FC", btf.pvf(2, true))),
        ("legacy PVF", legacy),
        ("full BDI", btf.bdi(0, |_| true)),
        ("sparse BDI", btf.bdi(2, |pixel| pixel != 1)),
    ]
}

/// Little room, so that an allocation that a header merely claims is refused.
fn tight() -> Limits {
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 1 << 20;
    limits
}

fn open(bytes: &[u8]) -> btfkit_formats::Result<Archive> {
    Archive::open(bytes, &OpenOptions::default(), &tight())
}

#[test]
fn a_container_cut_or_continued_anywhere_is_an_error() {
    for (name, whole) in files() {
        assert!(open(&whole).is_ok(), "{name}");
        for end in 0..whole.len() {
            let error = open(&whole[..end]).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Malformed, "{name}, {end} of {}: {error}", whole.len());
            assert!(error.offset().is_some(), "{name}, {end}: {error}");
        }
        for extra in [1, 4, 1000] {
            let longer = [whole.clone(), vec![0; extra]].concat();
            assert_eq!(open(&longer).unwrap_err().kind(), ErrorKind::Malformed, "{name} and {extra}");
        }
    }
}

#[test]
fn a_flipped_bit_in_a_container_never_panics() {
    for (name, whole) in files() {
        let mut refused = 0;
        for bit in 0..whole.len() * 8 {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            let Ok(archive) = open(&flipped) else {
                refused += 1;
                continue;
            };
            let contents = archive.contents();
            for view in 0..contents.views.len() {
                let _ = archive.read_images(&flipped, view, 0..contents.lights.len());
            }
        }
        // Texts, angles, colours and matrices may be anything; sizes and counts may not.
        assert!(refused > 8 * 40, "{name}: {refused}");
    }
}

/// The kind of refusal when a `u32` of an FMF file is another.
fn with(at: usize, value: u32) -> ErrorKind {
    let btf = Btf::small();
    let mut bytes = [btf.head("!FMF06FCR", true), btf.fmf(2, false)].concat();
    assert!(open(&bytes).is_ok());
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    open(&bytes).unwrap_err().kind()
}

#[test]
fn nonsense_headers_are_refused_with_a_reason() {
    let size = HEADER + 4 + 2 * (12 + 3 * 8);
    let matrices = size + 8 + 4;
    for (at, value, kind) in [
        (9, 290, ErrorKind::Malformed), // size of the header
        (9, u32::MAX, ErrorKind::Malformed),
        (HEADER, u32::MAX, ErrorKind::Limit), // views
        (HEADER, 60_000, ErrorKind::Malformed),
        (HEADER, 0, ErrorKind::Malformed),
        (HEADER + 12, u32::MAX, ErrorKind::Limit), // lights
        (HEADER + 12, 65_536, ErrorKind::Malformed),
        (HEADER + 12, 0, ErrorKind::Malformed),
        (HEADER + 4, 0x7fc0_0000, ErrorKind::Malformed), // theta: not a number, negative, large
        (HEADER + 4, 0xbf00_0000, ErrorKind::Malformed),
        (HEADER + 4, 0x4100_0000, ErrorKind::Malformed),
        (size, 1 << 31, ErrorKind::Limit), // width
        (size, 0, ErrorKind::Malformed),
        (size, 5, ErrorKind::Malformed),
        (size + 4, 1 << 24, ErrorKind::Malformed), // height: 2^26 pixels, but no such matrix
        (size + 8, u32::MAX, ErrorKind::Limit),    // rotations
        (size + 8, 1 << 26, ErrorKind::Malformed),
        (matrices, 1, ErrorKind::Malformed),     // declared rank
        (matrices + 5, 0, ErrorKind::Malformed), // rank
        (matrices + 5, u32::MAX, ErrorKind::Malformed),
        (matrices + 9, u32::MAX, ErrorKind::Malformed), // rows
        (matrices + 13, 7, ErrorKind::Malformed),
    ] {
        assert_eq!(with(at, value), kind, "byte {at}, {value}");
    }
    let btf = Btf { width: 1 << 31, height: 1 << 31, ..Btf::small() };
    let error = open(&btf.head("!DFMF08FCR", true)).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("byte {}: found 2147483648 x 2147483648 pixels, expected at most 67108864", size + 1)
    );
}

#[test]
fn numbers_of_channels_are_limited() {
    let few = Btf { channels: vec![String::new(); 1024], ..Btf::small() };
    let whole = [few.head("!FMF06FCR", true), few.fmf(2, false)].concat();
    assert!(open(&whole).is_ok());
    let many = Btf { channels: vec![String::new(); 1025], ..Btf::small() };
    assert_eq!(open(&many.head("!FMF06FCR", true)).unwrap_err().kind(), ErrorKind::Limit);
    let none = Btf { channels: Vec::new(), ..Btf::small() };
    assert_eq!(open(&none.head("!FMF06FCR", true)).unwrap_err().kind(), ErrorKind::Malformed);
}

#[test]
fn other_files_are_refused() {
    for bytes in [&b""[..], b"!", b"4627\n1\n", b"!DFMF", b"!BDIF06R", b"!PVF07FCR......", b"PK\x03\x04"] {
        let error = open(bytes).unwrap_err();
        assert!(error.kind() == ErrorKind::Malformed && error.to_string().contains("signature"), "{error}");
    }
}

#[test]
fn a_small_file_does_not_buy_a_large_allocation() {
    // 2^16 lights and 2^14 pixels are announced by a rank-1 file of a few hundred kB: 6 GB of samples.
    let lights = vec![(0.1, 0.2); 1 << 16];
    let btf = Btf { views: directions(1), lights, width: 1 << 7, height: 1 << 7, rank: 1, ..Btf::small() };
    let bytes = [btf.head("!FMF06FCR", true), btf.fmf(2, false)].concat();
    let archive = open(&bytes).unwrap();
    assert_eq!(archive.read_images(&bytes, 0, 0..1 << 16).unwrap_err().kind(), ErrorKind::Limit);
    assert!(archive.read_images(&bytes, 0, 65_530..65_536).is_ok());
}

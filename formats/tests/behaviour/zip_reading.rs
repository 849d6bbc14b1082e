//! Good zips are read whole, bad ones are refused for the right reason.

use std::borrow::Cow;

use btfkit_formats::zip::{Method, ZipEntry, ZipIndex};
use btfkit_formats::{Error, ErrorKind, Limits};

use crate::support::{RawEntry, deflate, raw_zip, raw_zip_declaring};

fn open(entries: &[RawEntry]) -> Result<ZipIndex, Error> {
    ZipIndex::open(&raw_zip(entries), &Limits::default())
}

/// Opens, reads the only entry, and gives the error that one of the two must meet.
fn refusal(entry: RawEntry) -> Error {
    let zip = raw_zip(&[entry]);
    ZipIndex::open(&zip, &Limits::default())
        .and_then(|index| index.read(&zip, 0).map(Cow::into_owned))
        .unwrap_err()
}

#[test]
fn stored_entries_are_borrowed_and_deflated_ones_inflated() {
    let long = b"abc".repeat(1000);
    let zip = raw_zip(&[
        RawEntry::stored("folder/", b""),
        RawEntry::stored("folder/a.txt", b"hello"),
        RawEntry::deflated("ä.bin", &long),
        RawEntry::deflated("empty", b""),
    ]);
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    let names: Vec<&str> = index.entries().iter().map(ZipEntry::name).collect();
    assert_eq!(names, ["folder/a.txt", "ä.bin", "empty"]);
    assert_eq!(index.entries()[0].method(), Method::Stored);
    assert_eq!(&zip[index.entries()[0].compressed_range()], b"hello");
    assert!(matches!(index.read(&zip, 0).unwrap(), Cow::Borrowed(b"hello")));
    assert_eq!(index.entries()[1].method(), Method::Deflated);
    assert_eq!(index.entries()[1].uncompressed_bytes(), 3000);
    assert_eq!(*index.read(&zip, 1).unwrap(), *long);
    assert!(index.read(&zip, 2).unwrap().is_empty());
    assert_eq!(index.read(&zip, 3).unwrap_err().kind(), ErrorKind::Argument);
    assert_eq!(index.read(&zip[..40], 0).unwrap_err().kind(), ErrorKind::Malformed);
}

#[test]
fn zip64_sizes_are_read() {
    let data = vec![7u8; 5000];
    let zip = raw_zip(&[
        RawEntry { zip64: true, ..RawEntry::stored("a", &data) },
        RawEntry { zip64: true, ..RawEntry::deflated("b", &data) },
    ]);
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    assert_eq!(*index.read(&zip, 0).unwrap(), *data);
    assert_eq!(*index.read(&zip, 1).unwrap(), *data);
}

#[test]
fn bytes_before_the_archive_are_allowed() {
    let mut zip = b"#!/bin/sh a self-extracting header".to_vec();
    zip.extend(raw_zip(&[RawEntry::stored("a", b"hello")]));
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    assert_eq!(*index.read(&zip, 0).unwrap(), *b"hello");
}

#[test]
fn names_that_escape_are_refused() {
    for name in ["../a", "/a", "a/../../b", "..\\a", "C:\\a", ""] {
        let error = open(&[RawEntry::stored(name, b"x")]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{name:?}: {error}");
    }
}

#[test]
fn names_without_the_flag_of_utf8_are_of_code_page_437() {
    let name = |name: &[u8]| RawEntry { name: name.to_vec(), ..RawEntry::stored("", b"x") };
    let zip = raw_zip(&[name(b"Gr\x81n/a.jpg"), name("Grün/b.jpg".as_bytes())]);
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    let names: Vec<&str> = index.entries().iter().map(ZipEntry::name).collect();
    assert_eq!(names, ["Grün/a.jpg", "Grün/b.jpg"]);
    assert_eq!(*index.read(&zip, 0).unwrap(), *b"x");
    // What the name becomes must be safe, and no name twice.
    assert!(open(&[name(b"../\x81")]).is_err());
    assert!(open(&[name(b"\x81"), name("ü".as_bytes())]).is_err());
}

#[test]
fn duplicate_names_are_refused() {
    let error = open(&[RawEntry::stored("a", b"x"), RawEntry::stored("a", b"y")]).unwrap_err();
    assert_eq!((error.kind(), error.entry()), (ErrorKind::Malformed, Some("a")));
}

#[test]
fn encryption_and_other_methods_are_unsupported() {
    for flags in [1, 1 | 1 << 6, 1 << 13] {
        let error = open(&[RawEntry { flags, ..RawEntry::stored("a", b"x") }]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    }
    let error = open(&[RawEntry { method: 14, ..RawEntry::stored("a", b"x") }]).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("14"), "{error}");
}

#[test]
fn the_checksum_is_always_verified() {
    for entry in [RawEntry::stored("a", b"hello"), RawEntry::deflated("a", b"hello")] {
        let error = refusal(RawEntry { crc32: 0x1234_5678, ..entry });
        assert!(error.to_string().contains("12345678"), "{error}");
    }
}

#[test]
fn deflate_must_give_exactly_the_declared_size() {
    let good = RawEntry::deflated("a", &[9; 500]);
    for uncompressed in [0, 499, 501, 5000] {
        let error = refusal(RawEntry { uncompressed, ..good.clone() });
        assert_eq!(error.kind(), ErrorKind::Malformed, "{uncompressed}: {error}");
    }
    let mut trailing = good.clone();
    trailing.data.push(0);
    assert!(refusal(trailing).to_string().contains("compressed bytes of which"));
    let mut cut = good.clone();
    cut.data.pop();
    assert!(refusal(cut).to_string().contains("stop"));
    let mut garbage = good;
    garbage.data.fill(0xFF);
    assert_eq!(refusal(garbage).kind(), ErrorKind::Malformed);
}

#[test]
fn a_stored_entry_cannot_change_its_size() {
    for uncompressed in [4, 6] {
        let error = refusal(RawEntry { uncompressed, ..RawEntry::stored("a", b"hello") });
        assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");
    }
}

#[test]
fn bombs_are_refused_before_they_are_inflated() {
    let limits = Limits::default();
    let honest_bomb = RawEntry::deflated("a", &vec![0; 3 << 20]);
    let mut small = Limits::default();
    small.max_entry_bytes = 1 << 20;
    let error = ZipIndex::open(&raw_zip(std::slice::from_ref(&honest_bomb)), &small).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");

    // It says that it is small: inflating stops one byte after the declared size.
    let error = refusal(RawEntry { uncompressed: 1000, ..honest_bomb });
    assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");

    // It says that it is larger than deflate can make of its bytes.
    let boast = RawEntry { uncompressed: limits.max_entry_bytes, ..RawEntry::deflated("a", b"hello") };
    let error = ZipIndex::open(&raw_zip(&[boast]), &limits).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");

    let huge = RawEntry { uncompressed: u64::MAX, zip64: true, ..RawEntry::deflated("a", b"hello") };
    assert_eq!(ZipIndex::open(&raw_zip(&[huge]), &limits).unwrap_err().kind(), ErrorKind::Limit);
}

#[test]
fn entries_that_share_bytes_are_refused() {
    // The first entry's data are the whole second entry, local header included.
    let inner = RawEntry::stored("b", b"hello");
    let inner_zip = raw_zip(std::slice::from_ref(&inner));
    let local_bytes = 30 + 1 + 5;
    let outer = RawEntry::stored("a", &inner_zip[..local_bytes]);
    let mut zip = raw_zip(&[outer, inner]);
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    let first = index.entries()[0].compressed_range();
    // Point the second directory record at the copy inside the first entry.
    let directory = index.entries()[1].compressed_range().end;
    let second_record = directory + 46 + 1;
    let offset_field = second_record + 42;
    zip[offset_field..offset_field + 4].copy_from_slice(&(first.start as u32).to_le_bytes());
    let error = ZipIndex::open(&zip, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("overlap"), "{error}");
}

#[test]
fn data_that_run_into_the_directory_are_refused() {
    let mut zip = raw_zip(&[RawEntry::stored("a", b"hello")]);
    let directory = 30 + 1 + 5;
    for size_field in [directory + 20, directory + 24] {
        zip[size_field] += 1;
    }
    let error = ZipIndex::open(&zip, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("before the directory"), "{error}");
}

#[test]
fn headers_that_disagree_are_refused() {
    let zip = raw_zip(&[RawEntry::stored("abc", b"hello")]);
    let mut renamed = zip.clone();
    renamed[30] = b'x';
    let error = ZipIndex::open(&renamed, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("xbc"), "{error}");
    let mut method = zip;
    method[8] = 8;
    assert!(ZipIndex::open(&method, &Limits::default()).is_err());
}

#[test]
fn the_number_of_entries_must_be_the_declared_one() {
    let entries = [RawEntry::stored("a", b"x"), RawEntry::stored("b", b"y")];
    for declared in [0, 1, 3] {
        let error = ZipIndex::open(&raw_zip_declaring(&entries, declared), &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");
    }
    let mut one = Limits::default();
    one.max_entries = 1;
    for declared in [0, 2] {
        let error = ZipIndex::open(&raw_zip_declaring(&entries, declared), &one).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
    }
}

#[test]
fn what_is_no_zip_is_refused() {
    for bytes in [&b""[..], b"PK", b"hello", &[0; 100], &deflate(b"x")] {
        assert_eq!(ZipIndex::open(bytes, &Limits::default()).unwrap_err().kind(), ErrorKind::Malformed);
    }
}

#[test]
fn a_symbolic_link_is_refused() {
    let mut zip = raw_zip(&[RawEntry::stored("link.jpg", b"/etc/passwd")]);
    assert!(ZipIndex::open(&zip, &Limits::default()).is_ok());
    let directory = zip.windows(4).position(|bytes| bytes == b"PK\x01\x02").unwrap();
    // Made by Unix; the upper half of the external attributes is the mode.
    zip[directory + 5] = 3;
    zip[directory + 40..directory + 42].copy_from_slice(&0o120_777u16.to_le_bytes());
    let error = ZipIndex::open(&zip, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("symbolic link"), "{error}");
}

#[test]
fn a_unicode_path_counts_where_it_is_of_the_name() {
    let field = |version: u8, of: &[u8], name: &[u8]| {
        let data = [&[version][..], &crate::support::crc32(of).to_le_bytes(), name].concat();
        [&0x7075u16.to_le_bytes()[..], &(data.len() as u16).to_le_bytes(), &data].concat()
    };
    let other = [&[9u8, 9, 1, 0, 7][..], &field(1, b"Gr?n.jpg", "Grün.jpg".as_bytes())].concat();
    let name_of = |more: Vec<u8>| {
        let entry = RawEntry { more, ..RawEntry::stored("Gr?n.jpg", b"x") };
        open(&[entry]).map(|index| index.entries()[0].name().to_owned())
    };
    for (more, name) in [
        (field(1, b"Gr?n.jpg", "Grün.jpg".as_bytes()), "Grün.jpg"),
        (other, "Grün.jpg"),
        (field(2, b"Gr?n.jpg", "Grün.jpg".as_bytes()), "Gr?n.jpg"),
        (field(1, b"another.jpg", "Grün.jpg".as_bytes()), "Gr?n.jpg"),
        (field(1, b"Gr?n.jpg", b"Gr\xfcn.jpg"), "Gr?n.jpg"),
        (field(1, b"Gr?n.jpg", b""), "Gr?n.jpg"),
        (vec![0x75, 0x70, 3, 0, 1, 0, 0], "Gr?n.jpg"),
    ] {
        assert_eq!(name_of(more).unwrap(), name);
    }
    assert!(name_of(field(1, b"Gr?n.jpg", b"../a.jpg")).unwrap_err().to_string().contains("climbs"));
}

//! What the writer writes, the reader reads; and the same input gives the same bytes.

use std::io::Write;

use btfkit_formats::zip::{Method, ZipIndex, ZipWriter};
use btfkit_formats::{ErrorKind, Limits};

fn write(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Vec::new());
    for (name, data) in entries {
        writer.write_entry(name, data).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn round_trip() {
    let entries: Vec<(String, Vec<u8>)> =
        (0..50usize).map(|i| (format!("f{}/ä {i}.jpg", i % 7), vec![i as u8; i * i])).collect();
    let zip = write(&entries);
    assert_eq!(zip, write(&entries), "the same entries give the same bytes");
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    assert_eq!(index.entries().len(), entries.len());
    for (i, (name, data)) in entries.iter().enumerate() {
        assert_eq!(index.entries()[i].name(), name);
        assert_eq!(index.entries()[i].method(), Method::Stored);
        assert_eq!(*index.read(&zip, i).unwrap(), **data);
    }
}

#[test]
fn an_empty_archive_is_an_archive() {
    assert!(ZipIndex::open(&write(&[]), &Limits::default()).unwrap().entries().is_empty());
}

#[test]
fn more_entries_than_the_old_format_can_count() {
    let entries: Vec<(String, Vec<u8>)> =
        (0..65_537u32).map(|i| (format!("{i}"), i.to_le_bytes().to_vec())).collect();
    let zip = write(&entries);
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    assert_eq!(index.entries().len(), 65_537);
    assert_eq!(*index.read(&zip, 65_536).unwrap(), 65_536u32.to_le_bytes());
}

#[test]
fn names_that_cannot_be_read_back_are_refused_and_leave_the_archive_whole() {
    let mut writer = ZipWriter::new(Vec::new());
    writer.write_entry("a", b"1").unwrap();
    for name in ["", "/a", "../a", "a/", "a//b", "./a", "a\\b", "a"] {
        let error = writer.write_entry(name, b"2").unwrap_err();
        assert_eq!((error.kind(), error.entry()), (ErrorKind::Argument, Some(name)));
    }
    let zip = writer.finish().unwrap();
    let index = ZipIndex::open(&zip, &Limits::default()).unwrap();
    assert_eq!(index.entries().len(), 1);
}

/// Takes so many bytes, then is full.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        let taken = data.len().min(self.0);
        self.0 -= taken;
        if taken == 0 { Err(std::io::Error::other("disk full")) } else { Ok(taken) }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_reported_wherever_it_strikes() {
    let whole = write(&[("a".into(), vec![1; 100])]).len();
    for room in 0..whole {
        let mut writer = ZipWriter::new(Full(room));
        let error = match writer.write_entry("a", &[1; 100]) {
            Ok(()) => writer.finish().err().unwrap(),
            Err(error) => error,
        };
        assert_eq!(error.kind(), ErrorKind::Io, "{room}: {error}");
    }
    let mut writer = ZipWriter::new(Full(whole));
    writer.write_entry("a", &[1; 100]).unwrap();
    writer.finish().unwrap();
}

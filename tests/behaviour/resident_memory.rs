//! Memory as the system counts it: what is resident of the program, pages of mapped archives included.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use btfkit_formats::npy::{directions_file, header};
use btfkit_formats::{Direction, SampleType};

use crate::fixture::btf;

const MIB: u64 = 1 << 20;

/// The most memory of a command, as far as it was looked at: of its own, and of files below a folder. Bytes.
struct Peak {
    own: u64,
    mapped: u64,
    code: Option<i32>,
}

/// Runs a command and looks at it again and again. A peak between two looks is missed, so a test may pass that should
/// not; none fails that should pass.
fn peak(command: &mut Command, folder: &Path) -> Peak {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let (mut own, mut mapped) = (0, 0);
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        let read =
            |name: &str| std::fs::read_to_string(format!("/proc/{}/{name}", child.id())).unwrap_or_default();
        own = own.max(kib(read("status").lines().find_map(|line| line.strip_prefix("RssAnon:"))));
        let smaps = read("smaps");
        let mut in_folder = false;
        let mut sum = 0;
        for line in smaps.lines() {
            if let Some(resident) = line.strip_prefix("Rss:") {
                sum += if in_folder { kib(Some(resident)) } else { 0 };
            } else if line.split(' ').next().is_some_and(|first| first.contains('-') && !first.ends_with(':'))
            {
                in_folder = line.contains(&*folder.to_string_lossy());
            }
        }
        mapped = mapped.max(sum);
    };
    Peak { own, mapped, code }
}

/// `  123 kB` in bytes.
fn kib(text: Option<&str>) -> u64 {
    let number = text.and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok());
    number.unwrap_or(0) * 1024
}

/// A zip of stored entries of zeros.
fn zip(path: &Path, entries: usize, bytes: usize) {
    let mut file = std::fs::File::create(path).unwrap();
    let zeros = vec![0; bytes];
    let crc = crc32fast::hash(&zeros);
    let mut directory = Vec::new();
    let mut offset = 0u32;
    for number in 0..entries {
        let name = format!("{number:04}.bin");
        let mut common = Vec::new();
        for half in [20u16, 0, 0, 0, 0] {
            common.extend(half.to_le_bytes());
        }
        for word in [crc, bytes as u32, bytes as u32] {
            common.extend(word.to_le_bytes());
        }
        common.extend((name.len() as u16).to_le_bytes());
        common.extend(0u16.to_le_bytes());
        file.write_all(&[b"PK\x03\x04", common.as_slice(), name.as_bytes()].concat()).unwrap();
        file.write_all(&zeros).unwrap();
        directory
            .extend([b"PK\x01\x02\x14\x00", common.as_slice(), &[0; 10], &offset.to_le_bytes()].concat());
        directory.extend(name.as_bytes());
        offset += (30 + name.len() + bytes) as u32;
    }
    file.write_all(&directory).unwrap();
    let mut end = b"PK\x05\x06\x00\x00\x00\x00".to_vec();
    end.extend([(entries as u16).to_le_bytes(), (entries as u16).to_le_bytes()].concat());
    end.extend((directory.len() as u32).to_le_bytes());
    end.extend(offset.to_le_bytes());
    end.extend([0, 0]);
    file.write_all(&end).unwrap();
}

/// A numpy array of 2 views under 32 lights, 8 bits: 64 MiB.
fn npy(path: &Path) {
    let mut file = std::fs::File::create(path).unwrap();
    file.write_all(&header([2, 32, 1024, 1024, 1], SampleType::U8)).unwrap();
    (0..64).for_each(|image| file.write_all(&vec![image; MIB as usize]).unwrap());
    for (name, count) in [("a.views.npy", 2), ("a.lights.npy", 32)] {
        let direction =
            |n: usize| Direction::from_degrees(75.0 * n as f64 / count as f64, 30.0 * n as f64 % 360.0);
        let list: Vec<Direction> = (0..count).map(direction).collect();
        std::fs::write(path.with_file_name(name), directions_file(&list)).unwrap();
    }
}

#[test]
fn pages_of_an_archive_that_have_been_passed_are_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| -> PathBuf { folder.path().join(name) };
    zip(&place("a.zip"), 64, MIB as usize);
    npy(&place("a.npy"));
    // Listed, then refused, since there is no picture in it.
    let listed = peak(btf().arg("info").arg(place("a.zip")), folder.path());
    assert_eq!(listed.code, Some(65));
    assert!(listed.mapped <= 12 * MIB, "{} MiB of a zip that is listed", listed.mapped / MIB);
    let allowed = 224;
    for words in
        [&["import", "a.npy", "a.zarr"][..], &["check", "a.npy"], &["verify", "a.zarr", "--source", "a.npy"]]
    {
        let mut command = btf();
        command.current_dir(folder.path()).args(words).args(["--threads", "2"]);
        command.args(["--memory", &format!("{allowed}MiB")]);
        let found = peak(&mut command, folder.path());
        assert!(matches!(found.code, Some(0 | 65)), "{command:?}: {:?}", found.code);
        assert!(found.mapped <= 24 * MIB, "{command:?}: {} MiB mapped", found.mapped / MIB);
        let sum = (found.own + found.mapped) / MIB;
        assert!(sum <= allowed, "{command:?}: {sum} MiB");
    }
}

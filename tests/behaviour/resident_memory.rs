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

/// A numpy array of so many views and lights of a square plane, 8 bits; each image is made of their numbers.
fn npy(path: &Path, [views, lights, side]: [usize; 3], image: impl Fn(usize, usize) -> Vec<u8>) {
    let mut file = std::fs::File::create(path).unwrap();
    let shape = [views, lights, side, side, 1].map(|count| count as u64);
    file.write_all(&header(shape, SampleType::U8)).unwrap();
    for view in 0..views {
        (0..lights).for_each(|light| file.write_all(&image(view, light)).unwrap());
    }
    for (name, count) in [("views.npy", views), ("lights.npy", lights)] {
        let direction =
            |n: usize| Direction::from_degrees(75.0 * n as f64 / count as f64, 30.0 * n as f64 % 360.0);
        let list: Vec<Direction> = (0..count).map(direction).collect();
        std::fs::write(path.with_extension(name), directions_file(&list)).unwrap();
    }
}

#[test]
fn pages_of_an_archive_that_have_been_passed_are_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| -> PathBuf { folder.path().join(name) };
    zip(&place("a.zip"), 64, MIB as usize);
    // 64 MiB.
    npy(&place("a.npy"), [2, 32, 1024], |view, light| vec![(32 * view + light) as u8; MIB as usize]);
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

/// More codes than memory holds: whatever is kept from pass to pass, of blocks and of bounds, and whatever the threads.
#[test]
fn a_clustering_stays_within_its_memory() {
    const SIDE: usize = 448;
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| -> PathBuf { folder.path().join(name) };
    // 55 MiB of codes.
    npy(&place("a.npy"), [17, 17, SIDE], |view, light| {
        let grey = |at: usize| {
            let (y, x) = (at / SIDE, at % SIDE);
            ((y / 7 * 37 + x / 9 * 91) % 160 + (3 * view + 2 * light + y + x) % 64) as u8
        };
        (0..SIDE * SIDE).map(grey).collect()
    });
    crate::fixture::succeed(btf().arg("import").args([place("a.npy"), place("a.zarr")]));
    for (allowed, threads) in [(84, 1), (84, 4), (100, 4)] {
        let model = place(&format!("{allowed}-{threads}.zarr"));
        crate::fixture::succeed(btf().arg("tile").args([&place("a.zarr"), &model]).args(["--tile", "none"]));
        let mut command = btf();
        command.arg("cluster").args([&place("a.zarr"), &model]);
        command.args(["--clusters", "32", "--sample", "1000", "--passes", "3", "--tolerance", "0"]);
        command.args(["--threads", &threads.to_string(), "--memory", &format!("{allowed}MiB")]);
        let found = peak(&mut command, folder.path());
        let sum = (found.own + found.mapped) / MIB;
        println!("{allowed} MiB, {threads} threads: {sum} MiB");
        assert_eq!(found.code, Some(0));
        // Room to spare, also for what an observer counts beside it: some 20 MiB of the program's code.
        assert!(sum + 24 <= allowed, "{threads} threads: {sum} of {allowed} MiB");
    }
}

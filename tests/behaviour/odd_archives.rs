//! Archives as other people's programs leave them: lists for other names and folders, other encodings, files beside.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use btfkit::store::measurement::Measurement;
use btfkit_formats::jpeg;
use btfkit_formats::picture::{self, Picture};
use btfkit_formats::{Samples, zip};
use tempfile::TempDir;

use crate::fixture::{btf, fail, succeed};

/// A grey picture of one value.
pub(crate) fn png(value: u8) -> Vec<u8> {
    let samples = Samples::U8(vec![value; 64]);
    picture::png::encode(&Picture { width: 8, height: 8, channels: vec!["Y".to_owned()], samples }).unwrap()
}

/// A folder of files, and the folder that holds it.
pub(crate) fn set(files: &[(&str, Vec<u8>)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("set");
    for (name, bytes) in files {
        let path = root.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    (folder, root)
}

/// Three pictures of the values 10, 20, 30, by these names.
pub(crate) fn three(names: [&str; 3]) -> Vec<(&str, Vec<u8>)> {
    names.into_iter().zip([10, 20, 30]).map(|(name, value)| (name, png(value))).collect()
}

/// The azimuth of the light under which each value was taken, whole degrees.
pub(crate) fn azimuths(archive: &Path) -> Vec<(u8, i64)> {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("s.zarr");
    succeed(btf().arg("import").args([archive, &store]));
    let measurement = Measurement::open(&store).unwrap();
    let description = measurement.description();
    let Samples::U8(samples) = measurement.read_reflectance(0, description.size.window()).unwrap() else {
        panic!("8 bits were written")
    };
    let values = samples.iter().take(description.lights.len());
    let degrees = description.lights.iter().map(|light| light.degrees().1.round() as i64);
    let mut found: Vec<(u8, i64)> = values.copied().zip(degrees).collect();
    found.sort_unstable();
    found
}

pub(crate) const RIGHT: [(u8, i64); 3] = [(10, 0), (20, 90), (30, 180)];

/// A light list of three names whose lights are at 0, 90 and 180 degrees.
pub(crate) fn list(names: [&str; 3]) -> String {
    format!("3\n{} 1 0 1\n{} 0 1 1\n{} -1 0 1\n", names[0], names[1], names[2])
}

pub(crate) fn told(archive: &Path) -> String {
    succeed(btf().arg("info").arg(archive))
}

pub(crate) fn refused(archive: &Path) -> String {
    let folder = tempfile::tempdir().unwrap();
    fail(btf().arg("import").arg(archive).arg(folder.path().join("s.zarr")), 65)
}

#[test]
fn the_list_that_is_named_is_the_one_that_is_read() {
    let names = ["a.png", "b.png", "c.png"];
    let mut files = three(names);
    files.push(("a_old.lp", list(["c.png", "b.png", "a.png"]).into_bytes()));
    files.push(("Backup/x.lp", list(["b.png", "c.png", "a.png"]).into_bytes()));
    files.push(("z_new.lp", list(names).into_bytes()));
    let (_folder, root) = set(&files);
    assert_eq!(azimuths(&root.join("z_new.lp")), RIGHT);
    assert_eq!(azimuths(&root.join("a_old.lp")), [(10, 180), (20, 90), (30, 0)]);
    let error = refused(&root);
    assert!(error.contains("two light lists that differ") && error.contains("a_old.lp"), "{error}");
    // Lists that say the same are one.
    fs::remove_file(root.join("a_old.lp")).unwrap();
    fs::write(root.join("Backup/x.lp"), list(["../c.png", "b.png", "a.png"]).replace('\n', "\r\n")).unwrap();
    assert!(refused(&root).contains("differ"));
    let same = "3\r\nc.png -2 0 2\r\na.png 2 0 2\r\nb.png 0 3 3\r\n";
    fs::write(root.join("Backup/x.lp"), same).unwrap();
    assert_eq!(azimuths(&root), RIGHT);
}

#[test]
fn lights_without_names_follow_the_numbers_in_names() {
    let twelve: Vec<(String, Vec<u8>)> = (1..=12).map(|n| (format!("p{n}.png"), png(10 * n))).collect();
    let mut files: Vec<(&str, Vec<u8>)> = twelve.iter().map(|(n, b)| (n.as_str(), b.clone())).collect();
    let lights: String = (0..12)
        .map(|n| {
            let (sin, cos) = f64::from(30 * n).to_radians().sin_cos();
            format!("{cos} {sin} 1\n")
        })
        .collect();
    files.push(("l.lp", format!("12\n{lights}").into_bytes()));
    let (_folder, root) = set(&files);
    let expected: Vec<(u8, i64)> = (0..12u8).map(|n| (10 * (n + 1), 30 * i64::from(n))).collect();
    assert_eq!(azimuths(&root), expected);
    assert!(told(&root).contains("the order of the numbers in their names"));
    // Which of two is first?
    fs::rename(root.join("p12.png"), root.join("p01.png")).unwrap();
    let error = refused(&root);
    assert!(error.contains("either may be first") && error.contains("p01.png"), "{error}");
}

#[test]
fn lists_of_other_encodings_and_decimal_marks_are_read() {
    let names = ["a.png", "b.png", "c.png"];
    let plain = list(names);
    let utf16 = |text: &str, big: bool| -> Vec<u8> {
        let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
        units.flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect()
    };
    let comma = "3\na.png 0,707106781 0 0,707106781\nb.png 0 0,5 0,5\nc.png -1 0 1\n";
    for bytes in [
        plain.clone().into_bytes(),
        [b"\xEF\xBB\xBF", plain.as_bytes()].concat(),
        utf16(&plain, false),
        utf16(&plain, true),
        comma.as_bytes().to_vec(),
        utf16(comma, false),
    ] {
        let mut files = three(names);
        files.push(("l.lp", bytes));
        assert_eq!(azimuths(&set(&files).1), RIGHT);
    }
    let table = "file,theta_i,phi_i\na.png,45,0\nb.png,45,90\nc.png,45,180\n";
    for bytes in [table.as_bytes().to_vec(), utf16(table, false), utf16(table, true)] {
        let mut files = three(names);
        files.push(("t.csv", bytes));
        let (folder, root) = set(&files);
        let store = folder.path().join("s.zarr");
        succeed(btf().arg("import").args([&root, &store]).arg("--table").arg(root.join("t.csv")));
    }
    let mut files = three(names);
    files.push(("l.lp", utf16(&plain, false).split_off(2)));
    assert!(refused(&set(&files).1).contains("UTF-16 without its mark"));
}

#[test]
fn names_that_differ_a_little_are_found_with_a_remark() {
    for (listed, there, differs) in [
        (["A.PNG", "B.PNG", "C.PNG"], ["a.png", "b.png", "c.png"], "in case"),
        (["a.CR2", "b.CR2", "c.CR2"], ["a.png", "b.png", "c.png"], "in its ending"),
        (["u\u{308}1.png", "b.png", "c.png"], ["\u{fc}1.png", "b.png", "c.png"], "in its Unicode form"),
    ] {
        let mut files = three(there);
        files.push(("l.lp", list(listed).into_bytes()));
        let (_folder, root) = set(&files);
        assert_eq!(azimuths(&root), RIGHT, "{listed:?}");
        assert!(told(&root).contains(differs), "{listed:?}");
    }
    let mut files = three(["a.png", "b.png", "c.png"]);
    files.push(("l.lp", list(["a.png", "A.png", "c.png"]).into_bytes()));
    assert!(refused(&set(&files).1).contains("the lines 2 and 3 mean"), "one picture, two lights");
}

#[test]
fn the_path_in_a_list_tells_folders_of_a_project_apart() {
    let exports = ["jpeg-exports/o_0.png", "jpeg-exports/o_1.png", "jpeg-exports/o_2.png"];
    let captures = ["original-captures/o_0.png", "original-captures/o_1.png", "original-captures/o_2.png"];
    let mut files = three(exports);
    files.extend(captures.into_iter().map(|name| (name, png(99))));
    let windows = |n: usize| format!("C:\\Users\\me\\RTI\\o\\jpeg-exports\\o_{n}.png");
    let lines = [windows(0), windows(1), windows(2)];
    let text = list([&lines[0], &lines[1], &lines[2]]);
    files.push(("assembly-files/o.lp", text.clone().into_bytes()));
    let (_folder, root) = set(&files);
    assert_eq!(azimuths(&root), RIGHT);
    assert_eq!(azimuths(&root.join("assembly-files/o.lp")), RIGHT);
    // Nothing decides.
    fs::write(root.join("assembly-files/o.lp"), text.replace("jpeg-exports\\", "")).unwrap();
    let error = refused(&root);
    assert!(error.contains("there 2 times") && error.contains("original-captures/o_0.png"), "{error}");
}

#[test]
fn what_systems_leave_behind_is_not_looked_at() {
    let name = |n: usize| format!("tl{} pl0 tv0 pv0.png", 15 * n);
    let names = [name(0), name(1), name(2)];
    let mut files = three([&names[0], &names[1], &names[2]]);
    let copy = |folder: &str| format!("{folder}/{}", names[0]);
    let copies = [".ipynb_checkpoints", ".thumbnails/large", "__MACOSX", "@eaDir"].map(copy);
    files.extend(copies.iter().map(|copy| (copy.as_str(), png(1))));
    files.push(("Thumbs.db", b"x".to_vec()));
    files.push(("notes.txt", b"x".to_vec()));
    let (folder, root) = set(&files);
    assert_eq!(azimuths(&root).len(), 3);
    assert!(told(&root).contains("6 other files ignored"), "{}", told(&root));
    // The same in a zip.
    let archive = folder.path().join("set.zip");
    let mut writer = zip::ZipWriter::new(fs::File::create(&archive).unwrap());
    for (name, bytes) in &files {
        writer.write_entry(name, bytes).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(azimuths(&archive).len(), 3);
}

#[test]
fn angles_are_never_read_by_half() {
    for behind in [
        ",5", "p5", "-5", "_5", " 5", "point5", "dot5", " .5", "pt5", "comma5", "_p5", "..5", "pi", "g",
        "rev", "mil", "arcmin", "cdeg", "x10", "\u{b7}5", "_point_5", " arcmin",
    ] {
        for [before, after] in [["tl", "_pl0_tv22_pv90"], ["theta_i", "_phi_i0"], ["l", "_0_v22_90"]] {
            let name = |n: usize| format!("{before}{n}{behind}{after}.png");
            let names = [name(0), name(7), name(15)];
            let (_folder, root) = set(&three([&names[0], &names[1], &names[2]]));
            let said = refused(&root);
            if before != "l" {
                let expected =
                    ["behind the angle 0", "fractions with a point", "rename", "--table", &names[0]];
                assert!(expected.iter().all(|words| said.contains(words)), "{behind:?}: {said}");
                // No pattern reads these.
                assert!(!said.contains("--pattern"), "{behind:?}: {said}");
            }
        }
    }
}

#[test]
fn orientations_are_stated_and_must_agree() {
    let options = jpeg::EncodeOptions::UBO2003;
    let plain = jpeg::encode(&[100; 16 * 8], 16, 8, 1, &options).unwrap();
    let turned = |orientation: u8| {
        let exif = b"\xFF\xE1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0";
        [&plain[..2], exif, &[orientation, 0, 0, 0, 0, 0, 0], &plain[2..]].concat()
    };
    let of = |orientations: [u8; 2]| {
        set(&[
            ("tl0 pl0 tv0 pv0.jpg", turned(orientations[0])),
            ("tl15 pl0 tv0 pv0.jpg", turned(orientations[1])),
        ])
    };
    let (_folder, root) = of([6, 6]);
    assert!(told(&root).contains("the orientation 6 that the pictures ask for is not applied"));
    azimuths_of_jpegs(&root);
    let (_folder, root) = of([6, 8]);
    assert!(refused(&root).contains("asks for the orientation 8, expected 6"));
    let (_folder, root) = of([1, 3]);
    assert!(refused(&root).contains("asks for the orientation 3, expected 1"));
}

fn azimuths_of_jpegs(root: &Path) {
    let folder = tempfile::tempdir().unwrap();
    succeed(btf().arg("import").arg(root).arg(folder.path().join("s.zarr")));
}

#[test]
fn known_formats_are_called_by_their_names() {
    let webp = b"RIFF\x10\0\0\0WEBPVP8 and more".to_vec();
    let nef = b"II*\0\x08\0\0\0 and more".to_vec();
    for (name, bytes, words) in [
        ("tl0 pl0 tv0 pv0.png", webp.clone(), "a WebP picture"),
        ("tl0 pl0 tv0 pv0.webp", webp, "a WebP picture"),
        ("tl0 pl0 tv0 pv0.NEF", nef, "a Nikon raw file"),
    ] {
        let (_folder, root) = set(&[(name, bytes)]);
        let error = refused(&root);
        assert!(error.contains(words) && error.contains("convert it"), "{error}");
    }
    let (_folder, root) = set(&[("set.7z", b"7z\xBC\xAF\x27\x1C\0\x04".to_vec())]);
    let error = refused(&root.join("set.7z"));
    assert!(error.contains("a 7z archive") && error.contains("unpack it"), "{error}");
}

#[test]
fn names_of_channels_go_with_an_array() {
    let channels = ["400nm", "500nm", "600nm", "700nm"].map(str::to_owned).to_vec();
    let samples = Samples::F32((0..16).map(|n| n as f32 / 16.0).collect());
    let picture = Picture { width: 2, height: 2, channels, samples };
    let bytes = picture::exr::encode(&picture, picture::exr::Compression::Zip).unwrap();
    let (folder, root) = set(&[("tl0 pl0 tv0 pv0.exr", bytes)]);
    let [first, array, again] = ["a.zarr", "a.npy", "b.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("import").args([&root, &first]));
    succeed(btf().arg("export").args([&first, &array]));
    succeed(btf().arg("import").args([&array, &again]));
    let open = |store: &Path| {
        let measurement = Measurement::open(store).unwrap();
        let description = measurement.description();
        (description.channels.clone(), measurement.read_reflectance(0, description.size.window()).unwrap())
    };
    assert_eq!(open(&again), open(&first));
    // Of another array.
    fs::write(folder.path().join("a.channels.txt"), "R\nG\nB\n").unwrap();
    let error = refused(&array);
    assert!(
        error.contains("3 names of channels") && error.contains("a.channels.txt")
            || error.contains("NAME.channels.txt"),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_files() {
    let (folder, root) = set(&three(["a.png", "b.png", "c.png"]));
    let pipe = |path: &Path| assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    for name in ["p", "p.lp", "p.zip", "p.npy", "p.btf"] {
        let path = folder.path().join(name);
        pipe(&path);
    }
    let store = folder.path().join("s.zarr");
    for path in ["p", "p.lp", "p.zip", "p.npy", "p.btf", "/dev/zero"] {
        let told = fail(btf().arg("import").args([&folder.path().join(path), &store]), 66);
        assert!(told.contains("expected a file"), "{path}: {told}");
    }
    let told =
        fail(btf().arg("import").args([&root, &store]).arg("--table").arg(folder.path().join("p")), 65);
    assert!(told.contains("expected a file"), "{told}");
    // Among pictures it is none.
    pipe(&root.join("d.png"));
    fs::write(root.join("l.lp"), list(["a.png", "b.png", "c.png"])).unwrap();
    assert_eq!(azimuths(&root), RIGHT);
}

//! Archives that contradict themselves or leave something open: the right reading, a refusal, or a printed note.

use std::fs;
use std::path::Path;

use btfkit_formats::{npy, zip};

use crate::fixture::{btf, fail, fixture, succeed};
use crate::odd_archives::{RIGHT, azimuths, list, png, refused, set, three, told};

/// A zip of these files.
fn zipped(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Vec::new());
    for (name, bytes) in files {
        writer.write_entry(name, bytes).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn the_order_of_names_is_followed_only_where_it_is_one() {
    let lights = b"3\n1 0 1\n0 1 1\n-1 0 1\n";
    for names in [["p1.png", "p2.png", "p10.png"], ["P1.png", "p2.png", "p3.png"]] {
        let mut files = three(names);
        files.push(("l.lp", lights.to_vec()));
        let (_folder, root) = set(&files);
        assert_eq!(azimuths(&root), RIGHT, "{names:?}");
    }
    for names in [
        ["p1.png", "P2.png", "p3.png"],
        ["a.png", "B.png", "c.png"],
        ["p1.png", "P1.png", "p3.png"],
        ["p1.png", "p2.png", "q1.png"],
        ["p\u{ff11}.png", "p\u{ff12}.png", "p\u{ff11}\u{ff10}.png"],
    ] {
        let mut files = three(names);
        files.push(("l.lp", lights.to_vec()));
        let (_folder, root) = set(&files);
        let error = refused(&root);
        let reasons = ["either may be first", "digits other than", "which differ in more than their numbers"];
        assert!(reasons.iter().any(|reason| error.contains(reason)), "{error}");
        assert!(error.contains("put the names of the pictures into the list"), "{error}");
    }
}

#[test]
fn a_line_of_a_list_that_leads_nowhere_is_named() {
    let mut files = three(["a.png", "b.png", "c.png"]);
    files.push(("l.lp", list(["a.png", "b.png,", "c.png"]).into_bytes()));
    let (_folder, root) = set(&files);
    let error = refused(&root);
    assert!(error.contains("line 3") && error.contains("\"b.png,\", which is not there"), "{error}");
    // A list that is cut, or put together of two.
    for (count, lights) in [("4", 3), ("2", 3)] {
        fs::write(root.join("l.lp"), list(["a.png", "b.png", "c.png"]).replacen('3', count, 1)).unwrap();
        let error = refused(&root);
        let words = format!("line 1 gives {count} as the number of lights, up to line 4 there are {lights}");
        assert!(error.contains(&words), "{error}");
    }
    fs::write(root.join("l.lp"), list(["\"a.png\"", "b.png", "c.png"]) + "\x1A").unwrap();
    assert_eq!(azimuths(&root), RIGHT);
}

#[test]
fn a_list_that_was_read_is_not_one_of_the_files_that_are_ignored() {
    let mut files = three(["a.png", "b.png", "c.png"]);
    files.push(("l.lp", list(["a.png", "b.png", "c.png"]).into_bytes()));
    let (_folder, root) = set(&files);
    assert!(!told(&root).contains("ignored"), "{}", told(&root));
    fs::write(root.join("notes.txt"), "x").unwrap();
    assert!(told(&root).contains("1 other file ignored"), "{}", told(&root));
}

#[test]
fn pictures_that_are_left_out_are_named() {
    let mut files = three(["tl10 pl0 tv0 pv0.png", "tl20 pl0 tv0 pv0.png", "tl30 pl0 tv0 pv0.png"]);
    files.push(("tl40 pl0 tv0.png", png(1)));
    files.push(("notes.txt", Vec::new()));
    let (_folder, root) = set(&files);
    let found = told(&root);
    assert!(found.contains("2 other files ignored"), "{found}");
    assert!(
        found.contains("left out, as they have no direction or one that is dropped:")
            && found.contains("tl40 pl0"),
        "{found}"
    );
    // One that is missing for it.
    fs::write(root.join("tl10 pl0 tv10 pv0.png"), png(1)).unwrap();
    let error = refused(&root);
    assert!(error.contains("missing: 2") && error.contains("tl40 pl0 tv0.png"), "{error}");
}

/// A PNG that states a gamma.
fn with_gamma(png: &[u8], gamma: u32) -> Vec<u8> {
    let chunk = [&b"gAMA"[..], &gamma.to_be_bytes()].concat();
    let whole = [&4u32.to_be_bytes()[..], &chunk, &crc32fast::hash(&chunk).to_be_bytes()].concat();
    [&png[..33], &whole, &png[33..]].concat()
}

#[test]
fn colours_that_are_not_srgb_are_stated_and_not_mixed() {
    let names = ["tl10 pl0 tv0 pv0.png", "tl20 pl0 tv0 pv0.png"];
    let of = |gammas: [u32; 2]| {
        let files: Vec<(&str, Vec<u8>)> =
            names.into_iter().zip(gammas).map(|(name, gamma)| (name, with_gamma(&png(10), gamma))).collect();
        set(&files)
    };
    let words = |root: &std::path::Path| told(root).split_whitespace().collect::<Vec<_>>().join(" ");
    let stated = "the gamma 1.00000 (gAMA), which the pictures state, is not applied";
    let (_folder, root) = of([100_000; 2]);
    assert!(words(&root).contains(stated), "{}", words(&root));
    let (_folder, root) = of([45_455; 2]);
    assert!(!words(&root).contains("gAMA"));
    for (gammas, told) in [
        (
            [45_455, 100_000],
            "states the gamma 1.00000 (gAMA) for its colours, expected sRGB or nothing like the first",
        ),
        (
            [100_000, 45_455],
            "states sRGB or nothing for its colours, expected the gamma 1.00000 (gAMA) like the first",
        ),
    ] {
        let (_folder, root) = of(gammas);
        let error = refused(&root);
        assert!(error.contains(told) && error.contains("tl20 pl0"), "{error}");
    }
}

#[test]
fn a_counter_behind_an_angle_is_refused_with_the_pattern_that_reads_it() {
    for names in [
        [
            "00000 tl10 pl0 tv0 pv0_001.png",
            "00001 tl20 pl0 tv0 pv0_002.png",
            "00002 tl30 pl0 tv0 pv0_003.png",
        ],
        ["tl10_pl0-1.png", "tl20_pl0-2.png", "tl30_pl0-3.png"],
        ["set/l10_0_v0_0 07.png", "set/l20_0_v0_0 08.png", "set/l30_0_v0_0 09.png"],
    ] {
        let (folder, root) = set(&three(names));
        let error = refused(&root);
        let pattern = error.split("--pattern '").nth(1).and_then(|rest| rest.split('\'').next()).unwrap();
        let store = folder.path().join("s.zarr");
        succeed(btf().arg("import").args([&root, &store]).args(["--pattern", pattern]));
        assert!(succeed(btf().arg("info").arg(&store)).contains("theta 10.0 to 30.0"), "{pattern}");
    }
    let (_folder, root) =
        set(&three(["tl7,5 pl0 tv0 pv0.png", "tl15 pl0 tv0 pv0.png", "tl30 pl0 tv0 pv0.png"]));
    let error = refused(&root);
    assert!(error.contains("tl7,5") && !error.contains("only count"), "{error}");
}

#[test]
fn lights_that_are_almost_one_are_told() {
    let names = ["tl15 pl0 tv0 pv0.png", "tl15.0004 pl0 tv0 pv0.png", "tl60 pl0 tv0 pv0.png"];
    let (_folder, root) = set(&three(names));
    let found = told(&root).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(found.contains("theta 15.0004 phi 0 are 0.000400 degrees apart"), "{found}");
}

#[test]
fn zips_that_unpack_themselves_are_read() {
    let (folder, root) = set(&[]);
    let mut files = three(["a.png", "b.png", "c.png"]);
    files.push(("l.lp", list(["a.png", "b.png", "c.png"]).into_bytes()));
    let bytes = zipped(&files);
    for (name, before) in
        [("a.zip", &b""[..]), ("b.exe", b"MZ a program"), ("c.zip", b"PK\x07\x08"), ("d.ZIP", &[7; 70_000])]
    {
        let path = folder.path().join(name);
        fs::write(&path, [before, &bytes].concat()).unwrap();
        assert_eq!(azimuths(&path), RIGHT, "{name}");
    }
    assert!(!root.exists());
}

#[test]
fn zips_are_named_where_several_contradict_each_other() {
    let names = ["tl10 pl0 tv0 pv0.png", "tl20 pl0 tv0 pv0.png", "tl30 pl0 tv0 pv0.png"];
    let bytes = zipped(&three(names));
    let (_folder, root) = set(&[("one.zip", bytes.clone()), ("two.zip", bytes)]);
    let error = refused(&root);
    assert!(error.contains("one.zip: tl10 pl0") && error.contains("two.zip: tl10 pl0"), "{error}");
    let mut files = three(["a.png", "b.png", "c.png"]);
    let other = zipped(&files);
    files.push(("l.lp", list(["a.png", "b.png", "c.png"]).into_bytes()));
    let (_folder, root) = set(&[("one.zip", zipped(&files)), ("two.zip", other)]);
    let error = refused(&root);
    assert!(error.contains("there 2 times") && error.contains("two.zip: a.png"), "{error}");
    // Formats that are not read are called by their names in zips, too.
    let webp = ("tl10 pl0 tv0 pv0.webp", b"RIFF\x10\0\0\0WEBPVP8 and more".to_vec());
    let (_folder, root) = set(&[("one.zip", zipped(&[webp]))]);
    assert!(refused(&root.join("one.zip")).contains("pv0.webp is a WebP picture"));
    // Lists in a zip: what to do can be done.
    let mut files = three(["a.png", "b.png", "c.png"]);
    files.push(("l.lp", list(["a.png", "b.png", "c.png"]).into_bytes()));
    files.push(("old/l.lp", list(["b.png", "a.png", "c.png"]).into_bytes()));
    let (_folder, root) = set(&[("one.zip", zipped(&files))]);
    let error = refused(&root.join("one.zip"));
    assert!(error.contains("differ") && error.contains("unpack the archive to a folder"), "{error}");
}

#[test]
fn names_of_channels_that_do_not_fit_are_refused_by_a_hint_that_helps() {
    let (folder, _) = set(&[]);
    let array = folder.path().join("a.npy");
    let bytes = |channels: u64| {
        let count = usize::try_from(4 * channels).unwrap();
        [npy::header([1, 1, 2, 2, channels], btfkit_formats::SampleType::U8), vec![9; count]].concat()
    };
    let lights = npy::directions_file(&[btfkit_formats::Direction::from_degrees(15.0, 0.0)]);
    fs::write(folder.path().join("a.lights.npy"), lights).unwrap();
    fs::write(&array, bytes(4)).unwrap();
    let names = folder.path().join("a.channels.txt");
    for (text, words) in [
        ("R\nG\nB\n", "3 names of channels in NAME.channels.txt"),
        ("R\nG\nB\nA\n", "A says how opaque"),
        ("550nm\n550.0nm\n600nm\n650nm\n", "these two mean the same"),
    ] {
        fs::write(&names, text).unwrap();
        let error = fail(btf().arg("import").arg(&array).arg(folder.path().join("s.zarr")), 65);
        assert!(error.contains(words) && !error.contains("--order"), "{error}");
    }
    fs::remove_file(&names).unwrap();
    let error = fail(btf().arg("import").arg(&array).arg(folder.path().join("s.zarr")), 65);
    assert!(error.contains("channel 0, channel 1, channel 2, channel 3, expected one grey"), "{error}");
    fs::write(&array, bytes(3)).unwrap();
    succeed(btf().arg("info").arg(&array));
}

#[test]
fn what_an_option_says_is_no_longer_assumed() {
    let folder = tempfile::tempdir().unwrap();
    let array = folder.path().join("m.npy");
    succeed(btf().arg("export").args([&fixture().measurement(), &array]));
    let about = |path: &Path, options: &[&str]| {
        let told = succeed(btf().arg("info").arg(path).args(options));
        told.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let archive = fixture().archive();
    for (path, options, assumed) in [
        (&array, ["--transfer", "linear"], "taken to be display values (sRGB)"),
        (&array, ["--cosine", "excluded"], "cosine of the light's polar angle is taken to be in the samples"),
        (&archive, ["--transfer", "linear"], "the pictures' transfer curve is sRGB"),
    ] {
        let (before, after) = (about(path, &[]), about(path, &options));
        assert!(before.contains(assumed), "{before}");
        assert!(!after.contains(assumed), "{options:?}: {after}");
    }
    // What the option says nothing about is still assumed.
    assert!(about(&array, &["--transfer", "linear"]).contains("Row 0 is taken to be the top"));
    // An option that says what is assumed anyway changes nothing.
    assert_eq!(about(&array, &["--transfer", "srgb"]), about(&array, &[]));
}

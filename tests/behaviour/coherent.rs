//! The coherent rule: a texel is a function of the model, the seed and its place, however it is asked for.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use btfkit::kernel::Kernel;
use btfkit::method::coherent::{Plane, Variation};
use btfkit::shape::{Size, Window};
use btfkit::store::enlarged::Enlarged;
use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use btfkit_formats::Samples;
use tempfile::TempDir;

use crate::fixture::{assert_same, btf, fail, fixture, succeed, tree};
use crate::interruption::{count, interrupt};
use crate::pictures::pixels;

/// Models of the fixture's measurement: its name, what is taken as the tile, and the lattice.
const MODELS: [(&str, &str, &str); 4] = [
    ("whole", "none", "none"),
    ("cut", "40x36", "none"),
    ("ribs", "40x36", "0,10"),
    ("cells", "40x36", "9,0;0,10"),
];

/// A model that is never written again; its measurement lies beside it under the name that is looked for.
pub fn model(name: &str) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        for (name, tile, lattice) in MODELS {
            let model = folder.path().join(format!("{name}.model.zarr"));
            succeed(btf().arg("tile").args([&fixture().measurement(), &model]).args(["--tile", tile]));
            succeed(btf().arg("normals").args([&fixture().measurement(), &model]));
            let clusters = ["--clusters", "24"];
            succeed(btf().arg("cluster").args([&fixture().measurement(), &model]).args(clusters));
            succeed(btf().arg("appearance").arg(&model).args(["--lattice", lattice]));
        }
        folder
    });
    folder.path().join(format!("{name}.model.zarr"))
}

pub fn enlarge(model: &Path, output: &Path, size: &str) -> Command {
    let mut command = btf();
    command.arg("enlarge").args([model, output]).args(["--size", size]);
    command
}

fn plane(name: &str, kernel: Kernel) -> Plane {
    let model = Model::open(&model(name)).unwrap();
    let tile = model.tile().unwrap().size;
    Plane::new(tile, &model.index().unwrap(), &model.appearance().unwrap(), kernel).unwrap()
}

/// Texels of a part of a window.
fn part(texels: &[u32], width: usize, part: Window) -> Vec<u32> {
    let rows = texels.chunks_exact(width).skip(part.y).take(part.size.height);
    rows.flat_map(|row| &row[part.x..part.x + part.size.width]).copied().collect()
}

#[test]
fn another_lattice_describes_the_appearance_anew() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    succeed(&mut crate::fixture::model_of(&fixture().measurement(), &model));
    let describe = |lattice: &str| {
        succeed(btf().arg("appearance").arg(&model).args(["--lattice", lattice, "--force"]));
        Model::open(&model).unwrap().appearance().unwrap()
    };
    let (none, ribs) = (describe("none"), describe("0,11.3"));
    assert_ne!(none, ribs);
    assert_eq!(describe("none"), none);
}

#[test]
fn windows_cut_differently_hold_the_same_texels() {
    let size = Size::new(75, 90);
    let joins = Size::new(64, 96);
    for (name, ..) in MODELS {
        let plane = plane(name, Kernel::fastest());
        let variations = [
            plane.variation(1),
            Variation { seed: u32::MAX, jitter: 256, wrap: None },
            Variation { seed: 3, jitter: 100, wrap: Some(joins) },
        ];
        for variation in variations {
            for (y, x) in [(0, 0), (-37, -51), (2_000_000_001, -2_000_000_000), (-(1 << 31), (1 << 31) - 90)]
            {
                let whole = plane.window(&variation, y, x, size).unwrap();
                for (top, left, height, width) in
                    [(0, 0, 1, 90), (74, 89, 1, 1), (13, 7, 40, 33), (1, 1, 74, 5), (40, 0, 35, 90)]
                {
                    let size = Size::new(height, width);
                    let alone = plane.window(&variation, y + top as i64, x + left as i64, size).unwrap();
                    let expected = part(&whole, 90, Window { y: top, x: left, size });
                    assert!(alone == expected, "{name}, {variation:?}, {y} + {top}, {x} + {left}");
                }
            }
        }
    }
}

#[test]
fn every_kernel_gives_the_same_texels() {
    for (name, ..) in MODELS {
        let window = |kernel: Kernel| {
            let plane = plane(name, kernel);
            plane.window(&plane.variation(5), -30, -40, Size::new(101, 83)).unwrap()
        };
        let plain = window(Kernel::Plain);
        for kernel in Kernel::available() {
            assert!(window(kernel) == plain, "{name}, {kernel:?}");
        }
    }
}

#[test]
fn a_plane_that_joins_repeats_after_its_size() {
    let (height, width) = (96, 64);
    for (name, ..) in MODELS {
        let plane = plane(name, Kernel::fastest());
        let wrap = Some(Size::new(height, width));
        let variation = Variation { wrap, ..plane.variation(2) };
        let size = Size::new(height, width);
        let first = plane.window(&variation, 0, 0, size).unwrap();
        for (rows, columns) in [(1, 0), (0, 1), (-1, 1), (100_003, -5)] {
            let (y, x) = (rows * height as i64, columns * width as i64);
            assert!(plane.window(&variation, y, x, size).unwrap() == first, "{name} {y} {x}");
        }
        let across = plane.window(&variation, -10, 20, size).unwrap();
        for (n, texel) in across.iter().enumerate() {
            let (y, x) = ((n / width + height - 10) % height, (n % width + 20) % width);
            assert_eq!(*texel, first[y * width + x], "{name} {y} {x}");
        }
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("tile.zarr");
        succeed(enlarge(&model(name), &output, "64x96").args(["--tileable", "--seed", "2"]));
        assert!(source(&output, Size::new(height, width)) == first, "{name}");
    }
}

/// All source texels of an enlarged index.
fn source(path: &Path, size: Size) -> Vec<u32> {
    Enlarged::open(path).unwrap().read_source(size.window()).unwrap().unwrap()
}

#[test]
fn what_is_stored_is_the_plane_from_place_0() {
    let size = Size::new(90, 130);
    let folder = tempfile::tempdir().unwrap();
    for (name, ..) in MODELS {
        let output = folder.path().join(name);
        succeed(enlarge(&model(name), &output, "130x90").args(["--seed", "7", "--keep-normals"]));
        let plane = plane(name, Kernel::Plain);
        let source = source(&output, size);
        assert!(source == plane.window(&plane.variation(7), 0, 0, size).unwrap(), "{name}");
        let model = Model::open(&model(name)).unwrap();
        let (index, normals) = (model.index().unwrap(), model.normals().unwrap());
        let store = Enlarged::open(&output).unwrap();
        let clusters: Vec<u16> = source.iter().map(|&texel| index[texel as usize]).collect();
        assert!(store.read(size.window()).unwrap() == clusters, "{name}");
        let expected: Vec<[f32; 3]> = source.iter().map(|&texel| normals[texel as usize]).collect();
        assert!(store.read_normals(size.window()).unwrap().unwrap() == expected, "{name}");
    }
}

#[test]
fn without_the_source_the_index_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let [with, without] = ["with", "without"].map(|name| folder.path().join(name));
    succeed(&mut enlarge(&model("whole"), &with, "600x70"));
    succeed(enlarge(&model("whole"), &without, "600x70").arg("--no-source"));
    assert_same(&with.join("index"), &without.join("index"));
    assert!(with.join("source").exists() && !without.join("source").exists());
    let told = fail(image(&without, &folder.path().join("a.png")).args(["--values", "measured"]), 66);
    assert!(told.contains("source"), "{told}");
}

/// Three blocks by two, none of them whole but one; the same bytes by threads, kernels, shards, and again.
const BLOCKS: &str = "2100x1300";

#[test]
fn threads_kernels_and_shards_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, more: &[&str], kernel: &str| {
        let mut command = enlarge(&model("cut"), &folder.path().join(name), BLOCKS);
        succeed(command.args(more).env("BTFKIT_KERNEL", kernel))
    };
    run("one", &["--threads", "1"], "");
    run("two", &["--threads", "2", "--memory", "64MiB"], "plain");
    for shard in ["2/4", "0/4", "2/4", "3/4", "1/4"] {
        run("parts", &["--shard", shard], "");
    }
    let told = run("parts", &[], "");
    assert!(told.contains("; blocks of shards: 0 written, 6 found done"), "{told}");
    // A shard that a crash of the machine cut off is not taken for done.
    for (array, length) in [("index", 100), ("source", 0)] {
        let shard = folder.path().join("parts").join(array).join("c/0/1");
        std::fs::OpenOptions::new().write(true).open(shard).unwrap().set_len(length).unwrap();
        let told = run("parts", &[], "");
        assert!(told.contains("; blocks of shards: 1 written, 5 found done"), "{told}");
    }
    for name in ["two", "parts"] {
        assert_same(&folder.path().join(name), &folder.path().join("one"));
    }
}

#[test]
fn killed_and_stopped_it_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let [disturbed, whole] = ["disturbed", "whole"].map(|name| folder.path().join(name));
    let run = |path: &Path| enlarge(&model("whole"), path, BLOCKS);
    let shards = || count(&disturbed, "index/c/");
    for signal in ["-KILL", "-TERM", "-KILL"] {
        let before = shards();
        let code = interrupt(&mut run(&disturbed), signal, || shards() > before);
        assert_eq!(code, if signal == "-TERM" { Some(75) } else { None }, "it ended before {signal}");
    }
    let host = btfkit::disk::host();
    std::fs::write(disturbed.join(format!("index/c/0/.0.tmp-{host}-999999999-00000000")), b"x").unwrap();
    succeed(&mut run(&disturbed));
    succeed(&mut run(&whole));
    assert_same(&disturbed, &whole);
}

#[test]
fn a_range_of_seeds_makes_the_output_of_each_seed() {
    let folder = tempfile::tempdir().unwrap();
    succeed(enlarge(&model("whole"), &folder.path().join("plane.zarr"), "70x60").args(["--seed", "3..5"]));
    for seed in ["3", "4", "5"] {
        let alone = folder.path().join(seed);
        succeed(enlarge(&model("whole"), &alone, "70x60").args(["--seed", seed]));
        assert_same(&folder.path().join(format!("plane-{seed}.zarr")), &alone);
    }
    let [third, fourth] = ["3", "4"].map(|seed| source(&folder.path().join(seed), Size::new(60, 70)));
    let same = third.iter().zip(&fourth).filter(|(a, b)| a == b).count();
    assert!(same * 20 < third.len(), "{same} of {} texels are the same for two seeds", third.len());
}

#[test]
fn another_recipe_in_the_same_place_is_refused_and_the_setting_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.zarr");
    succeed(&mut enlarge(&model("whole"), &output, "64x64"));
    let before = tree(&output);
    for (more, named) in [
        (&["--seed", "2"][..], "seed was 1, now 2"),
        (&["--jitter", "0.25"], "jitter was 128, now 64"),
        (&["--no-source"], "source was true, now false"),
        (&["--keep-normals"], "keep_normals was false, now true"),
        (&["--tileable"], "tileable was false, now true"),
    ] {
        let told = fail(enlarge(&model("whole"), &output, "64x64").args(more), 65);
        assert!(told.contains(named), "{told}");
    }
    let told = fail(&mut enlarge(&model("cut"), &output, "64x64"), 65);
    assert!(told.contains("model was"), "{told}");
    let told = fail(&mut enlarge(&model("whole"), &output, "64x65"), 65);
    assert!(told.contains("size was"), "{told}");
    assert_eq!(before, tree(&output));
}

#[test]
fn what_cannot_be_made_is_refused_and_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.zarr");
    let told = fail(enlarge(&model("whole"), &output, "96x65").arg("--tileable"), 2);
    assert!(told.contains("96x65") && told.contains("multiples of") && told.contains("96x80"), "{told}");
    for (size, more) in [
        ("0x64", &[][..]),
        ("64x-1", &[]),
        ("64x64", &["--jitter", "1.5"]),
        ("64x64", &["--jitter", "nan"]),
        ("64x64", &["--seed", "4294967296"]),
        ("64x64", &["--seed", "4294967295..4294967296"]),
        ("64x64", &["--shard", "2/2"]),
        ("64x64", &["--memory", "1MiB"]),
        ("64x64", &["--method", "other"]),
    ] {
        fail(enlarge(&model("whole"), &output, size).args(more), 2);
    }
    for store in [fixture().measurement(), fixture().enlarged()] {
        let told = fail(&mut enlarge(&store, &output, "64x64"), 65);
        assert!(told.contains("model"), "{told}");
    }
    fail(&mut enlarge(&folder.path().join("nothing"), &output, "64x64"), 66);
    assert!(!output.exists());

    let bare = folder.path().join("bare.model.zarr");
    succeed(btf().arg("tile").args([&fixture().measurement(), &bare]));
    succeed(btf().arg("cluster").args([&fixture().measurement(), &bare]).args(["--clusters", "8"]));
    for mut command in [enlarge(&bare, &output, "64x64"), plane_image(&bare, &output, "0,0,8,8")] {
        let told = fail(&mut command, 66);
        assert!(told.contains("btf appearance"), "{told}");
    }
    assert!(!output.exists());
    succeed(btf().arg("appearance").arg(&bare));
    succeed(&mut enlarge(&bare, &output, "64x64"));
}

fn image(source: &Path, out: &Path) -> Command {
    let mut command = btf();
    command.arg("image").arg(source).args(["--light", "30,90", "--force", "--out"]).arg(out);
    command
}

fn plane_image(model: &Path, out: &Path, window: &str) -> Command {
    let mut command = image(model, &out.with_extension("png"));
    command.args(["--plane", "--window", window]);
    command
}

#[test]
fn a_picture_of_the_plane_is_that_of_its_stored_index() {
    let folder = tempfile::tempdir().unwrap();
    let (model, big) = (model("whole"), folder.path().join("big.zarr"));
    let [stored, made] = ["stored", "made"].map(|name| folder.path().join(format!("{name}.png")));
    succeed(enlarge(&model, &big, "700x540").args(["--seed", "4", "--jitter", "0.75"]));
    let same = || assert!(std::fs::read(&stored).unwrap() == std::fs::read(&made).unwrap());
    for window in ["0,0,700,540", "501,505,40,20"] {
        succeed(image(&big, &stored).arg("--model").arg(&model).args(["--window", window]));
        succeed(plane_image(&model, &made, window).args(["--seed", "4", "--jitter", "0.75"]));
        same();
    }
    // Far from place 0, and in parts, it goes on as it does near it: as the library says.
    let mut far = btf();
    far.arg("image").arg(&model).args(["--plane", "--window", "-600,-2000000000,70,1100", "--what", "index"]);
    succeed(far.arg("--force").arg("--out").arg(&made));
    for window in ["-2147483649,0,8,8", "0,2147483641,8,8", "0,0,0,8"] {
        fail(&mut plane_image(&model, &made, window), 2);
    }
    let told = fail(image(&model, &made).arg("--plane"), 2);
    assert!(told.contains("--window"), "{told}");
    fail(image(&big, &made).args(["--plane", "--window", "0,0,8,8"]), 2);
}

#[test]
fn measured_values_are_those_of_the_measured_texel() {
    let folder = tempfile::tempdir().unwrap();
    let big = folder.path().join("big.zarr");
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let description = measurement.description();
    let lights = description.lights.len();
    let stored = measurement.read_reflectance(4, description.size.window()).unwrap();
    let Samples::U8(stored) = stored else { panic!("not 8-bit") };
    for name in ["whole", "cut"] {
        let path = model(name);
        let output = big.with_file_name(format!("{name}.zarr"));
        succeed(&mut enlarge(&path, &output, "90x70"));
        let tile = Model::open(&path).unwrap().tile().unwrap();
        let expected: Vec<u8> = source(&output, Size::new(70, 90))
            .iter()
            .flat_map(|&texel| {
                let [row, column] = tile.source[texel as usize].map(|place| place as usize);
                let at = ((row * description.size.width + column) * lights + 11) * 3;
                stored[at..at + 3].to_vec()
            })
            .collect();
        let [measured, model_path] = [fixture().measurement(), path.clone()].map(|p| p.display().to_string());
        let more = ["--values", "measured", "--measurement", &measured];
        assert!(
            pixels(&output, 4, 11, &[&more[..], &["--model", &model_path]].concat()) == expected,
            "{name}"
        );
        let window = ["--plane", "--window", "0,0,90,70"];
        assert!(pixels(&path, 4, 11, &[&more[..], &window].concat()) == expected, "{name}");
    }
}

#[test]
fn a_pyramid_of_the_plane_is_that_of_its_stored_index() {
    let folder = tempfile::tempdir().unwrap();
    let (model, big) = (model("cut"), folder.path().join("big.zarr"));
    succeed(enlarge(&model, &big, "300x530").args(["--seed", "2"]));
    let [stored, made] = ["stored", "made"].map(|name| folder.path().join(format!("{name}.dzi")));
    let export = |source: &Path, output: &Path| {
        let mut command = btf();
        command.arg("export").args([source, output]).args(["--light", "30,90"]);
        command
    };
    succeed(export(&big, &stored).arg("--model").arg(&model));
    succeed(export(&model, &made).args(["--plane", "--window", "0,0,300,530", "--seed", "2"]));
    let tiles = |output: &Path| {
        let mut files = tree(&PathBuf::from(output.to_str().unwrap().replace(".dzi", "_files")));
        files.retain(|name, _| name.extension().is_some_and(|ending| ending == "png"));
        files
    };
    let (stored, made) = (tiles(&stored), tiles(&made));
    assert!(stored.len() > 8 && stored == made);
}

//! Pictures at measured directions are the stored samples themselves.

use std::path::Path;

use btfkit::color::Transfer;
use btfkit::store::enlarged::Enlarged;
use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use btfkit_formats::Samples;

use crate::fixture::{btf, copy, fail, fixture, succeed};

/// The 8-bit pixels of `btf image` at a view and a light of the fixture.
pub fn pixels(source: &Path, view: usize, light: usize, more: &[&str]) -> Vec<u8> {
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let angles = |direction: btfkit_formats::Direction| {
        let (theta, phi) = direction.degrees();
        format!("{theta},{phi}")
    };
    let [view, light] =
        [measurement.description().views[view], measurement.description().lights[light]].map(angles);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.png");
    succeed(
        btf()
            .arg("image")
            .arg(source)
            .args(["--view", &view, "--light", &light])
            .args(more)
            .arg("--out")
            .arg(&out),
    );
    let file = std::io::BufReader::new(std::fs::File::open(&out).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut samples).unwrap();
    samples
}

#[test]
fn the_measurement_shows_its_samples() {
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let lights = measurement.description().lights.len();
    let stored = measurement.read_reflectance(4, measurement.description().size.window()).unwrap();
    let Samples::U8(stored) = stored else { panic!("not 8-bit") };
    let expected: Vec<u8> =
        stored.chunks_exact(lights * 3).flat_map(|texel| &texel[33..36]).copied().collect();
    assert_eq!(pixels(&fixture().measurement(), 4, 11, &[]), expected);
}

#[test]
fn tile_and_enlarged_index_show_the_samples_of_the_representatives() {
    let model = Model::open(&fixture().model()).unwrap();
    let representatives = model.representatives().unwrap();
    let [_, views, lights, channels] = representatives.shape;
    assert_eq!(representatives.transfer, Transfer::Srgb);
    let Samples::U8(samples) = &representatives.samples else { panic!("not 8-bit") };
    let sample = |cluster: &u16| {
        let at = ((usize::from(*cluster) * views + 7) * lights + 2) * channels;
        &samples[at..at + channels]
    };
    let expected: Vec<u8> = model.index().unwrap().iter().flat_map(sample).copied().collect();
    assert_eq!(pixels(&fixture().model(), 7, 2, &[]), expected);
    let enlarged = Enlarged::open(&fixture().enlarged()).unwrap();
    let index = enlarged.read(enlarged.size().window()).unwrap();
    let expected: Vec<u8> = index.iter().flat_map(sample).copied().collect();
    assert_eq!(pixels(&fixture().enlarged(), 7, 2, &[]), expected);
}

#[test]
fn a_window_is_a_part_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let image = |name: &str, window: &[&str]| {
        let out = folder.path().join(name);
        succeed(
            btf()
                .arg("image")
                .arg(fixture().enlarged())
                .args(["--what", "index"])
                .args(window)
                .arg("--out")
                .arg(&out),
        );
        let file = std::io::BufReader::new(std::fs::File::open(&out).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut samples).unwrap();
        (samples, info.width as usize)
    };
    let (whole, width) = image("whole.png", &[]);
    let (part, part_width) = image("part.png", &["--window", "500,490,20,50"]);
    assert_eq!(part_width, 20);
    for y in 0..50 {
        let at = ((490 + y) * width + 500) * 3;
        assert_eq!(part[y * 60..(y + 1) * 60], whole[at..at + 60]);
    }
}

#[test]
fn more_than_256_clusters_work_to_the_last_picture() {
    let folder = tempfile::tempdir().unwrap();
    let [model, big, out] = ["wide.model.zarr", "wide.zarr", "wide.png"].map(|name| folder.path().join(name));
    succeed(btf().arg("model").args([&fixture().measurement(), &model]).args(["--clusters", "300"]));
    succeed(btf().arg("enlarge").args([&model, &big]).args(["--size", "40x30"]));
    succeed(btf().arg("image").arg(&big).arg("--out").arg(&out));
    let index = Model::open(&model).unwrap().index().unwrap();
    assert!(
        index.iter().any(|&cluster| cluster >= 256),
        "the index must need 16 bits for this test to mean anything"
    );
}

/// Where the chunks of a shard of 4 x 4 chunks lie in it: an index of 16 pairs of u64 and a checksum end it.
fn chunk_range(shard: &[u8], number: usize) -> std::ops::Range<usize> {
    let index = &shard[shard.len() - 4 - 16 * 16..];
    let [offset, length] =
        [0, 8].map(|at| u64::from_le_bytes(index[16 * number + at..][..8].try_into().unwrap()) as usize);
    offset..offset + length
}

#[test]
fn a_window_reads_only_the_chunks_that_it_touches() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.zarr");
    crate::fixture::copy(&fixture().enlarged(), &broken);
    let image = |source: &Path, window: &str, name: &str| {
        let mut command = btf();
        command.arg("image").arg(source).arg("--model").arg(fixture().model());
        command.args(["--light", "20,45", "--window", window, "--out"]).arg(folder.path().join(name));
        command
    };
    // Rows and columns 128 to 384 of the first shard alone.
    let inner = "130,129,250,255";
    for ending in ["png", "exr"] {
        succeed(&mut image(&fixture().enlarged(), inner, &format!("whole.{ending}")));
    }
    // All other shards and the normals are gone, all other chunks of the first shard are wrecked.
    for gone in ["index/c/0/1", "index/c/1/0", "index/c/1/1"] {
        std::fs::remove_file(broken.join(gone)).unwrap();
    }
    std::fs::remove_dir_all(broken.join("normals/c")).unwrap();
    let shard = broken.join("index/c/0/0");
    let mut bytes = std::fs::read(&shard).unwrap();
    for number in (0..16).filter(|number| ![5, 6, 9, 10].contains(number)) {
        let range = chunk_range(&bytes, number);
        bytes[range].fill(0xA5);
    }
    std::fs::write(&shard, bytes).unwrap();
    for ending in ["png", "exr"] {
        succeed(&mut image(&broken, inner, &format!("part.{ending}")));
        let [whole, part] = ["whole", "part"]
            .map(|name| std::fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap());
        assert!(whole == part, "{ending} differs");
    }
    let told = crate::fixture::fail(&mut image(&broken, "130,129,250,260", "damaged.png"), 65);
    assert!(told.contains("index") && told.contains("damaged"), "{told}");
    let told = crate::fixture::fail(&mut image(&broken, "500,490,20,50", "missing.png"), 66);
    assert!(told.contains("index/c/0/1") && told.contains("has not been written"), "{told}");
    for name in ["damaged.png", "missing.png"] {
        assert!(!folder.path().join(name).exists());
    }
}

#[test]
fn the_memory_that_is_allowed_changes_no_byte_of_a_picture_and_too_little_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let image = |source: &Path, memory: &str, name: &str| {
        let mut command = btf();
        command.arg("image").arg(source).args(["--memory", memory, "--out"]).arg(folder.path().join(name));
        command
    };
    for (number, source) in [fixture().enlarged(), fixture().measurement()].iter().enumerate() {
        for ending in ["png", "exr"] {
            let [little, much] = ["little", "much"].map(|name| format!("{name}-{number}.{ending}"));
            succeed(&mut image(source, "16488KiB", &little));
            succeed(&mut image(source, "1GiB", &much));
            assert_eq!(
                std::fs::read(folder.path().join(little)).unwrap(),
                std::fs::read(folder.path().join(much)).unwrap()
            );
        }
    }
    let told = crate::fixture::fail(&mut image(&fixture().enlarged(), "16388KiB", "none.png"), 2);
    assert!(told.contains("--memory"), "{told}");
}

/// The figures that `btf fit --report` tells are those of the normals: the tile's spread, worked out again.
#[test]
fn the_report_of_a_fit_is_a_table_and_a_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("field");
    let told = succeed(btf().arg("fit").arg(fixture().model()).arg("--report").arg(&name));
    let text = std::fs::read_to_string(folder.path().join("field.txt")).unwrap();
    assert!(told.contains(text.trim_end()), "{told}");
    let normals = Model::open(&fixture().model()).unwrap().normals().unwrap();
    for (axis, component) in ["n_x", "n_y", "n_z"].iter().enumerate() {
        let values = normals.iter().map(|n| f64::from(n[axis]));
        let mean = values.clone().sum::<f64>() / normals.len() as f64;
        let spread = (values.map(|v| (v - mean).powi(2)).sum::<f64>() / normals.len() as f64).sqrt();
        let line = text.lines().find(|line| line.starts_with(component)).unwrap();
        let cells: Vec<f64> = line.split_whitespace().skip(1).map(|cell| cell.parse().unwrap()).collect();
        let [_, _, tile, synthesis, ..] = cells[..] else { panic!("{line}") };
        assert!((tile - spread).abs() < 6e-4, "{component}: {tile} for {spread}");
        assert!((synthesis - spread).abs() < 0.25 * spread, "{component}: {synthesis} for {spread}");
    }
    let sheet = std::io::BufReader::new(std::fs::File::open(folder.path().join("field.png")).unwrap());
    let reader = png::Decoder::new(sheet).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (1120, 920));
}

/// A picture that needs nothing but what is there is made, and says what is not; one that needs more says how much is
/// missing.
#[test]
fn a_picture_of_a_store_that_is_not_complete_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let [store, enlarged] = ["half.zarr", "big.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("import").args([&fixture().archive(), &store]).args(["--shard", "0/2"]));
    let image = |store: &Path, name: &str| {
        let mut command = btf();
        command.arg("image").arg(store).arg("--out").arg(folder.path().join(name));
        command
    };
    let told = succeed(&mut image(&store, "there.png"));
    assert!(told.contains("half.zarr is not complete, 4 of 9 views are missing"), "{told}");
    let told = fail(image(&store, "absent.png").args(["--view", "20,15"]), 66);
    assert!(told.contains("4 of 9 views are missing") && told.contains("goes on where it stopped"), "{told}");
    let zoom = folder.path().join("there.dzi");
    for _ in 0..2 {
        let told = succeed(btf().arg("export").args([&store, &zoom]));
        assert!(told.contains("note: ") && told.contains("4 of 9 views are missing"), "{told}");
    }
    copy(&fixture().enlarged(), &enlarged);
    std::fs::remove_file(enlarged.join("index/c/1/1")).unwrap();
    let model = fixture().model();
    let with = |window: &str, name: &str| {
        let mut command = image(&enlarged, name);
        command.arg("--model").arg(&model).args(["--window", window]);
        command
    };
    let told = succeed(&mut with("0,0,64,64", "corner.png"));
    assert!(told.contains("big.zarr is not complete, 1 of 4 shards are missing"), "{told}");
    let told = fail(&mut with("500,600,30,90", "end.png"), 66);
    assert!(told.contains("1 of 4 shards are missing"), "{told}");
    let told = succeed(image(&fixture().measurement(), "whole.png").args(["--view", "20,15"]));
    assert!(!told.contains("missing"), "{told}");
    // Whoever names the picture without the option is told which.
    let told = fail(btf().arg("image").arg(&store).arg("a.png"), 2);
    assert!(told.contains("use --out a.png"), "{told}");
}

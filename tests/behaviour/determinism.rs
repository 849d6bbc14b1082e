//! The same bytes whatever the threads, the kernel, the band and the form of the archive.

use std::process::Command;

use crate::fixture::{assert_same, btf, enlarge, fixture, model_of, succeed, unpack};

#[test]
fn threads_and_kernels_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    for (name, threads, kernel) in [("one", "1", "plain"), ("three", "3", "")] {
        let [measurement, model, enlarged] = ["zarr", "model.zarr", "big.zarr"]
            .map(|end| folder.path().join(name).join(format!("sample.{end}")));
        let run = |command: &mut Command| {
            succeed(command.env("BTFKIT_KERNEL", kernel).args(["--threads", threads]))
        };
        run(btf().arg("import").args([&fixture().archive(), &measurement]));
        run(&mut model_of(&measurement, &model));
        run(&mut enlarge(&model, &enlarged));
    }
    let [one, three] = ["one", "three"].map(|name| folder.path().join(name));
    assert_same(&one, &three);
    assert_same(&one.join("sample.zarr"), &fixture().measurement());
}

#[test]
fn the_band_height_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    for band in ["1", "7", "600"] {
        let output = folder.path().join(band);
        succeed(enlarge(&fixture().model(), &output).args(["--band", band]));
        assert_same(&output, &fixture().enlarged());
    }
}

#[test]
fn a_folder_of_views_gives_the_store_of_the_zip() {
    let folder = tempfile::tempdir().unwrap();
    let (images, store) = (folder.path().join("MANYFILES"), folder.path().join("store.zarr"));
    unpack(&fixture().archive(), &images);
    std::fs::write(images.join("readme.txt"), "not an image").unwrap();
    succeed(btf().arg("import").args([&images, &store]));
    assert_same(&store, &fixture().measurement());
}

#[test]
fn the_random_field_of_another_seed_is_another() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("other");
    succeed(
        btf()
            .arg("enlarge")
            .args([&fixture().model(), &output])
            .args(["--method", "paper", "--size", "64x64", "--seed", "2"]),
    );
    let read = |path: &std::path::Path| {
        let store = btfkit::store::enlarged::Enlarged::open(path).unwrap();
        store.read(btfkit::shape::Size::new(64, 64).window()).unwrap()
    };
    assert_ne!(read(&output), read(&fixture().enlarged()));
}

#[test]
fn outputs_of_a_range_of_seeds_are_those_of_each_seed() {
    let folder = tempfile::tempdir().unwrap();
    let range = folder.path().join("plane.zarr");
    let size = ["--method", "paper", "--size", "90x70"];
    succeed(btf().arg("enlarge").args([&fixture().model(), &range]).args(size).args(["--seed", "3..5"]));
    for seed in 3..=5 {
        let alone = folder.path().join(seed.to_string());
        let seed_text = seed.to_string();
        succeed(
            btf().arg("enlarge").args([&fixture().model(), &alone]).args(size).args(["--seed", &seed_text]),
        );
        assert_same(&folder.path().join(format!("plane-{seed}.zarr")), &alone);
    }
    assert!(!range.exists());
}

/// Neither column nor row shows where a tileable output begins: the costs across its borders are like those inside.
#[test]
fn a_tileable_output_joins_at_its_borders() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("tile");
    let mut command = btf();
    command.arg("enlarge").args([&fixture().model(), &output]).args(["--size", "256x192", "--keep-normals"]);
    succeed(command.args(["--method", "paper", "--tileable"]));
    let store = btfkit::store::enlarged::Enlarged::open(&output).unwrap();
    let size = store.size();
    let normals = store.read_normals(size.window()).unwrap().unwrap();
    let normal = |y: usize, x: usize| normals[y % size.height * size.width + x % size.width];
    let step =
        |a: [f32; 3], b: [f32; 3]| f64::from((0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f32>());
    let down = |y: usize| (0..size.width).map(|x| step(normal(y, x), normal(y + 1, x))).sum::<f64>();
    let along = |x: usize| (0..size.height).map(|y| step(normal(y, x), normal(y, x + 1))).sum::<f64>();
    for (name, steps) in [
        ("rows", (0..size.height).map(down).collect::<Vec<_>>()),
        ("columns", (0..size.width).map(along).collect()),
    ] {
        let (across, inside) = (steps[steps.len() - 1], &steps[..steps.len() - 1]);
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        let spread = (inside.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / inside.len() as f64).sqrt();
        assert!((across - mean).abs() < 4.0 * spread, "{name}: {across} across, {mean} +- {spread} inside");
    }
    let refused = crate::fixture::fail(
        btf().arg("enlarge").args([&fixture().model(), &folder.path().join("odd")]).args([
            "--size",
            "255x192",
            "--tileable",
            "--method",
            "paper",
        ]),
        2,
    );
    assert!(refused.contains("255"), "{refused}");
}

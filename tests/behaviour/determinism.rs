//! The same bytes whatever the threads, the kernel, the band and the form of the archive.

use std::process::Command;

use crate::fixture::{assert_same, btf, enlarge, fixture, succeed, unpack};

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
        run(btf().arg("model").args([&measurement, &model]).args(["--clusters", "24"]));
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
        btf().arg("enlarge").args([&fixture().model(), &output]).args(["--size", "64x64", "--seed", "2"]),
    );
    let read = |path: &std::path::Path| {
        let store = btfkit::store::enlarged::Enlarged::open(path).unwrap();
        store.read(btfkit::shape::Size::new(64, 64).window()).unwrap()
    };
    assert_ne!(read(&output), read(&fixture().enlarged()));
}

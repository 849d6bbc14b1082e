//! Bad input gets a clear message and exit code and leaves nothing that a later run takes for good.

use std::path::{Path, PathBuf};
use std::process::Command;

use btfkit_formats::jpeg::{EncodeOptions, encode};

use crate::fixture::{assert_same, btf, fail, fixture, succeed, unpack};

/// The fixture's images in a folder, to be harmed.
struct Images {
    folder: tempfile::TempDir,
    paths: Vec<PathBuf>,
}

impl Images {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let paths = unpack(&fixture().archive(), &folder.path().join("images"));
        Self { folder, paths }
    }

    fn store(&self) -> PathBuf {
        self.folder.path().join("store.zarr")
    }

    fn import(&self) -> Command {
        let mut command = btf();
        command.arg("import").args([&self.folder.path().join("images"), &self.store()]);
        command
    }

    /// Mends everything and checks that the import then ends as if nothing had happened.
    fn mend_and_import(&self) {
        unpack(&fixture().archive(), &self.folder.path().join("images"));
        succeed(&mut self.import());
        assert_same(&self.store(), &fixture().measurement());
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

#[test]
fn every_image_cut_short_is_named() {
    let images = Images::new();
    for &number in &[5, 40] {
        let bytes = std::fs::read(&images.paths[number]).unwrap();
        std::fs::write(&images.paths[number], &bytes[..bytes.len() / 2]).unwrap();
    }
    let told = fail(&mut images.import(), 65);
    assert!(told.contains(&name(&images.paths[5])) && told.contains(&name(&images.paths[40])), "{told}");
    assert!(!images.store().exists());
    images.mend_and_import();
}

#[test]
fn an_image_of_another_size_is_named_with_both_sizes() {
    let images = Images::new();
    let grown = encode(&vec![90; 64 * 48 * 3], 64, 48, 3, &EncodeOptions::UBO2003).unwrap();
    std::fs::write(&images.paths[33], grown).unwrap();
    let told = fail(&mut images.import(), 65);
    assert!(
        told.contains(&name(&images.paths[33])) && told.contains("64x48") && told.contains("56x48"),
        "{told}"
    );
    assert!(!images.store().exists());
    images.mend_and_import();
}

#[test]
fn every_missing_and_every_duplicate_image_is_named() {
    let images = Images::new();
    std::fs::copy(&images.paths[20], images.folder.path().join("images").join(name(&images.paths[20])))
        .unwrap();
    for &number in &[3, 77, 150] {
        std::fs::remove_file(&images.paths[number]).unwrap();
    }
    let told = fail(&mut images.import(), 65);
    let angles = |number: usize| {
        let image = btfkit_formats::ubo2003::parse_name(&name(&images.paths[number])).unwrap();
        (image.view, image.light)
    };
    for number in [3, 77, 150, 20] {
        let (view, light) = angles(number);
        for part in [view.theta_deg(), view.phi_deg(), light.theta_deg(), light.phi_deg()] {
            assert!(told.contains(&format!("{part}")), "{part} of {number} in {told}");
        }
    }
    assert!(told.contains("3") && told.to_lowercase().contains("missing"), "{told}");
    images.mend_and_import_after_removing_duplicate(20);
}

impl Images {
    fn mend_and_import_after_removing_duplicate(&self, number: usize) {
        std::fs::remove_file(self.folder.path().join("images").join(name(&self.paths[number]))).unwrap();
        self.mend_and_import();
    }
}

#[test]
fn a_truncated_zip_and_a_file_that_is_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(fixture().archive()).unwrap();
    for (kept, what) in [(bytes.len() / 2, "half.zip"), (bytes.len() - 1, "short.zip"), (0, "empty.zip")] {
        let path = folder.path().join(what);
        std::fs::write(&path, &bytes[..kept]).unwrap();
        let store = folder.path().join("store.zarr");
        let told = fail(btf().arg("import").args([&path, &store]), 65);
        assert!(told.contains(what), "{told}");
        assert!(!store.exists());
    }
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "no archive at all\n".repeat(100)).unwrap();
    let told = fail(btf().arg("import").args([&text, &folder.path().join("store.zarr")]), 65);
    assert!(told.contains("notes.txt") && told.contains("expected"), "{told}");
    fail(btf().arg("import").args([&folder.path().join("nothing.zip"), &folder.path().join("s")]), 66);
}

#[test]
fn a_target_that_cannot_be_written_is_an_io_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file.zarr");
    std::fs::write(&file, "in the way").unwrap();
    let below = file.join("store.zarr");
    fail(btf().arg("import").args([&fixture().archive(), &below]), 74);
    let told = fail(btf().arg("import").args([&fixture().archive(), &file]), 65);
    assert!(told.contains("not a Zarr store"), "{told}");
    assert_eq!(std::fs::read(&file).unwrap(), b"in the way");
}

#[test]
fn a_full_target_is_an_io_error_and_a_later_run_completes_it() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store.zarr");
    // Files may not grow beyond 20 KiB: metadata fits, shards do not. The signal is ignored, so that
    // the write fails as it does on a full disk.
    let script = "trap '' XFSZ; ulimit -f 20; exec \"$@\"";
    let mut limited = Command::new("bash");
    limited
        .args(["-c", script, "bash", env!("CARGO_BIN_EXE_btf"), "import"])
        .args([&fixture().archive(), &store]);
    let told = fail(&mut limited, 74);
    assert!(told.contains("cannot write"), "{told}");
    assert!(crate::fixture::tree_names(&store).iter().all(|path| !path.to_string_lossy().contains(".tmp-")));
    succeed(btf().arg("import").args([&fixture().archive(), &store]));
    assert_same(&store, &fixture().measurement());
}

#[test]
fn a_damaged_shard_is_an_error_with_its_name_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store.zarr");
    succeed(btf().arg("import").args([&fixture().archive(), &store]));
    let shard = store.join("reflectance/c/0/0/0/0/0");
    let whole = std::fs::read(&shard).unwrap();
    let out = folder.path().join("out.png");
    let image = || {
        let mut command = btf();
        command.arg("image").arg(&store).arg("--out").arg(&out).args(["--light", "0,0", "--view", "0,0"]);
        command
    };
    succeed(&mut image());
    for at in [0, whole.len() / 3, whole.len() - 3] {
        let mut harmed = whole.clone();
        harmed[at] ^= 0x10;
        std::fs::write(&shard, harmed).unwrap();
        let told = fail(&mut image(), 65);
        assert!(told.contains("reflectance"), "{told}");
    }
    for kept in [0, 10, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&shard, &whole[..kept]).unwrap();
        fail(&mut image(), 65);
    }
    std::fs::remove_file(&shard).unwrap();
    let told = fail(&mut image(), 66);
    assert!(told.contains("reflectance"), "{told}");
}

#[test]
fn nonsense_metadata_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store.zarr");
    succeed(btf().arg("import").args([&fixture().archive(), &store]));
    let out = folder.path().join("out.png");
    for (file, from, to) in [
        ("reflectance/zarr.json", "48", "48000000000"),
        ("zarr.json", "\"format\": 2", "\"format\": 9"),
        ("zarr.json", "srgb", "sRGB?"),
        ("view_direction/zarr.json", "float64", "float32"),
    ] {
        let path = store.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} has no {from}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let told = fail(btf().arg("image").arg(&store).arg("--out").arg(&out), 65);
        assert!(told.contains("store.zarr"), "{told}");
        std::fs::write(&path, text).unwrap();
    }
    succeed(btf().arg("image").arg(&store).arg("--out").arg(&out));
}

/// Every byte of a store's metadata with one bit flipped, and many of a shard's: an error or a reading, never a panic.
#[test]
fn no_flipped_bit_of_a_store_brings_the_reader_down() {
    use btfkit::store::measurement::Measurement;
    let folder = tempfile::tempdir().unwrap();
    let (archive, store) = (folder.path().join("s.zip"), folder.path().join("s.zarr"));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "16x16", "--views", "3", "--lights", "4"]));
    succeed(btf().arg("import").args([&archive, &store]));
    let read = || -> btfkit::Result<(btfkit_formats::Samples, Vec<u8>)> {
        let measurement = Measurement::open(&store)?;
        let window = measurement.description().size.window();
        Ok((measurement.read_reflectance(1, window)?, measurement.read_luminance(1, window)?))
    };
    let truth = read().unwrap();
    let mut refused = 0;
    for (file, step) in [
        ("zarr.json", 1),
        ("reflectance/zarr.json", 1),
        ("view_direction/zarr.json", 1),
        ("view_direction/c/0/0", 1),
        ("reflectance/c/1/0/0/0/0", 3),
    ] {
        let path = store.join(file);
        let whole = std::fs::read(&path).unwrap();
        for at in (0..whole.len()).step_by(step) {
            let mut harmed = whole.clone();
            harmed[at] ^= 1 << (at % 8);
            std::fs::write(&path, &harmed).unwrap();
            match read() {
                Err(_) => refused += 1,
                // Samples are covered by checksums: what is read of a harmed shard must be the truth.
                Ok(found) if file.starts_with("reflectance/c") => {
                    assert!(found == truth, "{file}, byte {at}");
                }
                Ok(_) => {}
            }
        }
        std::fs::write(&path, &whole).unwrap();
    }
    assert!(read().unwrap() == truth);
    assert!(refused > 1000, "{refused}");
}

/// The metadata of every array of a model with one bit flipped, byte by byte: an error or a reading, never a panic.
#[test]
fn no_flipped_bit_of_a_models_metadata_brings_the_reader_down() {
    use btfkit::store::model::{Model, Stage};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.zarr");
    succeed(btf().arg("model").args([&fixture().measurement(), &path]).args([
        "--clusters",
        "8",
        "--mrf",
        "2d",
    ]));
    let read = || -> btfkit::Result<()> {
        let model = Model::open(&path)?;
        let (_, _, _, _) = (model.tile()?, model.index()?, model.normals()?, model.distance()?);
        let (_, _, _) = (model.representatives()?, model.surface()?, model.triangles()?);
        model.appearance()?;
        model.digest_of(&[Stage::Cluster, Stage::Fit, Stage::Appearance]).map(drop)
    };
    read().unwrap();
    let mut refused = 0;
    for file in [
        "zarr.json",
        "tile_source/zarr.json",
        "index/zarr.json",
        "normals/zarr.json",
        "distance/zarr.json",
        "representatives/zarr.json",
        "view_triangles/zarr.json",
        "mrf/mean/zarr.json",
        "mrf/gain/zarr.json",
        "mrf/marginals/zarr.json",
        "mrf/level_0/gamma/zarr.json",
        "mrf/level_0/neighbourhood/zarr.json",
        "appearance/features/zarr.json",
        "appearance/level_0/basis/zarr.json",
        "appearance/level_1/offset/zarr.json",
    ] {
        let file = path.join(file);
        let whole = std::fs::read(&file).unwrap();
        for at in 0..whole.len() {
            let mut harmed = whole.clone();
            harmed[at] ^= 1 << (at % 8);
            std::fs::write(&file, &harmed).unwrap();
            refused += usize::from(read().is_err());
        }
        std::fs::write(&file, &whole).unwrap();
    }
    read().unwrap();
    assert!(refused > 3000, "{refused}");
}

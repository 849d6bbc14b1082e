//! What `btf verify` finds, and what shards and codecs leave the same.

use std::path::{Path, PathBuf};

use crate::fixture::{assert_same, btf, copy, fail, fixture, succeed, tree_names};

/// The fixture's measurement, to be harmed.
fn copied(folder: &Path) -> PathBuf {
    let store = folder.join("harmed.zarr");
    copy(&fixture().measurement(), &store);
    store
}

#[test]
fn a_whole_measurement_passes_and_equals_its_archive() {
    let (store, archive) = (fixture().measurement(), fixture().archive());
    let told = succeed(btf().arg("verify").arg(&store).arg("--source").arg(&archive));
    assert!(told.contains("9 of 9"), "{told}");
}

#[test]
fn each_damaged_chunk_is_named_and_a_new_import_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    for array in ["reflectance", "luminance"] {
        let store = copied(&folder.path().join(array));
        let shards: Vec<PathBuf> = tree_names(&store)
            .into_iter()
            .filter(|path| path.to_string_lossy().contains(&format!("{array}/c/4/")))
            .collect();
        let [shard] = shards.as_slice() else { panic!("{shards:?}") };
        let mut bytes = std::fs::read(shard).unwrap();
        bytes[100] ^= 4;
        std::fs::write(shard, bytes).unwrap();
        let output = btf().arg("verify").arg(&store).output().unwrap();
        assert_eq!(output.status.code(), Some(65));
        let told = String::from_utf8_lossy(&output.stdout);
        assert!(told.contains(&format!("damaged: {array} of view 4, chunk at row 0, column 0")), "{told}");
        assert_eq!(told.matches("damaged: ").count(), 1, "{told}");
        std::fs::remove_file(shard).unwrap();
        fail(btf().arg("verify").arg(&store), 66);
        succeed(btf().arg("import").args([&fixture().archive(), &store]));
        assert_same(&store, &fixture().measurement());
    }
}

#[test]
fn codes_that_are_not_those_of_the_samples_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let store = copied(folder.path());
    // Both decode, but they belong to different views.
    std::fs::copy(store.join("luminance/c/2/0/0/0"), store.join("luminance/c/3/0/0/0")).unwrap();
    let output = btf().arg("verify").arg(&store).output().unwrap();
    assert_eq!(output.status.code(), Some(65));
    assert!(String::from_utf8_lossy(&output.stdout).contains("codes that are not those of the samples"));
}

#[test]
fn another_archive_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.zip");
    let size = ["--size", "56x48", "--views", "9", "--lights", "19", "--seed", "5"];
    succeed(btf().arg("sample").arg(&other).args(size));
    fail(btf().arg("verify").arg(fixture().measurement()).arg("--source").arg(&other), 65);
}

#[test]
fn shards_in_any_number_and_order_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for shards in
        [&["0/1"][..], &["2/4", "0/4", "2/4", "3/4", "1/4"], &["1/2", "0/2"], &["0/20", "8/9", "0/1"]]
    {
        let store = folder.path().join(format!("s{}.zarr", shards.len()));
        for shard in shards {
            succeed(btf().arg("import").args([&fixture().archive(), &store]).args(["--shard", shard]));
        }
        assert_same(&store, &fixture().measurement());
    }
    fail(btf().arg("import").arg(fixture().archive()).args(["--shard", "4/4"]), 2);
}

/// Copies the files of a row of shards over those of another, in these arrays.
fn exchange(store: &Path, arrays: &[&str], [from, to]: [&str; 2]) {
    for array in arrays {
        let (from, to) = (store.join(array).join("c").join(from), store.join(array).join("c").join(to));
        for (name, bytes) in crate::fixture::tree(&from) {
            std::fs::write(to.join(name), bytes).unwrap();
        }
    }
}

#[test]
fn shards_that_fit_together_in_the_place_of_others_are_found_by_their_checksums() {
    let folder = tempfile::tempdir().unwrap();
    let store = copied(folder.path());
    exchange(&store, &["reflectance", "luminance"], ["2", "3"]);
    let output = btf().arg("verify").arg(&store).output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(65), "{told}");
    assert!(told.contains("of view 3") && told.contains("the shard of another view"), "{told}");
    let store = folder.path().join("big.zarr");
    copy(&fixture().enlarged(), &store);
    exchange(&store, &["index", "normals"], ["0", "1"]);
    let output = btf().arg("verify").arg(&store).arg("--model").arg(fixture().model()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(65), "{told}");
    for folder in ["index/c/1", "normals/c/1"] {
        assert!(told.contains(&format!("{folder}: the checksum of this row of shards")), "{told}");
    }
}

#[test]
fn what_is_only_missing_is_not_called_damaged() {
    for (store, lost, other) in [
        ("m.zarr", "normals/c/0/0/0", "index/c/0/0"),
        ("coherent.zarr", "normals/c/0/0/0", "index/c/0/0"),
        ("p_files", "0/0_0.png", "1/0_0.png"),
    ] {
        let copy = crate::damaged_stores::Copy::new();
        let store = copy.place(store);
        std::fs::remove_file(store.join(lost)).unwrap();
        let told = fail(btf().arg("verify").arg(&store), 66);
        assert!(told.contains("not whole"), "{told}");
        std::fs::write(store.join(other), "damaged").unwrap();
        let told = fail(btf().arg("verify").arg(&store), 65);
        assert!(told.contains("damaged"), "{told}");
    }
}

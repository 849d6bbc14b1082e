//! The paper's method gives the bytes that it always gave.

use std::path::Path;

use btfkit::run::recipe::digest_bytes;

use crate::fixture::{btf, fixture, succeed, tree};

/// SHA-256 of the shards of index and normals, of an enlargement of a model.
///
/// Measured by the program as it was before it knew any other method (commit 2978242), by these very commands without
/// `--method`: of the fixture's sample, `btf tile --tile 40x36`, `btf normals`, `btf fit` with these settings,
/// `btf cluster --clusters 24`, and `btf enlarge` with those.
const EXPECTED: [(&str, &[&str], &[&str], &str); 3] = [
    (
        "3d",
        &["--mrf", "3d"],
        &["--size", "530x600"],
        "c77ceb409c93abc12f3f765d66579bb834467f8663e3d5e8f94fe11187f8478d",
    ),
    (
        "2d",
        &["--mrf", "2d", "--marginals", "channel"],
        &["--size", "256x192", "--tileable", "--seed", "9"],
        "36729d4afebf0eec34865b46f81d1c279aaa70d23a35df68fddba7dbef158139",
    ),
    (
        "slopes",
        &["--field", "slopes"],
        &["--size", "90x1100", "--candidates", "4"],
        "352eab4eadf13111bb5a9c097ded3dc88a40231fb23619ea5db0f6c301380d74",
    ),
];

#[test]
fn enlargements_by_the_papers_method_have_the_bytes_of_the_first_version() {
    let folder = tempfile::tempdir().unwrap();
    for (name, fit, enlarge, expected) in EXPECTED {
        let [model, output] = [".model.zarr", ".zarr"].map(|end| folder.path().join(format!("{name}{end}")));
        succeed(btf().arg("tile").args([&fixture().measurement(), &model]).args(["--tile", "40x36"]));
        succeed(btf().arg("normals").args([&fixture().measurement(), &model]));
        succeed(btf().arg("fit").arg(&model).args(fit));
        succeed(btf().arg("cluster").args([&fixture().measurement(), &model]).args(["--clusters", "24"]));
        let mut command = btf();
        command.arg("enlarge").args([&model, &output]).args(["--keep-normals", "--method", "paper"]);
        succeed(command.args(enlarge));
        assert_eq!(digest(&output), expected, "{name}");
    }
}

/// SHA-256 of the files below `index/c` and `normals/c`, in the order of their names.
fn digest(store: &Path) -> String {
    let shards =
        ["index/c", "normals/c"].map(|array| tree(&store.join(array)).into_values().collect::<Vec<_>>());
    digest_bytes(&shards.concat().concat())
}

//! What is taken as the tile, what the recipe says of it, and what is advised.

use std::path::Path;

use btfkit::stage::tile::Report;
use btfkit::store::model::{Model, Stage};
use serde_json::Value;

use crate::fixture::{btf, fail, fixture, succeed};

/// The fixture's measurement, rows and columns.
const PLANE: [usize; 2] = [48, 56];

fn tile(model: &Path, options: &[&str]) -> std::process::Command {
    let mut command = btf();
    command.arg("tile").args([&fixture().measurement(), model]).args(options);
    command
}

/// The setting `key` of the recipe of a model's tile, and its report.
fn of(model: &Path, key: &str) -> (Option<String>, Report) {
    let model = Model::open(model).unwrap();
    let recipe = model.recipe_text(Stage::Tile).unwrap().unwrap();
    let setting = recipe.get(key).and_then(Value::as_str).map(str::to_owned);
    (setting, model.report(Stage::Tile).unwrap())
}

#[test]
fn of_a_small_plane_nearly_all_is_the_tile_and_goes_through_both_methods() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    let told =
        succeed(btf().arg("model").args([&fixture().measurement(), &model]).args(["--clusters", "24"]));
    assert!(!told.contains("of what was measured"), "{told}");
    let (choice, report) = of(&model, "tile");
    // Two thirds of the sides at least: four fifths, rounded down to a multiple of 8.
    let [height, width] = report.size;
    assert_eq!((choice.as_deref(), report.wraps), (Some("largest"), true));
    assert!(height >= PLANE[0] * 2 / 3 && width >= PLANE[1] * 2 / 3, "{report:?}");
    // The same by name, and by no other.
    for same in [vec![], vec!["--tile", "auto"], vec!["--tile", "largest"]] {
        succeed(&mut tile(&model, &same));
    }
    for other in ["plane", "none", "periodic", "cut", "40x32"] {
        let told = fail(&mut tile(&model, &["--tile", other]), 65);
        assert!(told.contains("tile was"), "{told}");
    }
    for method in ["paper", "coherent"] {
        let big = folder.path().join(method);
        succeed(btf().arg("enlarge").args([&model, &big]).args(["--method", method, "--size", "130x90"]));
    }
}

#[test]
fn a_plane_is_taken_whole_where_its_borders_join_or_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    let told = succeed(&mut tile(&model, &["--tile", "plane"]));
    assert!(told.contains("56x48 the whole measurement, its borders do not join"), "{told}");
    let (choice, report) = of(&model, "tile");
    assert_eq!((choice.as_deref(), report.size, report.wraps), (Some("plane"), PLANE, false));
}

#[test]
fn little_of_a_measurement_is_told_with_the_advice_to_take_all() {
    let folder = tempfile::tempdir().unwrap();
    let little = succeed(&mut tile(&folder.path().join("little"), &["--tile", "24x24"]));
    assert!(little.contains("21 % of what was measured: --tile none"), "{little}");
    assert!(little.contains("4.7 times the texels"), "{little}");
    let most = succeed(&mut tile(&folder.path().join("most"), &["--tile", "48x40"]));
    assert!(!most.contains("of what was measured"), "{most}");
}

#[test]
fn a_tile_is_cut_to_whole_cells_of_a_lattice_that_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    let given = ["--tile", "cut", "--lattice", "13,0;0,11"];
    let told = succeed(&mut tile(&model, &given));
    let (lattice, report) = of(&model, "lattice");
    assert_eq!(lattice.as_deref(), Some("13,0;0,11"));
    let [height, width] = report.size;
    assert!(report.wraps && height % 13 == 0 && width % 11 == 0, "{report:?}");
    // The shorter vector's wave comes first.
    assert_eq!(report.cells, [[0, (width / 11) as i32], [(height / 13) as i32, 0]]);
    assert!(told.contains(&format!("holds {} cells", height / 13 * (width / 11))), "{told}");
    succeed(&mut tile(&model, &given));
    for other in [&["--tile", "cut"][..], &["--tile", "cut", "--lattice", "none"]] {
        assert!(fail(&mut tile(&model, other), 65).contains("lattice was"));
    }
    // Ribs leave the other side alone, and a size that is given stays.
    let ribs = folder.path().join("ribs");
    succeed(&mut tile(&ribs, &["--tile", "cut", "--lattice", "0,11"]));
    let (_, report) = of(&ribs, "tile");
    assert_eq!((report.size[0] % 8, report.size[1] % 11), (0, 0), "{report:?}");
    let sized = folder.path().join("sized");
    let told = succeed(&mut tile(&sized, &["--tile", "40x32", "--lattice", "13,0;0,11"]));
    assert!(
        told.contains("no whole number of cells of the lattice, whose steps are 13.0 rows and 11.0 columns"),
        "{told}"
    );
    fail(&mut tile(&folder.path().join("bad"), &["--lattice", "13"]), 2);
}

#[test]
fn of_a_plane_the_lattice_is_told_and_left_to_the_appearance() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    let mut command = btf();
    command.arg("model").args([&fixture().measurement(), &model]).args(["--tile", "plane"]);
    let told = succeed(command.args(["--clusters", "24", "--lattice", "20,0;0,11"]));
    // 40 of 48 rows and 55 of 56 columns are whole cells.
    assert!(told.contains("holds 10 cells of a lattice, whose steps are"), "{told}");
    assert!(told.contains("exemplar  55x40"), "{told}");
    assert!(told.contains("only 2 in a direction"), "{told}");
}

#[test]
fn a_plane_that_is_too_small_to_cut_is_taken_whole_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store] = ["s.zip", "s.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "16x14", "--views", "3", "--lights", "7"]));
    succeed(btf().arg("import").args([&archive, &store]));
    let tile = |name: &str, options: &[&str]| {
        let mut command = btf();
        command.arg("tile").args([&store, &folder.path().join(name)]).args(options);
        command
    };
    let told = fail(&mut tile("cut", &["--tile", "cut"]), 2);
    assert!(told.contains("too small") && told.contains("--tile plane"), "{told}");
    succeed(&mut tile("auto", &[]));
}

//! What a store says about itself, changed by one who can seal it again: every member of the attributes of every kind
//! of store is taken out, and made another type; and numbers are put in that contradict what the arrays have.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::crafted_stores::told;
use crate::damaged_stores::{Copy, METHODS, seal_again, with_context};
use crate::fixture::{btf, fail, succeed, tree_names};

/// A store, the file that says what it is, and where in it.
struct Described {
    name: String,
    file: PathBuf,
    root: &'static str,
}

fn described(copy: &Copy) -> Vec<Described> {
    let zarr = |name: String| {
        let file = copy.place(&name).join("zarr.json");
        Described { name, file, root: "/attributes/btfkit" }
    };
    let mut all: Vec<Described> =
        ["s", "m"].iter().chain(&METHODS).map(|name| zarr(format!("{name}.zarr"))).collect();
    all.push(Described {
        name: "p_files".to_owned(),
        file: copy.place("p_files").join("btfkit.json"),
        root: "",
    });
    all
}

/// Pointers of all members below a value; of a list the first element only.
fn members(value: &Value, at: &str, found: &mut Vec<String>) {
    let mut below = |name: &str, value: &Value| {
        let pointer = format!("{at}/{}", name.replace('~', "~0").replace('/', "~1"));
        found.push(pointer.clone());
        members(value, &pointer, found);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(name, value)| below(name, value)),
        Value::Array(list) => list.iter().take(1).for_each(|value| below("0", value)),
        _ => {}
    }
}

/// Changes one member and seals what it is in again; none where it is taken out.
fn forge(document: &Value, root: &str, pointer: &str, value: Option<Value>) -> Value {
    let mut document = document.clone();
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    match (document.pointer_mut(&format!("{root}{parent}")).unwrap(), value) {
        (Value::Object(map), Some(value)) => drop(map.insert(name.replace("~1", "/"), value)),
        (Value::Object(map), None) => drop(map.remove(&name.replace("~1", "/")).unwrap()),
        (Value::Array(list), Some(value)) => list[0] = value,
        (Value::Array(list), None) => drop(list.remove(0)),
        _ => panic!("{pointer}"),
    }
    seal_again(document.pointer_mut(root).unwrap().as_object_mut().unwrap());
    document
}

fn of_another_type(value: &Value) -> Value {
    match value {
        Value::String(_) | Value::Array(_) | Value::Object(_) => json!(-7),
        Value::Number(_) | Value::Bool(_) => json!("seven"),
        Value::Null => json!({"seven": 7}),
    }
}

/// What may be missing, since recipes and reports of older versions do not have it, or since it decides about nothing.
fn may_go(store: &str, pointer: &str) -> bool {
    let of_list = pointer.ends_with("/0");
    match store {
        "s.zarr" => pointer == "/remarks" || pointer.starts_with("/recipe/reading"),
        "m.zarr" => {
            [
                "/stages/tile/report/lattice",
                "/stages/tile/report/cells",
                "/stages/cluster/report/batches",
                // Null means the same as nothing.
                "/stages/fit/recipe/levels",
                "/stages/cluster/report/taken_from",
                "/stages/tile/report/patch",
            ]
            .contains(&pointer)
                || pointer.ends_with("/note")
                || (of_list && pointer.contains("passes"))
        }
        "p_files" => pointer == "/notes",
        _ => pointer == "/model_name",
    }
}

#[test]
fn every_member_that_is_missing_or_of_another_type_is_told() {
    let copy = Copy::new();
    let mut believed = Vec::new();
    for Described { name, file, root } in described(&copy) {
        let whole = std::fs::read(&file).unwrap();
        let document: Value = serde_json::from_slice(&whole).unwrap();
        let mut pointers = Vec::new();
        members(document.pointer(root).unwrap(), "", &mut pointers);
        // These are worked out again from the rest.
        pointers
            .retain(|pointer| !["digest", "seal"].iter().any(|name| pointer.ends_with(&format!("/{name}"))));
        for pointer in &pointers {
            let value = document.pointer(&format!("{root}{pointer}")).unwrap();
            for change in [None, Some(of_another_type(value))] {
                let forged = forge(&document, root, pointer, change.clone());
                std::fs::write(&file, forged.to_string()).unwrap();
                let found = with_context(|context| told(&copy.place(&name), context));
                let what = change.map_or("missing".to_owned(), |value| value.to_string());
                let nothing = ["", "[] []"].contains(&found.as_str());
                if nothing != (what == "missing" && may_go(&name, pointer)) {
                    believed.push(format!("{name} {pointer}: {what}: {found}"));
                }
            }
        }
        std::fs::write(&file, whole).unwrap();
    }
    assert!(believed.is_empty(), "{} told wrongly:\n{}", believed.len(), believed.join("\n"));
}

#[test]
fn numbers_that_contradict_the_arrays_or_lie_beyond_their_range_are_told() {
    let copy = Copy::new();
    let all = described(&copy);
    // 24x20 texels, 7 clusters, 4 views, 5 lights, 3 channels of 8 bits.
    let cases: Vec<(&str, &str, Value, &str)> = vec![
        ("s.zarr", "/radiometry", json!("radiance"), "radiometry: got \"radiance\""),
        ("s.zarr", "/assumptions", json!(["none"]), "assumptions"),
        ("s.zarr", "/recipe/codec", json!("predictive"), "codec: got \"predictive\""),
        ("s.zarr", "/recipe/codec", json!("none"), "codec: got \"none\""),
        ("s.zarr", "/recipe/method", json!(99), "method: got 99, expected 1 to"),
        ("s.zarr", "/recipe/method", json!(0), "method: got 0, expected 1 to"),
        ("s.zarr", "/recipe/reading/turn_deg", json!(45), "turn_deg: got 45"),
        ("s.zarr", "/recipe/reading/drop_views", json!([2, 2]), "drop_views"),
        ("s.zarr", "/recipe/reading/samples", json!("f32"), "samples: got \"float32\""),
        ("s.zarr", "/recipe/reading/transfer", json!("linear"), "transfer: got \"linear\""),
        ("s.zarr", "/recipe/reading/more", json!(1), "unknown field `more`"),
        ("m.zarr", "/stages/cluster/recipe/method", json!(99), "method: got 99, expected 1 to"),
        ("m.zarr", "/stages/cluster/report/representative_bytes", json!(421), "got 421, expected 420"),
        ("m.zarr", "/stages/cluster/report/index_bytes", json!(481), "got 481, expected 480"),
        ("m.zarr", "/stages/cluster/report/tile_bytes", json!(1), "tile_bytes: got 1"),
        ("m.zarr", "/stages/cluster/report/measurement_bytes", json!(1), "measurement_bytes: got 1"),
        ("m.zarr", "/stages/cluster/report/single_texel_clusters", json!(8), "got 8 of 7"),
        ("m.zarr", "/stages/cluster/report/representative_lightness_error", json!(-1.0), "an error of -1"),
        ("m.zarr", "/stages/cluster/recipe/limits/tolerance", json!(-0.5), "tolerance: the recipe says -0.5"),
        ("m.zarr", "/stages/cluster/recipe/limits/passes", json!(0), "passes: got"),
        (
            "m.zarr",
            "/stages/cluster/recipe/amount",
            json!({"clusters": 6}),
            "clusters: got 7, the recipe says 6",
        ),
        ("m.zarr", "/stages/tile/report/seam_visibility", json!(-1.0), "seam_visibility: got -1"),
        ("m.zarr", "/stages/tile/report/cells", json!([[9, 9]]), "cells: got [[9, 9]]"),
        (
            "m.zarr",
            "/stages/tile/report/patch",
            json!({"y": 1, "x": 0, "height": 20, "width": 24, "overlap": 0}),
            "patch: got Patch",
        ),
        ("m.zarr", "/stages/normals/report/view", json!(4), "view: got 4 of 4"),
        ("m.zarr", "/stages/normals/report/lights", json!(4), "lights: got 4, expected 5"),
        ("m.zarr", "/stages/normals/report/mean", json!([1.0, 1.0, 0.0]), "no mean of unit vectors"),
        ("m.zarr", "/stages/normals/report/spread_deg", json!(181), "spread_deg: got 181"),
        ("m.zarr", "/stages/fit/report/levels/0/gain", json!(0.5), "gain: got 0.5, mrf/gain has"),
        (
            "m.zarr",
            "/stages/fit/report/levels/0/size",
            json!([20, 23]),
            "size: got [20, 23], expected [20, 24]",
        ),
        ("m.zarr", "/stages/fit/report/levels/0/radius", json!(-1.0), "radius: got -1"),
        ("m.zarr", "/stages/appearance/report/found", json!("there"), "found: got \"there\""),
        ("m.zarr", "/stages/appearance/report/strongest_peak", json!(2.0), "strongest_peak: got 2"),
        ("coherent.zarr", "/recipe/jitter", json!(257), "jitter: expected 0 to 256"),
        (
            "coherent.zarr",
            "/recipe/candidates",
            json!(8),
            "candidates: got one, which --method coherent has not",
        ),
        ("quilt.zarr", "/recipe/jitter", json!(8), "jitter: got one, which --method quilt has not"),
        ("paper.zarr", "/recipe/candidates", json!(481), "candidates: expected 1 to 480"),
        ("paper.zarr", "/recipe/source", json!(true), "source: got one, which --method paper has not"),
        ("tiles.zarr", "/recipe/tiles", json!(257), "tiles: expected 1 to 256"),
        ("tiles.zarr", "/recipe/tileable", json!(true), "tileable: 40x32 holds no whole tiles"),
        ("repeat.zarr", "/recipe/tileable", json!(true), "tileable: 40x32 holds no whole tiles"),
        ("repeat.zarr", "/recipe/rule", json!("roller2"), "unknown variant"),
        ("p_files", "/recipe/exposure", json!(0.0), "exposure: got 0"),
        ("p_files", "/recipe/tiles", json!({"jpeg": 101}), "a quality of 101"),
        ("p_files", "/recipe/view", json!([91.0, 0.0]), "view: got 91,0 degrees"),
        ("p_files", "/recipe/source/size", json!([0, 40]), "a side of 0"),
        ("p_files", "/recipe/source/window", json!([1, 0, 40, 32]), "window: got [1, 0, 40, 32] of 40x32"),
        ("p_files", "/recipe/source/kind", json!("plane"), "unknown field `size`"),
        ("p_files", "/recipe/method", json!(2), "method: got 2, expected 1 to 1"),
        ("p_files", "/kind", json!("model"), "unknown variant `model`"),
    ];
    for (name, pointer, value, words) in cases {
        let Described { file, root, .. } = all.iter().find(|store| store.name == name).unwrap();
        let whole = std::fs::read(file).unwrap();
        let document: Value = serde_json::from_slice(&whole).unwrap();
        std::fs::write(file, forge(&document, root, pointer, Some(value.clone())).to_string()).unwrap();
        let found = with_context(|context| told(&copy.place(name), context));
        assert!(found.contains(words), "{name} {pointer} {value}: expected {words:?}, told {found:?}");
        std::fs::write(file, whole).unwrap();
    }
}

#[test]
fn a_store_that_claims_an_older_layout_than_it_has_is_refused() {
    let copy = Copy::new();
    for Described { name, file, root } in described(&copy) {
        let whole = std::fs::read(&file).unwrap();
        let document: Value = serde_json::from_slice(&whole).unwrap();
        let mut forged = forge(&document, root, "/format", Some(json!(1)));
        std::fs::write(&file, forged.to_string()).unwrap();
        let found = with_context(|context| told(&copy.place(&name), context));
        assert!(found.contains("got 1 beside a seal"), "{name}: {found}");
        let ours = forged.pointer_mut(root).unwrap().as_object_mut().unwrap();
        ours.remove("seal");
        std::fs::write(&file, forged.to_string()).unwrap();
        let found = with_context(|context| told(&copy.place(&name), context));
        assert!(found.contains("got 1 beside checksums"), "{name}: {found}");
        // Without these too it is held against its arrays.
        let ours = forged.pointer_mut(root).unwrap().as_object_mut().unwrap();
        ours.remove("checksums");
        for entry in ours.get_mut("stages").and_then(Value::as_object_mut).into_iter().flatten() {
            entry.1.as_object_mut().unwrap().remove("checksums");
        }
        std::fs::write(&file, forged.to_string()).unwrap();
        if ["s.zarr", "m.zarr"].contains(&name.as_str()) {
            let found = with_context(|context| told(&copy.place(&name), context));
            assert!(found.contains("layout format 1, whose stores have no view_theta"), "{name}: {found}");
        }
        std::fs::write(&file, whole).unwrap();
    }
}

/// Dimensions that another program selects by, exchanged, in the array and in the copy of its metadata.
#[test]
fn permuted_names_of_dimensions_are_told() {
    let copy = Copy::new();
    let is_array = |file: &Path| {
        file.ends_with("zarr.json") && std::fs::read_to_string(file).unwrap().contains("\"array\"")
    };
    for name in ["s.zarr", "m.zarr", "coherent.zarr"] {
        let store = copy.place(name);
        for file in tree_names(&store).into_iter().filter(|file| is_array(file)) {
            let whole = std::fs::read(&file).unwrap();
            let mut document: Value = serde_json::from_slice(&whole).unwrap();
            if document["node_type"] != "array" {
                continue;
            }
            let names = document["dimension_names"].as_array_mut().unwrap();
            if names.len() < 2 {
                continue;
            }
            names.reverse();
            std::fs::write(&file, document.to_string()).unwrap();
            let found = with_context(|context| told(&store, context));
            assert!(found.contains("dimension_names"), "{}: {found}", file.display());
            std::fs::write(&file, whole).unwrap();
        }
    }
}

/// Names like those of chunks, where there is no such chunk: a file of the user's, which `--force` leaves alone.
#[test]
fn a_number_that_is_no_chunk_is_a_file_of_the_users() {
    let copy = Copy::new();
    let store = copy.place("coherent.zarr");
    let again = || {
        let mut command = btf();
        command.arg("enlarge").args([&copy.place("m.zarr"), &store]);
        command.args(["--size", "40x32", "--seed", "9", "--force"]);
        command
    };
    for name in ["index/c/5", "index/c/0/1", "index/c/0/00", "normals/c/0/0/1", "index/c/0/0.txt"] {
        let file = store.join(name);
        std::fs::write(&file, "mine").unwrap();
        let found = fail(&mut again(), 65);
        assert!(found.contains(name) && found.contains("no part of"), "{name}: {found}");
        assert_eq!(std::fs::read(&file).unwrap(), b"mine", "{name}");
        std::fs::remove_file(&file).unwrap();
    }
    let model = copy.place("m.zarr");
    let file = model.join("index/c/7");
    std::fs::write(&file, "mine").unwrap();
    let mut cluster = btf();
    cluster.arg("cluster").args([&copy.place("s.zarr"), &model]).args(["--clusters", "5", "--force"]);
    let found = fail(&mut cluster, 65);
    assert!(found.contains("index/c/7"), "{found}");
    std::fs::remove_file(&file).unwrap();
    succeed(&mut cluster);
    succeed(btf().arg("appearance").arg(&model));
    succeed(&mut again());
}

//! Stores that were changed by one who knows how: numbers and attributes that no run makes, with the checksums, digests
//! and seals that belong to them. So each rule about what a store may hold is reached, and has to hold by itself.

use std::path::Path;

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::shape::{Size, Window};
use btfkit::stage::verify::{self, Beside, Found};
use btfkit::store::enlarged::{Description, Enlarged, Texels};
use btfkit::store::model::{Model, Stage};
use btfkit::zarr::metadata::seal;
use serde_json::{Value, json};

use crate::coherent_damage::change;
use crate::damaged_stores::{Copy, seal_again, with_context};
use crate::fixture::{assert_same, btf, fail, fixture, succeed, tree_names};

/// What `verify` says of a store: its findings, or the error that keeps it from looking.
pub fn told(store: &Path, context: &Context<'_>) -> String {
    match verify::run(store, &Beside::default(), context) {
        Ok(Found::Other(report)) => {
            report.findings.iter().map(|finding| format!("{}: {}\n", finding.part, finding.what)).collect()
        }
        Ok(Found::Measurement { report, .. }) => format!("{:?} {:?}", report.damaged, report.findings),
        Err(error) => error.to_string(),
    }
}

/// Numbers of bytes from the beginning of an array, and what is written there.
type Patches<'a> = Vec<(usize, &'a [u8])>;

/// Changes elements of an array that lies in one chunk: numbers of bytes from its beginning, and bytes.
fn patch(store: &Path, array: &str, patches: &[(usize, &[u8])]) {
    let chunks = tree_names(&store.join(array).join("c"));
    let [chunk] = chunks.as_slice() else { panic!("{array}: {chunks:?}") };
    let mut bytes = zstd::stream::decode_all(std::fs::File::open(chunk).unwrap()).unwrap();
    for &(at, patch) in patches {
        bytes[at..at + patch.len()].copy_from_slice(patch);
    }
    let mut compressor = zstd::bulk::Compressor::new(3).unwrap();
    compressor.include_checksum(true).unwrap();
    std::fs::write(chunk, compressor.compress(&bytes).unwrap()).unwrap();
}

/// Declares a stage done again, with the checksums that its arrays have now.
fn declare(model: &Path, stage: Stage, context: &Context<'_>) -> Result<()> {
    let model = Model::open(model)?;
    let recipe = model.recipe_text(stage)?.unwrap();
    model.finish(stage, &recipe, &model.report::<Value>(stage)?, context)
}

#[test]
fn numbers_that_no_model_has_are_found_behind_right_checksums() {
    // Of the model that is damaged: 24x20 texels, 7 clusters, 4 views and 5 lights.
    let (f32s, f64s) = (|value: f32| value.to_le_bytes(), |value: f64| value.to_le_bytes());
    let (infinite, negative, one) = (f32s(f32::INFINITY), f32s(-1.0), f32s(1.0));
    let (far, row) = (2000u32.to_le_bytes(), 7 * 4);
    let site = |dy: i32, dx: i32| [dy.to_le_bytes(), dx.to_le_bytes()].concat();
    let (causal, back, distant) = (site(0, 1), site(0, -1), site(65, 0));
    let (nan, large, zero) = (f64s(f64::NAN), f64s(1e9), f64s(0.0));
    let infinite_f64 = f64s(f64::INFINITY);
    let cases: Vec<(Stage, &str, Patches<'_>, &str)> = vec![
        (Stage::Tile, "tile_source", vec![(0, &far)], "tile_source: row 2000"),
        (Stage::Tile, "tile_source", vec![(4, &far)], "column 2000 lie outside"),
        (Stage::Tile, "light_triangles", vec![(0, &[3, 0, 3, 0])], "light_triangles: not the triangles"),
        (Stage::Tile, "light_theta", vec![(0, &large)], "light_theta: not the angles"),
        (Stage::Tile, "view_phi", vec![(8, &large)], "view_phi: not the angles"),
        (Stage::Tile, "light_direction", vec![(16, &large)], "light_direction: direction 1 is theta"),
        (Stage::Tile, "light_direction", vec![(24, &nan)], "light_direction: direction 1 is theta"),
        (Stage::Cluster, "index", vec![(3, &[7])], "index: cluster 7 of 7"),
        (Stage::Cluster, "representative_texel", vec![(0, &far)], "representative_texel: row 2000"),
        (Stage::Cluster, "representative_texel", vec![(4, &far)], "column 2000 lie outside"),
        (Stage::Cluster, "distance", vec![(4, &infinite), (row, &infinite)], "from 0 to 1 got inf"),
        (Stage::Cluster, "distance", vec![(4, &negative), (row, &negative)], "from 0 to 1 got -1"),
        (Stage::Cluster, "distance", vec![(row, &one)], "from 0 to 1 got"),
        (Stage::Cluster, "distance", vec![(row + 4, &one)], "from 1 to 1 got 1"),
        (Stage::Normals, "normals", vec![(12 * 5 + 8, &negative), (12 * 5, &one)], "texel 5 has"),
        (Stage::Fit, "mrf/mean", vec![(0, &infinite_f64)], "the mean or the covariance"),
        (Stage::Fit, "mrf/covariance", vec![(0, &nan)], "the mean or the covariance"),
        (Stage::Fit, "mrf/covariance", vec![(8, &large)], "covariance: a covariance matrix is not symmetric"),
        (Stage::Fit, "mrf/covariance", vec![(8, &large), (16, &large)], "covariance: "),
        (Stage::Fit, "mrf/gain", vec![(0, &zero)], "the gain is 0"),
        (Stage::Fit, "mrf/gain", vec![(0, &infinite_f64)], "the gain is inf"),
        (Stage::Fit, "mrf/level_0/gamma", vec![(0, &nan)], "gamma is not finite"),
        (Stage::Fit, "mrf/level_0/gamma", vec![(0, &large)], "not stable"),
        (Stage::Fit, "mrf/level_0/sigma", vec![(0, &zero)], "sigma: "),
        (Stage::Fit, "mrf/level_0/neighbourhood", vec![(0, &back)], "is not causal"),
        (Stage::Fit, "mrf/level_0/neighbourhood", vec![(0, &causal), (8, &causal)], "is there twice"),
        (Stage::Fit, "mrf/level_0/neighbourhood", vec![(0, &distant)], "no site farther than 64"),
        (Stage::Fit, "mrf/marginals", vec![(0, &infinite)], "marginals"),
    ];
    let copy = Copy::new();
    let model = copy.place("m.zarr");
    with_context(|context| {
        assert_eq!(told(&model, context), "");
        for (stage, array, patches, words) in cases {
            let files: Vec<_> =
                tree_names(&model.join(array)).into_iter().chain([model.join("zarr.json")]).collect();
            let whole: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
            patch(&model, array, &patches);
            let told = match declare(&model, stage, context) {
                Ok(()) => told(&model, context),
                Err(error) => error.to_string(),
            };
            assert!(told.contains(words) && !told.contains("checksum"), "{array} {patches:?}: {told}");
            files.iter().zip(whole).for_each(|(file, bytes)| std::fs::write(file, bytes).unwrap());
        }
        assert_eq!(told(&model, context), "");
    });
}

#[test]
fn chunks_that_cannot_be_decoded_are_found_behind_right_checksums() {
    let copy = Copy::new();
    let model = copy.place("m.zarr");
    let file = model.join("representatives/c/0/0/0/0");
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    with_context(|context| {
        declare(&model, Stage::Cluster, context).unwrap();
        let told = told(&model, context);
        assert!(told.contains("representatives: ") && !told.contains("not the one"), "{told}");
    });
}

#[test]
fn attributes_that_no_model_has_are_found_behind_right_seals() {
    let copy = Copy::new();
    let model = copy.place("m.zarr");
    let file = model.join("zarr.json");
    let whole = std::fs::read(&file).unwrap();
    let stages = "/attributes/btfkit/stages";
    let patch = |height: usize| json!({"y": 0, "x": 0, "height": height, "width": 24, "overlap": 0});
    let cases: Vec<(Vec<(&str, Value)>, &str)> = vec![
        (vec![("tile/report/size", json!([0, 24]))], "got sides"),
        (vec![("tile/report/measurement_size", json!([1u64 << 40, 24]))], "got sides"),
        (vec![("tile/report/patch", patch(19))], "a patch of 24x19, which is not the tile"),
        (
            vec![
                ("tile/report/patch", patch(20)),
                ("tile/report/wraps", json!(false)),
                ("tile/recipe/tile", json!("none")),
            ],
            "a patch of 24x20, which is not the tile",
        ),
        (vec![("tile/report/size", json!([19, 24]))], "got no patch"),
        (vec![("tile/recipe/tile", json!("none"))], "the recipe says tile none"),
        (vec![("tile/report/wraps", json!(false))], "the recipe says tile periodic"),
        (vec![("cluster/report/clusters", json!(0))], "clusters: got 0"),
        (vec![("cluster/report/clusters", json!(65537))], "clusters: got 65537"),
        (vec![("cluster/recipe/tile", json!("0"))], "stage cluster is not of this tile"),
        (vec![("appearance/recipe/cluster", json!("0"))], "stage appearance is not of this cluster"),
        (vec![("fit/report/mrf", json!("2d"))], "mrf: got"),
        (vec![("fit/recipe/levels", json!(2))], "got 1 level,"),
        (vec![("fit/report/levels/0/eta", json!(0))], "level 0: got 0 sites"),
        (vec![("fit/report/levels/0/eta", json!(4097))], "level 0: got 4097 sites"),
        (vec![("fit/recipe/levels", json!(0)), ("fit/report/levels", json!([]))], "got 0 levels"),
        (vec![("appearance/report/wraps", json!(false))], "wraps false, of a tile"),
        (vec![("cluster/report/passes", json!(null))], "report of cluster"),
        (vec![("cluster/report/index_bytes", json!(-1))], "report of cluster"),
        (vec![("normals/report/lights", json!(-1))], "report of normals"),
    ];
    for (changes, words) in cases {
        for (member, value) in &changes {
            change(&file, &format!("{stages}/{member}"), Some(value.clone()));
        }
        let told = with_context(|context| told(&model, context));
        assert!(told.contains(words), "{changes:?}: {told}");
        std::fs::write(&file, &whole).unwrap();
    }
}

#[test]
fn what_no_enlargement_has_is_found_behind_right_checksums_and_seals() {
    let copy = Copy::new();
    let store = copy.place("coherent.zarr");
    let model = Model::open(&copy.place("m.zarr")).unwrap();
    let file = store.join("zarr.json");
    let whole = std::fs::read(&file).unwrap();
    for (member, value, words) in [
        ("clusters", json!(0), "clusters: got 0"),
        ("clusters", json!(65537), "clusters: got 65537"),
        ("clusters", json!(null), "clusters or tile: none"),
        ("tile", json!(null), "clusters or tile: none"),
        ("clusters", json!(8), "8 clusters, the model has"),
        ("recipe/stage", json!("tile"), "stage: got \"tile\", expected"),
        ("recipe/size", json!([0, 40]), "got a side of 0"),
        ("recipe/size", json!([32, 1u64 << 40]), "got a side of 1099511627776"),
    ] {
        change(&file, &format!("/attributes/btfkit/{member}"), Some(value.clone()));
        let told = with_context(|context| told(&store, context));
        assert!(told.contains(words), "{member} {value}: {told}");
        std::fs::write(&file, &whole).unwrap();
    }
    // Of 32 rows of 40 texels; the tile has 480 texels, the model 7 clusters.
    let window = Window { y: 0, x: 0, size: Size::new(32, 40) };
    let enlarged = Enlarged::open(&store).unwrap();
    let recipe = enlarged.attributes().unwrap()["recipe"].clone();
    let index = enlarged.read(window).unwrap();
    let source = enlarged.read_source(window).unwrap().unwrap();
    let normals = enlarged.read_normals(window).unwrap().unwrap().as_flattened().to_vec();
    let tile = model.tile().unwrap().size;
    let description =
        Description { size: window.size, clusters: 7, tile, keep_source: true, keep_normals: true };
    with_context(|context| {
        let write = |index: &[u16], source: &[u32], normals: &[f32]| {
            let enlarged = Enlarged::create(&store, &description, &recipe, model.path(), context).unwrap();
            enlarged.write(window, Texels { index, source, normals }).unwrap();
            enlarged.finish(context).unwrap();
            told(&store, context)
        };
        assert_eq!(write(&index, &source, &normals), "");
        let (mut other, mut beyond) = (index.clone(), index.clone());
        (other[50], beyond[50]) = ((index[50] + 1) % 7, 7);
        let told = write(&beyond, &source, &normals);
        assert!(told.contains("index: cluster 7 of 7, at row 1, column 10"), "{told}");
        let told = write(&other, &source, &normals);
        assert!(told.contains("row 1, column 10 is not what the model has"), "{told}");
        let mut far = source.clone();
        far[50] = 480;
        let told = write(&index, &far, &normals);
        assert!(told.contains("got texel 480, the tile has 480, at row 1, column 10"), "{told}");
        let (mut long, mut turned) = (normals.clone(), normals.clone());
        long[150..153].copy_from_slice(&[1.0, 1.0, 0.0]);
        turned[150..153].copy_from_slice(&[1.0, 0.0, 0.0]);
        let told = write(&index, &source, &long);
        assert!(told.contains("no unit vector, at row 1, column 10"), "{told}");
        let told = write(&index, &source, &turned);
        assert!(told.contains("normals: ") && told.contains("row 1, column 10 is not what"), "{told}");
        assert_eq!(write(&index, &source, &normals), "");
    });
    // A member that is not there yet is not damage: what is not finished is said to be that.
    let Value::Object(members) = serde_json::from_slice(&whole).unwrap() else { panic!() };
    assert!(members["attributes"]["btfkit"].get("checksums").is_some());
    change(&file, "/attributes/btfkit/checksums", None);
    let told = with_context(|context| told(&store, context));
    assert!(told.contains("was not declared finished"), "{told}");
}

/// The enlargement of several shards, the last of each row and column cut off by the border, without one file of each
/// array in turn: told as missing, not declared finished, and made again by the same command.
#[test]
fn an_enlargement_without_a_shard_of_any_array_is_not_whole_and_is_mended() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("big.zarr");
    let verify = || {
        let mut command = btf();
        command.arg("verify").arg(&store).arg("--model").arg(fixture().model());
        command
    };
    let make_at = |place: &Path| {
        let mut command = btf();
        command.arg("enlarge").args([&fixture().model(), place]).args([
            "--size",
            "530x700",
            "--keep-normals",
        ]);
        command
    };
    let (make, whole) = (|| make_at(&store), folder.path().join("whole.zarr"));
    succeed(&mut make_at(&whole));
    succeed(&mut make());
    for array in ["index", "source", "normals"] {
        for file in tree_names(&store.join(array).join("c")) {
            std::fs::remove_file(&file).unwrap();
            let output = verify().output().unwrap();
            let told = String::from_utf8_lossy(&output.stdout);
            assert_eq!(output.status.code(), Some(66), "{told}");
            assert!(told.contains("1 of 4 shards have not been written") == (array == "index"), "{told}");
            succeed(&mut make());
            assert_same(&store, &whole);
            // Another shard of the array in its place, whole in itself.
            let bytes = std::fs::read(&file).unwrap();
            let other = tree_names(&store.join(array).join("c")).into_iter().find(|other| *other != file);
            std::fs::copy(other.unwrap(), &file).unwrap();
            fail(&mut verify(), 65);
            std::fs::write(&file, bytes).unwrap();
        }
    }
    succeed(&mut verify());
    // Arrays that the recipe says are there.
    for array in ["source", "normals"] {
        let moved = folder.path().join("moved");
        std::fs::rename(store.join(array), &moved).unwrap();
        fail(&mut verify(), 66);
        std::fs::rename(&moved, store.join(array)).unwrap();
    }
    // What is written in part is not declared finished.
    let part = folder.path().join("part.zarr");
    let made = Enlarged::open(&whole).unwrap();
    let tile = made.tile().unwrap();
    let (size, clusters) = (made.size(), made.clusters());
    let description = Description { size, clusters, tile, keep_source: true, keep_normals: true };
    let recipe = made.attributes().unwrap()["recipe"].clone();
    with_context(|context| {
        let model = fixture().model();
        let enlarged = Enlarged::create(&part, &description, &recipe, &model, context).unwrap();
        let window = Window { y: 0, x: 0, size: Size::new(512, 530) };
        let texels = window.size.texels();
        let (index, source, normals) = (vec![0; texels], vec![0; texels], vec![0.0; 3 * texels]);
        enlarged.write(window, Texels { index: &index, source: &source, normals: &normals }).unwrap();
        enlarged.finish(context).unwrap();
        assert!(!enlarged.attributes().unwrap().contains_key("checksums"));
    });
    // A model has no archive to be compared with.
    fail(btf().arg("verify").arg(fixture().model()).arg("--source").arg(fixture().archive()), 2);
}

/// Changes a member of our attributes, with a seal that is right again but digests as they are told.
fn change_and_seal(file: &Path, pointer: &str, value: Value) {
    let mut document: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    *document.pointer_mut(pointer).unwrap() = value;
    let ours = document.pointer_mut("/attributes/btfkit").unwrap();
    ours["seal"] = json!(seal(ours.as_object().unwrap()));
    std::fs::write(file, document.to_string()).unwrap();
}

#[test]
fn a_recipe_that_no_stage_has_is_found_behind_its_right_digest() {
    for (stage, member, value, words) in [
        (Stage::Tile, "measurement", json!(7), "recipe of tile: invalid type: integer `7`"),
        (Stage::Cluster, "seeds", json!(1), "recipe of cluster: unknown field `seeds`"),
        (Stage::Normals, "robust", json!("yes"), "recipe of normals: invalid type: string \"yes\""),
        (Stage::Fit, "gains", json!("loud"), "recipe of fit: unknown variant `loud`"),
        (Stage::Appearance, "stage", json!("fit"), "recipe of appearance: stage: got \"fit\""),
    ] {
        let copy = Copy::new();
        let model = copy.place("m.zarr");
        let told = with_context(|context| {
            let opened = Model::open(&model).unwrap();
            let mut recipe = opened.recipe_text(stage).unwrap().unwrap();
            recipe[member] = value.clone();
            opened.finish(stage, &recipe, &opened.report::<Value>(stage).unwrap(), context).unwrap();
            told(&model, context)
        });
        assert!(told.contains(words), "{words}: {told}");
    }
}

#[test]
fn arrays_and_entries_of_another_model_are_found() {
    let copy = Copy::new();
    let model = copy.place("m.zarr");
    let file = model.join("zarr.json");
    let whole = std::fs::read(&file).unwrap();
    let stages = "/attributes/btfkit/stages";
    let found = |words: &str| {
        let told = with_context(|context| told(&model, context));
        assert!(told.contains(words), "{words}: {told}");
        std::fs::write(&file, &whole).unwrap();
    };
    change_and_seal(&file, &format!("{stages}/cluster/digest"), json!("0"));
    found("cluster: digest: it is not that of the recipe");
    change(&file, &format!("{stages}/cluster/checksums"), None);
    found("cluster: no checksums");
    let entry = json!({"recipe": {}, "digest": "", "report": {}, "checksums": {}});
    change(&file, &format!("{stages}/more"), Some(entry));
    found("unknown variant `more`");
    // Numbers that a model may have, but not this one.
    let half = 0.5f64.to_le_bytes();
    let patches: [(&str, &[u8]); 4] =
        [("mrf/mean", &half), ("mrf/gain", &half), ("appearance/features", &[77]), ("centres", &[1])];
    for (array, bytes) in patches {
        let copy = Copy::new();
        let model = copy.place("m.zarr");
        patch(&model, array, &[(0, bytes)]);
        let told = with_context(|context| told(&model, context));
        assert!(told.contains(&format!("{array}/c/0")) && told.contains("its checksum is not"), "{told}");
    }
}

#[test]
fn what_other_programs_read_is_what_the_store_says() {
    let copy = Copy::new();
    for (name, array) in [("s.zarr", "view_theta"), ("m.zarr", "mrf/mean"), ("coherent.zarr", "source")] {
        let place = format!("/consolidated_metadata/metadata/{}", array.replace('/', "~1"));
        let file = copy.place(name).join("zarr.json");
        let whole = std::fs::read(&file).unwrap();
        let mut document: Value = serde_json::from_slice(&whole).unwrap();
        document.pointer_mut(&place).unwrap()["shape"] = json!([1]);
        std::fs::write(&file, document.to_string()).unwrap();
        let told = with_context(|context| told(&copy.place(name), context));
        assert!(told.contains("the copy of all metadata"), "{name}: {told}");
        std::fs::write(&file, whole).unwrap();
    }
    let store = copy.place("s.zarr");
    let file = store.join("zarr.json");
    let whole = std::fs::read(&file).unwrap();
    change(&file, "/attributes/btfkit/checksums", None);
    let found = with_context(|context| told(&store, context));
    assert!(found.contains("was not declared finished"), "{found}");
    std::fs::write(&file, whole).unwrap();
    patch(&store, "view_theta", &[(0, &77.0f64.to_le_bytes())]);
    let found = with_context(|context| told(&store, context));
    assert!(found.contains("view_theta: not the angles of view_direction"), "{found}");
}

#[test]
fn what_no_pyramid_has_is_found_behind_right_seals() {
    let copy = Copy::new();
    let tiles = copy.place("p_files");
    let file = tiles.join("btfkit.json");
    let whole = std::fs::read(&file).unwrap();
    for (place, value, words) in [
        ("/recipe/source/window", json!([0, 0, 0, 32]), "got a side of 0"),
        ("/recipe/source/window", json!([0, 0, 40, 1u64 << 40]), "got a side of 1099511627776"),
        ("/recipe/tile_side", json!(1 << 20), "sizes that no pyramid has"),
        ("/recipe/overlap", json!(9), "sizes that no pyramid has"),
        ("/recipe/overlap", json!(2), "not the text that follows from the recipe"),
        ("/checksums", json!(null), "none are kept"),
    ] {
        let mut state: Value = serde_json::from_slice(&whole).unwrap();
        let (parent, name) = place.rsplit_once('/').unwrap();
        state.pointer_mut(parent).unwrap()[name] = value.clone();
        seal_again(state.as_object_mut().unwrap());
        std::fs::write(&file, state.to_string()).unwrap();
        let found = with_context(|context| told(&tiles, context));
        assert!(found.contains(words), "{place} {value}: {found}");
        std::fs::write(&file, &whole).unwrap();
    }
    let mut state: Value = serde_json::from_slice(&whole).unwrap();
    state.as_object_mut().unwrap().remove("checksums");
    seal_again(state.as_object_mut().unwrap());
    std::fs::write(&file, state.to_string()).unwrap();
    let found = with_context(|context| told(&tiles, context));
    assert!(found.contains("none are kept"), "{found}");
    std::fs::write(&file, &whole).unwrap();
    std::fs::copy(tiles.join("0/0_0.png"), tiles.join("1/0_0.png")).unwrap();
    let found = with_context(|context| told(&tiles, context));
    assert!(found.contains("got a tile of 1x1, expected 2x1"), "{found}");
}

/// Every file of a pyramid taken away, made undecodable, and exchanged for that of another: of each kind it is told what
/// it is, and the same command mends it.
#[test]
fn files_of_a_pyramid_that_are_missing_or_of_another_are_told_and_mended() {
    let copy = Copy::new();
    let (tiles, description) = (copy.place("p_files"), copy.place("p.dzi"));
    let mut export = btf();
    export.arg("export").args([copy.place("coherent.zarr"), description.clone()]).args(["--tile-size", "16"]);
    succeed(&mut export);
    let export_other = || {
        let mut command = btf();
        command.arg("export").args([copy.place("coherent.zarr"), copy.place("q.dzi")]).args([
            "--tile-size",
            "8",
            "--overlap",
            "0",
        ]);
        command
    };
    succeed(&mut export_other());
    let verify = |words: &str| {
        let found = with_context(|context| told(&description, context));
        assert!(found.contains(words) && (!words.is_empty() || found.is_empty()), "{words}: {found}");
    };
    verify("");
    for (file, other) in [("p.dzi", "q.dzi"), ("p.html", "q.html")] {
        let (file, other) = (copy.place(file), copy.place(other));
        let whole = std::fs::read(&file).unwrap();
        std::fs::remove_file(&file).unwrap();
        verify(&format!("{}: it is not there", file.display()));
        std::fs::copy(other, &file).unwrap();
        verify(&format!("{}: not the text that follows from the recipe", file.display()));
        std::fs::write(&file, whole).unwrap();
    }
    for file in tree_names(&tiles).into_iter().filter(|file| file.extension().is_some_and(|e| e == "png")) {
        let whole = std::fs::read(&file).unwrap();
        std::fs::write(&file, &whole[..whole.len() - 20]).unwrap();
        verify(&format!("{}: ", file.display()));
        let found = with_context(|context| told(&description, context));
        assert!(!found.contains("checksum"), "{found}");
        std::fs::remove_file(&file).unwrap();
        verify(&format!("{}: no such tile", file.display()));
        succeed(&mut export);
        assert_eq!(std::fs::read(&file).unwrap(), whole);
    }
    verify("");
    // Of one that was interrupted early the first few are told.
    let other = copy.place("q_files");
    for file in tree_names(&other).into_iter().filter(|file| file.extension().is_some_and(|e| e == "png")) {
        std::fs::remove_file(file).unwrap();
    }
    let found = with_context(|context| told(&copy.place("q.dzi"), context));
    let (missing, tiles) = (found.matches("no such tile").count(), 5 * 4 + 3 * 2 + 2 + 1 + 1 + 1 + 1);
    assert!((20..tiles).contains(&missing), "{missing}: {found}");
}

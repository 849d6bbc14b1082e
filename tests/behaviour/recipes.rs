//! Results of another recipe are refused, results of the same are kept, and what is missing is named.

use crate::fixture::{btf, fail, fixture, model_of, succeed, tree};

#[test]
fn a_finished_command_run_again_changes_nothing() {
    let fixture = fixture();
    let before = tree(&fixture.model());
    let told = succeed(btf().arg("import").args([&fixture.archive(), &fixture.measurement()]));
    assert!(told.contains("0 views written, 9 found done"), "{told}");
    succeed(&mut model_of(&fixture.measurement(), &fixture.model()));
    assert_eq!(before, tree(&fixture.model()));
}

#[test]
fn another_recipe_in_the_same_place_is_refused_and_the_setting_named() {
    let fixture = fixture();
    let import = fail(
        btf().arg("import").args([&fixture.archive(), &fixture.measurement()]).args(["--white", "0.5"]),
        65,
    );
    assert!(import.contains("white was 1.0, now 0.5"), "{import}");
    let model = fail(
        btf().arg("model").args([&fixture.measurement(), &fixture.model()]).args([
            "--tile",
            "cut",
            "--clusters",
            "25",
        ]),
        65,
    );
    assert!(model.contains("clusters was 24, now 25"), "{model}");
    let enlarge = fail(
        btf().arg("enlarge").args([&fixture.model(), &fixture.enlarged()]).args([
            "--size",
            "64x64",
            "--keep-normals",
            "--method",
            "paper",
        ]),
        65,
    );
    assert!(enlarge.contains("size was"), "{enlarge}");
}

#[test]
fn a_stage_that_has_not_been_run_is_named() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.zarr");
    fail(btf().arg("cluster").args([&fixture.measurement(), &model]), 66);
    succeed(btf().arg("tile").args([&fixture.measurement(), &model]));
    let told = fail(btf().arg("fit").arg(&model), 66);
    assert!(told.contains("normals"), "{told}");
    let told =
        fail(btf().arg("enlarge").arg(&model).arg(folder.path().join("big")).args(["--size", "64x64"]), 66);
    assert!(told.contains("cluster"), "{told}");
}

#[test]
fn the_stages_one_by_one_make_the_model_of_one_go() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.zarr");
    succeed(btf().arg("tile").args([&fixture.measurement(), &model]).args(["--tile", "cut"]));
    succeed(btf().arg("normals").args([&fixture.measurement(), &model]));
    succeed(btf().arg("fit").arg(&model));
    succeed(btf().arg("cluster").args([&fixture.measurement(), &model]).args(["--clusters", "24"]));
    succeed(btf().arg("appearance").arg(&model));
    let (mut one_by_one, mut one_go) = (tree(&model), tree(&fixture.model()));
    let attributes = |tree: &mut std::collections::BTreeMap<_, Vec<u8>>| -> serde_json::Value {
        serde_json::from_slice(&tree.remove(std::path::Path::new("zarr.json")).unwrap()).unwrap()
    };
    assert_eq!(attributes(&mut one_by_one), attributes(&mut one_go));
    assert_eq!(one_by_one, one_go);
}

#[test]
fn a_model_is_not_mixed_with_another_measurement() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let (archive, other) = (folder.path().join("other.zip"), folder.path().join("other.zarr"));
    succeed(
        btf()
            .arg("sample")
            .arg(&archive)
            .args(["--size", "56x48", "--views", "3", "--lights", "7", "--seed", "9"]),
    );
    succeed(btf().arg("import").args([&archive, &other]));
    let told = fail(btf().arg("compare").args([&fixture.model(), &other]), 65);
    assert!(told.contains("another measurement"), "{told}");
}

#[test]
fn a_dry_run_prints_the_plan_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store.zarr");
    let told = succeed(btf().arg("import").args([&fixture().archive(), &store]).arg("--dry-run"));
    let plan: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(plan["views"], 9);
    assert!(!store.exists());
}

#[test]
fn usage_errors_exit_with_2() {
    let fixture = fixture();
    let big = tempfile::tempdir().unwrap();
    fail(btf().arg("enlarge").args([&fixture.model(), &big.path().join("b")]).args(["--size", "0x5"]), 2);
    fail(
        btf().arg("enlarge").args([&fixture.model(), &big.path().join("b")]).args([
            "--size",
            "9x9",
            "--method",
            "paper",
            "--candidates",
            "0",
            "--method",
            "paper",
        ]),
        2,
    );
    fail(
        btf().arg("tile").args([&fixture.measurement(), &big.path().join("m")]).args(["--tile", "900x900"]),
        2,
    );
    let told = fail(
        btf().arg("cluster").args([&fixture.measurement(), &fixture.model()]).args(["--clusters", "1000000"]),
        2,
    );
    assert!(told.contains("1000000"), "{told}");
}

#[test]
fn a_model_that_lost_an_array_is_mended_by_the_same_command() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.zarr");
    let run = || succeed(&mut model_of(&fixture.measurement(), &model));
    run();
    let whole = tree(&model);
    for lost in [
        "index/c/0/0",
        "mrf/level_0/gamma/c/0/0",
        "tile_source/zarr.json",
        "normals/c/0/0/0",
        "appearance/features/zarr.json",
        "appearance/level_1/basis/c/0/0",
    ] {
        std::fs::remove_file(model.join(lost)).unwrap();
        run();
        assert_eq!(whole, tree(&model), "{lost}");
    }
}

#[test]
fn of_two_recipes_started_at_once_one_wins_and_the_other_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..4 {
        let store = folder.path().join(format!("{round}.zarr"));
        let start = |white: &str| {
            let mut command = btf();
            command.arg("import").args([&fixture().archive(), &store]).args(["--white", white, "-q"]);
            command.stderr(std::process::Stdio::null()).spawn().unwrap()
        };
        let (mut first, mut second) = (start("1"), start("0.5"));
        let mut codes = [first.wait().unwrap().code(), second.wait().unwrap().code()];
        codes.sort_unstable();
        assert_eq!(codes, [Some(0), Some(65)]);
    }
}

#[test]
fn two_processes_with_one_recipe_make_one_store() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("shared.zarr");
    let start = || {
        let mut command = btf();
        command.arg("import").args([&fixture().archive(), &store]).arg("-q").spawn().unwrap()
    };
    let (mut first, mut second) = (start(), start());
    assert!(first.wait().unwrap().success() && second.wait().unwrap().success());
    crate::fixture::assert_same(&store, &fixture().measurement());
}

#[test]
fn an_imports_recipe_names_all_that_its_bytes_depend_on() {
    const KEYS: [&str; 14] = [
        "assumptions",
        "channels",
        "codec",
        "format",
        "images",
        "lights",
        "method",
        "reading",
        "samples",
        "size",
        "stage",
        "transfer",
        "views",
        "white",
    ];
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let sample = |name: &str, size: &str, views: &str, lights: &str, seed: &str| {
        let counts = ["--size", size, "--views", views, "--lights", lights, "--seed", seed];
        succeed(btf().arg("sample").arg(at(name)).args(counts));
    };
    sample("base.zip", "16x16", "3", "4", "1");
    sample("size.zip", "16x24", "3", "4", "1");
    sample("views.zip", "16x16", "2", "4", "1");
    sample("lights.zip", "16x16", "3", "3", "1");
    sample("seed.zip", "16x16", "3", "4", "2");
    succeed(btf().arg("import").args([at("base.zip"), at("base.zarr")]));
    succeed(btf().arg("export").args([at("base.zarr"), at("base.npy")]));
    let recipe = |source: &str, options: &[&str]| {
        let mut import = btf();
        import.arg("import").args([at(source), at("new.zarr")]).args(options).arg("--dry-run");
        let plan: serde_json::Value = serde_json::from_str(&succeed(&mut import)).unwrap();
        plan["recipe"].as_object().unwrap().clone()
    };
    let base = recipe("base.zip", &[]);
    let mut keys: Vec<&str> = base.keys().map(String::as_str).collect();
    keys.sort_unstable();
    assert_eq!(keys, KEYS);
    assert!(KEYS.iter().all(|&key| key == "assumptions" || !base[key].is_null()), "{base:?}");
    for (source, options, key) in [
        ("size.zip", &[][..], "size"),
        ("views.zip", &[], "views"),
        ("lights.zip", &[], "lights"),
        ("seed.zip", &[], "images"),
        ("base.npy", &[], "format"),
        ("base.zip", &["--swap"], "reading"),
        ("base.zip", &["--transfer", "linear"], "transfer"),
        ("base.zip", &["--white", "0.5"], "white"),
        ("base.zip", &["--codec", "predictive"], "codec"),
        ("base.zip", &["--samples", "u16"], "samples"),
    ] {
        let other = recipe(source, options);
        assert!(other[key] != base[key], "{source} {options:?} {key}: {}", other[key]);
    }
}

#[test]
fn options_of_some_formats_are_in_the_recipe() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let reading = |source: &str, options: &[&str]| {
        let mut import = btf();
        import.arg("import").args([at(source), at("new.zarr")]).args(options).arg("--dry-run");
        let plan: serde_json::Value = serde_json::from_str(&succeed(&mut import)).unwrap();
        plan["recipe"]["reading"].clone()
    };
    succeed(btf().arg("sample").arg(at("a.zip")).args(["--size", "8x8"]));
    succeed(btf().arg("import").args([at("a.zip"), at("a.zarr")]));
    succeed(btf().arg("export").args([at("a.zarr"), at("a.npy")]));
    std::fs::remove_file(at("a.views.npy")).unwrap();
    std::fs::remove_file(at("a.lights.npy")).unwrap();
    assert_eq!(reading("a.npy", &["--order", "ubo81"])["order"], "ubo81");
    succeed(btf().arg("export").args([at("a.zarr"), at("a.btf")]));
    let [plain, reversed] = [&[][..], &["--rows", "reversed"]].map(|options| reading("a.btf", options));
    assert_ne!(plain, reversed);
    // Two ways to read a Radiance picture whose header names X first; of another one there is one.
    for (order, is_read) in [("+X 8 +Y 8", true), ("-Y 8 +X 8", false)] {
        std::fs::create_dir_all(at("hdr")).unwrap();
        let mut picture = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{order}\n").into_bytes();
        picture.extend([100, 90, 80, 129].repeat(64));
        std::fs::write(at("hdr/tl0 pl0 tv0 pv0.hdr"), picture).unwrap();
        if is_read {
            assert_ne!(reading("hdr", &[]), reading("hdr", &["--hdr", "atrium"]));
        } else {
            let told = fail(btf().arg("info").arg(at("hdr")).args(["--hdr", "atrium"]), 2);
            assert!(told.contains("--hdr changes nothing"), "{told}");
        }
    }
}

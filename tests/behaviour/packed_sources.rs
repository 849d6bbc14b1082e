//! Values of components and packed models: they are taken wherever a material is, and mean the same everywhere.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::GenericImageView;
use serde_json::Value;

use crate::fixture::{btf, copy, fail, fixture, succeed};

/// A folder with the fixture's model and components in it (`c.model.zarr`), packed (`c.btfc`), and an enlargement
/// (`big.zarr`).
fn material() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    copy(&fixture().model(), &at("c.model.zarr"));
    succeed(btf().arg("components").args([&fixture().measurement(), &at("c.model.zarr")]));
    succeed(btf().arg("pack").args([&at("c.model.zarr"), &at("c.btfc")]).args(["--quality", "1:50"]));
    let enlarge = |name: &str, options: &[&str]| {
        let size = ["--size", "70x50"];
        succeed(btf().arg("enlarge").args([&at("c.model.zarr"), &at(name)]).args(size).args(options));
    };
    enlarge("big.zarr", &[]);
    enlarge("bare.zarr", &["--no-source"]);
    folder
}

fn json(command: &mut Command) -> Value {
    serde_json::from_str(&succeed(command.arg("--json"))).unwrap()
}

#[test]
fn a_flat_object_is_the_picture_by_components_too() {
    let folder = material();
    let at = |name: &str| folder.path().join(name);
    let by_components = ["--values", "components"];
    for (source, options) in
        [("c.model.zarr", &by_components[..]), ("c.btfc", &[]), ("big.zarr", &by_components)]
    {
        for light in ["15,0", "40,100", "85,200"] {
            let picture = |command: &str, more: &[&str], name: &str| {
                let mut run = btf();
                run.arg(command).arg(at(source)).args(options).args(["--light", light, "--force"]).args(more);
                succeed(run.arg("--out").arg(at(name)));
                image::open(at(name)).unwrap()
            };
            let flat = picture("image", &[], "image.png");
            let size = format!("{}x{}", flat.width(), flat.height());
            let rendered = picture("render", &["--shape", "flat", "--size", &size], "flat.png");
            assert_eq!(flat.dimensions(), rendered.dimensions());
            for ((x, y, a), (.., b)) in flat.pixels().zip(rendered.pixels()) {
                let apart = a.0.iter().zip(b.0).map(|(&a, b)| a.abs_diff(b)).max();
                assert!(apart <= Some(1), "{source} {light}, {x},{y}: {a:?} {b:?}");
            }
        }
    }
    // Threads change nothing, and components are other values than clusters.
    let render = |name: &str, options: &[&str]| {
        let plane = ["--plane", "--size", "40x30"];
        succeed(
            btf().arg("render").arg(at("c.model.zarr")).args(plane).args(options).arg("--out").arg(at(name)),
        );
        std::fs::read(at(name)).unwrap()
    };
    let one = render("one.exr", &["--values", "components", "--threads", "1"]);
    assert!(one == render("four.exr", &["--values", "components", "--threads", "4"]));
    assert!(one != render("clusters.exr", &["--values", "model"]));
    // What cannot be is said, with what to do.
    let refused = |source: &str, options: &[&str], code: i32, words: [&str; 2]| {
        let told =
            fail(btf().arg("render").arg(at(source)).args(options).arg("--out").arg(at("no.png")), code);
        assert!(words.iter().all(|words| told.contains(words)), "{source} {options:?}: {told}");
    };
    refused("bare.zarr", &by_components, 66, ["does not say which texel", "--no-source"]);
    refused("c.btfc", &["--plane"], 2, ["packed model", "its tile only"]);
    refused("c.btfc", &["--model", "c.model.zarr"], 2, ["packed model", "its own values"]);
    let model = fixture().model();
    refused(model.to_str().unwrap(), &by_components, 66, ["run btf components", ""]);
    succeed(btf().arg("unpack").args([&at("c.btfc"), &at("u.model.zarr")]));
    let told = succeed(
        btf().arg("render").arg(at("u.model.zarr")).args(["--size", "9x9"]).arg("--out").arg(at("u.png")),
    );
    assert!(told.contains("the model has no clusters: values are those of its components"), "{told}");
}

#[test]
fn a_picture_opens_only_what_it_shows() {
    let folder = material();
    let at = |name: &str| folder.path().join(name);
    let shown = |options: &[&str], name: &str| {
        let mut run = btf();
        let measurement = fixture().measurement();
        run.arg("image").arg(at("c.model.zarr")).args(options);
        if options.contains(&"measured") {
            run.arg("--measurement").arg(measurement);
        }
        succeed(run.arg("--force").arg("--out").arg(at(name)));
        std::fs::read(at(name)).unwrap()
    };
    let subjects = [&["--what", "normals"][..], &["--values", "measured"], &["--values", "components"]];
    let before: Vec<_> = subjects.iter().map(|options| shown(options, "before.png")).collect();
    for array in ["index", "representatives"] {
        std::fs::remove_dir_all(at("c.model.zarr").join(array)).unwrap();
    }
    for (options, before) in subjects.iter().zip(before) {
        assert!(shown(options, "after.png") == before, "{options:?}");
    }
    let told = fail(btf().arg("image").arg(at("c.model.zarr")).arg("--out").arg(at("x.png")), 66);
    assert!(told.contains("btf cluster"), "{told}");
}

#[test]
fn a_packed_model_is_compared_like_the_model_that_it_unpacks_to() {
    let folder = material();
    let at = |name: &str| folder.path().join(name);
    let measurement = fixture().measurement();
    let compare = |model: &Path| {
        let mut run = btf();
        run.arg("compare").args([&measurement, model]);
        run
    };
    // The tile was cut: the model says where it lies.
    let told = fail(&mut compare(&at("c.btfc")), 2);
    assert!(told.contains("it does not say where") && told.contains("--tile-of MODEL"), "{told}");
    let of_cut = ["--tile-of", "c.model.zarr"];
    let packed = json(compare(&at("c.btfc")).args(of_cut).current_dir(folder.path()));
    let components = json(compare(&at("c.model.zarr")).args(["--by", "components"]));
    let figure = |report: &Value| report["all"]["psnr_db"].as_f64().unwrap();
    let about = json(btf().arg("info").arg(at("c.btfc")));
    let said = about["planes"].as_array().unwrap().last().unwrap()["psnr_db"].as_f64().unwrap();
    let (found, whole) = (figure(&packed), figure(&components));
    assert!((said - 0.1..said + 0.4).contains(&found) && found < whole, "{said} {found} {whole}");
    let told =
        fail(compare(&at("c.btfc")).args(["--by", "clusters"]).args(of_cut).current_dir(folder.path()), 2);
    assert!(told.contains("no clusters"), "{told}");
    let told = fail(compare(&at("c.model.zarr")).args(of_cut).current_dir(folder.path()), 2);
    assert!(told.contains("a model knows its tile"), "{told}");

    // All of a measurement needs no model; shares and pictures are made as of models.
    succeed(btf().arg("tile").args([&measurement, &at("w.model.zarr")]).args(["--tile", "none"]));
    succeed(btf().arg("components").args([&measurement, &at("w.model.zarr")]));
    succeed(btf().arg("pack").args([&at("w.model.zarr"), &at("w.btfc")]).args(["--quality", "1:50"]));
    succeed(btf().arg("unpack").args([&at("w.btfc"), &at("v.model.zarr")]));
    let (packed, unpacked) = (json(&mut compare(&at("w.btfc"))), json(&mut compare(&at("v.model.zarr"))));
    assert!((figure(&packed) - figure(&unpacked)).abs() < 0.02, "{packed} {unpacked}");
    // Every byte is counted, and it is said of what it is a part.
    let length = std::fs::metadata(at("w.btfc")).unwrap().len();
    let about = json(btf().arg("info").arg(at("w.btfc")));
    let ledger = &packed["ledger"];
    assert_eq!(ledger["parts"][0]["coded_bytes"], length);
    assert_eq!(ledger["parts"][0]["raw_bytes"], about["raw_bytes"]);
    assert_eq!((&ledger["tile_bytes"], &about["bytes"]), (&about["tile_bytes"], &length.into()));
    assert_eq!(ledger["tile_bytes"], ledger["measurement_bytes"]);
    let told = succeed(&mut compare(&at("w.btfc")));
    assert!(
        told.contains("size of packed file as plain numbers: ") && told.contains("of the whole measurement"),
        "{told}"
    );
    let told = succeed(btf().arg("info").arg(at("w.btfc")));
    assert!(told.contains("of the header") && told.contains("all of the measurement"), "{told}");
    let of_clusters = json(compare(&at("c.model.zarr")).args(["--by", "clusters"]));
    let names = |ledger: &Value| {
        ledger["parts"].as_array().unwrap().iter().map(|part| part["name"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&of_clusters["ledger"]), ["index", "representatives"]);
    assert!(
        of_clusters["ledger"]["tile_bytes"].as_u64() < of_clusters["ledger"]["measurement_bytes"].as_u64()
    );
    assert_eq!(names(&unpacked["ledger"]), ["components"]);
    let swapped = json(btf().arg("compare").args([&at("w.btfc"), &measurement]));
    assert_eq!(swapped, packed);
    for shard in ["1/2", "0/2"] {
        let options = ["--partial", "sums", "--shard", shard];
        succeed(compare(&at("w.btfc")).args(options).current_dir(folder.path()));
    }
    let options = ["--partial", "sums", "--reduce"];
    assert_eq!(json(compare(&at("w.btfc")).args(options).current_dir(folder.path())), packed);
    succeed(compare(&at("w.btfc")).arg("--picture").arg(at("side.png")));
    assert!(at("side.png").exists());
    // Another measurement, or the same imported in another way, is not what it was made of.
    succeed(btf().arg("import").args([&fixture().archive(), &at("f.zarr")]).args(["--samples", "f16"]));
    let told = fail(btf().arg("compare").args([&at("f.zarr"), &at("w.btfc")]), 65);
    assert!(told.contains("was not made of"), "{told}");
    let told = fail(compare(&at("c.btfc")).arg("--tile-of").arg(at("w.model.zarr")), 65);
    assert!(told.contains("was not packed from"), "{told}");
}

#[test]
fn a_packed_model_is_exported_and_imported_as_the_samples_that_it_stands_for() {
    let folder = material();
    let at = |name: &str| folder.path().join(name);
    let export = |from: &str, name: &str, options: &[&str]| -> PathBuf {
        succeed(btf().arg("export").args([&at(from), &at(name)]).args(options));
        at(name)
    };
    let told = succeed(btf().arg("import").args([&at("c.btfc"), &at("p.zarr")]));
    assert!(told.contains("what it left out is lost"), "{told}");
    for (name, options) in [
        ("npy", &[][..]),
        ("zip", &["--quality", "95"]),
        ("exr", &["--to", "exr"]),
        ("png", &["--to", "png"]),
        ("btf", &["--rank", "5"]),
        ("fmf.btf", &["--to", "fmf"]),
        ("dzi", &["--deepzoom"]),
    ] {
        let direct = export("c.btfc", &format!("a.{name}"), options);
        if name == "dzi" {
            continue;
        }
        let through = export("p.zarr", &format!("b.{name}"), options);
        let same = if direct.is_dir() {
            crate::fixture::tree(&direct) == crate::fixture::tree(&through)
        } else {
            std::fs::read(&direct).unwrap() == std::fs::read(&through).unwrap()
        };
        assert!(same, "{name}");
    }
    // Samples are as coarse as the file, no coarser.
    let told = succeed(btf().arg("info").arg(at("p.zarr")));
    assert!(told.contains("packed model, "), "{told}");
    succeed(btf().arg("model").args([&at("p.zarr"), &at("p.model.zarr")]).args([
        "--tile",
        "none",
        "--clusters",
        "20",
    ]));
    succeed(btf().arg("enlarge").args([&at("p.model.zarr"), &at("grown.zarr")]).args(["--size", "40x40"]));
    // Commands that need more than values say what to do.
    for (command, more) in [
        ("enlarge", &["x.zarr", "--size", "30x30"][..]),
        ("cluster", &["c.model.zarr"]),
        ("appearance", &[]),
        ("view", &["--export", "x.html"]),
        ("verify", &[]),
        ("components", &["c.model.zarr"]),
    ] {
        let told = fail(btf().arg(command).arg(at("c.btfc")).args(more).current_dir(folder.path()), 65);
        assert!(told.contains("got a packed model") && told.contains("btf import"), "{command}: {told}");
    }
    // A file that was cut says so wherever it is opened.
    let bytes = std::fs::read(at("c.btfc")).unwrap();
    std::fs::write(at("cut.btfc"), &bytes[..bytes.len() - 9]).unwrap();
    for (command, out) in
        [("export", "cut.npy"), ("import", "cut.zarr"), ("image --out", "i.png"), ("render --out", "r.png")]
    {
        let words = command.split(' ').collect::<Vec<_>>();
        let told = succeed(btf().arg(words[0]).arg(at("cut.btfc")).args(&words[1..]).arg(at(out)));
        assert!(told.contains("the file was cut"), "{command}: {told}");
    }
    std::fs::write(at("none.btfc"), &bytes[..40]).unwrap();
    for (command, out) in [("export", "none.npy"), ("import", "none.zarr")] {
        let told = fail(btf().arg(command).args([&at("none.btfc"), &at(out)]), 65);
        assert!(
            told.contains("none.btfc: ") && told.contains("found the end of the file"),
            "{command}: {told}"
        );
    }
}

#[test]
fn baselines_are_compared_at_the_same_bytes() {
    let folder = material();
    let at = |name: &str| folder.path().join(name);
    let compare = |options: &[&str]| {
        let mut run = btf();
        run.arg("compare")
            .args([&fixture().measurement(), &at("c.model.zarr")])
            .arg("--baselines")
            .args(options);
        run
    };
    let report = json(compare(&["--curves"]).arg(at("curves.png")));
    assert!(image::open(at("curves.png")).unwrap().width() >= 600);
    let rows = report["rows"].as_array().unwrap();
    let figure = |row: &Value, name: &str| row["figures"][name].as_f64().unwrap();
    let of = |method: &str| -> Vec<&Value> { rows.iter().filter(|row| row["method"] == method).collect() };
    // Clusters as they are have the figures of a plain comparison; means have the least squared error.
    let plain = json(btf().arg("compare").args([&fixture().measurement(), &at("c.model.zarr")]));
    let [texel, mean, median] =
        ["texel", "mean", "median"].map(|rule| of(&format!("clusters, {rule}"))[0].clone());
    assert!((figure(&texel, "psnr_db") - plain["all"]["psnr_db"].as_f64().unwrap()).abs() < 1e-9);
    assert!((figure(&texel, "lightness") - plain["all"]["lightness"].as_f64().unwrap()).abs() < 1e-9);
    assert!(figure(&mean, "psnr_db") > figure(&median, "psnr_db"), "{report}");
    assert!(figure(&median, "psnr_db") > figure(&texel, "psnr_db"), "{report}");
    // More bytes of a method are never worse, but for what 8 bits cost; packed files never exceed what they are beside.
    for method in ["PCA", "PCA per view", "packed"] {
        let rows = of(method);
        assert!(rows.len() >= 3, "{method}: {report}");
        for pair in rows.windows(2) {
            assert!(pair[0]["bytes"].as_u64() < pair[1]["bytes"].as_u64(), "{method}");
            assert!(figure(pair[0], "psnr_db") < figure(pair[1], "psnr_db") + 0.3, "{method}: {report}");
        }
    }
    assert_eq!(of("polynomials").len(), 1);
    for row in rows {
        assert!((0.0..=1.0).contains(&figure(row, "ssim")) && figure(row, "sharpness") >= 0.0, "{row}");
    }
    let told = succeed(&mut compare(&["--threads", "1"]));
    assert!(told.contains("PCA per view") && told.contains("ahead"), "{told}");
    assert_eq!(json(&mut compare(&["--threads", "1"])), json(&mut compare(&["--threads", "3"])));
    let told = fail(
        btf().arg("compare").args([&fixture().measurement(), &fixture().model()]).arg("--baselines"),
        66,
    );
    assert!(told.contains("btf components"), "{told}");
}

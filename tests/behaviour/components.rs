//! Components of a model, and the packed file: what comes back, whatever the samples, threads and memory.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::fixture::{assert_same, btf, copy, fail, fixture, succeed, tree};

/// A measurement of the fixture's archive, imported with options, and a model of its whole plane with components.
fn model(folder: &Path, import: &[&str], components: &[&str]) -> [PathBuf; 2] {
    let [store, model] = ["m.zarr", "m.model.zarr"].map(|name| folder.join(name));
    succeed(btf().arg("import").args([&fixture().archive(), &store]).args(import));
    succeed(btf().arg("tile").args([&store, &model]).args(["--tile", "none"]));
    let told = succeed(btf().arg("components").args([&store, &model]).args(components));
    assert!(told.contains("components, PSNR"), "{told}");
    [store, model]
}

fn json(command: &mut Command) -> Value {
    serde_json::from_str(&succeed(command.arg("--json"))).unwrap()
}

#[test]
fn components_are_packed_and_come_back_whatever_the_samples() {
    for import in
        [&[][..], &["--samples", "u16"], &["--samples", "f16", "--transfer", "linear"], &["--samples", "f32"]]
    {
        let folder = tempfile::tempdir().unwrap();
        let [store, model] = model(folder.path(), import, &["--components", "24"]);
        let [file, again] = ["m.btfc", "again.model.zarr"].map(|name| folder.path().join(name));
        let packed = json(btf().arg("pack").args([&model, &file]).args(["--quality", "1:100"]));
        let (bytes, raw) = (packed["bytes"].as_u64().unwrap(), packed["tile_bytes"].as_u64().unwrap());
        assert!(100 * bytes <= raw && 101 * bytes > raw * 99 / 100, "{import:?}: {packed}");
        succeed(btf().arg("unpack").args([&file, &again]));
        let compared = json(btf().arg("compare").args([&store, &again]));
        let whole = json(btf().arg("compare").args([&store, &model]).args(["--by", "components"]));
        let of = |report: &Value, name: &str| report["all"][name].as_f64().unwrap();
        // The packed one is coarser than the model, and as good as was said where samples lie on the sRGB curve.
        assert!(of(&compared, "psnr_db") < of(&whole, "psnr_db"), "{import:?}: {compared} {whole}");
        assert!(of(&compared, "lightness") < 3.0, "{import:?}: {compared}");
        if !import.contains(&"linear") {
            let said = packed["psnr_db"].as_f64().unwrap();
            let found = of(&compared, "psnr_db");
            assert!((said - 0.1..said + 0.4).contains(&found), "{import:?}: {said} {found}");
        }
        succeed(btf().arg("verify").arg(&again));
    }
}

#[test]
fn bytes_depend_on_neither_threads_nor_memory() {
    let folder = tempfile::tempdir().unwrap();
    let made: Vec<PathBuf> = [["--threads", "1"], ["--threads", "5"], ["--memory", "40MiB"]]
        .iter()
        .enumerate()
        .map(|(number, options)| {
            let at = folder.path().join(number.to_string());
            std::fs::create_dir(&at).unwrap();
            let [_, model] = model(&at, &[], options);
            succeed(btf().arg("pack").args([&model, &at.join("m.btfc")]).args(options));
            std::fs::remove_dir_all(at.join("m.zarr")).unwrap();
            at
        })
        .collect();
    assert_same(&made[0], &made[1]);
    assert_same(&made[0], &made[2]);
    let told = fail(
        btf()
            .arg("components")
            .args([&fixture().measurement(), &fixture().model()])
            .args(["--memory", "8MiB"]),
        2,
    );
    assert!(told.contains("finding components of") && told.contains("--memory"), "{told}");
}

#[test]
fn a_model_of_components_is_pictured_and_an_enlargement_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let whole = at("c.model.zarr");
    copy(&fixture().model(), &whole);
    let told =
        fail(btf().arg("image").arg(&whole).args(["--values", "components", "--out"]).arg(at("i.png")), 66);
    assert!(told.contains("run btf components MEASUREMENT"), "{told}");
    succeed(btf().arg("components").args([&fixture().measurement(), &whole]));
    let picture = |source: &Path, name: &str, options: &[&str]| {
        let told = succeed(btf().arg("image").arg(source).args(options).arg("--out").arg(at(name)));
        (told, std::fs::read(at(name)).unwrap())
    };
    let exact = ["--values", "measured", "--measurement", fixture().measurement().to_str().unwrap()]
        .map(String::from);
    let exact: Vec<&str> = exact.iter().map(String::as_str).collect();
    let (_, measured) = picture(&whole, "measured.png", &exact);
    let (_, clusters) = picture(&whole, "clusters.png", &[]);
    let (_, components) = picture(&whole, "components.png", &["--values", "components"]);
    let pixels = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().into_rgb8().into_raw();
    let distance = |a: &[u8], b: &[u8]| -> u64 {
        pixels(a).iter().zip(pixels(b)).map(|(&a, b)| u64::from(a.abs_diff(b)).pow(2)).sum()
    };
    assert!(2 * distance(&components, &measured) < distance(&clusters, &measured));
    // Of a model without clusters nothing need be asked for, and it is said.
    succeed(btf().arg("pack").args([&whole, &at("c.btfc")]).args(["--quality", "1:20"]));
    succeed(btf().arg("unpack").args([&at("c.btfc"), &at("u.model.zarr")]));
    let (told, unpacked) = picture(&at("u.model.zarr"), "u.png", &[]);
    assert!(told.contains("the model has no clusters: values are those of its components"), "{told}");
    assert!(2 * distance(&unpacked, &measured) < distance(&clusters, &measured));
    let (told, packed) = picture(&at("c.btfc"), "p.png", &[]);
    assert!(distance(&packed, &unpacked) < 100 && told.contains("p.png"), "{told}");
    picture(&at("c.btfc"), "w.png", &["--window", "3,4,8,9", "--light", "45,90"]);
    for options in [&["--values", "measured"][..], &["--what", "index"], &["--plane", "--window", "0,0,9,9"]]
    {
        let told = fail(btf().arg("image").arg(at("c.btfc")).args(options).args(["--out", "y.png"]), 2);
        assert!(told.contains("a packed model has") && told.contains("btf unpack"), "{told}");
    }
    // The tile was cut: which texel was measured where is not known any more.
    let told = fail(btf().arg("compare").args([&fixture().measurement(), &at("u.model.zarr")]), 65);
    assert!(told.contains("btf unpack made this model"), "{told}");
    succeed(btf().arg("enlarge").args([&whole, &at("big.zarr")]).args(["--size", "64x64"]));
    let (_, by_clusters) = picture(&at("big.zarr"), "e.png", &[]);
    let (_, by_components) = picture(&at("big.zarr"), "f.png", &["--values", "components"]);
    assert_ne!(by_clusters, by_components);
    let told = fail(
        btf().arg("image").arg(&whole).args([
            "--values",
            "components",
            "--measurement",
            "x",
            "--out",
            "y.png",
        ]),
        2,
    );
    assert!(told.contains("--measurement"), "{told}");
}

#[test]
fn a_packed_file_is_told_of_cut_and_never_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [_, model] = model(folder.path(), &[], &[]);
    let file = at("m.btfc");
    let pack = |quality: &str| {
        let mut command = btf();
        command.arg("pack").args([&model, &file]).args(["--quality", quality]);
        command
    };
    let told = succeed(pack("30kB").args(["--licence", "CC-BY-4.0", "--texel-mm", "0.25"]));
    assert!(
        told.contains("of the tile's samples")
            && told.contains("may be nearer to the measurement: btf components"),
        "{told}"
    );
    let about = json(btf().arg("info").arg(&file));
    assert_eq!((&about["kind"], &about["size"]), (&"packed model".into(), &serde_json::json!([56, 48])));
    let told = succeed(btf().arg("info").arg(&file));
    assert!(told.contains("CC-BY-4.0") && told.contains("0.25") && told.contains("plane 6"), "{told}");
    let again = succeed(pack("30kB").args(["--licence", "CC-BY-4.0", "--texel-mm", "0.25"]));
    assert!(again.contains("found done"), "{again}");
    fail(&mut pack("20kB"), 65);
    for (quality, expected) in
        [("9", "expected at least"), ("90dB", "expected at most"), ("1:x", "expected bytes")]
    {
        let told = fail(pack(quality).arg("--force"), 2);
        assert!(told.contains(expected), "{told}");
    }
    let told = fail(btf().arg("pack").args([&model, &at("m.zarr2")]), 2);
    assert!(told.contains(".btfc"), "{told}");

    let bytes = std::fs::read(&file).unwrap();
    let ends: Vec<usize> = about["planes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|plane| plane["bytes"].as_u64().unwrap() as usize)
        .collect();
    let cut = at("cut.btfc");
    for (length, planes) in [(ends[2], 3), (ends[3] + 1, 4)] {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        let told = succeed(btf().arg("info").arg(&cut));
        assert!(told.contains(&format!("{planes} of 6 planes are there")), "{told}");
        let unpacked = at(&format!("cut-{planes}.model.zarr"));
        let told = succeed(btf().arg("unpack").args([&cut, &unpacked]));
        assert!(told.contains("the file was cut"), "{told}");
        assert!(succeed(btf().arg("unpack").args([&cut, &unpacked])).contains("found done"));
        succeed(btf().arg("image").arg(&unpacked).arg("--out").arg(at(&format!("{planes}.png"))));
        let before = tree(&unpacked);
        fail(btf().arg("unpack").args([&file, &unpacked]), 65);
        assert_eq!(tree(&unpacked), before);
    }
    let mut damaged = bytes.clone();
    damaged[ends[4] + 30] ^= 1;
    std::fs::write(&cut, &damaged).unwrap();
    let told = succeed(btf().arg("info").arg(&cut));
    assert!(told.contains("is damaged: 5 of 6 planes are read"), "{told}");
    damaged[40] ^= 1;
    std::fs::write(&cut, &damaged).unwrap();
    for command in ["info", "unpack"] {
        let mut run = btf();
        run.arg(command).arg(&cut);
        if command == "unpack" {
            run.arg(at("none.model.zarr"));
        }
        let told = fail(&mut run, 65);
        assert!(told.contains("a damaged header: its checksum differs"), "{told}");
    }
    assert!(!at("none.model.zarr").exists());
}

/// A measurement of floats by the fixture's archive, some of whose samples are changed, and a model with its tile.
fn of_floats(folder: &Path, transfer: &str, change: impl Fn(&mut [[u8; 4]])) -> [PathBuf; 2] {
    let at = |name: &str| folder.join(format!("{name}-{transfer}.zarr"));
    let [floats, store, model] = [at("f"), at("m"), at("model")];
    let npy = folder.join(format!("f-{transfer}.npy"));
    let reading = ["--samples", "f32", "--transfer", transfer];
    succeed(btf().arg("import").args([&fixture().archive(), &floats]).args(reading));
    succeed(btf().arg("export").args([&floats, &npy]));
    let mut bytes = std::fs::read(&npy).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    change(bytes[header..].as_chunks_mut::<4>().0);
    std::fs::write(&npy, bytes).unwrap();
    succeed(btf().arg("import").args([&npy, &store]).args(["--transfer", transfer, "--force"]));
    succeed(btf().arg("tile").args([&store, &model]).args(["--tile", "none"]));
    [store, model]
}

#[test]
fn samples_that_components_do_not_hold_are_refused_or_told() {
    for (transfer, large) in [("srgb", 1e6f32), ("linear", 1e12), ("srgb", -1e6), ("linear", -1e12)] {
        let folder = tempfile::tempdir().unwrap();
        let [store, model] = of_floats(folder.path(), transfer, |samples| {
            (samples[5], samples[5000]) = (large.to_le_bytes(), large.to_le_bytes());
        });
        let told = fail(btf().arg("components").args([&store, &model]), 65);
        assert!(
            told.contains("2 samples out of range") && told.contains("btf cluster"),
            "{transfer} {large}: {told}"
        );
        let told = fail(btf().arg("pack").args([&model, &folder.path().join("m.btfc")]), 66);
        assert!(told.contains("btf components"), "{told}");
    }
    let folder = tempfile::tempdir().unwrap();
    let [store, model] = of_floats(folder.path(), "linear", |samples| {
        (samples[5], samples[50], samples[60]) =
            (f32::NAN.to_le_bytes(), f32::INFINITY.to_le_bytes(), 1e9f32.to_le_bytes());
    });
    let told = succeed(btf().arg("components").args([&store, &model]));
    assert!(told.contains("2 samples of the tile: no finite numbers, counted as black"), "{told}");
    let told = succeed(btf().arg("info").arg(&model));
    assert!(told.contains("2 samples of the tile: no finite numbers"), "{told}");
    succeed(btf().arg("verify").arg(&model));
}

/// Puts the right checksum on the header of a packed file, whose last section is cut off.
fn with_header(bytes: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    let end = 22 + u32::from_le_bytes(bytes[18..22].try_into().unwrap()) as usize;
    let mut bytes = bytes.to_vec();
    change(&mut bytes[..end]);
    let checksum = crc32fast::hash(&bytes[..end]);
    bytes[end..end + 4].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

#[test]
fn whoever_opens_a_packed_file_gives_the_same_answer() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [_, model] = model(folder.path(), &[], &[]);
    succeed(btf().arg("pack").args([&model, &at("m.btfc")]).args(["--quality", "30kB"]));
    let bytes = std::fs::read(at("m.btfc")).unwrap();
    let red = bytes.windows(6).position(|six| six == b"\x01R\x01G\x01B").unwrap();
    let forged = at("forged.btfc");
    type Change = Box<dyn Fn(&mut [u8])>;
    let header: [(&str, Change); 3] = [
        ("a step of 3", Box::new(|head: &mut [u8]| head[14..18].copy_from_slice(&f32::MAX.to_le_bytes()))),
        ("channel", Box::new(move |head: &mut [u8]| head[red + 1] = b'Q')),
        ("1 to 256 channels", Box::new(|head: &mut [u8]| head[12..14].fill(255))),
    ];
    let commands = |file: &Path| {
        let with = |arguments: &[&str], output: Option<&str>| {
            let mut command = btf();
            command.arg(arguments[0]).arg(file).args(&arguments[1..]);
            command.args(output.map(at));
            command
        };
        [
            with(&["info"], None),
            with(&["unpack"], Some("forged.model.zarr")),
            with(&["image", "--out"], Some("forged.png")),
            with(&["render", "--out"], Some("forged.png")),
            with(&["import"], Some("forged.zarr")),
        ]
    };
    for (told, change) in header {
        std::fs::write(&forged, with_header(&bytes, change)).unwrap();
        for mut command in commands(&forged) {
            let said = fail(&mut command, 65);
            assert!(said.contains(told) && said.contains("forged.btfc"), "{command:?}: {said}");
        }
    }
    // A step that only its numbers make too large: what decodes it says so, and leaves nothing.
    let large = |head: &mut [u8]| head[14..18].copy_from_slice(&1e19f32.to_le_bytes());
    std::fs::write(&forged, with_header(&bytes, large)).unwrap();
    for mut command in commands(&forged).into_iter().skip(1).take(3) {
        let said = fail(&mut command, 65);
        assert!(said.contains("expected finite numbers, of at most"), "{command:?}: {said}");
    }
    assert!(!at("forged.model.zarr").exists() && !at("forged.png").exists());
    // What takes more memory than is allowed is told before it is decoded; what it is is told without.
    for mut command in commands(&at("m.btfc")).into_iter().skip(1) {
        let said = fail(command.args(["--memory", "13MiB"]), 2);
        assert!(said.contains("MiB, or more, allows it"), "{command:?}: {said}");
    }
    succeed(btf().arg("info").arg(at("m.btfc")).args(["--memory", "13MiB"]));
}

#[test]
fn a_model_whose_unpacking_was_killed_is_not_whole_and_not_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [_, model] = model(folder.path(), &[], &[]);
    succeed(btf().arg("pack").args([&model, &at("m.btfc")]).args(["--quality", "30kB"]));
    let again = at("again.model.zarr");
    succeed(btf().arg("unpack").args([&at("m.btfc"), &again]));
    let whole = tree(&again);
    // As a kill leaves it before its first stage is done.
    let root = again.join("zarr.json");
    let mut begun: Value = serde_json::from_slice(&std::fs::read(&root).unwrap()).unwrap();
    begun.as_object_mut().unwrap().remove("consolidated_metadata");
    let ours = &mut begun["attributes"]["btfkit"];
    ours["stages"] = serde_json::json!({});
    ours["seal"] = btfkit::zarr::metadata::seal(ours.as_object().unwrap()).into();
    std::fs::write(&root, begun.to_string()).unwrap();
    let said = fail(btf().arg("verify").arg(&again), 66);
    assert!(said.contains("not whole") && !said.contains("damaged"), "{said}");
    succeed(btf().arg("unpack").args([&at("m.btfc"), &again]));
    assert!(tree(&again) == whole);
}

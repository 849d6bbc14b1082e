//! Advice is right: whoever follows it once gets on, and what is said of a result is true of it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::fixture::{btf, copy, fail, fixture, succeed, tree};

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// A command line of words and paths.
fn run(words: &[&str], paths: &[&Path], options: &[&str]) -> Command {
    let mut command = btf();
    command.args(words).args(paths).args(options);
    command
}

/// The figure that an error of memory advises.
fn advised(told: &str) -> String {
    let figure = told.split("--memory ").nth(1).and_then(|rest| rest.split(',').next());
    figure.unwrap_or_else(|| panic!("no figure in {told}")).to_owned()
}

#[test]
fn the_memory_that_is_advised_once_is_enough_whatever_the_command() {
    let fixture = fixture();
    let [archive, measurement, model, enlarged] =
        [fixture.archive(), fixture.measurement(), fixture.model(), fixture.enlarged()]
            .map(|path| text(&path));
    let words = |line: &str| -> Vec<String> {
        let places = [
            ("ARCHIVE", &archive),
            ("MEASUREMENT", &measurement),
            ("MODEL", &model),
            ("ENLARGED", &enlarged),
        ];
        let place =
            |word: &str| places.iter().find(|(name, _)| *name == word).map(|(_, place)| (*place).clone());
        line.split(' ').map(|word| place(word).unwrap_or_else(|| word.to_owned())).collect()
    };
    for line in [
        "import ARCHIVE new.zarr",
        "import ARCHIVE new.zarr --codec predictive",
        "model MEASUREMENT new.model.zarr --levels 1",
        "model MEASUREMENT new.model.zarr --levels 1 --tile none --ratio 50",
        "model MEASUREMENT new.model.zarr --levels 1 --clusters 300 --first minibatch",
        "tile MEASUREMENT new.model.zarr",
        "curve MEASUREMENT MODEL --most 4",
        "enlarge MODEL new.zarr --size 300x300",
        "enlarge MODEL new.zarr --size 300x300 --method paper",
        "enlarge MODEL new.zarr --size 100x100 --method quilt",
        "enlarge MODEL new.zarr --size 96x96 --method tiles",
        "image MEASUREMENT --out new.png",
        "image MODEL --out new.jpg",
        "image ENLARGED --out new.exr",
        "image --plane MODEL --window 0,0,600,20 --out new.png",
        "export MEASUREMENT new.npy",
        "export MEASUREMENT new.btf --rank 2",
        "export ENLARGED new.dzi",
        "compare MODEL MEASUREMENT",
        "verify MEASUREMENT",
        "verify MODEL",
        "verify ENLARGED",
        "check MEASUREMENT",
        "info ARCHIVE",
        "sample new.zip --size 16x16 --views 2 --lights 2",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let command = |memory: &str| {
            let mut command = btf();
            command.current_dir(folder.path()).args(words(line)).args(["--memory", memory]);
            command
        };
        let figure = advised(&fail(&mut command("1KiB"), 2));
        succeed(&mut command(&figure));
    }
}

#[test]
fn what_is_shown_instead_of_a_direction_that_was_not_measured_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(&folder.path().join("p.png"));
    let [measurement, model] = [fixture().measurement(), fixture().model()];
    for source in [&measurement, &model] {
        let image = |options: &[&str]| {
            succeed(btf().arg("image").arg(source).args(["--out", &out, "--force"]).args(options))
        };
        assert!(!image(&[]).contains("note"), "measured directions, and those between them, are as they are");
        assert!(!image(&["--light", "40,100", "--view", "20,33"]).contains("note"));
        let told = image(&["--light", "88,0"]);
        assert!(
            told.contains("the light at theta 88 phi 0 lies beyond") && !told.contains("the view"),
            "{told}"
        );
        let told = image(&["--view", "85,10"]);
        assert!(
            told.contains("the view at theta 85 phi 10 lies beyond") && !told.contains("the light"),
            "{told}"
        );
        let told = image(&["--light", "1.047,0"]);
        assert!(told.contains("angles are degrees") && told.contains("59.98"), "{told}");
        // Of what has no light there is nothing to say.
        if source == &model {
            assert!(!image(&["--what", "index"]).contains("note"));
        }
    }
    let picture = text(&folder.path().join("side.png"));
    let told = succeed(btf().arg("compare").args([&model, &measurement]).args([
        "--picture",
        &picture,
        "--light",
        "88,0",
    ]));
    assert!(told.contains("the light at theta 88 phi 0 lies beyond"), "{told}");
}

#[test]
fn names_that_were_exchanged_or_are_of_something_else_are_told_with_the_way_out() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [archive, measurement, model, enlarged] =
        [fixture.archive(), fixture.measurement(), fixture.model(), fixture.enlarged()];
    let other = at("other.zarr");
    succeed(&mut run(&["import"], &[&archive, &other], &["--turn", "90", "-q"]));
    let archives = at("archives");
    std::fs::create_dir(&archives).unwrap();
    ["1.zip", "2.zip"].iter().for_each(|name| {
        std::fs::copy(&archive, archives.join(name)).unwrap();
    });
    let notes = at("notes");
    std::fs::create_dir(&notes).unwrap();
    std::fs::write(notes.join("readme.txt"), "mine").unwrap();
    let (new, out) = (at("new.zarr"), at("new.png"));
    let before = tree(folder.path());
    let cases: [(Command, i32, &str); 15] = [
        (run(&["model"], &[&at("new.model.zarr"), &measurement], &[]), 2, "what is read is named first"),
        (run(&["model"], &[&model, &measurement], &[]), 2, "what is read is named first"),
        (run(&["enlarge"], &[&new, &model], &["--size", "9x9"]), 2, "what is read is named first"),
        (run(&["enlarge"], &[&enlarged, &at("sample.zarr")], &["--size", "9x9"]), 65, "expected a model"),
        (run(&["import"], &[&new, &archive], &[]), 66, "the store to make is named last"),
        (run(&["import"], &[&measurement, &new], &[]), 2, "is a store already"),
        (run(&["import"], &[&model, &new], &[]), 2, "is a store already"),
        (run(&["sample"], &[&new], &[]), 2, "btf import"),
        (run(&["export"], &[&enlarged, &out], &[]), 2, "btf image"),
        (run(&["image"], &[&out, Path::new("--out"), &measurement], &[]), 2, "--out names the picture"),
        (run(&["info"], &[&archives], &[]), 65, "a measurement each"),
        (run(&["check"], &[&archives], &[]), 65, "a measurement each"),
        (run(&["compare"], &[&model, &other], &[]), 65, "name the measurement that the model was made of"),
        (
            run(&["judge"], &[&enlarged, Path::new("--against"), &other], &["--crop", "16"]),
            65,
            "name the measurement that the model was made of",
        ),
        (
            run(&["image"], &[&model, Path::new("--out"), &out, Path::new("--measurement"), &other], &[]),
            65,
            "name the measurement that the model was made of",
        ),
    ];
    for (mut command, code, words) in cases {
        let told = fail(command.current_dir(folder.path()), code);
        assert!(told.contains(words) && !told.contains("--force"), "{command:?}: {told}");
        assert_eq!(tree(folder.path()), before, "{command:?}");
    }
    // Of many archives the good ones are imported; the folder may have been meant for their stores.
    let told = fail(run(&["import"], &[&archive, &notes], &[]).current_dir(folder.path()), 65);
    assert!(told.contains("--into"), "{told}");
    // Where it is the same measurement imported anew, the model is what is to be made again.
    let (again, of_it) = (at("again.zarr"), at("again.model.zarr"));
    succeed(&mut run(&["import"], &[&archive, &again], &["-q"]));
    succeed(&mut run(&["tile"], &[&again, &of_it], &["-q"]));
    succeed(&mut run(&["import"], &[&archive, &again], &["-q", "--turn", "90", "--force"]));
    let told = fail(&mut run(&["normals"], &[&again, &of_it], &[]), 65);
    assert!(told.contains("btf model") && told.contains("--force"), "{told}");
}

/// Files that a user may have put into a store, or that only look like ours.
#[test]
fn only_files_that_we_ourselves_write_go_with_a_store_that_is_made_anew() {
    const FOREIGN: [&str; 14] = [
        "reflectance/c/notes.txt",
        "reflectance/c/0/0/0/0/notes",
        "reflectance/c/0/0/0/0/0.bak",
        "reflectance/notes.txt",
        "c/0/0",
        "mine/zarr.json",
        "mine/c/0/0",
        ".lock-notes",
        ".locked",
        "reflectance/.lock-mine",
        ".my.tmp-notes",
        "a.tmp-host-1-0a",
        ".draft.tmp-of-mine",
        "index/c/model-path",
    ];
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("s.zarr");
    let import = |options: &[&str]| run(&["import"], &[&fixture.archive(), &store], options);
    succeed(&mut import(&[]));
    for name in FOREIGN {
        let file = store.join(name);
        let made = !file.parent().unwrap().exists();
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(&file, "mine").unwrap();
        let before = tree(&store);
        let told = fail(&mut import(&["--turn", "90", "--force"]), 65);
        assert!(told.contains(name) && told.contains("move that file away"), "{told}");
        assert_eq!(tree(&store), before, "{name}");
        std::fs::remove_file(&file).unwrap();
        if made {
            std::fs::remove_dir_all(store.join(Path::new(name).iter().next().unwrap())).ok();
            succeed(&mut import(&[]));
        }
    }
    // What killed writers leave is ours.
    for name in
        [".zarr.json.tmp-host-1-0a1b2c3d", "reflectance/c/.0.tmp-other-host-77-0a", ".lock", ".lock-writing"]
    {
        std::fs::write(store.join(name), "").unwrap();
    }
    // What others noted is not kept, and that is said.
    let root = store.join("zarr.json");
    let mut document: serde_json::Value = serde_json::from_slice(&std::fs::read(&root).unwrap()).unwrap();
    document["attributes"]["sample_number"] = "17".into();
    std::fs::write(&root, document.to_string()).unwrap();
    let output = import(&["--turn", "90", "--force"]).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && told.contains("sample_number"), "{told}");
}

#[test]
fn a_pyramid_with_files_of_others_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let pyramid = folder.path().join("p.dzi");
    let export = |options: &[&str]| run(&["export"], &[&fixture().model(), &pyramid], options);
    succeed(&mut export(&[]));
    for name in ["3/notes.png", "mine/0_0.png", "0/0_0.png.bak", "0_0.png"] {
        let file = folder.path().join("p_files").join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(&file, "mine").unwrap();
        let told = fail(&mut export(&["--light", "40,0", "--force"]), 65);
        assert!(told.contains(name) && file.exists(), "{told}");
        std::fs::remove_file(&file).unwrap();
        succeed(&mut export(&[]));
    }
}

/// The program under limits of the shell.
fn limited(limit: &str, arguments: &[String]) -> (Option<i32>, String) {
    let line: Vec<String> = arguments.iter().map(|argument| format!("'{argument}'")).collect();
    let program = env!("CARGO_BIN_EXE_btf");
    let script = format!("{limit}; exec '{program}' {}", line.join(" "));
    let output = Command::new("sh").args(["-c", &script]).stdin(Stdio::null()).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn limits_of_the_system_are_told_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(&folder.path().join("p.png"));
    let image = ["image", &text(&fixture().measurement()), "--out", &out].map(str::to_owned);
    let (code, told) = limited("ulimit -s 64", &image);
    assert!(code == Some(1) && told.contains("ulimit -s"), "{code:?} {told}");
    let (code, told) = limited("ulimit -n 5", &image);
    assert!(code == Some(74) && told.contains("ulimit -n"), "{code:?} {told}");
    let link = folder.path().join("dangling.png");
    std::os::unix::fs::symlink("nowhere/at/all", &link).unwrap();
    for (command, made) in [
        (run(&["image"], &[&fixture().measurement(), Path::new("--out"), &link], &[]), &link),
        (run(&["export"], &[&fixture().measurement(), &link], &["--to", "npy"]), &link),
        (run(&["export"], &[&fixture().measurement(), &link], &["--to", "png"]), &link),
        (run(&["sample"], &[&link], &["--size", "8x8"]), &link),
        (run(&["import"], &[&fixture().archive(), &link], &["--codec", "stock"]), &link),
    ] {
        let mut command = command;
        let output = command.output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        // An import takes the name for an archive.
        assert!(matches!(output.status.code(), Some(65 | 66 | 2)), "{command:?} {told}");
        assert!(told.contains("\n  ") && made.is_symlink(), "no advice: {command:?} {told}");
    }
    let stores: [PathBuf; 2] = ["s.zarr", "m.model.zarr"].map(|name| folder.path().join(name));
    for store in &stores {
        std::os::unix::fs::symlink("nowhere/at/all", store).unwrap();
    }
    for mut command in [
        run(&["import"], &[&fixture().archive(), &stores[0]], &[]),
        run(&["model"], &[&fixture().measurement(), &stores[1]], &[]),
        run(&["enlarge"], &[&fixture().model(), &stores[0]], &["--size", "16x16", "--method", "repeat"]),
    ] {
        let output = command.output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && told.contains("link") && told.contains("\n  "),
            "{command:?} {told}"
        );
    }
}

#[test]
fn a_crafted_number_of_clusters_is_damage_and_no_want_of_memory() {
    let folder = tempfile::tempdir().unwrap();
    for clusters in [65_536, 65_535, 300] {
        let store = folder.path().join(format!("{clusters}.model.zarr"));
        copy(&fixture().model(), &store);
        let root = store.join("zarr.json");
        let mut document: serde_json::Value = serde_json::from_slice(&std::fs::read(&root).unwrap()).unwrap();
        let ours = document["attributes"]["btfkit"].as_object_mut().unwrap();
        ours["stages"]["cluster"]["report"]["clusters"] = clusters.into();
        ours["seal"] = btfkit::zarr::metadata::seal(ours).into();
        std::fs::write(&root, document.to_string()).unwrap();
        let told = fail(btf().arg("verify").arg(&store).args(["--memory", "64MiB"]), 65);
        assert!(!told.contains("--memory"), "{told}");
    }
}

#[test]
fn highlights_that_an_import_cuts_off_are_told_with_the_option_that_keeps_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (floats, npy) = (at("f.zarr"), at("f.npy"));
    succeed(&mut run(
        &["import"],
        &[&fixture().archive(), &floats],
        &["--samples", "f32", "--transfer", "linear"],
    ));
    succeed(&mut run(&["export"], &[&floats, &npy], &[]));
    // Twice as bright.
    let mut bytes = std::fs::read(&npy).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    for sample in bytes[header..].as_chunks_mut::<4>().0 {
        *sample = (2.0 * f32::from_le_bytes(*sample)).to_le_bytes();
    }
    std::fs::write(&npy, bytes).unwrap();
    for samples in ["u8", "u16"] {
        let store = at(&format!("{samples}.zarr"));
        let told = succeed(&mut run(&["import"], &[&npy, &store], &["--samples", samples]));
        assert!(told.contains("above white became white") && told.contains("--samples f16"), "{told}");
    }
    let told = succeed(&mut run(&["import"], &[&npy, &at("f16.zarr")], &["--samples", "f16"]));
    assert!(!told.contains("became white"), "{told}");
}

#[test]
fn stores_in_each_others_place_are_told_with_the_command_that_was_meant() {
    let fixture = fixture();
    let folder = tempfile::tempdir().unwrap();
    let [measurement, model, enlarged] = [fixture.measurement(), fixture.model(), fixture.enlarged()];
    let of_model: [(&str, &[&str]); 4] = [("tile", &[]), ("cluster", &[]), ("normals", &[]), ("curve", &[])];
    for (command, options) in of_model {
        let told = fail(run(&[command], &[&model, &measurement], options).current_dir(folder.path()), 2);
        let meant = format!("btf {command} {} {}", measurement.display(), model.display());
        assert!(told.contains("the other way round") && told.contains(&meant), "{told}");
    }
    for subject in [&model, &enlarged] {
        let told = fail(&mut run(&["judge"], &[&measurement, Path::new("--against"), subject], &[]), 2);
        let meant = format!("btf judge {} --against {}", subject.display(), measurement.display());
        assert!(told.contains(&meant), "{told}");
    }
}

#[test]
fn names_of_results_that_mean_something_else_are_refused_with_one_that_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("folder")).unwrap();
    let small = ["--size", "8x8", "--views", "1", "--lights", "2"];
    for name in ["folder", "folder/", "new/", "s.tar", "s.btf", "s.v2"] {
        let told = fail(btf().arg("sample").arg(at(name)).args(small), 2);
        let meant = told.split("btf sample ").last().unwrap().trim();
        assert!(meant.ends_with(".zip"), "{told}");
        if !name.starts_with("new") {
            succeed(btf().arg("sample").arg(meant).args(small).arg("--force"));
        }
    }
    let measurement = fixture().measurement();
    for (name, format) in [("x.npy", "png"), ("x.h5", "exr"), ("x.zip", "npy"), ("x.btf", "hdf5")] {
        let told = fail(btf().arg("export").args([&measurement, &at(name)]).args(["--to", format]), 2);
        assert!(told.contains("leave out --to") && !at(name).exists(), "{told}");
    }
    let told = fail(btf().arg("image").args([&fixture().model(), &at("x.png")]), 2);
    assert!(told.contains("use --out"), "{told}");
    let told =
        fail(btf().arg("image").args([&fixture().model(), &at("x.png")]).arg("--out").arg(at("y.png")), 2);
    assert!(told.contains("leave out") && !told.contains("use --out"), "{told}");
}

#[test]
fn the_lattice_that_a_warning_asks_for_can_be_given() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    copy(&fixture().model(), &model);
    let lattice = ["--lattice", "8,0;0,8"];
    // As the warnings of enlarge say it; without --force another lattice is another recipe.
    fail(btf().arg("appearance").arg(&model).args(lattice), 65);
    succeed(btf().arg("appearance").arg(&model).arg("--force").args(lattice));
    succeed(btf().arg("appearance").arg(&model).args(["--lattice", "none", "--force"]));
    let measurement = fixture().measurement();
    succeed(btf().arg("model").args([&measurement, &model]).args(["--force", "--tile", "none"]));
}

#[test]
fn a_pattern_is_advised_only_where_it_reads_all_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let archive = folder.path().join("s.zip");
    succeed(btf().arg("sample").arg(&archive).args(["--size", "8x8", "--views", "2", "--lights", "3"]));
    let files = crate::fixture::unpack(&archive, &folder.path().join("unpacked"));
    let advice = |name: &dyn Fn(usize, &str) -> String| {
        let set = folder.path().join("set");
        drop(std::fs::remove_dir_all(&set));
        std::fs::create_dir(&set).unwrap();
        for (number, file) in files.iter().enumerate() {
            let stem = file.file_stem().unwrap().to_str().unwrap();
            std::fs::copy(file, set.join(format!("{}.jpg", name(number, stem)))).unwrap();
        }
        (set.clone(), fail(btf().arg("info").arg(&set), 65))
    };
    // The last digits only count.
    let (set, told) = advice(&|number, stem| format!("{stem}_{number}"));
    let pattern = told.split("--pattern '").nth(1).and_then(|rest| rest.split('\'').next());
    let pattern = pattern.unwrap_or_else(|| panic!("no pattern in {told}")).replace('\n', " ");
    succeed(btf().arg("info").arg(&set).args(["--pattern", &pattern]));
    // Decimal commas are fractions, which no pattern reads.
    let (_, told) = advice(&|_, stem| stem.replace(" tv", ",5 tv"));
    assert!(!told.contains("--pattern") && told.contains("--table"), "{told}");
    let (_, told) = advice(&|_, stem| stem.replace(" tv", "_5 tv"));
    assert!(!told.contains("--pattern") && told.contains("--table"), "{told}");
}

#[test]
fn arrays_without_directions_are_told_of_the_lists_that_they_can_have() {
    let folder = tempfile::tempdir().unwrap();
    let array = folder.path().join("a.npy");
    succeed(btf().arg("export").args([&fixture().measurement(), &array]));
    std::fs::remove_file(folder.path().join("a.views.npy")).unwrap();
    let told = fail(btf().arg("info").arg(&array), 65);
    assert!(told.contains("NAME.views.npy") && !told.contains("uniform"), "{told}");
}

#[test]
fn a_tile_that_is_mostly_black_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let array = at("a.npy");
    succeed(btf().arg("export").args([&fixture().measurement(), &array]));
    let enlarged = |name: &str| {
        let [store, model, large] = ["", ".model", ".large"].map(|kind| at(&format!("{name}{kind}.zarr")));
        succeed(btf().arg("import").args([&array, &store]));
        let plain = ["--tile", "none", "--clusters", "16", "--levels", "1"];
        let made = succeed(btf().arg("model").args([&store, &model]).args(plain));
        let checked = btf().arg("check").arg(&store).output().unwrap();
        let checked = String::from_utf8_lossy(&checked.stdout).into_owned();
        [made, checked, succeed(btf().arg("enlarge").args([&model, &large]).args(["--size", "96x96"]))]
    };
    let plain = enlarged("plain").concat();
    assert!(
        !["are black", "is black from", "black-background"].iter().any(|words| plain.contains(words)),
        "{plain}"
    );
    // Three of four columns become black in every image.
    let mut bytes = std::fs::read(&array).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    for (at, sample) in bytes[header..].iter_mut().enumerate() {
        if at / 3 % 56 >= 14 {
            // Noise, as JPEG leaves it.
            *sample = 2 * (at % 3) as u8;
        }
    }
    std::fs::write(&array, bytes).unwrap();
    let [made, checked, told] = enlarged("black");
    assert!(made.contains("75 % of it is black from everywhere"), "{made}");
    assert!(checked.contains("black-background") && checked.contains("crop the pictures"), "{checked}");
    assert!(told.contains("75 % of the tile are black") && told.contains("crop the pictures"), "{told}");
}

//! What the program must never do, whatever it is asked: replace what is there, hide an option from a recipe, lose the
//! kind of an error, wait in silence, show what others wrote as if it were its own.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::fixture::{Fixture, btf, fail, fixture, model_of, succeed, tree};
use crate::option_effects::{Effect, IDLE, OUTPUTS, RECIPES, Shown};

/// Arguments of each command that prints its recipe.
fn dry_run(command: &str, fixture: &Fixture, folder: &Path) -> Command {
    let mut run = btf();
    let new = folder.join("new.zarr");
    run.arg(command);
    match command {
        "import" => run.args([&fixture.archive(), &new]),
        "tile" | "model" => run.args([&fixture.measurement(), &new]),
        "cluster" | "normals" => run.args([&fixture.measurement(), &fixture.model()]),
        "fit" | "appearance" => run.arg(fixture.model()),
        "components" => run.args([fixture.measurement(), fixture.model()]),
        "enlarge" => run.args([&fixture.model(), &new]).args(["--size", "64x64"]),
        "export" => run.args([&fixture.model(), &folder.join("new.dzi")]).arg("--deepzoom"),
        other => panic!("no arguments for {other}"),
    };
    run.arg("--dry-run");
    run
}

fn recipe(run: &mut Command) -> Value {
    let plan: Value = serde_json::from_str(&succeed(run)).unwrap();
    let recipe = plan.get("recipe").or_else(|| plan.get("recipes")).cloned();
    recipe.unwrap_or_else(|| panic!("{run:?}: no recipe in {plan}"))
}

#[test]
fn every_option_that_changes_bytes_changes_the_recipe_and_no_other_does() {
    let folder = tempfile::tempdir().unwrap();
    for of in RECIPES {
        let run = || dry_run(of.command, fixture(), folder.path());
        let plain = recipe(&mut run());
        for (option, effect) in of.options {
            match effect {
                // The clause that an option stands for may replace one that the command has already.
                Effect::Changes(arguments) => {
                    let mut with = without_replaced(&mut run(), arguments);
                    let without = base_of(of.command, option, &mut run());
                    assert_ne!(
                        recipe(with.args(*arguments)),
                        without.unwrap_or_else(|| plain.clone()),
                        "{} {option}",
                        of.command
                    );
                }
                Effect::Keeps(arguments) => {
                    assert_eq!(recipe(run().args(*arguments)), plain, "{} {option}", of.command);
                }
                Effect::Apart(_) => {}
            }
        }
    }
}

/// A command line whose places are those of the fixture, and a folder for what it makes.
fn placed(arguments: &[&str], new: &Path) -> Command {
    let fixture = fixture();
    let places = [
        ("{archive}", fixture.archive()),
        ("{measurement}", fixture.measurement()),
        ("{model}", fixture.model()),
        ("{enlarged}", fixture.enlarged()),
        ("{new}", new.to_owned()),
    ];
    let mut command = btf();
    for argument in arguments {
        let placed = places
            .iter()
            .fold((*argument).to_owned(), |text, (name, place)| text.replace(name, place.to_str().unwrap()));
        command.arg(placed);
    }
    command
}

#[test]
fn every_option_of_a_command_without_a_recipe_shows() {
    for of in OUTPUTS {
        // What is printed, and every file that is made.
        let made = |options: &[&str]| {
            let folder = tempfile::tempdir().unwrap();
            let mut words = vec![of.command];
            let mut base = of.base.iter();
            while let Some(word) = base.next() {
                // An option that is given again takes the place of the one that is there.
                if word.starts_with("--") && options.contains(word) {
                    base.next();
                } else {
                    words.push(word);
                }
            }
            words.extend(options);
            let told = succeed(&mut placed(&words, folder.path()));
            (told.replace(folder.path().to_str().unwrap(), ""), tree(folder.path()))
        };
        for (option, shown) in of.options {
            if let Shown::Shows(with, beside) = shown {
                assert_ne!(made(with), made(beside), "{} {option} changes nothing", of.command);
            }
        }
    }
}

#[test]
fn an_option_that_would_change_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, option) in IDLE {
        let told = fail(&mut placed(arguments, folder.path()), 2);
        assert!(told.contains(option), "{arguments:?}: {told}");
        assert_eq!(tree(folder.path()).len(), 0, "{arguments:?}");
    }
}

/// The recipe beside which an option's must be another, where the option needs others to be allowed.
fn base_of(command: &str, option: &str, run: &mut Command) -> Option<Value> {
    let arguments: &[&str] = match (command, option) {
        ("enlarge", "tiles") => &["--method", "tiles"],
        ("enlarge", "candidates") => &["--method", "paper"],
        ("export", "seed" | "jitter") => &["--plane", "--window", "0,0,16,16"],
        ("export", "plane") => &["--window", "0,0,16,16"],
        ("export", "quality") => &["--format", "jpeg"],
        _ => return None,
    };
    Some(recipe(run.args(arguments)))
}

/// The command without the options that are given again.
fn without_replaced(run: &mut Command, arguments: &[&str]) -> Command {
    let mut new = btf();
    let mut skip = false;
    for argument in run.get_args() {
        if skip {
            skip = false;
        } else if argument == "--size" && arguments.contains(&"--size") {
            skip = true;
        } else {
            new.arg(argument);
        }
    }
    new
}

#[test]
fn an_import_with_another_reading_is_refused_and_shards_of_two_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store] = ["square.zip", "square.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "32x32", "--views", "7", "--lights", "7"]));
    let import = |options: &[&str]| {
        let mut command = btf();
        command.arg("import").args([&archive, &store]).args(options);
        command
    };
    succeed(&mut import(&["--shard", "0/2"]));
    fail(&mut import(&["--shard", "1/2", "--transpose"]), 65);
    succeed(&mut import(&[]));
    let before = tree(&store);
    for option in [&["--transpose"][..], &["--swap"], &["--cosine", "excluded"], &["--turn", "90"]] {
        let told = fail(&mut import(option), 65);
        assert!(told.contains("another recipe: reading") && told.contains("--force"), "{told}");
    }
    assert_eq!(tree(&store), before);
    // The model of the store as it was is not that of the store as it is now.
    let model = folder.path().join("square.model.zarr");
    let analyse = |model: &Path, options: &[&str]| {
        let mut command = btf();
        command.arg("model").args([&store, model]).args(["--clusters", "9", "--tile", "plane"]).args(options);
        command
    };
    succeed(&mut analyse(&model, &[]));
    succeed(&mut import(&["--cosine", "excluded", "--force"]));
    let told = fail(&mut analyse(&model, &[]), 65);
    assert!(told.contains("is not what") && told.contains("imported anew"), "{told}");
    fail(btf().arg("compare").args([&model, &store]), 65);
    succeed(&mut analyse(&model, &["--force"]));
    let fresh = folder.path().join("fresh.model.zarr");
    succeed(&mut analyse(&fresh, &[]));
    assert_eq!(tree(&model), tree(&fresh));
}

/// Every command that makes a file or a folder beside a store, as its arguments and the file; `other` are arguments by
/// which the result is another.
fn outputs(fixture: &Fixture, folder: &Path) -> Vec<(Vec<String>, PathBuf, Vec<&'static str>)> {
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let [measurement, model] = [fixture.measurement(), fixture.model()].map(|path| text(&path));
    let enlarged = text(&fixture.enlarged());
    let mut all = Vec::new();
    let mut add = |arguments: &[&str], file: &str, other: &[&'static str]| {
        let path = folder.join(file);
        let arguments =
            arguments.iter().map(|&part| if part == "OUT" { text(&path) } else { part.to_owned() });
        all.push((arguments.collect(), path, other.to_vec()));
    };
    add(&["sample", "OUT", "--size", "16x16", "--views", "2", "--lights", "3"], "s.zip", &["--seed", "2"]);
    add(&["export", &measurement, "OUT"], "e.zip", &["--quality", "40"]);
    add(&["export", &measurement, "OUT"], "e.npy", &[]);
    add(&["export", &measurement, "OUT", "--rank", "3"], "e.btf", &["--rank", "2"]);
    add(&["export", &measurement, "OUT", "--to", "fmf", "--rank", "3"], "e.fmf", &[]);
    add(&["export", &measurement, "OUT", "--to", "png"], "png", &[]);
    add(&["export", &measurement, "OUT", "--to", "exr"], "exr", &[]);
    #[cfg(feature = "hdf5")]
    add(&["export", &measurement, "OUT"], "e.h5", &[]);
    add(&["export", &enlarged, "OUT", "--deepzoom"], "d.dzi", &["--overlap", "2"]);
    add(&["image", &model, "--out", "OUT"], "i.png", &["--exposure", "2"]);
    add(&["image", &enlarged, "--out", "OUT"], "i.exr", &["--exposure", "2"]);
    add(&["curve", &measurement, &model, "--most", "4", "--out", "OUT"], "c.png", &["--most", "2"]);
    add(&["compare", &model, &measurement, "--picture", "OUT"], "p.png", &["--light", "60,0"]);
    add(&["check", &measurement, "--picture", "OUT"], "k.png", &[]);
    add(&["enlarge", &model, "OUT", "--size", "32x32"], "n.zarr", &["--seed", "2"]);
    add(&["import", &text(&fixture.archive()), "OUT"], "m.zarr", &["--white", "0.5"]);
    all
}

/// A file's bytes, or those of all files of a folder.
fn contents(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    if path.is_dir() { tree(path) } else { BTreeMap::from([(PathBuf::new(), fs::read(path).unwrap())]) }
}

fn run(arguments: &[String], more: &[&str]) -> Command {
    let mut command = btf();
    // An option that is given again replaces the first.
    let replaced = |argument: &String| more.contains(&argument.as_str());
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        if argument.starts_with("--") && replaced(argument) {
            arguments.next();
        } else {
            command.arg(argument);
        }
    }
    command.args(more);
    command
}

#[test]
fn nothing_that_exists_is_replaced_without_force() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, path, other) in outputs(fixture(), folder.path()) {
        // What was never ours is refused, and left alone.
        fs::write(&path, b"mine").unwrap();
        let code = run(&arguments, &[]).output().unwrap().status.code();
        assert!(matches!(code, Some(65)), "{arguments:?}: {code:?}");
        assert_eq!(fs::read(&path).unwrap(), b"mine", "{arguments:?}");
        fs::remove_file(&path).unwrap();
        // The same result is found done, and not touched.
        succeed(&mut run(&arguments, &[]));
        // Of a store the metadata of arrays may be written again, with the same bytes.
        let modified = |path: &Path| path.is_file().then(|| fs::metadata(path).unwrap().modified().unwrap());
        let (made, at) = (contents(&path), modified(&path));
        succeed(&mut run(&arguments, &[]));
        assert_eq!((contents(&path), modified(&path)), (made.clone(), at), "{arguments:?}");
        if other.is_empty() {
            continue;
        }
        // Another one is refused, with the way out, which works; and back again.
        let told = fail(&mut run(&arguments, &other), 65);
        assert!(told.contains("--force"), "{told}");
        assert_eq!(contents(&path), made, "{arguments:?}");
        let mut forced = other.clone();
        forced.push("--force");
        succeed(&mut run(&arguments, &forced));
        assert_ne!(contents(&path), made, "{arguments:?}");
        succeed(&mut run(&arguments, &["--force"]));
        assert_eq!(contents(&path), made, "{arguments:?}");
    }
    let left: Vec<PathBuf> = crate::fixture::tree_names(folder.path())
        .into_iter()
        .filter(|path| path.to_string_lossy().contains(".tmp-") || path.to_string_lossy().contains(".lock"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn force_never_replaces_a_pipe_or_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("target");
    fs::write(&target, b"mine").unwrap();
    for (arguments, path, _) in outputs(fixture(), folder.path()) {
        // A link to a file, and a pipe.
        std::os::unix::fs::symlink(&target, &path).unwrap();
        let told = fail(run(&arguments, &[]).arg("--force"), 65);
        assert!(told.contains("choose another name"), "{arguments:?}: {told}");
        assert!(fs::symlink_metadata(&path).unwrap().is_symlink(), "{arguments:?}");
        assert_eq!(fs::read(&target).unwrap(), b"mine", "{arguments:?}");
        fs::remove_file(&path).unwrap();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        fail(run(&arguments, &[]).arg("--force"), 65);
        assert!(!fs::symlink_metadata(&path).unwrap().is_file(), "{arguments:?}");
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn what_cannot_be_told_is_an_error_of_output() {
    let measurement = fixture().measurement();
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for arguments in [&["info"][..], &["info", "--json"], &["verify"], &["verify", "--json"]] {
        let mut command = btf();
        let output = command.args(arguments).arg(&measurement).stdout(full()).output().unwrap();
        assert_eq!(output.status.code(), Some(74), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"), "{output:?}");
    }
}

#[test]
fn what_has_the_name_of_a_shard_and_is_no_file_is_damage_and_not_missing() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.zarr");
    crate::fixture::copy(&fixture().measurement(), &copy);
    let shard = copy.join("reflectance/c/0/0/0/0/0");
    fs::remove_file(&shard).unwrap();
    fail(btf().arg("verify").arg(&copy), 66);
    assert!(Command::new("mkfifo").arg(&shard).status().unwrap().success());
    fail(btf().arg("verify").arg(&copy), 65);
    fs::remove_file(&shard).unwrap();
    fs::create_dir(&shard).unwrap();
    fail(btf().arg("verify").arg(&copy), 65);
}

#[test]
fn a_pipe_among_the_files_of_a_result_is_never_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let measurement = fixture().measurement();
    let [pictures, zoom] = ["pictures", "zoom.dzi"].map(|name| folder.path().join(name));
    let ended = |command: &mut Command| {
        let code = command.status().unwrap().code();
        assert_ne!(code, Some(124), "{command:?} hung");
        code
    };
    let limited = |arguments: &[&str]| {
        let mut command = Command::new("timeout");
        command.args(["20", env!("CARGO_BIN_EXE_btf"), "export"]).args(arguments).stderr(Stdio::null());
        command
    };
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let of_pictures = [&text(&measurement), &text(&pictures), "--to", "png"];
    let of_zoom = [&text(&fixture().enlarged()), &text(&zoom), "--deepzoom"];
    for arguments in [&of_pictures[..], &of_zoom] {
        assert_eq!(ended(&mut limited(arguments)), Some(0));
    }
    let tile = crate::fixture::tree_names(&folder.path().join("zoom_files"))
        .into_iter()
        .find(|path| path.extension().is_some_and(|ending| ending == "png"))
        .unwrap();
    let page = folder.path().join("zoom.html");
    let picture = crate::fixture::tree_names(&pictures).pop().unwrap();
    for (path, arguments) in
        [(&picture, &of_pictures[..]), (&page, &of_zoom), (&zoom, &of_zoom), (&tile, &of_zoom)]
    {
        let kept = fs::read(path).unwrap();
        fs::remove_file(path).unwrap();
        assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
        ended(&mut limited(arguments));
        let _ = fs::remove_file(path);
        fs::write(path, kept).unwrap();
    }
    // The state of an enlargement, and the name of what a killed run left.
    let index = folder.path().join("index.zarr");
    let again = crate::interruption::killed_with_a_state(&index, &[]);
    for name in [".index.tmp-host-1-1", "enlarge-state"] {
        let _ = fs::remove_file(index.join(name));
        assert!(Command::new("mkfifo").arg(index.join(name)).status().unwrap().success());
        let mut limited = Command::new("timeout");
        limited.args(["60", env!("CARGO_BIN_EXE_btf")]).args(again.get_args()).stderr(Stdio::null());
        ended(&mut limited);
    }
}

#[test]
fn files_of_others_in_a_store_or_a_pyramid_are_not_removed_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let [store, zoom] = ["store.zarr", "zoom.dzi"].map(|name| folder.path().join(name));
    let tiles = folder.path().join("zoom_files");
    let import = |white: &str| {
        let mut command = btf();
        command.arg("import").args([&fixture().archive(), &store]).args(["--white", white]);
        command
    };
    let export = |exposure: &str| {
        let mut command = btf();
        command.arg("export").args([&fixture().measurement(), &zoom]).args(["--exposure", exposure]);
        command
    };
    succeed(&mut import("1"));
    succeed(&mut export("1"));
    for (place, again) in [
        (&store, &import as &dyn Fn(&str) -> Command),
        (&store.join("reflectance"), &import),
        (&store.join("mine"), &import),
        (&tiles, &export),
        (&tiles.join("0"), &export),
    ] {
        let mine = place.join("notes.txt");
        fs::create_dir_all(place).unwrap();
        fs::write(&mine, b"mine").unwrap();
        let told = fail(again("2").arg("--force"), 65);
        assert!(told.contains("notes.txt is no part of"), "{told}");
        assert_eq!(fs::read(&mine).unwrap(), b"mine");
        fs::remove_file(&mine).unwrap();
    }
    succeed(import("2").arg("--force"));
    succeed(export("2").arg("--force"));
}

#[test]
fn no_result_lies_inside_of_a_store() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store.zarr");
    crate::fixture::copy(&fixture().measurement(), &store);
    let before = tree(&store);
    for place in ["picture.png", "reflectance/c/0/0/0/0/0.png", "new/deep.exr"] {
        let told = fail(btf().arg("image").arg(&store).arg("--force").arg("--out").arg(store.join(place)), 2);
        assert!(told.contains("inside of the store"), "{told}");
    }
    for (place, format) in [
        ("a.npy", "npy"),
        ("reflectance/c/0/0/0/0/0", "npy"),
        ("pictures", "png"),
        ("a.h5", "hdf5"),
        ("a.btf", "dfmf"),
    ] {
        let mut export = btf();
        export.arg("export").args([&store, &store.join(place)]).args(["--to", format, "--force"]);
        fail(&mut export, 2);
    }
    fail(btf().arg("export").args([&store, &store.join("zoom.dzi")]), 2);
    // Neither do stores, folders of pages, and the demo.
    let (archive, measurement, model) = (fixture().archive(), fixture().measurement(), fixture().model());
    let inside = store.join("new").join("inside.zarr");
    for command in [
        vec![Path::new("import"), &archive, &inside],
        vec![Path::new("import"), &archive, Path::new("--into"), &store],
        vec![Path::new("model"), &measurement, &inside],
        vec![Path::new("model"), &measurement, Path::new("--into"), &store],
        vec![Path::new("enlarge"), &model, &inside, Path::new("--size"), Path::new("64x64")],
        vec![Path::new("man"), Path::new("--out"), &store],
        vec![Path::new("demo"), &inside],
    ] {
        let told = fail(btf().args(&command), 2);
        assert!(told.contains("inside of the store"), "{command:?}: {told}");
    }
    assert_eq!(tree(&store), before);
}

#[test]
fn force_removes_only_what_is_of_its_kind() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = folder.path().join("photos.zarr");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("holiday.jpg"), b"mine").unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (archive, model, measurement) =
        (text(&fixture().archive()), text(&fixture().model()), text(&fixture().measurement()));
    let place = text(&foreign);
    for arguments in [
        &["import", &archive, &place][..],
        &["enlarge", &model, &place, "--size", "16x16"],
        &["tile", &measurement, &place],
        &["export", &measurement, &place, "--to", "png"],
        &["image", &model, "--out", &format!("{place}/../photos.zarr/holiday.jpg/x.png")],
    ] {
        let code = btf().args(arguments).arg("--force").output().unwrap().status.code();
        assert!(matches!(code, Some(65 | 74)), "{arguments:?}: {code:?}");
        assert_eq!(fs::read(foreign.join("holiday.jpg")).unwrap(), b"mine", "{arguments:?}");
    }
    // A store of another kind is no less dear.
    let copy = folder.path().join("copy.zarr");
    crate::fixture::copy(&fixture().model(), &copy);
    let before = tree(&copy);
    fail(btf().arg("import").args([&fixture().archive(), &copy]).arg("--force"), 65);
    assert_eq!(tree(&copy), before);
}

#[test]
fn the_stages_of_a_model_are_done_anew_by_force_and_what_builds_on_them_too() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.model.zarr");
    succeed(&mut model_of(&fixture().measurement(), &model));
    let entries = || -> Vec<String> {
        let text = fs::read_to_string(model.join("zarr.json")).unwrap();
        let attributes: Value = serde_json::from_str(&text).unwrap();
        let stages = attributes.pointer("/attributes/btfkit/stages").unwrap().as_object().unwrap();
        let mut names: Vec<String> = stages.keys().cloned().collect();
        names.sort();
        names
    };
    let fit = |options: &[&str]| {
        let mut command = btf();
        command.arg("fit").arg(&model).args(options);
        command
    };
    let told = fail(&mut fit(&["--mrf", "2d"]), 65);
    assert!(told.contains("--force"), "{told}");
    succeed(&mut fit(&["--mrf", "2d", "--force"]));
    assert_eq!(entries(), ["appearance", "cluster", "fit", "normals", "tile"]);
    let both = [&fixture().measurement(), &model];
    let told = btf().arg("normals").args(both).args(["--robust", "--force"]).output().unwrap();
    assert!(
        String::from_utf8_lossy(&told.stderr).contains("went with it: fit; to make it again: btf fit"),
        "{told:?}"
    );
    assert_eq!(entries(), ["appearance", "cluster", "normals", "tile"]);
    succeed(btf().arg("cluster").args(both).args(["--clusters", "5", "--force"]));
    assert_eq!(entries(), ["cluster", "normals", "tile"]);
    succeed(btf().arg("tile").args(both).args(["--tile", "none", "--force"]));
    assert_eq!(entries(), ["tile"]);
    // Back to the model that there was, to the byte.
    succeed(model_of(&fixture().measurement(), &model).arg("--force"));
    assert_eq!(tree(&model), tree(&fixture().model()));
}

#[test]
fn a_misspelt_last_archive_does_not_become_a_store() {
    let folder = tempfile::tempdir().unwrap();
    let absent = folder.path().join("secnod.zip");
    let told = fail(btf().arg("import").args([&fixture().archive(), &absent]), 66);
    assert!(told.contains("no such archive") && told.contains(".zarr"), "{told}");
    assert!(!absent.exists());
    let into = folder.path().join("stores");
    let misspelt = folder.path().join("second.zarr");
    fail(btf().arg("import").args([&fixture().archive(), &misspelt]).arg("--into").arg(&into), 66);
    assert!(!misspelt.exists() && !into.exists());
}

#[test]
fn input_that_does_not_exist_is_missing_for_every_command() {
    let absent = "no-such-thing";
    for arguments in [
        &["info", absent][..],
        &["check", absent],
        &["import", absent, "x.zarr"],
        &["import", absent],
        &["verify", absent],
        &["export", absent, "x.npy"],
        &["export", absent, "x.dzi", "--deepzoom"],
        &["model", absent],
        &["tile", absent, "x.model.zarr"],
        &["cluster", absent, absent],
        &["curve", absent, absent],
        &["normals", absent, absent],
        &["fit", absent],
        &["appearance", absent],
        &["compare", absent, absent],
        &["enlarge", absent, "x.zarr", "--size", "16x16"],
        &["image", absent, "--out", "x.png"],
        &["judge", absent, "--against", absent],
    ] {
        let folder = tempfile::tempdir().unwrap();
        let told = fail(btf().args(arguments).current_dir(folder.path()), 66);
        assert!(told.contains(absent), "{arguments:?}: {told}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{arguments:?} left something");
    }
}

/// The program under a limit of the shell.
fn limited(limit: &str, arguments: &[String]) -> Command {
    let mut command = Command::new("bash");
    command.args(["-c", &format!("{limit}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_btf")]).args(arguments);
    command.stdin(Stdio::null());
    command
}

#[test]
fn a_file_that_may_not_grow_is_an_error_of_output_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, path, _) in outputs(fixture(), folder.path()) {
        // 512 bytes: less than any of these.
        let told = fail(&mut limited("ulimit -f 0", &arguments), 74);
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(told.contains(&format!("/{name}")), "{arguments:?}: {told}");
        assert!(
            told.contains("ulimit -f") || arguments[1].ends_with(".h5") || told.contains(".h5"),
            "{told}"
        );
        let left = crate::fixture::tree_names(folder.path());
        assert!(left.iter().all(|file| !file.to_string_lossy().contains(".tmp-")), "{left:?}");
    }
}

#[test]
fn a_folder_that_may_not_be_written_is_an_error_of_output() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    // A file where a folder would have to be refuses everybody, root too.
    let blocked = folder.path().join("blocked");
    fs::write(&blocked, b"").unwrap();
    for (arguments, _, _) in outputs(fixture(), &blocked) {
        fail(&mut run(&arguments, &[]), 74);
    }
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), b"").is_ok() {
        println!("skipped: this user may write everywhere");
        return;
    }
    for (arguments, _, _) in outputs(fixture(), &locked) {
        fail(&mut run(&arguments, &[]), 74);
    }
}

#[test]
fn what_may_not_be_read_is_not_called_damaged() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("m.zarr");
    crate::fixture::copy(&fixture().measurement(), &store);
    let probe = folder.path().join("probe");
    fs::write(&probe, b"").unwrap();
    fs::set_permissions(&probe, fs::Permissions::from_mode(0o0)).unwrap();
    if fs::read(&probe).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    for file in ["reflectance/c/0/0/0/0/0", "luminance/c/0/0/0/0", "luminance/zarr.json", "zarr.json"] {
        fs::set_permissions(store.join(file), fs::Permissions::from_mode(0o0)).unwrap();
        let told = fail(btf().arg("check").arg(&store), 74);
        assert!(!told.contains("damaged") && !told.contains("delete"), "{file}: {told}");
        fs::set_permissions(store.join(file), fs::Permissions::from_mode(0o644)).unwrap();
    }
}

/// Every option that takes a number with a fraction, with a command that is whole but for it.
#[test]
fn numbers_that_are_none_are_errors_of_usage() {
    let options: &[(&str, &[&str])] = &[
        ("sample", &["--scale"]),
        ("import", &["--white"]),
        ("model", &["--error", "--ratio", "--tolerance"]),
        ("cluster", &["--error", "--ratio", "--tolerance"]),
        ("enlarge", &["--jitter"]),
        ("image", &["--exposure", "--jitter", "--light", "--view"]),
        ("export", &["--exposure", "--jitter", "--light", "--view"]),
        ("compare", &["--light", "--view"]),
        ("tile", &["--lattice"]),
        ("appearance", &["--lattice"]),
    ];
    for (command, options) in options {
        for option in *options {
            for number in
                ["nan", "NaN", "inf", "-inf", "1e999", "-1", "0x1", "", "nan,0", "0,nan", "inf,0", "1e999,0"]
            {
                let mut run = btf();
                let places = if ["sample", "image", "appearance"].contains(command) {
                    &["a"][..]
                } else {
                    &["a", "b"]
                };
                run.arg(command).args(places).arg(format!("{option}={number}"));
                if *command == "image" {
                    run.args(["--out", "b.png"]);
                }
                if *command == "enlarge" {
                    run.args(["--size", "16x16"]);
                }
                let told = fail(&mut run, 2);
                assert!(told.contains(option), "{run:?}: {told}");
            }
        }
    }
}

#[test]
fn threads_have_bounds() {
    for threads in ["0", "-1", "1025", "100000", "99999999999999999999", "x"] {
        let told = fail(btf().arg(format!("--threads={threads}")).args(["info", "x"]), 2);
        assert!(told.contains("--threads"), "{told}");
    }
    let folder = tempfile::tempdir().unwrap();
    let arguments = |threads: &str| -> Vec<String> {
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        let out = text(&folder.path().join("i.png"));
        ["--threads", threads, "image", &text(&fixture().model()), "--out", &out, "--force"]
            .map(str::to_owned)
            .to_vec()
    };
    // Threads that the system refuses, and memory that there is not: an error, no panic and no abort.
    let output = limited("ulimit -v 600000", &arguments("1000")).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0..=2 | 74)) && !told.contains("panicked"), "{output:?}");
}

#[test]
fn what_others_wrote_is_shown_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let wild = "a\u{1b}[31mRED\u{7}\nbtf: forged\u{9b}m\u{202e}\u{2028}\u{7f}<script>";
    let harmful =
        |text: &str| text.chars().any(|c| (c.is_control() && c != '\n') || "\u{202e}\u{2028}".contains(c));
    let check = |command: &mut Command| {
        let output = command.output().unwrap();
        for bytes in [&output.stdout, &output.stderr] {
            let text = String::from_utf8(bytes.clone()).unwrap();
            assert!(!harmful(&text) && !text.contains("\nbtf: forged"), "{command:?}: {text:?}");
        }
    };
    // Paths.
    let place = folder.path().join(wild);
    fs::create_dir(&place).unwrap();
    for command in ["info", "check", "verify", "fit", "appearance", "model"] {
        check(btf().arg(command).arg(&place));
    }
    check(btf().arg("import").arg(&place));
    check(
        btf().args(["sample", "--size", "16x16", "--views", "2", "--lights", "3"]).arg(place.join("s.zip")),
    );
    check(btf().args(["--progress", "json", "import"]).arg(place.join("s.zip")).arg(place.join("s.zarr")));
    check(btf().arg("import").arg(place.join("s.zip")).arg(place.join("t.zarr")).arg("--dry-run"));
    // Names in an archive: two of one pair, and one that is no picture.
    let archive = folder.path().join("names.zip");
    let mut zip = btfkit_formats::zip::ZipWriter::new(fs::File::create(&archive).unwrap());
    for number in 0..2 {
        zip.write_entry(&format!("{wild}{number}/00000 tl000 pl000 tv000 pv000.jpg"), b"no picture").unwrap();
    }
    zip.finish().unwrap();
    for command in ["info", "check", "import"] {
        check(btf().arg(command).arg(&archive).current_dir(folder.path()));
    }
    // Attributes of a store.
    let store = folder.path().join("store.zarr");
    crate::fixture::copy(&fixture().measurement(), &store);
    let file = store.join("zarr.json");
    let mut metadata: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    metadata["attributes"]["btfkit"]["assumptions"] = serde_json::json!([wild]);
    metadata["attributes"]["btfkit"]["recipe"]["white"] = serde_json::json!(wild);
    metadata["attributes"]["btfkit"]["digest"] = serde_json::json!(wild);
    fs::write(&file, metadata.to_string()).unwrap();
    check(btf().arg("info").arg(&store));
    check(btf().arg("import").args([&fixture().archive(), &store]));
    metadata["attributes"]["btfkit"]["kind"] = serde_json::json!(wild);
    fs::write(&file, metadata.to_string()).unwrap();
    for command in ["info", "check", "verify"] {
        check(btf().arg(command).arg(&store));
    }
}

/// Waits until a command says `word` on standard error.
fn wait_for(child: &mut std::process::Child, word: &str) -> String {
    use std::io::{BufRead, BufReader};
    let stderr = child.stderr.take().unwrap();
    for line in BufReader::new(stderr).lines() {
        let line = line.unwrap();
        if line.contains(word) {
            return line;
        }
    }
    panic!("it ended without a word");
}

#[test]
fn who_waits_for_a_lock_says_so_and_ends_at_the_first_signal() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.model.zarr");
    succeed(btf().arg("tile").args([&fixture().measurement(), &model]));
    for (stage, signal) in [("normals", "-TERM"), ("cluster", "-INT")] {
        let lock = model.join(format!(".lock-{stage}"));
        let held = fs::File::create(&lock).unwrap();
        fs::write(&lock, "process 42 on elsewhere").unwrap();
        held.lock().unwrap();
        let mut child = btf()
            .arg(stage)
            .args([&fixture().measurement(), &model])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let line = wait_for(&mut child, "waiting");
        assert!(line.contains("process 42 on elsewhere") && line.contains(stage), "{line}");
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).status();
        let deadline = Instant::now() + Duration::from_secs(60);
        while child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(child.wait().unwrap().code(), Some(75));
        drop(held);
        fs::remove_file(&lock).unwrap();
    }
    assert!(crate::fixture::tree_names(&model).iter().all(|file| !file.to_string_lossy().contains(".lock")));
}

#[test]
fn what_a_killed_output_left_is_swept_by_the_next_and_what_lives_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let [dead, living] = ["dead", "living"]
        .map(|name| folder.path().join(format!(".i.png.tmp-{name}-{}-00000000", std::process::id())));
    for path in [&dead, &living] {
        fs::write(path, b"half").unwrap();
    }
    let held = fs::File::open(&living).unwrap();
    held.lock().unwrap();
    succeed(btf().arg("image").arg(fixture().model()).arg("--out").arg(folder.path().join("i.png")));
    assert!(!dead.exists() && living.exists());
}

#[test]
fn a_tile_of_few_texels_has_as_many_clusters_and_only_a_given_number_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store, model] = ["s.zip", "s.zarr", "s.model.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "12x12", "--views", "7", "--lights", "7"]));
    succeed(btf().arg("import").args([&archive, &store]));
    fail(btf().arg("model").args([&store, &model]).args(["--tile", "none", "--clusters", "256"]), 2);
    succeed(btf().arg("model").args([&store, &model]).args(["--tile", "none"]));
    let told = succeed(btf().arg("cluster").args([&store, &model]).arg("--dry-run"));
    assert!(told.contains("\"clusters\": 144"), "{told}");
}

#[test]
fn a_signal_while_it_computes_is_told_as_json_where_progress_is() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store, model] = ["s.zip", "s.zarr", "s.model.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "400x400", "--views", "1", "--lights", "4"]));
    succeed(btf().arg("import").args([&archive, &store]));
    let mut child = btf()
        .arg("tile")
        .args([&store, &model])
        .args(["--tile", "cut", "--progress", "json"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The second stage of the work begins when the first line has come.
    let mut errors = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut told = String::new();
    std::io::BufRead::read_line(&mut errors, &mut told).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    std::io::Read::read_to_string(&mut errors, &mut told).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(75), "{told}");
    for line in told.lines() {
        serde_json::from_str::<serde_json::Value>(line).unwrap_or_else(|_| panic!("no JSON: {line}"));
    }
    assert!(told.lines().last().unwrap().contains("\"exit_code\":75"), "{told}");
}

#[test]
fn less_memory_than_a_command_takes_is_refused_with_what_it_takes() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name).display().to_string();
    let [archive, measurement, model, enlarged] =
        [fixture().archive(), fixture().measurement(), fixture().model(), fixture().enlarged()]
            .map(|path| path.display().to_string());
    for command in [
        format!("import {archive} {}", out("o.zarr")),
        format!("export {measurement} {}", out("o.npy")),
        format!("check {measurement}"),
        format!("check {archive}"),
        format!("verify {measurement}"),
        format!("verify {model}"),
        format!("verify {enlarged}"),
        format!("info {measurement}"),
        format!("model {measurement} {}", out("o.model.zarr")),
        format!("tile {measurement} {}", out("o.model.zarr")),
        format!("compare {model} {measurement}"),
        format!("enlarge {model} {} --size 64x64", out("b.zarr")),
        format!("image {measurement} --out {}", out("i.png")),
        format!("export {measurement} {}", out("i.dzi")),
        format!("sample {} --size 64x64", out("s.zip")),
        format!("judge {enlarged} --against {measurement}"),
    ] {
        for (memory, allowed) in
            [("1", "1 byte is allowed"), ("2500", "2 KiB are allowed"), ("5MiB", "5 MiB are allowed")]
        {
            let told = fail(btf().args(command.split(' ')).args(["--memory", memory]), 2);
            assert!(
                told.contains(allowed) && told.contains("--memory ") && told.contains(" takes "),
                "{command}: {told}"
            );
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "something was begun");
    fail(btf().arg("info").arg(&model).args(["--memory", "0"]), 2);
}

#[test]
fn less_address_space_than_it_takes_is_an_error_of_the_system_and_no_advice_to_allow_more() {
    let folder = tempfile::tempdir().unwrap();
    let limited = |kibibytes: u32, command: &str| {
        let mut shell = Command::new("sh");
        let program = env!("CARGO_BIN_EXE_btf");
        shell
            .arg("-c")
            .arg(format!("ulimit -v {kibibytes}; exec {program} {command}"))
            .env("RUST_BACKTRACE", "0");
        shell
    };
    let out = folder.path().join("o").display().to_string();
    let (archive, measurement) = (fixture().archive(), fixture().measurement());
    let told = fail(&mut limited(150_000, &format!("sample {out}.zip --size 1000x1000")), 1);
    assert!(told.contains("ulimit -v") && !told.contains("--memory"), "{told}");
    for command in [
        format!("import {} {out}.zarr", archive.display()),
        format!("check {}", measurement.display()),
        format!("verify {}", measurement.display()),
        format!("image {} --out {out}.png", measurement.display()),
        format!("enlarge {} {out}-big.zarr --size 500x500", fixture().model().display()),
    ] {
        // Threads have no arenas of their own, which would reserve more than is there.
        succeed(&mut limited(400_000, &command));
    }
}

/// An exit code, why, and a command that ends with it.
type Ending<'a> = (i32, &'a str, &'a dyn Fn() -> Option<i32>);

/// The table of docs/reference/safety.md, row by row: a command that ends with each code, and no other code is in the
/// table.
#[test]
fn exit_codes_are_those_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let at = |name: &str| text(&folder.path().join(name));
    let [archive, measurement, model] =
        [fixture().archive(), fixture().measurement(), fixture().model()].map(|path| text(&path));
    fs::write(at("mine.png"), "mine").unwrap();
    fs::write(at("damaged.zip"), &fs::read(&archive).unwrap()[..5000]).unwrap();
    std::os::unix::fs::symlink(at("nowhere"), at("link.zarr")).unwrap();
    succeed(btf().args(["tile", &measurement, &at("tile.zarr")]));
    // Stopped at the first signal while it waits for a stage that another process holds.
    let stopped = || {
        let held = fs::File::create(at("tile.zarr/.lock-normals")).unwrap();
        held.lock().unwrap();
        let mut child = btf()
            .args(["normals", &measurement, &at("tile.zarr")])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_for(&mut child, "waiting");
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        child.wait().unwrap().code()
    };
    let code = |arguments: &[&str]| btf().args(arguments).output().unwrap().status.code();
    let cases: &[Ending<'_>] = &[
        (0, "done", &|| code(&["info", &measurement])),
        (0, "found done", &|| code(&["import", &archive, &measurement])),
        (1, "a limit", &|| {
            let large = ["sample", &at("large.zip"), "--size", "1000x1000"].map(str::to_owned);
            limited("ulimit -v 150000", &large).output().unwrap().status.code()
        }),
        (2, "unknown option", &|| code(&["info", &measurement, "--no-such-option"])),
        (2, "no number", &|| code(&["image", &model, "--out", &at("i.png"), "--exposure", "nan"])),
        (2, "little memory", &|| code(&["check", &measurement, "--memory", "1MiB"])),
        (65, "damaged", &|| code(&["import", &at("damaged.zip"), &at("damaged.zarr")])),
        (65, "another recipe", &|| code(&["import", &archive, &measurement, "--white", "0.5"])),
        (65, "a file that exists", &|| code(&["image", &model, "--out", &at("mine.png")])),
        (65, "another kind", &|| code(&["fit", &measurement])),
        (66, "no such path", &|| code(&["info", &at("nothing")])),
        (66, "a link to nowhere", &|| code(&["info", &at("link.zarr")])),
        (66, "a stage not run", &|| code(&["fit", &at("tile.zarr")])),
        (74, "no folder can be there", &|| code(&["image", &model, "--out", &at("mine.png/i.png")])),
        (74, "no room", &|| {
            let image = ["image", &model, "--out", &at("i.png")].map(str::to_owned);
            limited("ulimit -f 0", &image).output().unwrap().status.code()
        }),
        (75, "stopped", &stopped),
    ];
    for (expected, what, run) in cases {
        assert_eq!(run(), Some(*expected), "{what}");
    }
    let page =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/safety.md")).unwrap();
    let (_, table) = page.split_once("## Exit codes").unwrap();
    let rows =
        table.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let told: Vec<i32> =
        rows.filter_map(|row| row.split('|').nth(1).and_then(|cell| cell.trim().parse().ok())).collect();
    let mut tried: Vec<i32> = cases.iter().map(|(code, _, _)| *code).collect();
    tried.dedup();
    assert_eq!(told, tried);
}

#[test]
fn a_stage_that_is_made_anew_leaves_files_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    succeed(&mut model_of(&fixture().measurement(), &model));
    let again = || {
        let mut command = btf();
        command.arg("cluster").args([&fixture().measurement(), &model]).args(["--clusters", "5", "--force"]);
        command
    };
    // Of the stage itself, and of one that builds on it.
    for place in ["centres", "appearance/features/c"] {
        let mine = model.join(place).join("notes.txt");
        fs::write(&mine, b"mine").unwrap();
        let told = fail(&mut again(), 65);
        assert!(told.contains("notes.txt is no part of") && !told.contains("run it again"), "{told}");
        assert_eq!(fs::read(&mine).unwrap(), b"mine");
        fs::remove_file(&mine).unwrap();
    }
    succeed(btf().arg("verify").arg(&model));
    succeed(&mut again());
}

//! Places that cannot be written to, links that lead nowhere, names that are no text, and measurements that moved.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::fixture::{btf, copy, enlarge, fail, fixture, model_of, succeed, tree};

/// Takes every right to write below a folder, or gives it back.
fn writable(folder: &Path, may: bool) {
    let mode = |path: &Path| if path.is_dir() || may { 0o555 } else { 0o444 } | if may { 0o200 } else { 0 };
    let set = |path: &Path| std::fs::set_permissions(path, PermissionsExt::from_mode(mode(path))).unwrap();
    set(folder);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { writable(&path, may) } else { set(&path) }
    }
}

/// The program as a user whom modes concern, which they do not concern the superuser; none where that cannot be.
fn as_user() -> Option<Command> {
    let program = env!("CARGO_BIN_EXE_btf");
    let mut command = Command::new(program);
    if std::fs::metadata("/proc/self").is_ok_and(|data| data.uid() == 0) {
        command = Command::new("setpriv");
        command.args(["--reuid=65534", "--regid=65534", "--clear-groups", program]);
        let mut test = Command::new("setpriv");
        test.args(["--reuid=65534", "--regid=65534", "--clear-groups", program, "--version"]);
        if !test.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success()) {
            println!("skipped: the program cannot be run as another user");
            return None;
        }
    }
    command.stdin(Stdio::null());
    Some(command)
}

#[test]
fn what_is_finished_is_found_done_where_nothing_can_be_written() {
    if as_user().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("read-only");
    for (from, name) in [(fixture().measurement(), "sample.zarr"), (fixture().model(), "sample.model.zarr")] {
        copy(&from, &place.join(name));
    }
    copy(&fixture().enlarged(), &place.join("big.zarr"));
    std::fs::copy(fixture().archive(), place.join("sample.zip")).unwrap();
    let at = |name: &str| place.join(name);
    succeed(btf().arg("image").arg(at("sample.zarr")).arg("--out").arg(at("i.png")));
    succeed(btf().arg("export").args([at("sample.zarr"), at("pyramid.dzi")]));
    std::fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).unwrap();
    writable(&place, false);
    let before = tree(&place);
    let words = |command: &mut Command, text: &str| {
        for word in text.split(' ') {
            if word.contains('.') {
                command.arg(place.join(word))
            } else {
                command.arg(word)
            };
        }
    };
    for done in [
        "import sample.zip sample.zarr",
        "tile sample.zarr sample.model.zarr --tile cut",
        "cluster sample.zarr sample.model.zarr --clusters 24",
        "normals sample.zarr sample.model.zarr",
        "fit sample.model.zarr",
        "appearance sample.model.zarr",
        "model sample.zarr sample.model.zarr --tile cut --clusters 24",
        "enlarge sample.model.zarr big.zarr --method paper --size 530x700 --keep-normals",
        "image sample.zarr --out i.png",
        "export sample.zarr pyramid.dzi",
        "info sample.zarr",
        "info big.zarr",
        "check sample.zarr",
        "verify sample.zarr",
        "verify sample.model.zarr",
        "verify big.zarr",
        "verify pyramid.dzi",
        "compare sample.model.zarr sample.zarr",
    ] {
        let mut command = as_user().unwrap();
        words(&mut command, done);
        succeed(&mut command);
    }
    // What is left to do fails where it writes.
    let mut command = as_user().unwrap();
    words(&mut command, "import sample.zip other.zarr");
    let told = fail(&mut command, 74);
    assert!(told.contains("other.zarr"), "{told}");
    writable(&place, true);
    assert!(tree(&place) == before, "something was written");
}

#[test]
fn links_that_lead_nowhere_and_what_is_no_file_are_missing_input() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    symlink("nothing.zarr", at("dangling.zarr")).unwrap();
    symlink("b.zarr", at("a.zarr")).unwrap();
    symlink("a.zarr", at("b.zarr")).unwrap();
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    symlink("pipe", at("to-pipe.zarr")).unwrap();
    symlink("/dev/null", at("device.zarr")).unwrap();
    symlink("nothing.dzi", at("dangling.dzi")).unwrap();
    symlink("loop.dzi", at("loop.dzi")).unwrap();
    for (name, what) in [
        ("dangling.zarr", "link to nothing.zarr, where nothing is"),
        ("dangling.zarr/", "link to nothing.zarr, where nothing is"),
        ("a.zarr", "leads back to itself"),
        ("a.zarr/within", "symbolic links"),
        ("dangling.dzi", "where nothing is"),
        ("loop.dzi", "leads back to itself"),
        ("pipe", "a pipe"),
        ("to-pipe.zarr", "a pipe"),
        ("device.zarr", "a device"),
    ] {
        for command in ["verify", "info"] {
            let told = fail(btf().arg(command).arg(at(name)), 66);
            assert!(
                told.contains(what) || command == "info" && name.ends_with("dzi"),
                "{command} {name}: {told}"
            );
        }
    }
    for command in ["import", "check"] {
        let told = fail(btf().arg(command).arg(at("dangling.zarr")), 66);
        assert!(told.contains("dangling.zarr"), "{told}");
    }
    fail(btf().arg("enlarge").arg(at("a.zarr")).arg(at("o.zarr")).args(["--size", "64x64"]), 66);
    fail(btf().arg("image").arg(at("dangling.zarr")).arg("--out").arg(at("o.png")), 66);
    // A link to a store is as good as the store.
    symlink(fixture().measurement(), at("good.zarr")).unwrap();
    succeed(btf().arg("verify").arg(at("good.zarr")));
}

#[test]
fn names_that_are_no_text_are_used_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &[u8]| folder.path().join(OsStr::from_bytes(name));
    for name in [&b"a\xff.zip"[..], b"a\xfe.zip"] {
        std::fs::copy(fixture().archive(), at(name)).unwrap();
    }
    succeed(btf().arg("import").args([at(b"a\xff.zip"), at(b"a\xfe.zip")]).arg("--into").arg(at(b"out\xfd")));
    let [first, second] = [&b"out\xfd/a\xff.zarr"[..], b"out\xfd/a\xfe.zarr"].map(&at);
    assert!(first.is_dir() && second.is_dir());
    // Two that become one are still refused.
    std::fs::create_dir(at(b"other")).unwrap();
    std::fs::copy(fixture().archive(), at(b"other/a\xff.zip")).unwrap();
    let told = fail(
        btf()
            .arg("import")
            .args([at(b"a\xff.zip"), at(b"other/a\xff.zip")])
            .arg("--into")
            .arg(at(b"out\xfd")),
        2,
    );
    assert!(told.contains("two archives would both become"), "{told}");
    let model = at(b"m\xff.model.zarr");
    succeed(&mut model_of(&first, &model));
    succeed(&mut enlarge(&model, &at(b"e\xff.zarr")));
    for (command, stores) in
        [("info", [&first, &model]), ("verify", [&first, &model]), ("check", [&first, &second])]
    {
        succeed(btf().arg(command).args(stores).arg("--json"));
    }
    succeed(btf().arg("compare").args([&model, &first]));
    succeed(
        btf()
            .arg("image")
            .arg(at(b"e\xff.zarr"))
            .arg("--model")
            .arg(&model)
            .arg("--out")
            .arg(at(b"i\xff.png")),
    );
    succeed(btf().arg("export").arg(&first).arg(at(b"x\xff.npy")));
    assert!(at(b"x\xff.views.npy").is_file());
    let told = fail(btf().arg("export").arg(&first).arg(at(b"p\xff.dzi")), 2);
    assert!(told.contains("UTF-8"), "{told}");
    succeed(btf().arg("fit").arg(&model).arg("--report").arg(at(b"r\xff")));
    assert!(at(b"r\xff.txt").is_file() && at(b"r\xff.png").is_file());
    // Plans name paths too.
    succeed(btf().arg("import").args([at(b"a\xff.zip"), at(b"n\xff.zarr")]).arg("--dry-run"));
    for stage in ["tile", "cluster", "normals"] {
        succeed(btf().arg(stage).args([&first, &model]).arg("--dry-run").arg("--force"));
    }
    succeed(btf().arg("enlarge").args([&model, &at(b"o\xff.zarr")]).args(["--size", "64x64", "--dry-run"]));
}

#[test]
fn measured_values_are_found_beside_the_model_where_they_lay_and_in_the_current_folder() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let picture = |model: &Path, within: Option<&Path>, out: &str| {
        let mut command = btf();
        command.arg("image").arg(model).args(["--values", "measured", "--out"]).arg(at(out));
        if let Some(folder) = within {
            command.current_dir(folder);
        }
        command
    };
    copy(&fixture().measurement(), &at("data/wood.zarr"));
    let model = at("models/other-name.model.zarr");
    succeed(&mut model_of(&at("data/wood.zarr"), &model));
    succeed(&mut picture(&model, None, "noted.png"));
    // Both moved together.
    let moved = at("moved");
    std::fs::create_dir(&moved).unwrap();
    for name in ["data", "models"] {
        std::fs::rename(at(name), moved.join(name)).unwrap();
    }
    let model = moved.join("models/other-name.model.zarr");
    succeed(&mut picture(&model, None, "moved.png"));
    // In the current folder, under the name that it has by default.
    std::fs::create_dir(at("here")).unwrap();
    std::fs::rename(moved.join("data/wood.zarr"), at("here/other-name.zarr")).unwrap();
    succeed(&mut picture(&model, Some(&at("here")), "current.png"));
    let told = fail(&mut picture(&model, None, "none.png"), 66);
    assert!(told.contains("looked for") && told.contains("--measurement"), "{told}");
    let pictures = ["noted.png", "moved.png", "current.png"].map(|name| std::fs::read(at(name)).unwrap());
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
}

#[test]
fn of_a_measurement_that_changed_it_is_said_which_and_what_to_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (measurement, model): (PathBuf, PathBuf) = (at("wood.zarr"), at("wood.model.zarr"));
    succeed(btf().arg("import").args([&fixture().archive(), &measurement]));
    succeed(&mut model_of(&measurement, &model));
    succeed(btf().arg("import").args([&fixture().archive(), &measurement]).args(["--transpose", "--force"]));
    let mut image = btf();
    image.arg("image").arg(&model).args(["--values", "measured", "--out"]).arg(at("i.png"));
    let mut again = model_of(&measurement, &model);
    let mut cluster = btf();
    cluster.arg("cluster").args([&measurement, &model]);
    let mut compare = btf();
    compare.arg("compare").args([&model, &measurement]);
    for command in [&mut image, &mut again, &mut cluster, &mut compare] {
        let told = fail(command, 65);
        let line = format!("{} is not what {} was made of", measurement.display(), model.display());
        assert!(told.contains(&line) && told.contains("imported anew since"), "{told}");
    }
    succeed(model_of(&measurement, &model).arg("--force"));
    succeed(&mut image);
}

#[test]
fn urls_of_files_are_paths_and_nothing_is_made_for_those_of_other_places() {
    let folder = tempfile::tempdir().unwrap();
    let url = |path: &Path| format!("file://{}", path.display().to_string().replace('%', "%25"));
    let made = folder.path().join("a b.zarr");
    let named = url(&made).replace(' ', "%20");
    succeed(btf().arg("import").args([url(&fixture().archive()), named.clone()]));
    assert!(tree(&made) == tree(&fixture().measurement()));
    assert!(succeed(btf().args(["status", &named])).contains("9 of 9 views"));
    for words in [
        &["import", "{archive}", "s3://bucket/a.zarr"][..],
        &["info", "https://example.org/a.zarr"],
        &["model", "s3://bucket/a.zarr", "a.model.zarr"],
        &["slurm", "{archive}", "--into=gs://bucket"],
    ] {
        let mut command = btf();
        command.current_dir(folder.path());
        words.iter().for_each(|word| match *word {
            "{archive}" => drop(command.arg(fixture().archive())),
            word => drop(command.arg(word)),
        });
        assert!(fail(&mut command, 2).contains("got a URL, expected a file or a folder"), "{words:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

//! Two processes that make the same output at the same time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;

use crate::fixture::{btf, fixture, succeed, tree};

/// Starts two commands at once; their exit codes and what they said.
fn both(commands: [&mut Command; 2]) -> [(Option<i32>, String); 2] {
    let started = commands.map(|command| {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    });
    started.map(|child| {
        let output = child.wait_with_output().unwrap();
        let told = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        (output.status.code(), told.concat())
    })
}

/// What lies in a folder, however it got there; no temporary name among it.
fn made(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = tree(folder);
    assert!(files.keys().all(|name| !name.to_string_lossy().contains(".tmp-")), "{:?}", files.keys());
    files
}

/// The arguments that make a variant of an output.
type Arguments = fn(usize) -> Vec<String>;

/// Outputs and the arguments that make them; `variant` 0 and 1 make different ones.
fn outputs() -> Vec<(&'static str, Arguments)> {
    fn words(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }
    fn measurement() -> String {
        fixture().measurement().display().to_string()
    }
    let mut list: Vec<(&'static str, Arguments)> = vec![
        ("s.zip", |variant| words(&format!("sample OUT --size 16x16 --views 2 --lights 3 --seed {variant}"))),
        ("e.zip", |variant| words(&format!("export {} OUT --quality {}", measurement(), 90 + variant))),
        ("e.btf", |variant| words(&format!("export {} OUT --rank {}", measurement(), 1 + variant))),
        ("e", |variant| words(&format!("export {} OUT --to {}", measurement(), ["png", "exr"][variant]))),
        ("i.png", |variant| words(&format!("image {} --out OUT --light {},0", measurement(), 15 + variant))),
        ("i.exr", |variant| words(&format!("image {} --out OUT --light {},0", measurement(), 15 + variant))),
    ];
    if cfg!(feature = "hdf5") {
        list.push(("e.h5", |_| words(&format!("export {} OUT", measurement()))));
    }
    list.push(("e.npy", |_| words(&format!("export {} OUT", measurement()))));
    list
}

fn command(arguments: &[String], output: &Path) -> Command {
    let mut command = btf();
    for argument in arguments {
        match argument.as_str() {
            "OUT" => command.arg(output),
            argument => command.arg(argument),
        };
    }
    command
}

/// What each variant makes alone.
fn alone(name: &str, arguments: Arguments, variant: usize) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    succeed(&mut command(&arguments(variant), &folder.path().join(name)));
    made(folder.path())
}

#[test]
fn of_two_that_make_the_same_one_writes_it_and_the_other_finds_it_done() {
    for (name, arguments) in outputs() {
        let expected = alone(name, arguments, 0);
        for force in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let output = folder.path().join(name);
            let [mut a, mut b] = [(); 2].map(|()| command(&arguments(0), &output));
            if force {
                a.arg("--force");
                b.arg("--force");
            }
            for (code, told) in both([&mut a, &mut b]) {
                assert_eq!(code, Some(0), "{name}: {told}");
            }
            assert!(made(folder.path()) == expected, "{name}, force {force}: another content");
        }
    }
}

#[test]
fn of_two_that_make_different_ones_the_second_is_told_and_nothing_is_mixed() {
    for (name, arguments) in outputs() {
        if arguments(0) == arguments(1) {
            continue;
        }
        let expected = [0, 1].map(|variant| alone(name, arguments, variant));
        for force in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let output = folder.path().join(name);
            let [mut a, mut b] = [0, 1].map(|variant| command(&arguments(variant), &output));
            if force {
                a.arg("--force");
                b.arg("--force");
            }
            let ended = both([&mut a, &mut b]);
            let found = made(folder.path());
            assert!(expected.contains(&found), "{name}, force {force}: mixed");
            for (variant, (code, told)) in ended.iter().enumerate() {
                // A folder that holds other files is never replaced.
                if found == expected[variant] || force && name != "e" {
                    assert_eq!(*code, Some(0), "{name}: {told}");
                } else {
                    assert_eq!(*code, Some(65), "{name}: {told}");
                    assert!(
                        told.contains("exists and holds something else")
                            || told.contains("meanwhile")
                            || told.contains("holds other files"),
                        "{told}"
                    );
                }
            }
        }
    }
}

#[test]
fn no_name_is_taken_before_all_are_known_to_be_free() {
    let folder = tempfile::tempdir().unwrap();
    let measurement = fixture().measurement();
    for taken in ["e.npy", "e.views.npy", "e.lights.npy", "e.channels.txt"] {
        for (force, file) in [(false, false), (false, true), (true, false)] {
            let at = folder.path().join(format!("{taken}-{force}-{file}"));
            let name = at.join(taken);
            std::fs::create_dir(&at).unwrap();
            if file {
                std::fs::write(&name, "x").unwrap();
            } else {
                std::fs::create_dir(&name).unwrap();
            }
            let mut export = btf();
            export.arg("export").arg(&measurement).arg(at.join("e.npy"));
            if force {
                export.arg("--force");
            }
            let told = crate::fixture::fail(&mut export, 65);
            assert!(told.contains(taken), "{told}");
            let names: Vec<_> =
                std::fs::read_dir(&at).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            assert_eq!(names, [taken], "{told}");
        }
    }
    // The report of a field is two files.
    let model = fixture().model();
    let copied = folder.path().join("m.model.zarr");
    crate::fixture::copy(&model, &copied);
    std::fs::create_dir(folder.path().join("r.png")).unwrap();
    let told =
        crate::fixture::fail(btf().arg("fit").arg(&copied).arg("--report").arg(folder.path().join("r")), 65);
    assert!(told.contains("r.png") && !folder.path().join("r.txt").exists(), "{told}");
}

/// An array and what lies beside it are of one measurement, whoever comes last.
#[test]
fn of_two_arrays_that_replace_each_other_nothing_is_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let stores = ["2", "3"].map(|views| {
        let (archive, store) = (at(&format!("{views}.zip")), at(&format!("{views}.zarr")));
        let sizes = ["--size", "8x8", "--views", views, "--lights", views];
        crate::fixture::succeed(btf().arg("sample").arg(&archive).args(sizes));
        crate::fixture::succeed(btf().arg("import").args([&archive, &store]));
        store
    });
    let export = |store: &Path, name: &str| {
        let mut command = btf();
        command.arg("export").arg(store).arg(at(name).join("e.npy")).arg("--force");
        command
    };
    let alone = stores.iter().zip(["alone-2", "alone-3"]).map(|(store, name)| {
        crate::fixture::succeed(&mut export(store, name));
        made(&at(name))
    });
    let alone: Vec<_> = alone.collect();
    for _ in 0..12 {
        let [(first, _), (second, _)] =
            both([&mut export(&stores[0], "both"), &mut export(&stores[1], "both")]);
        assert_eq!((first, second), (Some(0), Some(0)));
        assert!(alone.contains(&made(&at("both"))), "a mixture of two measurements");
    }
}

#[test]
fn a_store_that_is_made_anew_while_it_is_read_is_refused_and_never_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store] = ["a.zip", "a.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "24x24", "--views", "7", "--lights", "7"]));
    for codec in ["stock", "predictive"] {
        let import = |options: &[&str]| {
            let mut command = btf();
            succeed(
                command
                    .arg("import")
                    .args([&archive, &store])
                    .args(["--codec", codec, "--force"])
                    .args(options),
            )
        };
        import(&[]);
        let opened = Measurement::open(&store).unwrap();
        let window = opened.description().size.window();
        let before = opened.read_reflectance(1, window).unwrap();
        // By the same recipe it is the same: the metadata may be written anew.
        import(&[]);
        assert_eq!(opened.read_reflectance(1, window).unwrap(), before);
        import(&["--turn", "90"]);
        for result in
            [opened.read_reflectance(1, window).map(|_| ()), opened.read_luminance(1, window).map(|_| ())]
        {
            let error = result.unwrap_err();
            assert!(error.to_string().contains("was made anew while it was read"), "{codec}: {error}");
        }
        assert!(Measurement::open(&store).unwrap().read_reflectance(1, window).is_ok());
    }
}

/// Whoever reads a model reads all of it, or is told; and what is made anew of it that he does not read is his gain.
#[test]
fn a_model_that_is_made_anew_while_it_is_read_is_refused_and_never_mixed() {
    type Read = fn(&Model) -> btfkit::error::Result<()>;
    let readers: [(&str, Read); 8] = [
        ("tile", |model| model.tile().map(drop)),
        ("triangles", |model| model.triangles().map(drop)),
        ("index", |model| model.index().map(drop)),
        ("representatives", |model| model.representatives().map(drop)),
        ("clusters", |model| model.read_clusters().map(drop)),
        ("normals", |model| model.normals().map(drop)),
        ("surface", |model| model.surface().map(drop)),
        ("appearance", |model| model.appearance().map(drop)),
    ];
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("m.model.zarr");
    let make = |options: &[&str]| {
        succeed(
            crate::fixture::model_of(&fixture().measurement(), &store)
                .args(["--levels", "1", "--force"])
                .args(options),
        )
    };
    make(&[]);
    let opened: Vec<(&str, Read, Model)> =
        readers.into_iter().map(|(name, read)| (name, read, Model::open(&store).unwrap())).collect();
    opened
        .iter()
        .for_each(|(name, read, model)| read(model).unwrap_or_else(|error| panic!("{name}: {error}")));
    // By the same recipe it is the same.
    make(&[]);
    opened.iter().for_each(|(_, read, model)| read(model).unwrap());
    // Other clusters are none of the business of who reads normals.
    make(&["--passes", "1"]);
    let of_clusters = ["index", "representatives", "clusters", "appearance"];
    let refused = |read: &Read, model: &Model, name: &str| {
        let error = read(model).expect_err(name);
        assert!(error.to_string().contains("was made anew while it was read"), "{name}: {error}");
    };
    for (name, read, model) in &opened {
        match of_clusters.contains(name) {
            true => refused(read, model, name),
            false => read(model).unwrap(),
        }
    }
    // Of another tile everything is another; also for who has opened it and read nothing yet.
    let fresh = Model::open(&store).unwrap();
    make(&["--seed", "2"]);
    for (name, read, model) in &opened {
        refused(read, model, name);
        refused(read, &fresh, name);
        read(&Model::open(&store).unwrap()).unwrap();
    }
}

#[test]
fn pictures_that_change_after_they_were_checked_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store, pictures] = ["a.zip", "a.zarr", "pictures"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "24x24", "--views", "7", "--lights", "7"]));
    succeed(btf().arg("import").args([&archive, &store]));
    succeed(btf().arg("export").args([&store, &pictures]).args(["--to", "png"]));
    let source =
        btfkit::archive::open(std::slice::from_ref(&pictures), &btfkit::archive::Options::default()).unwrap();
    let stop = std::sync::atomic::AtomicBool::new(false);
    let silent = btfkit::run::progress::Silent;
    let context = btfkit::run::Context::new(&silent, &stop, 1, 1 << 28).unwrap();
    source.check(&context).unwrap();
    let before = source.read_images(0, 0..2).unwrap();
    let mut names: Vec<_> =
        std::fs::read_dir(pictures.join("tv0_pv0")).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    // Another picture of the same size in place of each.
    let other = std::fs::read(&names[names.len() - 1]).unwrap();
    let first = std::fs::read(&names[0]).unwrap();
    std::fs::write(&names[0], &other).unwrap();
    let error = (0..7).find_map(|view| source.read_images(view, 0..7).err()).unwrap();
    assert!(error.to_string().contains("was changed after it had been checked"), "{error}");
    assert!(source.check(&context).is_err());
    std::fs::write(&names[0], &first).unwrap();
    assert_eq!(source.read_images(0, 0..2).unwrap(), before);
}

#[test]
fn a_container_that_is_written_to_or_replaced_while_it_is_read_is_refused() {
    use std::os::unix::fs::FileExt;
    let folder = tempfile::tempdir().unwrap();
    for (name, to) in [("m.npy", "npy"), ("m.btf", "dfmf")] {
        let path = folder.path().join(name);
        let source = || {
            let paths = std::slice::from_ref(&path);
            let options = btfkit::archive::Options::default();
            btfkit::archive::open(paths, &options).unwrap()
        };
        let made = || {
            let mut command = btf();
            succeed(
                command.arg("export").args([&fixture().measurement(), &path]).args(["--to", to, "--force"]),
            );
        };
        let written = || {
            let file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
            let last = file.metadata().unwrap().len() - 1;
            file.write_all_at(b"x", last).unwrap();
        };
        let replaced = || {
            let beside = folder.path().join("beside");
            std::fs::copy(&path, &beside).unwrap();
            std::fs::rename(&beside, &path).unwrap();
        };
        for change in [&written as &dyn Fn(), &replaced] {
            made();
            let archive = source();
            archive.read_images(0, 0..1).unwrap();
            change();
            let error = archive.read_images(1, 0..1).unwrap_err();
            assert!(error.to_string().contains("changed while it was read"), "{name}: {error}");
        }
    }
}

//! No advice leads to a dead end: the commands that an error or a note advises are accepted, and after them the one
//! that was refused is too.

use std::path::Path;
use std::process::Command;

use crate::fixture::{btf, copy, fixture, succeed};

/// The commands that are advised in a line, without `btf`.
fn commands(line: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for after in line.split("btf ").skip(1) {
        let mut words = Vec::new();
        for word in after.split_whitespace() {
            if ["shows", "makes", "says", "lists", "with"].contains(&word) {
                break;
            }
            let bare = word.trim_end_matches([',', ';', ')']);
            words.push(bare.trim_matches('\'').to_owned());
            if bare != word {
                break;
            }
        }
        found.push(words);
    }
    found
}

/// The lines that say what to do: below an error, or behind a note.
fn advice(told: &str) -> String {
    let lines = told.lines().filter_map(|line| {
        line.strip_prefix("  ")
            .filter(|line| !line.starts_with(' '))
            .or_else(|| line.split_once("to make it: ").map(|(_, commands)| commands))
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn output(command: &mut Command) -> (bool, String) {
    let output = command.output().unwrap();
    let text =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (output.status.success(), text)
}

/// Runs the commands that are advised, with names in the place of words for them, and tells how many there were.
fn follow(folder: &Path, told: &str) -> usize {
    let all: Vec<Vec<String>> = advice(told).lines().flat_map(commands).collect();
    for (number, words) in all.iter().enumerate() {
        let named = |word: &String| match word.as_str() {
            "MEASUREMENT" => fixture().measurement().display().to_string(),
            word if word.starts_with("NAME.") => word.replace("NAME", &format!("made-{number}")),
            word => word.to_owned(),
        };
        let mut command = btf();
        command.current_dir(folder).args(words.iter().map(named));
        if words.first().is_some_and(|name| ["model", "cluster"].contains(&name.as_str())) {
            command.args(["--clusters", "16"]);
        }
        let (is_done, said) = output(&mut command);
        assert!(is_done, "advised by {told}: {command:?}: {said}");
    }
    all.len()
}

/// A model with only some of its stages, made of a measurement that lies beside it; of none it was only begun.
fn partial(folder: &Path, stages: &[&str]) {
    copy(&fixture().measurement(), &folder.join("m.zarr"));
    if stages.is_empty() {
        partial(folder, &["tile"]);
        let root = folder.join("m.model.zarr/zarr.json");
        let mut document: serde_json::Value = serde_json::from_slice(&std::fs::read(&root).unwrap()).unwrap();
        let ours = document["attributes"]["btfkit"].as_object_mut().unwrap();
        ours["stages"] = serde_json::json!({});
        ours["seal"] = btfkit::zarr::metadata::seal(ours).into();
        std::fs::write(&root, document.to_string()).unwrap();
    }
    for stage in stages {
        let mut command = btf();
        command.current_dir(folder).arg(stage);
        if ["tile", "cluster", "normals"].contains(stage) {
            command.arg("m.zarr");
        }
        succeed(command.arg("m.model.zarr").args((*stage == "cluster").then_some("--clusters=16")));
    }
}

#[test]
fn what_is_advised_of_a_model_that_lacks_stages_is_accepted_and_then_the_command_itself() {
    for stages in [&[][..], &["tile"], &["tile", "cluster"], &["tile", "cluster", "normals", "fit"]] {
        for line in [
            "view m.model.zarr --export v.html",
            "render m.model.zarr --size 16x16 --out r.png",
            "render m.model.zarr --plane --size 16x16 --out r.png",
            "enlarge m.model.zarr e.zarr --size 96x96",
            "enlarge m.model.zarr e.zarr --size 96x96 --method paper",
            "appearance m.model.zarr",
            "fit m.model.zarr",
            "image m.model.zarr --what normals --out n.png",
            "image m.model.zarr --values components --out c.png",
            "pack m.model.zarr p.btfc --quality 1:10",
        ] {
            let folder = tempfile::tempdir().unwrap();
            partial(folder.path(), stages);
            let run = || output(btf().current_dir(folder.path()).args(line.split(' ')).arg("--force"));
            // One piece of advice may lead to the next, but not for ever.
            for _ in 0..3 {
                let (is_done, told) = run();
                if is_done && advice(&told).is_empty() {
                    break;
                }
                assert!(follow(folder.path(), &told) > 0, "{stages:?} {line}: {told}");
            }
            let (is_done, told) = run();
            assert!(is_done, "{stages:?} {line}: {told}");
        }
    }
}

#[test]
fn a_model_that_was_unpacked_is_told_apart_from_one_that_is_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let run = |line: &str| output(btf().current_dir(folder.path()).args(line.split(' ')));
    copy(&fixture().measurement(), &folder.path().join("m.zarr"));
    for line in [
        "tile m.zarr m.model.zarr --tile 32x32",
        "components m.zarr m.model.zarr --components 8",
        "pack m.model.zarr p.btfc --quality 1:20 --licence CC-BY-4.0 --texel-mm 0.25",
        "unpack p.btfc u.model.zarr",
    ] {
        let (is_done, told) = run(line);
        assert!(is_done, "{line}: {told}");
    }
    for line in [
        "enlarge u.model.zarr e.zarr --size 96x96",
        "appearance u.model.zarr",
        "fit u.model.zarr",
        "cluster m.zarr u.model.zarr",
        "normals m.zarr u.model.zarr",
        "curve m.zarr u.model.zarr",
    ] {
        let (is_done, told) = run(line);
        assert!(!is_done && told.contains("btf unpack made this model"), "{line}: {told}");
        assert!(!advice(&told).contains("btf cluster"), "{line}: {told}");
        assert!(follow(folder.path(), &told) > 0, "{line}: {told}");
        std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).for_each(|path| {
            if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("made-")) {
                drop(std::fs::remove_dir_all(&path).or_else(|_| std::fs::remove_file(&path)));
            }
        });
    }
    // What the file said of itself goes with it, into the next file too.
    let (_, told) = run("info u.model.zarr");
    assert!(told.contains("CC-BY-4.0") && told.contains("0.25"), "{told}");
    assert!(run("pack u.model.zarr q.btfc --quality 1:30 --texel-mm 0.5").0);
    let (_, told) = run("info q.btfc");
    assert!(told.contains("CC-BY-4.0") && told.contains("0.5") && !told.contains("0.25"), "{told}");
}

#[test]
fn clusters_that_are_made_anew_say_what_went_with_them_and_models_that_go_on_do_not() {
    let folder = tempfile::tempdir().unwrap();
    partial(folder.path(), &["tile", "cluster", "normals", "fit", "appearance"]);
    let run = |line: &str| output(btf().current_dir(folder.path()).args(line.split(' ')));
    assert!(run("enlarge m.model.zarr e.zarr --size 96x96").0);
    let (is_done, told) = run("cluster m.zarr m.model.zarr --clusters 12 --force");
    assert!(is_done && told.contains("to make it again: btf appearance m.model.zarr"), "{told}");
    // The enlargement is of the model as it was: what is advised makes it anew.
    for line in
        ["image e.zarr --out i.png", "render e.zarr --size 16x16 --out r.png", "view e.zarr --export v.html"]
    {
        let (is_done, told) = run(line);
        assert!(!is_done && told.contains("before it was changed"), "{line}: {told}");
    }
    let (_, told) = run("image e.zarr --out i.png");
    assert!(follow(folder.path(), &told) == 2, "{told}");
    assert!(run("image e.zarr --out i.png").0);
    let (is_done, told) = run("model m.zarr m.model.zarr --clusters 10 --force");
    assert!(is_done && !told.contains("to make it again"), "{told}");
    let (_, told) = run("image e.zarr --out j.png");
    assert!(follow(folder.path(), &told) == 1, "{told}");
    assert!(run("image e.zarr --out j.png").0);
}

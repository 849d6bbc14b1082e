//! Commands over many inputs: a line each, failures told and passed over, a count at the end.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::fixture::{btf, copy, fail, fixture, succeed};

/// Runs a command; returns its exit code and the lines of both streams.
fn run(command: &mut Command) -> (Option<i32>, Vec<String>, Vec<String>) {
    let Output { status, stdout, stderr } = command.output().unwrap();
    let lines = |bytes: &[u8]| String::from_utf8_lossy(bytes).lines().map(str::to_owned).collect::<Vec<_>>();
    let told = lines(&stderr);
    assert!(!told.iter().any(|line| line.contains("panicked")), "{told:?}");
    (status.code(), lines(&stdout), told)
}

/// A file that is no archive and no store.
fn bad(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, "nothing that anybody knows").unwrap();
    path
}

#[test]
fn each_input_has_a_line_and_a_failure_does_not_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let bad = bad(folder.path(), "bad.zip");
    let other = folder.path().join("other.zarr");
    copy(&fixture().measurement(), &other);
    let good = fixture().measurement();
    for command in ["info", "check", "verify"] {
        let (code, told, failures) = run(btf().arg(command).args([&good, &bad, &other]));
        // A file that is no archive is bad input; where a store is expected, there is none.
        assert!(
            code == Some(65) || command == "verify" && matches!(code, Some(65 | 66)),
            "{command} {code:?}"
        );
        let begins = |line: &str, path: &Path| line.starts_with(&format!("{}: ", path.display()));
        assert!(begins(&told[0], &good) && begins(&told[1], &other), "{command}: {told:?}");
        assert_eq!(told[2..], [format!("2 done, 1 failed: {}", bad.display())], "{command}");
        let own: Vec<_> = failures.iter().filter(|line| line.starts_with("btf: ")).collect();
        assert!(own.len() == 1 && own[0].contains("bad.zip"), "{command}: {failures:?}");
        let (code, told, failures) = run(btf().arg(command).args([&good, &other]));
        assert_eq!(
            (code, told.len(), told[2].as_str(), failures.len()),
            (Some(0), 3, "2 done", 0),
            "{command}"
        );
        // Nothing but failures.
        let (code, told, failures) = run(btf().args([command, "--quiet"]).args([&good, &bad]));
        assert!(
            code != Some(0) && told.is_empty() && failures[0].contains("bad.zip"),
            "{command}: {failures:?}"
        );
    }
}

#[test]
fn the_exit_code_is_that_of_the_worst_failure_wherever_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let incomplete = folder.path().join("incomplete.zarr");
    copy(&fixture().measurement(), &incomplete);
    std::fs::remove_dir_all(incomplete.join("reflectance/c/3")).unwrap();
    fail(btf().arg("verify").arg(&incomplete), 66);
    let damaged = folder.path().join("damaged.zarr");
    copy(&fixture().measurement(), &damaged);
    let shard = crate::fixture::tree_names(&damaged.join("reflectance/c/2")).remove(0);
    let mut bytes = std::fs::read(&shard).unwrap();
    bytes[40..80].fill(0x5A);
    std::fs::write(&shard, bytes).unwrap();
    fail(btf().arg("verify").arg(&damaged), 65);
    for paths in [[&incomplete, &damaged], [&damaged, &incomplete]] {
        let (code, told, _) = run(btf().arg("verify").args(paths).arg(fixture().measurement()));
        assert_eq!(code, Some(65));
        assert!(told.last().unwrap().starts_with("1 done, 2 failed: "), "{told:?}");
    }
}

#[test]
fn json_of_many_is_a_line_each_and_the_count_stands_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let bad = bad(folder.path(), "bad.zarr");
    for command in ["check", "verify"] {
        let (code, told, failures) =
            run(btf().args([command, "--json"]).arg(fixture().measurement()).arg(&bad));
        assert_ne!(code, Some(0));
        let lines: Vec<serde_json::Value> =
            told.iter().map(|line| serde_json::from_str(line).expect(line)).collect();
        assert_eq!(lines.len(), 2, "{told:?}");
        assert_eq!(lines[0]["path"], fixture().measurement().display().to_string());
        assert!(lines[0].get("error").is_none() && lines[1]["error"].is_string(), "{told:?}");
        assert!(failures.last().unwrap().contains("1 done, 1 failed"), "{failures:?}");
    }
}

#[test]
fn what_belongs_to_one_input_is_refused_for_many() {
    let good = fixture().measurement();
    let told = fail(btf().arg("verify").args([&good, &good]).arg("--source").arg(fixture().archive()), 2);
    assert!(told.contains("--source for 2 stores"), "{told}");
    let told = fail(btf().arg("check").args([&good, &good]).args(["--picture", "sheet.png"]), 2);
    assert!(told.contains("--picture for 2 inputs"), "{told}");
}

#[test]
fn models_and_enlargements_of_many_go_into_a_folder_and_are_those_of_one() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first.zarr", "second.zarr"].map(|name| folder.path().join(name));
    for store in [&first, &second] {
        copy(&fixture().measurement(), store);
    }
    let none = folder.path().join("none.zarr");
    let [models, planes] = ["models", "planes"].map(|name| folder.path().join(name));
    let options = ["--tile", "cut", "--clusters", "24"];
    let (code, told, failures) =
        run(btf().arg("model").args([&first, &none, &second]).args(options).arg("--into").arg(&models));
    assert_eq!(code, Some(66), "{failures:?}");
    assert_eq!(told.len(), 3, "{told:?}");
    assert!(told[0].ends_with("first.model.zarr: 24 clusters"), "{told:?}");
    assert_eq!(told[2], format!("2 done, 1 failed: {}", none.display()));
    let made = ["first", "second"].map(|name| models.join(format!("{name}.model.zarr")));
    for model in &made {
        assert!(std::fs::read(model.join("index/c/0/0")).is_ok() || model.join("index").exists());
        crate::fixture::assert_same(&model.join("index"), &fixture().model().join("index"));
    }
    let size = ["--size", "64x48"];
    let (code, told, _) = run(btf().arg("enlarge").args(&made).args(size).arg("--into").arg(&planes));
    assert_eq!((code, told.len(), told[2].as_str()), (Some(0), 3, "2 done"), "{told:?}");
    let alone = folder.path().join("alone.zarr");
    succeed(btf().arg("enlarge").args([&made[0], &alone]).args(size));
    for name in ["first", "second"] {
        let plane = planes.join(format!("{name}.enlarged.zarr"));
        crate::fixture::assert_same(&plane.join("index"), &alone.join("index"));
    }
}

#[test]
fn of_two_names_the_second_is_the_output_unless_it_is_an_input() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("one.model.zarr");
    copy(&fixture().model(), &model);
    // A model of that name is meant, though it is not there: nothing is made under it.
    let missing = folder.path().join("two.model.zarr");
    let told = fail(btf().arg("enlarge").args([&model, &missing]).args(["--size", "16x16"]), 66);
    assert!(told.contains("two.model.zarr: no such model") && told.contains("named last"), "{told}");
    assert!(!folder.path().join("one.enlarged.zarr").exists() && !missing.exists());
    // The same name twice.
    let told = fail(btf().arg("enlarge").args([&model, &model]).args(["--size", "16x16"]), 2);
    assert!(told.contains("two inputs would both become"), "{told}");
}

//! Work shared between jobs: which part a scheduler gives, how much of a store is there, and which parts are left.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::fixture::{assert_same, btf, fail, fixture, succeed};

fn import(store: &Path, shard: &str) -> Command {
    let mut command = btf();
    command.arg("import").args([fixture().archive().as_path(), store]).args(["--shard", shard]);
    command
}

fn missing(store: &Path, shards: &str, format: &str) -> String {
    succeed(btf().arg("missing").arg(store).args(["--shards", shards, "--format", format]))
}

#[test]
fn what_is_missing_is_told_and_running_just_that_completes_a_store() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("s.zarr");
    for shard in ["1/4", "3/4"] {
        succeed(&mut import(&store, shard));
    }
    let told = fail(btf().arg("status").arg(&store), 66);
    assert!(told.contains("measurement, 4 of 9 views"), "{told}");
    assert_eq!(missing(&store, "4", "array"), "0,2\n");
    assert_eq!(missing(&store, "4", "lines"), "0\n2\n");
    assert_eq!(missing(&store, "9", "array"), "0,2,4,6,8\n");
    // A view without its lightness codes is as good as missing.
    std::fs::remove_file(store.join("luminance/c/3/0/0/0")).unwrap();
    assert_eq!(missing(&store, "4", "array"), "0,2-3\n");
    for part in missing(&store, "4", "lines").lines() {
        succeed(&mut import(&store, &format!("{part}/4")));
    }
    assert!(succeed(btf().arg("status").arg(&store)).contains("9 of 9 views"));
    assert_eq!(missing(&store, "4", "array"), "");
    assert_same(&store, &fixture().measurement());
}

#[test]
fn a_store_with_all_parts_that_was_not_declared_finished_has_one_part_left() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("s.zarr");
    succeed(&mut import(&store, "0/2"));
    let begun = std::fs::read(store.join("zarr.json")).unwrap();
    succeed(&mut import(&store, "1/2"));
    let root = std::fs::read(store.join("zarr.json")).unwrap();
    // As a run leaves it that was killed between its last view and the end.
    std::fs::write(store.join("zarr.json"), &begun).unwrap();
    let told = fail(btf().arg("status").arg(&store), 66);
    assert!(told.contains("not declared finished"), "{told}");
    assert_eq!(missing(&store, "2", "array"), "0\n");
    succeed(&mut import(&store, "0/2"));
    assert_eq!(std::fs::read(store.join("zarr.json")).unwrap(), root);
}

#[test]
fn models_and_enlargements_say_how_much_of_them_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.zarr");
    succeed(btf().arg("tile").args([fixture().measurement(), model.clone()]));
    let told = fail(btf().arg("status").arg(&model), 66);
    assert!(told.contains("model, 1 of 5 stages"), "{told}");
    assert!(fail(btf().arg("missing").arg(&model).args(["--shards", "4"]), 2).contains("btf model"));
    let plane = folder.path().join("big.zarr");
    let enlarge = |shard: &str| {
        let mut command = btf();
        command.arg("enlarge").args([&fixture().model(), &plane]);
        succeed(command.args(["--method", "repeat", "--size", "1100x2100", "--shard", shard]));
    };
    // Two by three blocks.
    enlarge("4/6");
    assert_eq!(missing(&plane, "6", "array"), "0-3,5\n");
    for part in ["0/2", "1/2"] {
        enlarge(part);
    }
    // One line each; the exit code is that of the worst.
    let mut all = btf();
    all.arg("status").args([&plane, &fixture().model(), &model, &fixture().enlarged()]).arg("--json");
    let output = all.output().unwrap();
    assert_eq!(output.status.code(), Some(66));
    let lines: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let done =
        |line: &Value| [&line["kind"], &line["done"], &line["units"]].map(ToString::to_string).join(" ");
    let told: Vec<String> = lines.iter().map(done).collect();
    assert_eq!(told, ["\"enlarged\" 6 6", "\"model\" 5 5", "\"model\" 1 5", "\"enlarged\" 1 1"]);
}

#[test]
fn the_part_may_come_from_the_variables_of_a_scheduler() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("s.zarr");
    let slurm =
        ["SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX", "SLURM_ARRAY_TASK_COUNT"];
    for task in ["5", "6"] {
        let mut command = import(&store, "env");
        succeed(command.envs(slurm.into_iter().zip([task, "5", "7", "3"])));
    }
    assert_eq!(missing(&store, "3", "array"), "2\n");
    // An array with holes, as one that is submitted again for a few parts.
    let mut command = import(&store, "env");
    let told = fail(command.envs(slurm.into_iter().zip(["7", "5", "7", "2"])), 2);
    assert!(told.contains("has holes") && told.contains("--shard $SLURM_ARRAY_TASK_ID/N"), "{told}");
    assert!(fail(&mut import(&store, "env"), 2).contains("no scheduler's variables"), "outside of a job");
}

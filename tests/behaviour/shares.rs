//! Work shared between jobs: which part a scheduler gives, how much of a store is there, and which parts are left.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::fixture::{assert_same, btf, copy, fail, fixture, succeed, tree_names};

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

#[test]
fn parts_of_a_verification_find_together_what_one_finds() {
    let folder = tempfile::tempdir().unwrap();
    for (name, store, file) in [
        ("measurement", fixture().measurement(), "reflectance/c/4/0/0/0/0"),
        ("enlarged", fixture().enlarged(), "index/c/1/0"),
    ] {
        let damaged = folder.path().join(format!("{name}.zarr"));
        copy(&store, &damaged);
        let verify = |store: &Path, shard: &str| {
            let mut command = btf();
            command.arg("verify").arg(store).args(["--shard", shard]);
            if name == "enlarged" {
                command.arg("--model").arg(fixture().model());
            }
            command
        };
        for shard in ["0/1", "0/2", "1/2", "2/99"] {
            let told = succeed(&mut verify(&store, shard));
            assert_eq!(told.contains("note: part"), shard != "0/1", "{name} {shard}: {told}");
        }
        let mut bytes = std::fs::read(damaged.join(file)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(damaged.join(file), bytes).unwrap();
        // View 4, and row of shards 1.
        let [finds, others] = if name == "measurement" { ["0/2", "1/2"] } else { ["1/2", "0/2"] };
        fail(&mut verify(&damaged, finds), 65);
        succeed(&mut verify(&damaged, others));
        fail(&mut verify(&damaged, "0/1"), 65);
    }
}

#[test]
fn parts_of_a_pyramid_in_any_order_and_twice_are_the_tiles_of_one() {
    let folder = tempfile::tempdir().unwrap();
    let export = |name: &str, shard: &str| {
        let mut command = btf();
        command.arg("export").arg(fixture().enlarged()).arg(folder.path().join(name));
        command.arg("--model").arg(fixture().model()).args([
            "--deepzoom",
            "--tile-size",
            "64",
            "--shard",
            shard,
        ]);
        command
    };
    succeed(&mut export("whole.dzi", "0/1"));
    let whole = folder.path().join("whole_files");
    for (name, shards) in [
        ("two.dzi", &["1/2", "0/2"][..]),
        ("mixed.dzi", &["2/3", "2/3", "0/2", "0/3", "1/2"]),
        ("many.dzi", &["7/40", "0/1"]),
    ] {
        let (last, before) = shards.split_last().unwrap();
        for shard in before {
            let told = succeed(&mut export(name, shard));
            assert!(told.contains("tiles of other parts are missing"), "{name} {shard}: {told}");
            assert!(!folder.path().join(name).exists(), "{name} {shard}");
            // By its description, which is not there yet, and by the folder of its tiles.
            for named in [name.to_owned(), name.replace(".dzi", "_files")] {
                let named = folder.path().join(named);
                assert!(fail(btf().arg("status").arg(&named), 66).contains("deepzoom, "));
                let (part, parts) = shard.split_once('/').unwrap();
                let left = missing(&named, parts, "lines");
                let mine = left.lines().any(|line| line == part);
                assert!(!left.is_empty() && !mine, "{name} {shard}: {left}");
            }
        }
        let told = succeed(&mut export(name, last));
        assert!(told.contains("a viewer of it"), "{name}: {told}");
        assert_same(&folder.path().join(name.replace(".dzi", "_files")), &whole);
        let description = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        assert_eq!(description(name), description("whole.dzi"));
        succeed(btf().arg("verify").arg(folder.path().join(name)));
        assert!(succeed(btf().arg("status").arg(folder.path().join(name))).contains("deepzoom, "));
        assert_eq!(missing(&folder.path().join(name), "3", "array"), "");
    }
    // Parts of a verification find together what one finds.
    let tile = whole.join("7/0_1.png");
    let bytes = std::fs::read(&tile).unwrap();
    std::fs::write(&tile, &bytes[..bytes.len() / 2]).unwrap();
    let verify = |shard: &str| {
        let mut command = btf();
        command.arg("verify").arg(folder.path().join("whole.dzi")).args(["--shard", shard]);
        command
    };
    fail(&mut verify("0/1"), 65);
    fail(&mut verify("1/2"), 65);
    assert!(succeed(&mut verify("0/2")).contains("note: part 0 of 2"));
    std::fs::write(&tile, bytes).unwrap();
    // Files that are called almost as tiles are count for nothing; a pyramid without its page lacks its end.
    let folder_of = |name: &str| folder.path().join(name);
    std::fs::rename(&tile, whole.join("7/0_01.png")).unwrap();
    assert_eq!(missing(&folder_of("whole.dzi"), "2", "array"), "1\n");
    std::fs::rename(whole.join("7/0_01.png"), &tile).unwrap();
    std::fs::remove_file(folder_of("whole.html")).unwrap();
    assert!(fail(btf().arg("status").arg(folder_of("whole.dzi")), 66).contains("not declared finished"));
    assert_eq!(missing(&folder_of("whole.dzi"), "2", "array"), "0\n");
    succeed(&mut export("whole.dzi", "0/2"));
    assert_eq!(missing(&folder_of("whole.dzi"), "2", "array"), "");
    fail(btf().arg("status").arg(folder_of("none.dzi")), 66);
}

#[test]
fn parts_of_a_comparison_give_the_figures_of_one_and_damaged_ones_are_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let compare = |more: &[&str]| {
        let mut command = btf();
        command.arg("compare").args([fixture().model(), fixture().measurement()]).arg("--json").args(more);
        command
    };
    let expected = succeed(&mut compare(&[]));
    let sums = folder.path().join("sums");
    let partial = ["--partial", sums.to_str().unwrap()];
    let with = |more: &[&str]| compare(&[&partial, more].concat());
    assert!(fail(&mut with(&["--reduce"]), 66).contains("0 of 9 views compared"));
    for shard in ["2/4", "0/4", "2/4", "1/4"] {
        let told = succeed(&mut with(&["--shard", shard]));
        assert!(told.contains("of 9 views compared"), "{told}");
        fail(&mut with(&["--reduce"]), 66);
    }
    // Whoever comes last tells the figures, by another number of parts too.
    assert_eq!(succeed(&mut with(&["--shard", "1/2"])), expected);
    assert_eq!(succeed(&mut with(&["--reduce"])), expected);
    // A changed file counts as missing.
    let files = tree_names(&sums);
    assert_eq!(files.len(), 9);
    let text = std::fs::read_to_string(&files[3]).unwrap();
    std::fs::write(&files[3], text.replacen("\"codes\":", "\"codes\":1", 1)).unwrap();
    assert!(fail(&mut with(&["--reduce"]), 66).contains("8 of 9 views"));
    assert_eq!(succeed(&mut with(&[])), expected);
    assert_eq!(std::fs::read_to_string(&files[3]).unwrap(), text);
    // Another model has sums of its own.
    let other = folder.path().join("other.zarr");
    succeed(btf().arg("model").args([fixture().measurement(), other.clone()]).args(["--clusters", "5"]));
    let mut command = btf();
    command.arg("compare").args([&other, &fixture().measurement()]).args(partial).arg("--reduce");
    assert!(fail(&mut command, 66).contains("0 of 9"));
}

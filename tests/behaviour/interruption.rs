//! Killed and stopped work goes on and ends with the bytes of an undisturbed run.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::fixture::{assert_same, btf, enlarge, fail, fixture, succeed};

/// Starts a command, waits until `ready`, and sends `signal`. Returns the exit code, none where it was killed.
pub fn interrupt(command: &mut Command, signal: &str, ready: impl Fn() -> bool) -> Option<i32> {
    let mut child: Child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while !ready() && child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < deadline, "{command:?} got nowhere");
        std::thread::sleep(Duration::from_micros(200));
    }
    let _ = Command::new("kill").args([signal, &child.id().to_string()]).status();
    child.wait().unwrap().code()
}

pub fn count(folder: &Path, part: &str) -> usize {
    crate::fixture::tree_names(folder).iter().filter(|name| name.to_string_lossy().contains(part)).count()
}

#[test]
fn a_file_that_is_cut_while_it_is_read_ends_with_a_word() {
    use std::io::{BufRead, BufReader};
    for (progress, told) in [("none", "btf: a file could not be read on"), ("json", "\"exit_code\":74")] {
        let mut command = btf();
        command.arg("view").arg(fixture().model()).args(["--progress", progress]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut String::new()).unwrap();
        // What the system sends then. Without a handler of ours the second one ends it.
        for _ in 0..2 {
            let _ =
                Command::new("kill").args(["-BUS", &child.id().to_string()]).stderr(Stdio::null()).status();
            std::thread::sleep(Duration::from_millis(20));
        }
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(74), "{said}");
        assert!(said.contains(told) && said.contains("run the command again"), "{said}");
    }
}

#[test]
fn an_import_killed_half_way_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("killed.zarr");
    for views in [1, 3, 6] {
        let mut command = btf();
        command.arg("import").args([&fixture().archive(), &store]).args(["--threads", "1"]);
        let code = interrupt(&mut command, "-KILL", || count(&store, "luminance/c") >= views);
        assert!(code.is_none() || views == 6, "the import ended before it was killed");
    }
    // A kill in the middle of a write leaves a temporary file; this one is as if of a dead process.
    let host = btfkit::disk::host();
    std::fs::write(store.join(format!(".zarr.json.tmp-{host}-999999999-00000000")), b"{").unwrap();
    succeed(btf().arg("import").args([&fixture().archive(), &store]));
    assert_same(&store, &fixture().measurement());
}

#[test]
fn an_enlargement_killed_half_way_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("killed");
    let mut command = enlarge(&fixture().model(), &output);
    // The first row of shards is two shards wide: killed once one of the four is there.
    let code = interrupt(&mut command, "-KILL", || count(&output, "index/c") >= 1);
    assert_eq!(code, None, "the enlargement ended before it was killed");
    let told = succeed(&mut command);
    assert!(!told.contains(" 2 found done"), "{told}");
    assert_same(&output, &fixture().enlarged());
}

/// An enlargement of many rows of shards, with its state beside them, killed once there is one.
pub fn killed_with_a_state(output: &Path, more: &[&str]) -> Command {
    let run = || {
        let mut command = btf();
        command
            .arg("enlarge")
            .args([&fixture().model(), output])
            .args(["--method", "paper", "--size", "520x3000"])
            .args(more);
        command
    };
    let code = interrupt(&mut run(), "-KILL", || output.join("enlarge-state").exists());
    assert_eq!(code, None, "the enlargement ended before it was killed");
    run()
}

#[test]
fn a_killed_enlargement_goes_on_after_its_last_row_of_shards() {
    let folder = tempfile::tempdir().unwrap();
    for more in [&[][..], &["--tileable", "--keep-normals"]] {
        let (output, undisturbed) = (folder.path().join("killed"), folder.path().join("undisturbed"));
        let mut command = killed_with_a_state(&output, more);
        let told = succeed(&mut command);
        assert!(!told.contains(" 0 found done"), "{told}");
        let whole = ["--method", "paper", "--size", "520x3000"];
        succeed(btf().arg("enlarge").args([&fixture().model(), &undisturbed]).args(whole).args(more));
        assert_same(&output, &undisturbed);
        for store in [output, undisturbed] {
            std::fs::remove_dir_all(store).unwrap();
        }
    }
}

#[test]
fn a_damaged_state_and_one_of_another_recipe_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let mut command = killed_with_a_state(&first, &[]);
    let mut other = killed_with_a_state(&second, &["--seed", "2"]);
    let state = first.join("enlarge-state");
    let whole = std::fs::read(&state).unwrap();
    std::fs::copy(second.join("enlarge-state"), &state).unwrap();
    let told = fail(&mut command, 65);
    assert!(told.contains("enlarge-state: the state of another recipe"), "{told}");
    std::fs::write(&state, &whole[..whole.len() - 1]).unwrap();
    let told = fail(&mut command, 65);
    assert!(told.contains("enlarge-state") && told.contains("delete this file"), "{told}");
    std::fs::remove_file(&state).unwrap();
    let told = succeed(&mut command);
    assert!(told.contains(" 0 found done"), "{told}");
    succeed(&mut other);
}

#[test]
fn the_first_term_signal_stops_with_75_and_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (output, undisturbed) = (folder.path().join("stopped"), folder.path().join("undisturbed"));
    let run = |path: &Path| {
        let mut command = btf();
        command
            .arg("enlarge")
            .args([&fixture().model(), path])
            .args(["--method", "paper", "--size", "600x1600"]);
        command
    };
    let code = interrupt(&mut run(&output), "-TERM", || count(&output, "index/c/0") >= 1);
    assert_eq!(code, Some(75));
    assert_eq!(count(&output, ".tmp-"), 0);
    succeed(&mut run(&output));
    succeed(&mut run(&undisturbed));
    assert_same(&output, &undisturbed);
}

//! Killed and stopped work goes on and ends with the bytes of an undisturbed run.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::fixture::{assert_same, btf, enlarge, fixture, succeed};

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
    let host = btfkit::store::mapped::host();
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

#[test]
fn an_enlargement_goes_on_after_whole_rows_of_shards() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("half");
    let mut command = enlarge(&fixture().model(), &output);
    succeed(&mut command);
    std::fs::remove_dir_all(output.join("index/c/1")).unwrap();
    let told = succeed(&mut command);
    assert!(told.contains("1 rows of shards written, 1 found done"), "{told}");
    assert_same(&output, &fixture().enlarged());
}

#[test]
fn the_first_term_signal_stops_with_75_and_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (output, undisturbed) = (folder.path().join("stopped"), folder.path().join("undisturbed"));
    let run = |path: &Path| {
        let mut command = btf();
        command.arg("enlarge").args([&fixture().model(), path]).args(["--size", "600x1600"]);
        command
    };
    let code = interrupt(&mut run(&output), "-TERM", || count(&output, "index/c/0") >= 1);
    assert_eq!(code, Some(75));
    assert_eq!(count(&output, ".tmp-"), 0);
    succeed(&mut run(&output));
    succeed(&mut run(&undisturbed));
    assert_same(&output, &undisturbed);
}

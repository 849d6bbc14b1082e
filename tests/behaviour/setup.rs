//! `scripts/setup` on machines that are made up of stubs.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

/// A folder of programs that do nothing, but for `apt-get`, which another process keeps from its lock `held` times.
fn machine(folder: &Path, programs: &[&str], held: u32) {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    for program in programs {
        write(program, "exit 0");
    }
    write("id", "echo 0");
    write("sleep", "exit 0");
    let apt = format!(
        r#"echo "$*" >>"$LOG"
count=$(($(/bin/cat "$LOG.count" 2>/dev/null || echo 0) + 1))
echo $count >"$LOG.count"
[ $count -gt {held} ] || {{ echo "E: Could not get lock /var/lib/apt/lists/lock" >&2; exit 100; }}"#
    );
    write("apt-get", &apt);
}

fn setup(folder: &Path, arguments: &[&str]) -> (Output, String) {
    let log = folder.join("log");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/setup");
    let output = Command::new("/bin/bash")
        .arg(script)
        .args(arguments)
        .env_clear()
        .env("PATH", folder)
        .env("HOME", folder)
        .env("LOG", &log)
        .output()
        .unwrap();
    (output, std::fs::read_to_string(log).unwrap_or_default())
}

#[test]
fn setup_waits_for_the_lock_of_apt_and_installs_what_is_asked_for() {
    if !Path::new("/bin/bash").exists() {
        println!("skipped: no /bin/bash");
        return;
    }
    let all = ["cc", "cargo", "git", "python3"];
    let folder = tempfile::tempdir().unwrap();
    machine(folder.path(), &all, 2);
    // All is there; HDF5 is for those who ask for it.
    let (output, log) = setup(folder.path(), &[]);
    assert!(output.status.success() && log.is_empty(), "{log}");
    let (output, log) = setup(folder.path(), &["browser"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}");
    assert_eq!(told.matches("waiting").count(), 2, "{told}");
    let lines: Vec<&str> = log.lines().collect();
    assert!(lines.iter().all(|line| line.contains("DPkg::Lock::Timeout=")), "{log}");
    assert_eq!(lines.iter().filter(|line| line.contains("update")).count(), 3, "{log}");
    for package in ["chromium", "nodejs", "npm"] {
        assert_eq!(lines.iter().filter(|line| line.ends_with(package)).count(), 1, "{package}: {log}");
    }
    let (output, _) = setup(folder.path(), &["hdf6"]);
    assert_eq!(output.status.code(), Some(2));
}

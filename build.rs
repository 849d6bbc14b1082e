//! Tells the program which commit it is built from: `BTF_COMMIT`, or `unknown` where there is no repository.
//!
//! Nothing but files is read, so that no git is needed, and the same commit gives the same program.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut watched = vec![folder.join("build.rs")];
    let commit = commit(&folder.join(".git"), &mut watched).unwrap_or_else(|| "unknown".to_owned());
    let mut told = std::io::stdout().lock();
    let _ = writeln!(told, "cargo::rustc-env=BTF_COMMIT={commit}");
    for path in watched.iter().filter(|path| path.exists()) {
        let _ = writeln!(told, "cargo::rerun-if-changed={}", path.display());
    }
}

/// The commit that is checked out, by its first twelve digits; `watched` gets the files that change when it does.
fn commit(git: &Path, watched: &mut Vec<PathBuf>) -> Option<String> {
    // Of a worktree, a file says where its own part of the repository lies.
    let own = match fs::read_to_string(git) {
        Ok(text) => git.parent()?.join(text.strip_prefix("gitdir: ")?.trim_end()),
        Err(_) => git.to_owned(),
    };
    let common = match fs::read_to_string(own.join("commondir")) {
        Ok(text) => own.join(text.trim_end()),
        Err(_) => own.clone(),
    };
    let head = fs::read_to_string(own.join("HEAD")).ok()?;
    watched.push(own.join("HEAD"));
    let hash = match head.trim_end().strip_prefix("ref: ") {
        None => head,
        Some(name) => {
            let (loose, packed) = (common.join(name), common.join("packed-refs"));
            watched.push(packed.clone());
            match fs::read_to_string(&loose) {
                Ok(hash) => {
                    watched.push(loose);
                    hash
                }
                Err(_) => {
                    // The next commit makes the file.
                    watched.push(loose.parent()?.to_owned());
                    let text = fs::read_to_string(&packed).ok()?;
                    text.lines()
                        .find_map(|line| line.strip_suffix(name)?.strip_suffix(' ').map(str::to_owned))?
                }
            }
        }
    };
    let digits = hash.trim_end().get(..12)?;
    digits.chars().all(|digit| digit.is_ascii_hexdigit()).then(|| digits.to_owned())
}

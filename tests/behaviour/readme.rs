//! The README's commands, run one after another as they stand there, on a smaller sample.

use std::path::Path;

use crate::fixture::{btf, succeed};

/// Sizes that are replaced, so that the test takes seconds.
const SMALLER: [(&str, &str); 2] =
    [("--size 256x256", "--size 128x128 --views 27 --lights 27"), ("--size 4096x4096", "--size 300x200")];

#[test]
fn every_command_of_the_readme_runs() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let mut count = 0;
    for line in text.lines().filter_map(|line| line.strip_prefix("    btf ")) {
        let line = SMALLER.iter().fold(line.to_owned(), |line, (large, small)| line.replace(large, small));
        succeed(btf().current_dir(folder.path()).args(line.split_whitespace()));
        count += 1;
    }
    assert!(count > 10, "{count} commands were found in README.md");
    for name in ["sheet.png", "side-by-side.png", "big.png", "judged.png", "big.html", "wood.btf"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}

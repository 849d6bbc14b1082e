//! A small measurement and its models, made once, and helpers to run the program.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use tempfile::TempDir;

/// Everything that the tests start from. `measurement`, `model` and `enlarged` are never written again.
pub struct Fixture {
    folder: TempDir,
}

impl Fixture {
    pub fn archive(&self) -> PathBuf {
        self.folder.path().join("sample.zip")
    }
    pub fn measurement(&self) -> PathBuf {
        self.folder.path().join("sample.zarr")
    }
    pub fn model(&self) -> PathBuf {
        self.folder.path().join("sample.model.zarr")
    }
    pub fn enlarged(&self) -> PathBuf {
        self.folder.path().join("big.zarr")
    }
}

/// The command that makes the fixture's model: of a tile whose borders join.
pub fn model_of(measurement: &Path, model: &Path) -> Command {
    let mut command = btf();
    command.arg("model").args([measurement, model]).args(["--tile", "cut", "--clusters", "24"]);
    command
}

/// The size of the fixture's enlarged index: two rows of shards, neither size a multiple of a shard.
pub const ENLARGED: [usize; 2] = [700, 530];

pub fn fixture() -> &'static Fixture {
    static FIXTURE: OnceLock<Fixture> = OnceLock::new();
    FIXTURE.get_or_init(|| {
        let fixture = Fixture { folder: tempfile::tempdir().unwrap() };
        let [archive, measurement, model, enlarged] =
            [fixture.archive(), fixture.measurement(), fixture.model(), fixture.enlarged()];
        succeed(
            btf().arg("sample").arg(&archive).args(["--size", "56x48", "--views", "9", "--lights", "19"]),
        );
        succeed(btf().arg("import").args([&archive, &measurement]));
        succeed(&mut model_of(&measurement, &model));
        succeed(&mut enlarge(&model, &enlarged));
        fixture
    })
}

pub fn btf() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_btf"));
    command.stdin(Stdio::null());
    command
}

/// The enlargement by the paper's method that made the fixture's, of a model to a place.
pub fn enlarge(model: &Path, output: &Path) -> Command {
    let mut command = btf();
    let size = format!("{}x{}", ENLARGED[1], ENLARGED[0]);
    command.arg("enlarge").args([model, output]).args([
        "--method",
        "paper",
        "--size",
        &size,
        "--keep-normals",
    ]);
    command
}

pub fn succeed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{command:?}: {told}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Runs a command that must fail with this exit code; returns what it said.
pub fn fail(command: &mut Command, code: i32) -> String {
    let Output { status, stderr, .. } = command.output().unwrap();
    let told = String::from_utf8_lossy(&stderr).into_owned();
    assert_eq!(status.code(), Some(code), "{command:?}: {told}");
    assert!(!told.contains("panicked"), "{told}");
    told
}

/// Every file below a folder and its bytes.
pub fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.to_string_lossy().ends_with("-path") {
                // What is left out is where the origin of a store lies, which is no part of what was made.
                files.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

/// Copies a store, to be harmed or moved.
pub fn copy(from: &Path, to: &Path) {
    for path in tree_names(from) {
        let to = to.join(path.strip_prefix(from).unwrap());
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(path, to).unwrap();
    }
}

/// Asserts that two stores hold the same files with the same bytes, but for the notes of where their origins lie.
pub fn assert_same(first: &Path, second: &Path) {
    let made = |store: &Path| {
        let mut files = tree(store);
        for name in ["model-path", "measurement-path"] {
            files.remove(Path::new(name));
        }
        files
    };
    let (a, b) = (made(first), made(second));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(
            bytes == &b[name],
            "{} differs between {} and {}",
            name.display(),
            first.display(),
            second.display()
        );
    }
}

/// Unpacks an archive into a folder with the library's own reader.
pub fn unpack(archive: &Path, folder: &Path) -> Vec<PathBuf> {
    let bytes = std::fs::read(archive).unwrap();
    let index = btfkit_formats::zip::ZipIndex::open(&bytes, &btfkit_formats::Limits::default()).unwrap();
    let unpack = |(number, entry): (usize, &btfkit_formats::zip::ZipEntry)| {
        let path = folder.join(entry.name());
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, index.read(&bytes, number).unwrap()).unwrap();
        path
    };
    index.entries().iter().enumerate().map(unpack).collect()
}

/// Names of the files below a folder that may be changing.
pub fn tree_names(folder: &Path) -> Vec<PathBuf> {
    let (mut names, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(at) = folders.pop() {
        for path in std::fs::read_dir(&at).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else {
                names.push(path);
            }
        }
    }
    names
}

/// A file of the shared data, or a printed line where there is none.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !path.exists() {
        println!("skipped: no shared data {name}");
        return None;
    }
    Some(path)
}

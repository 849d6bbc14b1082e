//! Stores whose metadata or chunks were changed, in every place and in many ways: `verify` finds each change, and no
//! command panics, hangs or believes what is claimed.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use btfkit::error::{ErrorKind, Result};
use btfkit::picture::deepzoom::Encoding;
use btfkit::run::progress::Silent;
use btfkit::run::shard::Shard;
use btfkit::run::{Context, recipe};
use btfkit::shape::Size;
use btfkit::stage::deepzoom;
use btfkit::stage::enlarge::{self, By};
use btfkit::stage::image::{Options, Scene, Subject, Values};
use btfkit::stage::verify::{self, Beside, Found};
use btfkit::stage::{about, export};
use btfkit::store::measurement::Measurement;
use btfkit::zarr::metadata::seal;
use btfkit_formats::Direction;
use serde_json::{Map, Value, json};
use tempfile::TempDir;

use crate::fixture::{btf, fail, fixture, succeed, tree, tree_names};

/// Everything that is damaged here, as small as it can be.
struct Small {
    folder: TempDir,
}

pub const METHODS: [&str; 6] = ["coherent", "paper", "repeat", "tiles", "roller", "quilt"];

fn small() -> &'static Small {
    static SMALL: OnceLock<Small> = OnceLock::new();
    SMALL.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        succeed(
            btf()
                .arg("sample")
                .arg(place("s.zip"))
                .args(["--size", "24x20", "--views", "4", "--lights", "5"]),
        );
        succeed(btf().arg("import").args([place("s.zip"), place("s.zarr")]));
        let clusters = ["--clusters", "7", "--tile", "periodic", "--levels", "1"];
        succeed(btf().arg("model").args([place("s.zarr"), place("m.zarr")]).args(clusters));
        for method in METHODS {
            let mut command = btf();
            command.arg("enlarge").args([place("m.zarr"), place(&format!("{method}.zarr"))]);
            command.args(["--method", method, "--size", "40x32", "--keep-normals"]);
            succeed(&mut command);
        }
        let mut command = btf();
        command.arg("export").args([place("coherent.zarr"), place("p.dzi")]).args([
            "--deepzoom",
            "--tile-size",
            "16",
        ]);
        succeed(&mut command);
        Small { folder }
    })
}

/// A copy of all of it, to be damaged and mended again.
pub struct Copy {
    folder: TempDir,
}

impl Copy {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in tree(small().folder.path()) {
            let to = folder.path().join(name);
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::write(to, bytes).unwrap();
        }
        Self { folder }
    }

    pub fn place(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

pub fn with_context<T>(work: impl FnOnce(&Context<'_>) -> T) -> T {
    let stop = AtomicBool::new(false);
    work(&Context::new(&Silent, &stop, 2, 1 << 28).unwrap())
}

/// Whether `verify` finds nothing wrong.
fn is_whole(path: &Path, context: &Context<'_>) -> bool {
    match verify::run(path, &Beside::default(), context) {
        Ok(Found::Measurement { report, .. }) => {
            report.damaged.is_empty() && report.views_missing.is_empty() && report.findings.is_empty()
        }
        Ok(Found::Other(report)) => report.findings.is_empty(),
        Err(error) => {
            assert!(
                matches!(error.kind(), ErrorKind::Input | ErrorKind::Missing | ErrorKind::Recipe),
                "{error}"
            );
            false
        }
    }
}

/// Runs everything else that reads a store; none may panic, and none may fail for the machine's sake.
fn use_it(path: &Path, context: &Context<'_>) {
    let picture = |subject: Subject| Options {
        source: path.to_owned(),
        model: None,
        subject,
        values: Values::Model,
        plane: None,
        window: None,
    };
    let appearance = Subject::Appearance {
        view: Direction::from_degrees(10.0, 20.0),
        light: Direction::from_degrees(30.0, 4.0),
    };
    let show = |subject: Subject| -> Result<()> {
        let scene = Scene::open(&picture(subject), context)?;
        let height = scene.size().height;
        for first in (0..height).step_by(64).take(2) {
            scene.read(first..(first + 64).min(height), context)?;
        }
        Ok(())
    };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.zarr");
    let results = [
        about::store(path).map(drop),
        show(appearance),
        show(Subject::Normals),
        Measurement::open(path).and_then(|measurement| {
            let output = folder.path().join("out.npy");
            let options = export::Options { output, format: export::Format::Npy, rank: None, quality: 90 };
            export::run(&export::Source::of(measurement), &options, context).map(drop)
        }),
        enlarge_it(path, &output, context),
        deepzoom::plan(
            &deepzoom::Options {
                picture: picture(appearance),
                exposure: 1.0,
                output: folder.path().join("out.dzi"),
                encoding: Encoding::Png,
                tile_side: 64,
                overlap: 1,
                shard: Shard::WHOLE,
            },
            context,
        )
        .map(drop),
    ];
    for error in results.into_iter().filter_map(std::result::Result::err) {
        let expected = [ErrorKind::Input, ErrorKind::Missing, ErrorKind::Recipe, ErrorKind::Usage];
        assert!(expected.contains(&error.kind()), "{}: {:?}: {error}", path.display(), error.kind());
    }
}

fn enlarge_it(model: &Path, output: &Path, context: &Context<'_>) -> Result<()> {
    let by = By::Coherent(enlarge::coherent::Options { jitter: None, keep_source: true, keep_normals: true });
    let options = enlarge::Options {
        model: model.to_owned(),
        output: output.to_owned(),
        size: Size::new(8, 8),
        seeds: 1..=1,
        tileable: false,
        by,
        shard: Shard::WHOLE,
    };
    enlarge::plan(&options)?.run(context).map(drop)
}

/// Places of all members of a document: pointers. Of long lists the first and the last.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    let escaped = |name: &str| name.replace('~', "~0").replace('/', "~1");
    match value {
        Value::Object(members) => {
            for (name, value) in members {
                let place = format!("{at}/{}", escaped(name));
                found.push(place.clone());
                places(value, &place, found);
            }
        }
        Value::Array(list) => {
            let mut numbers = vec![0, list.len().saturating_sub(1)];
            numbers.dedup();
            for number in numbers.into_iter().filter(|&number| number < list.len()) {
                let place = format!("{at}/{number}");
                found.push(place.clone());
                places(&list[number], &place, found);
            }
        }
        _ => {}
    }
}

/// What a member is changed to; `None` takes it away, a string that ends in `:` calls it otherwise.
fn changes() -> Vec<Option<Value>> {
    let deep = (0..100).fold(json!(1), |value, _| json!([value]));
    [
        json!("misspelt:"),
        json!(0),
        json!(1),
        json!(-1),
        json!(1u64 << 40),
        json!(1u64 << 63),
        json!(u64::MAX),
        json!(1e300),
        json!(0.5),
        json!("NaN"),
        json!(""),
        json!(true),
        json!(null),
        json!([]),
        json!({}),
        json!(vec![0; 3000]),
        deep,
    ]
    .into_iter()
    .map(Some)
    .chain([None])
    .collect()
}

/// Changes a member; false where that changes nothing.
fn change(document: &mut Value, place: &str, to: Option<&Value>) -> bool {
    let (parent, name) = place.rsplit_once('/').unwrap();
    let name = name.replace("~1", "/").replace("~0", "~");
    match document.pointer_mut(parent).unwrap() {
        Value::Object(members) => {
            let old = members.remove(&name).unwrap();
            match to {
                Some(Value::String(text)) if text.ends_with(':') => {
                    drop(members.insert(format!("{name}x"), old));
                }
                Some(value) if *value == old => return false,
                Some(value) => drop(members.insert(name, value.clone())),
                None => {}
            }
        }
        Value::Array(list) => {
            let number: usize = name.parse().unwrap();
            match to {
                Some(value) if *value == list[number] => return false,
                Some(value) => list[number] = value.clone(),
                None => drop(list.remove(number)),
            }
        }
        other => panic!("{other} has no members"),
    }
    true
}

/// What may be changed without being found: attributes of other programs, and what they make of ours.
fn is_free(place: &str, to: Option<&Value>) -> bool {
    // Which arrays are coordinates is said for other programs; an object of attributes may be empty, or not there.
    place == "/attributes/coordinates" || (place == "/attributes" && to.is_none_or(|to| *to == json!({})))
}

/// Changes every member of every metadata file of a store, one at a time. Of `each` changes one is used by all
/// commands; of those of arrays one of `step` is made, another kind at every member.
fn change_all(copy: &Copy, name: &str, each: usize, step: usize) -> usize {
    let store = copy.place(name);
    let files = tree_names(&store).into_iter().filter(|path| path.extension().is_some_and(|e| e == "json"));
    let (mut count, mut missed) = (0, Vec::new());
    with_context(|context| {
        assert!(is_whole(&store, context), "{name} is whole before");
        for (file_number, file) in files.enumerate() {
            let text = std::fs::read(&file).unwrap();
            let whole: Value = serde_json::from_slice(&text).unwrap();
            let mut all = Vec::new();
            places(&whole, "", &mut all);
            let step = if file.parent() == Some(store.as_path()) { 1 } else { step };
            for (number, place) in all.iter().enumerate() {
                // The copy of all documents is long, and compared as one.
                let in_copy = place.starts_with("/consolidated_metadata/metadata/");
                for (kind, to) in changes().iter().enumerate() {
                    let turn = file_number + number + kind;
                    if turn % step != 0 || (in_copy && turn % 97 != 0) {
                        continue;
                    }
                    let mut document = whole.clone();
                    if !change(&mut document, place, to.as_ref()) {
                        continue;
                    }
                    std::fs::write(&file, serde_json::to_vec(&document).unwrap()).unwrap();
                    count += 1;
                    if is_whole(&store, context) && !is_free(place, to.as_ref()) {
                        missed.push(format!("{}{place} to {to:?}", file.display()));
                    }
                    if count % each == 0 {
                        use_it(&store, context);
                    }
                }
            }
            std::fs::write(&file, text).unwrap();
        }
        assert!(is_whole(&store, context), "{name} is whole after");
    });
    assert!(
        missed.is_empty(),
        "{} of {count} were not found: {:#?}",
        missed.len(),
        &missed[..missed.len().min(30)]
    );
    count
}

#[test]
fn every_change_of_a_models_metadata_is_found() {
    let count = change_all(&Copy::new(), "m.zarr", 41, 7);
    assert!(count > 2000, "{count}");
}

#[test]
fn every_change_of_a_measurements_or_an_enlargements_metadata_is_found() {
    let copy = Copy::new();
    let names: Vec<String> = METHODS.iter().map(|method| format!("{method}.zarr")).collect();
    for name in names.iter().map(String::as_str).chain(["s.zarr", "p_files"]) {
        let count = change_all(&copy, name, 53, 1);
        assert!(count > 100, "{name}: {count}");
    }
}

/// Attributes that are changed and sealed again: as by one who knows how. Not all can be found; none does harm.
#[test]
fn attributes_that_are_sealed_again_do_no_harm() {
    let copy = Copy::new();
    for name in ["m.zarr", "coherent.zarr", "paper.zarr", "s.zarr"] {
        let file = copy.place(name).join("zarr.json");
        let text = std::fs::read(&file).unwrap();
        let whole: Value = serde_json::from_slice(&text).unwrap();
        let mut all = Vec::new();
        places(&whole["attributes"], "/attributes", &mut all);
        with_context(|context| {
            for (number, place) in all.iter().enumerate() {
                for (kind, to) in changes().iter().enumerate() {
                    let mut document = whole.clone();
                    if (number + kind) % 5 != 0 || !change(&mut document, place, to.as_ref()) {
                        continue;
                    }
                    if let Some(ours) =
                        document.pointer_mut("/attributes/btfkit").and_then(Value::as_object_mut)
                    {
                        seal_again(ours);
                    }
                    std::fs::write(&file, serde_json::to_vec(&document).unwrap()).unwrap();
                    let _ = is_whole(&copy.place(name), context);
                    if (number + kind) % 15 == 0 {
                        use_it(&copy.place(name), context);
                    }
                }
            }
        });
        std::fs::write(&file, text).unwrap();
    }
}

/// Digests and the seal as they have to be.
pub fn seal_again(ours: &mut Map<String, Value>) {
    let digest = |entry: &mut Map<String, Value>| {
        if let Some(recipe) = entry.get("recipe") {
            let digest = recipe::digest(recipe);
            entry.insert("digest".to_owned(), json!(digest));
        }
    };
    digest(ours);
    let stages = ours.get_mut("stages").and_then(Value::as_object_mut);
    stages.into_iter().flatten().filter_map(|(_, entry)| entry.as_object_mut()).for_each(digest);
    let sealed = seal(ours);
    ours.insert("seal".to_owned(), json!(sealed));
}

/// Every chunk file flipped, cut, emptied, exchanged, and replaced by what is no file.
#[test]
fn every_damaged_or_exchanged_chunk_is_found() {
    let copy = Copy::new();
    let names: Vec<String> = METHODS.iter().map(|method| format!("{method}.zarr")).collect();
    for name in names.iter().map(String::as_str).chain(["m.zarr", "s.zarr", "p_files"]) {
        let store = copy.place(name);
        let mut files = tree_names(&store);
        files.retain(|path| path.extension().is_none_or(|ending| ending == "png"));
        // Where the origin of a store lies is held against what lies there, and is no part of the store.
        files.retain(|path| !path.to_string_lossy().ends_with("-path"));
        files.sort();
        let all: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
        let mut missed = Vec::new();
        with_context(|context| {
            for (number, file) in files.iter().enumerate() {
                let whole = &all[number];
                let mut damaged =
                    vec![Vec::new(), whole[..whole.len() / 2].to_vec(), whole[..whole.len() - 1].to_vec()];
                for at in [0, whole.len() / 3, whole.len() * 2 / 3, whole.len() - 1] {
                    let mut flipped = whole.clone();
                    flipped[at] ^= 0x10;
                    damaged.push(flipped);
                }
                let as_long = all.iter().find(|other| other.len() == whole.len() && *other != whole);
                damaged.extend(as_long.cloned());
                damaged.extend(
                    all.iter().cycle().skip(number + 1).take(3).filter(|other| *other != whole).cloned(),
                );
                for (kind, bytes) in damaged.iter().enumerate() {
                    std::fs::write(file, bytes).unwrap();
                    if is_whole(&store, context) {
                        missed.push(format!("{}: {kind}", file.display()));
                    }
                    if (number + kind) % 13 == 0 {
                        use_it(&store, context);
                    }
                }
                std::fs::remove_file(file).unwrap();
                for make in
                    [&|| std::fs::create_dir(file).unwrap() as (), &|| pipe(file) as ()] as [&dyn Fn(); 2]
                {
                    make();
                    if is_whole(&store, context) {
                        missed.push(format!("{}: no file", file.display()));
                    }
                    if number % 11 == 0 {
                        use_it(&store, context);
                    }
                    let _ = std::fs::remove_file(file).or_else(|_| std::fs::remove_dir(file));
                }
                std::fs::write(file, whole).unwrap();
            }
            assert!(is_whole(&store, context), "{name}");
        });
        assert!(missed.is_empty(), "{name}: not found: {missed:#?}");
    }
}

fn pipe(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A frame of zstd that says it holds far more than its chunk is refused before room is made for it.
#[test]
fn a_chunk_that_claims_more_than_it_may_hold_is_refused() {
    let copy = Copy::new();
    let chunk = copy.place("m.zarr").join("distance/c/0/0");
    let bomb = zstd::bulk::compress(&vec![0u8; 64 << 20], 3).unwrap();
    std::fs::write(&chunk, &bomb).unwrap();
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xe4];
    frame.extend((1u64 << 46).to_le_bytes());
    frame.extend([1, 0, 0, 0, 0, 0, 0]);
    for bytes in [bomb, frame] {
        std::fs::write(&chunk, &bytes).unwrap();
        let mut command = std::process::Command::new("bash");
        command.args(["-c", "ulimit -v 1048576; exec timeout 20 \"$@\"", "bash", env!("CARGO_BIN_EXE_btf")]);
        command.args(["--threads", "1", "verify"]).arg(copy.place("m.zarr"));
        let output = command.output().unwrap();
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(65), "{told}");
        assert!(told.contains("distance/c/0/0"), "{told}");
    }
}

/// Metadata files that are no files, or too large, or not text.
#[test]
fn metadata_that_is_no_small_file_is_refused_without_waiting() {
    let copy = Copy::new();
    for name in ["m.zarr", "coherent.zarr", "s.zarr"] {
        let store = copy.place(name);
        let files = tree_names(&store).into_iter().filter(|path| path.ends_with("zarr.json"));
        with_context(|context| {
            for file in files {
                let whole = std::fs::read(&file).unwrap();
                let replaced: [(&str, &dyn Fn()); 5] = [
                    ("a pipe", &|| pipe(&file)),
                    ("a folder", &|| std::fs::create_dir(&file).unwrap()),
                    ("a device", &|| std::os::unix::fs::symlink("/dev/zero", &file).unwrap()),
                    ("large", &|| std::fs::File::create(&file).unwrap().set_len(1 << 40).unwrap()),
                    ("binary", &|| std::fs::write(&file, [0xff; 100]).unwrap()),
                ];
                for (what, replace) in replaced {
                    std::fs::remove_file(&file).unwrap();
                    replace();
                    assert!(!is_whole(&store, context), "{}: {what}", file.display());
                    use_it(&store, context);
                    let _ = std::fs::remove_file(&file).or_else(|_| std::fs::remove_dir(&file));
                    std::fs::write(&file, &whole).unwrap();
                }
            }
        });
    }
}

#[test]
fn directions_of_another_model_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let mut models = Vec::new();
    // The same samples, and directions whose triangles may be the same.
    for (name, turn) in [("a", "90"), ("b", "180")] {
        let (store, model) = (place(&format!("{name}.zarr")), place(&format!("{name}.model.zarr")));
        succeed(btf().arg("import").args([&fixture().archive(), &store]).args(["--turn", turn]));
        succeed(btf().arg("tile").args([&store, &model]).args(["--tile", "none"]));
        succeed(btf().arg("cluster").args([&store, &model]).args(["--clusters", "7"]));
        models.push(model);
    }
    succeed(btf().arg("verify").arg(&models[0]));
    for array in ["light_direction", "light_phi", "light_theta"] {
        std::fs::remove_dir_all(models[0].join(array)).unwrap();
        crate::fixture::copy(&models[1].join(array), &models[0].join(array));
    }
    let told = fail(btf().arg("verify").arg(&models[0]), 65);
    assert!(told.contains("light_direction"), "{told}");
    let picture = place("picture.png");
    let told = fail(btf().arg("image").arg(&models[0]).arg("--out").arg(&picture), 65);
    assert!(told.contains("light_direction") && told.contains("checksum") && !picture.exists(), "{told}");
}

//! Damaged descriptions of exemplars and of enlarged indices: each a clear error, before anything of the size that it
//! claims is allocated or made.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::coherent::{enlarge, model};
use crate::fixture::{btf, copy, fail, succeed, tree};

/// Changes a member of a JSON file, or takes it away.
pub fn change(file: &Path, pointer: &str, value: Option<Value>) {
    let mut metadata: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let (parent, member) = pointer.rsplit_once('/').unwrap();
    let parent = metadata.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}"));
    match (parent, value) {
        (Value::Object(members), Some(value)) => drop(members.insert(member.to_owned(), value)),
        (Value::Object(members), None) => drop(members.remove(member).unwrap()),
        (Value::Array(list), Some(value)) => list[member.parse::<usize>().unwrap()] = value,
        (Value::Array(list), None) => drop(list.remove(member.parse().unwrap())),
        (other, _) => panic!("{other} has no members"),
    }
    // Sealed again, so that what is looked at later is reached.
    if let Some(ours) = metadata.pointer_mut("/attributes/btfkit").and_then(Value::as_object_mut) {
        crate::damaged_stores::seal_again(ours);
    }
    std::fs::write(file, serde_json::to_vec(&metadata).unwrap()).unwrap();
}

/// A command with 1 GiB of address space and 20 seconds: enough for what the stores really hold.
fn limited(command: &Command) -> Command {
    let mut limited = Command::new("bash");
    limited.args(["-c", "ulimit -v 1048576; exec timeout 20 \"$@\"", "bash"]);
    limited.arg(command.get_program()).args(command.get_args()).args(["--threads", "1"]);
    limited
}

/// Runs `command` on a copy of a store that `damage` changed; it must fail with 65, or with 66 where something is
/// missing, and name `named`.
fn refused(store: &Path, damage: impl Fn(&Path), command: impl Fn(&Path) -> Command, named: &str) {
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join(store.file_name().unwrap());
    copy(store, &damaged);
    damage(&damaged);
    let output = limited(&command(&damaged)).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code();
    assert!(matches!(code, Some(65 | 66)) && told.contains(named), "{named}: {code:?}: {told}");
    assert!(!told.contains("panicked"), "{told}");
}

fn picture(model: &Path) -> Command {
    let mut command = btf();
    command.arg("image").arg(model).args(["--plane", "--window", "-9,4,40,30", "--out"]);
    command.arg(model.with_extension("png"));
    command
}

/// What is refused below is refused for the damage, not for the limits.
fn whole_ones_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.model.zarr");
    copy(&model("cut"), &whole);
    succeed(&mut limited(&picture(&whole)));
}

const REPORT: &str = "/attributes/btfkit/stages/appearance/report";

#[test]
fn a_damaged_report_of_an_appearance_is_refused() {
    whole_ones_are_accepted();
    let huge = json!(u64::MAX);
    let levels = json!([{"spacing": 1, "dims": 8, "shift": 9, "passes": 2, "repetition": 0}]);
    for (member, value, named) in [
        ("exemplar", Some(json!([0, 0, 36])), "appearance"),
        ("exemplar", Some(json!([0, 0, -36, 40])), "appearance"),
        ("exemplar", Some(json!([1, 0, 36, 40])), "exemplar"),
        ("exemplar", Some(json!([0, 0, 0, 40])), "exemplar"),
        ("exemplar", Some(json!([huge, 0, 36, 40])), "exemplar"),
        ("exemplar", Some(json!([0, 0, huge, huge])), "exemplar"),
        ("exemplar", Some(json!([0, 0, 1 << 20, 1 << 20])), "exemplar"),
        ("exemplar", Some(json!([0, 0, 8, 8])), "exemplar"),
        ("exemplar", None, "exemplar"),
        ("wraps", Some(json!("yes")), "appearance"),
        ("wraps", None, "wraps"),
        ("lattice", Some(json!([[0, 0]])), "lattice"),
        ("lattice", Some(json!([[2, 4], [1, 2]])), "lattice"),
        ("lattice", Some(json!([[1, 0], [0, 1], [1, 1]])), "lattice"),
        ("lattice", Some(json!([[i32::MIN, i32::MAX]])), "lattice"),
        ("lattice", Some(json!([[i32::MIN, i32::MIN], [i32::MAX, i32::MIN]])), "lattice"),
        ("lattice", Some(json!([[1]])), "appearance"),
        ("lattice", Some(json!([[0.5, 1]])), "appearance"),
        ("lattice", Some(json!([[u64::MAX, 1]])), "appearance"),
        ("lattice", None, "lattice"),
        ("levels", Some(json!([])), "levels"),
        ("levels", Some(levels), "level"),
        ("levels", Some(json!(4)), "appearance"),
        ("levels", None, "levels"),
        ("levels/0/passes", Some(json!(0)), "passes"),
        ("levels/0/passes", Some(json!(9)), "passes"),
        ("levels/0/passes", Some(json!(-1)), "appearance"),
        ("levels/3/passes", Some(huge.clone()), "passes"),
        ("levels/2/passes", None, "passes"),
        ("levels/1/shift", Some(json!(0)), "shift"),
        ("levels/1/shift", Some(json!(40)), "shift"),
        ("levels/1/shift", Some(json!(-3)), "appearance"),
        ("levels/1/shift", Some(huge), "appearance"),
        ("levels/3/repetition", Some(json!(-1)), "repetition"),
        ("levels/3/repetition", Some(json!((1 << 22) + 1)), "repetition"),
        ("levels/0/repetition", Some(json!(1)), "repetition"),
        ("levels/3/repetition", Some(json!(1i64 << 40)), "appearance"),
        ("levels/1", None, "level"),
    ] {
        let damage =
            |store: &Path| change(&store.join("zarr.json"), &format!("{REPORT}/{member}"), value.clone());
        refused(&model("cut"), damage, picture, named);
    }
    let damage = |store: &Path| {
        change(&store.join("zarr.json"), "/attributes/btfkit/stages/cluster/report/clusters", Some(json!(7)));
    };
    refused(&model("cut"), damage, picture, "");
}

#[test]
fn damaged_arrays_of_an_appearance_are_refused() {
    for array in ["appearance/features", "appearance/level_1/basis", "appearance/level_3/offset", "index"] {
        let metadata = move |store: &Path| store.join(array).join("zarr.json");
        for shape in
            [json!([]), json!([5]), json!([5, 5]), json!([72, 8, 2]), json!([1u64 << 40, 1u64 << 40])]
        {
            refused(
                &model("cut"),
                |store| change(&metadata(store), "/shape", Some(shape.clone())),
                picture,
                array,
            );
        }
        for kind in ["float64", "uint16", "nonsense"] {
            let damage = |store: &Path| change(&metadata(store), "/data_type", Some(json!(kind)));
            refused(&model("cut"), damage, picture, "");
        }
        refused(&model("cut"), |store| std::fs::remove_file(metadata(store)).unwrap(), picture, array);
        refused(&model("cut"), |store| std::fs::write(metadata(store), "{").unwrap(), picture, array);
        let chunks = move |store: &Path| store.join(array).join("c");
        refused(&model("cut"), |store| std::fs::remove_dir_all(chunks(store)).unwrap(), picture, array);
        let cut = |store: &Path| {
            for name in tree(&chunks(store)).keys() {
                let file = chunks(store).join(name);
                let bytes = std::fs::read(&file).unwrap();
                std::fs::write(file, &bytes[..bytes.len() / 2]).unwrap();
            }
        };
        refused(&model("cut"), cut, picture, array);
    }
    // A cluster beyond those that there are: the index of a model of more clusters.
    let folder = tempfile::tempdir().unwrap();
    let more = folder.path().join("more.model.zarr");
    succeed(
        btf().arg("tile").args([&crate::fixture::fixture().measurement(), &more]).args(["--tile", "40x36"]),
    );
    let clusters = ["--clusters", "60"];
    succeed(btf().arg("cluster").args([&crate::fixture::fixture().measurement(), &more]).args(clusters));
    let index = "index/c/0/0";
    let kept = "/attributes/btfkit/stages/cluster/checksums/index";
    let checksum = |store: &Path| -> Value {
        let metadata: Value =
            serde_json::from_slice(&std::fs::read(store.join("zarr.json")).unwrap()).unwrap();
        metadata.pointer(kept).unwrap().clone()
    };
    let exchange = |store: &Path| assert!(std::fs::copy(more.join(index), store.join(index)).is_ok());
    refused(&model("cut"), exchange, picture, "checksum");
    let damage = |store: &Path| {
        exchange(store);
        change(&store.join("zarr.json"), kept, Some(checksum(&more)));
    };
    refused(&model("cut"), damage, picture, "index: cluster");
}

/// Any numbers in the arrays themselves are numbers of some material: they change what is made, and break nothing.
#[test]
fn the_largest_weights_are_no_reason_to_fail() {
    use btfkit::kernel::Kernel;
    use btfkit::method::coherent::Plane;
    use btfkit::shape::Size;
    use btfkit::store::model::Model;
    let model = Model::open(&model("cut")).unwrap();
    let mut appearance = model.appearance().unwrap();
    appearance.features.iter_mut().for_each(|features| *features = [-128; 8]);
    for level in &mut appearance.levels {
        level.weights.fill(i16::MIN);
        level.offset.fill(i32::MIN);
        (level.passes, level.shift) = (8, 1);
        level.repetition = if level.dims == 8 { 1 << 22 } else { 0 };
    }
    let size = model.tile().unwrap().size;
    let index = model.index().unwrap();
    let plane = Plane::new(size, &index, &appearance, Kernel::Plain).unwrap();
    let texels = plane.window(&plane.variation(1), -3, 5, Size::new(20, 20)).unwrap();
    assert!(texels.iter().all(|&texel| (texel as usize) < size.texels()));
}

#[test]
fn a_damaged_enlarged_index_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let big = folder.path().join("big.zarr");
    succeed(&mut enlarge(&model("cut"), &big, "90x70"));
    let show = |values: &'static str| {
        move |store: &Path| {
            let mut command = btf();
            command.arg("image").arg(store).arg("--model").arg(model("cut"));
            if values == "measured" {
                command.arg("--measurement").arg(crate::fixture::fixture().measurement());
            }
            command.args(["--values", values, "--out"]).arg(store.with_extension(format!("{values}.png")));
            command
        }
    };
    for values in ["model", "measured"] {
        succeed(&mut limited(&show(values)(&big)));
    }
    for (member, value, named) in [
        ("recipe/rule", Some(json!("unheard-of")), "recipe"),
        ("recipe/rule", Some(json!(5)), "recipe"),
        // The oldest recipes name no method; theirs was the paper's.
        ("recipe/rule", None, "--method paper"),
        ("recipe/source", Some(json!("yes")), "recipe"),
        ("recipe/source", None, "source: got none"),
        ("recipe/model", Some(json!("0123")), "another model"),
        ("recipe", Some(json!([])), "recipe"),
        ("kind", Some(json!("model")), ""),
        ("kind", Some(json!(1)), "kind"),
        ("format", Some(json!(1000)), "format"),
        ("format", None, "format"),
    ] {
        let damage = |store: &Path| {
            change(&store.join("zarr.json"), &format!("/attributes/btfkit/{member}"), value.clone());
        };
        // What claims to be a model is refused as such, and needs none beside it.
        let plain = |store: &Path| {
            let mut command = btf();
            command.arg("image").arg(store).arg("--out").arg(store.with_extension("png"));
            command
        };
        let command: &dyn Fn(&Path) -> Command = if member == "kind" { &plain } else { &show("measured") };
        refused(&big, damage, command, named);
    }
    for (array, values) in [("index", "model"), ("source", "measured")] {
        let metadata = move |store: &Path| store.join(array).join("zarr.json");
        for shape in [json!([90]), json!([9, 9]), json!([1, 2, 3]), json!([1u64 << 40, 1u64 << 40])] {
            let damage = |store: &Path| change(&metadata(store), "/shape", Some(shape.clone()));
            refused(&big, damage, show(values), array);
        }
        refused(
            &big,
            |store| change(&metadata(store), "/data_type", Some(json!("float32"))),
            show(values),
            "",
        );
        refused(&big, |store| std::fs::remove_file(metadata(store)).unwrap(), show(values), array);
    }
    // Entries beyond the tile: the source of an enlargement of a larger tile.
    let larger = folder.path().join("larger.zarr");
    succeed(&mut enlarge(&model("whole"), &larger, "90x70"));
    for array in ["index", "source"] {
        let shard = format!("{array}/c/0/0");
        let cut = |store: &Path| {
            let bytes = std::fs::read(store.join(&shard)).unwrap();
            std::fs::write(store.join(&shard), &bytes[..bytes.len() - 40]).unwrap();
        };
        refused(&big, cut, show(if array == "index" { "model" } else { "measured" }), array);
    }
    let shard = "source/c/0/0";
    let beyond = |store: &Path| assert!(std::fs::copy(larger.join(shard), store.join(shard)).is_ok());
    refused(&big, beyond, show("measured"), "source: got texel");
    fail(&mut show("measured")(&folder.path().join("nothing")), 66);
}

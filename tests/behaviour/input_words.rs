//! What is said of inputs that are not what they seem, and how commands end.

use btfkit_formats::picture::exr;
use btfkit_formats::picture::{self, Picture};
use btfkit_formats::{Samples, f16};

use crate::fixture::{btf, fail, fixture, succeed};
use crate::odd_archives::{RIGHT, azimuths, png, refused, set, three, told};

#[test]
fn a_pattern_that_fits_no_name_is_told_with_a_name_and_a_bad_one_is_wrong_use() {
    let (_folder, root) = set(&three(["a_20_0.png", "a_20_90.png", "a_20_180.png"]));
    let info = |pattern: &str| {
        let mut command = btf();
        command.arg("info").arg(&root).args(["--pattern", pattern]);
        command
    };
    let said = fail(&mut info("b_{theta_i}_{phi_i}.png"), 65);
    assert!(said.contains("no name fits the pattern \"b_{theta_i}_{phi_i}.png\""), "{said}");
    assert!(said.contains("a_20_0.png"), "{said}");
    for pattern in ["a_{theta_i_{phi_i}.png", "{theta_i}", "{theta_i}{phi_i}", "a_{theta_i}rad_{phi_i}"] {
        let said = fail(&mut info(pattern), 2);
        assert!(said.contains("--pattern"), "{said}");
    }
    succeed(&mut info("a_{theta_i}_{phi_i}.png"));
    let mut drop = btf();
    drop.arg("info").arg(&root).args(["--pattern", "a_{theta_i}_{phi_i}.png", "--drop-view"]);
    let said = fail(drop.arg("99"), 2);
    assert!(said.contains("there is no view 99 to drop: views are numbered 0 to 0"), "{said}");
}

#[test]
fn one_misnamed_picture_of_many_is_named() {
    let mut files = Vec::new();
    for view in [0, 90] {
        for light in [0, 60, 120, 180] {
            files.push((format!("tl20_pl{light}_tv30_pv{view}.png"), png(9)));
        }
    }
    files[5].0 = "tl20_pl61_tv30_pv90.png".to_owned();
    let files: Vec<(&str, Vec<u8>)> =
        files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    let (_folder, root) = set(&files);
    let said = refused(&root);
    let lone = said.split("perhaps misnamed: ").nth(1).unwrap_or_default();
    assert!(lone.contains("tl20_pl61_tv30_pv90.png"), "{said}");
}

#[test]
fn radians_are_read_where_they_are_said_and_doubted_by_every_command_where_not() {
    let names = ["tl0.5rad_pl0rad.png", "tl0.5rad_pl1.570796327rad.png", "tl0.5rad_pl3.141592654rad.png"];
    let (_folder, root) = set(&three(names));
    assert_eq!(azimuths(&root), RIGHT);
    assert!(told(&root).contains("tl{theta_i:rad}rad_pl{phi_i:rad}rad"));
    let (_folder, root) =
        set(&three(["tl0.5gon_pl0gon.png", "tl0.5gon_pl100gon.png", "tl0.5gon_pl200gon.png"]));
    assert!(refused(&root).contains("\"gon_pl0gon\" behind the angle 0.5"));

    let (_folder, bare) = set(&three(["tl0.5_pl0.png", "tl0.5_pl1.57.png", "tl0.5_pl3.14.png"]));
    // Pictures of one value are a fault of their own.
    let output = |arguments: &[&str]| {
        let output = btf().args(arguments).arg(&bare).arg("--threads=1").output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    for arguments in [&["info"][..], &["check"], &["check", bare.to_str().unwrap(), "--json"]] {
        let said = output(arguments);
        assert!(said.contains("if the angles are radians"), "{arguments:?}: {said}");
    }
    let json: serde_json::Value = serde_json::from_str(&output(&["check", "--json"])).unwrap();
    assert!(json["notes"].to_string().contains("if the angles are radians"));
}

#[test]
fn a_label_of_the_view_further_up_is_read() {
    let (_folder, root) = set(&three([
        "view_30_45/exposure1/light_20_0.png",
        "view_30_45/exposure1/light_20_90.png",
        "view_30_45/exposure1/light_20_180.png",
    ]));
    let said = told(&root);
    assert!(said.contains("theta 30.0 to 30.0") && !said.contains("frontal"), "{said}");
}

/// An OpenEXR picture of these channels.
fn of_channels(names: &[&str]) -> Vec<u8> {
    let channels = names.iter().map(|&name| name.to_owned()).collect();
    let samples = Samples::F16(vec![f16::from_f32(0.5); 64 * names.len()]);
    exr::encode(&Picture { width: 8, height: 8, channels, samples }, exr::Compression::Zip).unwrap()
}

#[test]
fn channels_that_are_left_out_are_told_and_must_be_the_same() {
    let (rgb, rgbz) = (of_channels(&["R", "G", "B"]), of_channels(&["R", "G", "B", "Z"]));
    let (_folder, root) = set(&[("tl20_pl0.exr", rgbz.clone()), ("tl20_pl90.exr", rgbz.clone())]);
    let said = told(&root);
    assert!(
        said.contains("R G B") && said.contains("the channels Z, which are no colours, are left out"),
        "{said}"
    );
    let (_folder, root) = set(&[("tl20_pl0.exr", rgb), ("tl20_pl90.exr", rgbz)]);
    let said = refused(&root);
    assert!(said.contains("tl20_pl90.exr") && said.contains("the whole file is the picture"), "{said}");
}

#[test]
fn sizes_and_directions_beyond_what_can_be_are_wrong_use() {
    for size in ["0x5", "65537x5"] {
        let said = fail(btf().args(["sample", "/nowhere/s.zip", "--size", size]), 2);
        assert!(said.contains("each from 1 to 65536,"), "{said}");
    }
    for view in ["89,1e300", "89,361", "91,0"] {
        let said = fail(btf().args(["image", "/nowhere/m.zarr", "--out=/nowhere/p.png", "--view", view]), 2);
        assert!(said.contains("theta 0 to 90, phi -360 to 360"), "{said}");
    }
}

#[test]
fn the_file_of_a_picture_counts_as_memory() {
    let small = png(9);
    let text = [&b"tEXt"[..], b"x\0", &[b'a'; 24 << 20]].concat();
    let length = u32::try_from(text.len() - 4).unwrap().to_be_bytes();
    let large = [&small[..33], &length, &text, &crc32fast::hash(&text).to_be_bytes(), &small[33..]].concat();
    assert_eq!(picture::decode(&large, &btfkit_formats::Limits::default()).unwrap().width, 8);
    let (folder, root) = set(&[("tl20_pl0.png", large)]);
    let mut import = btf();
    import.arg("import").arg(&root).arg(folder.path().join("s.zarr")).arg("--memory");
    let said = fail(import.arg("16MiB"), 2);
    assert!(said.contains("checking pictures of up to 49 MiB takes 61 MiB"), "{said}");
}

#[test]
fn options_that_an_archive_has_no_use_for_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    succeed(btf().arg("export").arg(fixture().measurement()).arg(at("a.npy")));
    succeed(btf().arg("export").arg(fixture().measurement()).arg(at("a.btf")));
    succeed(btf().arg("export").arg(fixture().measurement()).arg(at("a.zip")));
    for (archive, options, whose) in [
        ("a.npy", &["--table", "none.csv"][..], "it is for pictures"),
        ("a.npy", &["--pattern", "{theta_i}"], "it is for pictures"),
        ("a.npy", &["--order", "ubo81"], "without directions of their own"),
        ("a.npy", &["--rows", "reversed"], "Bonn's containers"),
        ("a.btf", &["--order", "ubo81"], "BIG and MIF"),
        ("a.btf", &["--hdr", "atrium"], "Radiance pictures"),
        ("a.zip", &["--hdr", "atrium"], "Radiance pictures"),
        ("a.zip", &["--rows", "reversed"], "Bonn's containers"),
        ("a.zip", &["--order", "ubo81"], "BIG and MIF"),
    ] {
        let told = fail(btf().arg("import").args([at(archive), at("a.zarr")]).args(options), 2);
        assert!(told.contains("changes nothing") && told.contains(whose), "{archive} {options:?}: {told}");
        assert!(!at("a.zarr").exists());
    }
}

#[test]
fn a_folder_of_a_container_and_a_file_beside_it_say_what_to_name() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("set").join("material");
    std::fs::create_dir_all(&inner).unwrap();
    let (bonn, array, list) = (inner.join("m.btf"), inner.join("m.npy"), inner.join("notes.txt"));
    succeed(btf().arg("export").arg(fixture().measurement()).arg(&bonn));
    std::fs::write(&list, "notes").unwrap();
    for named in [&inner, &inner.parent().unwrap().to_owned(), &list] {
        let said = fail(btf().arg("info").arg(named), 65);
        assert!(said.contains("no pictures") && said.contains("m.btf (a Bonn BTF archive)"), "{said}");
        assert!(said.contains(&format!("name the file: {}", bonn.display())), "{said}");
    }
    succeed(btf().arg("export").arg(fixture().measurement()).arg(&array));
    let said = fail(btf().arg("info").arg(&inner), 65);
    assert!(said.contains("m.npy (a numpy array)") && !said.contains("m.views.npy"), "{said}");
    // Archives and pictures have faults of their own.
    let zip = inner.join("a.zip");
    std::fs::copy(fixture().archive(), &zip).unwrap();
    let said = fail(btf().arg("info").arg(&zip).args(["--pattern", "img_{theta_i}_{phi_i}.jpg"]), 65);
    assert!(said.contains("pattern") && !said.contains("name the file"), "{said}");
    assert!(!fail(btf().arg("info").arg(inner.join("none.zip")), 66).contains("name the file"));
    std::fs::remove_file(&zip).unwrap();
    std::fs::write(inner.join("a.png"), png(9)).unwrap();
    assert!(!refused(&inner).contains("name the file"));
}

#[test]
fn a_store_in_the_place_of_an_archive_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (store, archive) = (fixture().measurement(), folder.path().join("m.btf"));
    succeed(btf().arg("export").arg(&store).arg(&archive));
    let before = std::fs::read(store.join("zarr.json")).unwrap();
    for (named, code, words) in [
        (vec![store.clone(), archive.clone()], 2, "expected the archive first and the store last"),
        (
            vec![folder.path().join("new.zarr"), archive.clone()],
            66,
            "archives come first, and the store to make is named last",
        ),
        (vec![store.clone(), folder.path().join("new.zarr")], 2, "is a store already"),
        (vec![store.clone()], 2, "is a store already"),
    ] {
        let said = fail(btf().arg("import").args(&named), code);
        assert!(said.contains(words), "{named:?}: {said}");
    }
    assert_eq!(std::fs::read(store.join("zarr.json")).unwrap(), before);
    let foreign = folder.path().join("foreign");
    std::fs::create_dir(&foreign).unwrap();
    std::fs::write(foreign.join("zarr.json"), "{\"zarr_format\": 3, \"node_type\": \"group\"}").unwrap();
    assert!(fail(btf().arg("import").arg(&foreign), 65).contains("got a store, expected an archive"));
}

#[test]
fn a_single_channel_that_is_no_grey_is_told_or_refused() {
    let of =
        |name: &str| set(&[("tl20_pl0.exr", of_channels(&[name])), ("tl20_pl90.exr", of_channels(&[name]))]);
    for (name, grey) in [("R", false), ("layer.B", false), ("foo", false), ("Y", true), ("550nm", true)] {
        let (_folder, root) = of(name);
        assert_eq!(told(&root).contains("it is taken as grey"), !grey, "{name}");
    }
    for name in ["Z", "layer.Depth.Z", "mask", "N"] {
        let (_folder, root) = of(name);
        assert!(refused(&root).contains("expected light"), "{name}");
    }
}

#[test]
fn advice_on_radians_is_for_the_kind_of_archive() {
    let (folder, root) = set(&three(["a.png", "b.png", "c.png"]));
    let table = folder.path().join("t.csv");
    std::fs::write(&table, "file,theta_i,phi_i\na.png,0.5,0\nb.png,0.5,1.57\nc.png,0.5,3.14\n").unwrap();
    let said = succeed(btf().arg("info").arg(&root).arg("--table").arg(&table));
    assert!(said.contains("multiply them by 180 / pi") && !said.contains("--pattern"), "{said}");
}

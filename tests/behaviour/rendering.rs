//! `btf render`: pictures of a material on objects.

use std::path::Path;
use std::process::Command;

use image::GenericImageView;

use crate::fixture::{btf, fail, fixture, succeed, tree};

fn render(source: &Path, out: &Path) -> Command {
    let mut command = btf();
    command.arg("render").arg(source).arg("--out").arg(out).args(["--size", "40x30"]);
    command
}

#[test]
fn a_flat_object_is_the_picture_of_the_tile_and_nothing_depends_on_threads() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let model = fixture().model();
    for light in ["15,0", "40,100", "85,200"] {
        succeed(
            btf().arg("image").arg(&model).args(["--light", light, "--force", "--out"]).arg(at("image.png")),
        );
        let [image, size] = [image::open(at("image.png")).unwrap(), image::open(at("image.png")).unwrap()];
        let size = format!("{}x{}", size.width(), size.height());
        let flat = ["--shape", "flat", "--light", light, "--force", "--size", &size];
        succeed(btf().arg("render").arg(&model).args(flat).arg("--out").arg(at("flat.png")));
        let flat = image::open(at("flat.png")).unwrap();
        assert_eq!(flat.dimensions(), image.dimensions());
        for ((x, y, a), (.., b)) in flat.pixels().zip(image.pixels()) {
            let apart = a.0.iter().zip(b.0).map(|(&a, b)| a.abs_diff(b)).max();
            assert!(apart <= Some(1), "light {light}, {x},{y}: {a:?} {b:?}");
        }
    }
    for shape in ["sphere", "interior"] {
        for (name, threads) in [("one", "1"), ("four", "4")] {
            let args = ["--shape", shape, "--plane", "--threads", threads];
            succeed(render(&model, &at(&format!("{shape}-{name}.exr"))).args(args));
        }
        let bytes = |name: &str| std::fs::read(at(&format!("{shape}-{name}.exr"))).unwrap();
        assert!(bytes("one") == bytes("four"), "{shape}: other threads, other bytes");
    }
    let told = succeed(render(&model, &at("sphere-one.exr")).args(["--plane"]));
    assert!(told.contains("found done"), "{told}");
    fail(render(&model, &at("sphere-one.exr")).args(["--plane", "--seed", "2"]), 65);
}

#[test]
fn frames_are_the_same_pictures_whoever_makes_them() {
    let folder = tempfile::tempdir().unwrap();
    for motion in ["--turntable", "--light-sweep"] {
        let at = |name: &str| folder.path().join(motion).join(name);
        for part in ["whole", "parts"] {
            std::fs::create_dir_all(at(part)).unwrap();
        }
        let frames = ["--frames", "3", motion, "--shape", "cylinder"];
        succeed(render(&fixture().model(), &at("whole/f.png")).args(frames));
        for shard in ["1/2", "0/2"] {
            succeed(render(&fixture().model(), &at("parts/f.png")).args(frames).args(["--shard", shard]));
        }
        let (whole, parts) = (tree(&at("whole")), tree(&at("parts")));
        assert!(whole == parts);
        let names: Vec<_> = whole.keys().map(|name| name.display().to_string()).collect();
        assert_eq!(names, ["f-1.png", "f-2.png", "f-3.png"]);
        succeed(render(&fixture().model(), &at("still.png")).args(["--shape", "cylinder"]));
        let frames: Vec<&Vec<u8>> = whole.values().collect();
        assert!(
            *frames[0] == std::fs::read(at("still.png")).unwrap(),
            "the first is the picture without a motion"
        );
        assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    }
}

#[test]
fn frames_whose_names_are_no_text_keep_apart() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    for name in [b"a\xff.png", b"a\xfe.png"] {
        let out = folder.path().join(OsStr::from_bytes(name));
        succeed(render(&fixture().model(), &out).args(["--frames", "2", "--turntable"]));
    }
    let names: Vec<Vec<u8>> =
        tree(folder.path()).keys().map(|name| name.as_os_str().as_bytes().to_vec()).collect();
    let expected = [&b"a\xfe-1.png"[..], b"a\xfe-2.png", b"a\xff-1.png", b"a\xff-2.png"];
    assert_eq!(names, expected.map(<[u8]>::to_vec));
}

#[test]
fn a_light_that_would_light_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.png");
    for (shape, point, told) in [
        ("plane", "0,0,0", "the origin"),
        ("sphere", "0,-0,0", "the origin"),
        ("sphere", "0.5,0.5,0.5", "within the object"),
        ("sphere", "0,1,0", "on it"),
        ("cylinder", "0,0.8,0.6", "on it"),
        ("plane", "0.2,0.1,0", "on it"),
        ("flat", "7,7,0", "on it"),
    ] {
        let mut command = render(&fixture().model(), &out);
        command.args(["--shape", shape, "--point-light", point]);
        let said = fail(&mut command, 2);
        assert!(said.contains(told) && said.contains("--point-light"), "{shape} {point}: {said}");
    }
    for (shape, point) in [("sphere", "0.6,0.6,0.6"), ("cylinder", "0,0.7,0.61"), ("plane", "1.5,0,0")] {
        succeed(render(&fixture().model(), &out).args(["--force", "--shape", shape, "--point-light", point]));
    }
}

#[test]
fn a_mesh_and_an_environment_are_read_and_what_they_lack_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let square =
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(at("square.obj"), square).unwrap();
    std::fs::write(at("bare.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::fs::write(at("cut.glb"), b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    // Bright above, dim below and at one side.
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    hdr.extend([[200, 200, 255, 130], [200, 200, 255, 131]].concat().repeat(2));
    hdr.extend([[40, 30, 20, 128], [40, 30, 20, 126]].concat().repeat(2));
    std::fs::write(at("sky.hdr"), hdr).unwrap();
    let model = fixture().model();
    let mut made = Vec::new();
    for (name, more) in [
        ("plain", &[][..]),
        ("lit", &["--environment", "sky.hdr"][..]),
        ("turned", &["--environment", "sky.hdr", "--environment-turn", "100"]),
        ("few", &["--environment", "sky.hdr", "--environment-lights", "2"]),
        ("seen", &["--environment", "sky.hdr", "--show-environment"]),
    ] {
        let mut command = render(&model, &at(&format!("{name}.png")));
        command.current_dir(folder.path()).args(["--mesh", "square.obj", "--eye", "0,1,4"]).args(more);
        succeed(&mut command);
        made.push((name, std::fs::read(at(&format!("{name}.png"))).unwrap()));
    }
    for (n, (name, picture)) in made.iter().enumerate() {
        assert!(made[..n].iter().all(|(_, other)| other != picture), "{name} changes nothing");
    }
    let out = at("x.png");
    for (mesh, code, told) in [
        ("bare.obj", 65, "texture coordinates"),
        ("cut.glb", 65, "cut.glb"),
        ("none.obj", 66, "none.obj"),
        ("sky.hdr", 2, ".obj or .glb"),
    ] {
        let said = fail(render(&model, &out).arg("--mesh").arg(at(mesh)), code);
        assert!(said.contains(told), "{mesh}: {said}");
    }
    let said = fail(render(&model, &out).arg("--environment").arg(at("bare.obj")), 65);
    assert!(said.contains("bare.obj"), "{said}");
    let said = fail(render(&fixture().measurement(), &out).args(["--samples", "1"]), 65);
    assert!(said.contains("btf model"), "{said}");
    let said = fail(render(&model, &out).args(["--frames", "3"]), 2);
    assert!(said.contains("--turntable or --light-sweep"), "{said}");
    let said = fail(render(&model, &out).args(["--eye", "0,0,0"]), 2);
    assert!(said.contains("--eye and --target"), "{said}");
    let said = fail(render(&model, &out).args(["--memory", "13MiB"]), 2);
    assert!(said.contains("--memory") && said.contains("or more, allows it"), "{said}");
    assert!(!out.exists());
}

#[test]
fn an_enlargement_that_is_too_small_for_an_object_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let told = succeed(render(&fixture().enlarged(), &at("fits.png")).args(["--scale", "3"]));
    assert!(!told.contains("note"), "{told}");
    let told = succeed(render(&fixture().enlarged(), &at("beyond.png")).args(["--scale", "0.2"]));
    assert!(told.contains("530x700 texels and does not repeat"), "{told}");
}

#[test]
fn five_ways_are_shown_beside_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let sheet = folder.path().join("sheet.png");
    succeed(render(&fixture().model(), &sheet).args(["--shape", "interior", "--compare", "--samples", "2"]));
    let picture = image::open(&sheet).unwrap().to_rgb8();
    let panel = |number: u32| {
        let (left, top) = (12 + number % 3 * 52, 28 + number / 3 * 58);
        picture.view(left, top, 40, 30).to_image().into_raw()
    };
    let panels: Vec<Vec<u8>> = (0..6).map(panel).collect();
    for (n, panel) in panels.iter().enumerate() {
        assert!(panels[..n].iter().all(|other| other != panel), "panel {n} is another one");
        assert!(panel.iter().any(|value| *value != panel[0]), "panel {n} is empty");
    }
    let said = fail(render(&fixture().model(), &folder.path().join("s.exr")).arg("--compare"), 2);
    assert!(said.contains("display values only"), "{said}");
}

//! How an archive is read: elevations, views and lights that are left out, angles that cannot be; and that the store says
//! it.

use std::fs;
use std::path::{Path, PathBuf};

use btfkit::check::source::Views;
use btfkit::store::measurement::Measurement;
use btfkit_formats::Direction;
use btfkit_formats::ubo2003::{ImageName, parse_name};
use serde_json::Value;
use tempfile::TempDir;

use crate::fixture::{btf, fail, fixture, succeed, unpack};

/// Pictures of a small material in a folder, and what their names say.
fn pictures(views: &str, lights: &str, name: impl Fn(&ImageName) -> String) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let [archive, unpacked, named] = ["s.zip", "unpacked", "named"].map(|name| folder.path().join(name));
    let sizes = ["--size", "32x32", "--views", views, "--lights", lights];
    succeed(btf().arg("sample").arg(&archive).args(sizes));
    fs::create_dir(&named).unwrap();
    for path in unpack(&archive, &unpacked) {
        let angles = parse_name(path.to_str().unwrap()).unwrap();
        fs::copy(&path, named.join(format!("{}.jpg", name(&angles)))).unwrap();
    }
    (folder, named)
}

/// The labels of a name with these thetas.
fn labels(of: &ImageName, theta_i: f64, theta_v: f64) -> String {
    format!("tl{theta_i} pl{} tv{theta_v} pv{}", of.light.phi_deg(), of.view.phi_deg())
}

fn import(archive: &Path, store: &Path, options: &[&str]) -> String {
    succeed(btf().arg("import").args([archive, store]).args(options))
}

/// Directions as exact numbers, sorted.
fn sorted(list: &[Direction]) -> Vec<[u64; 2]> {
    let mut all: Vec<[u64; 2]> = list.iter().map(|d| [d.theta_rad.to_bits(), d.phi_rad.to_bits()]).collect();
    all.sort_unstable();
    all
}

fn found(path: &Path, options: &[&str]) -> Vec<(String, Option<String>)> {
    let output = btf().arg("check").arg(path).args(options).arg("--json").output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let checks = report["checks"].as_array().unwrap().iter();
    let findings = checks.flat_map(|check| check["findings"].as_array().unwrap().clone());
    let text = |value: &Value| value.as_str().map(str::to_owned);
    findings.map(|finding| (text(&finding["code"]).unwrap(), text(&finding["repair"]))).collect()
}

#[test]
fn elevations_are_found_and_read_as_what_they_are() {
    type Thetas = fn(&ImageName) -> (f64, f64);
    let cases: [(&str, Thetas, &str); 3] = [
        ("elevations", |of| (90.0 - of.light.theta_deg(), 90.0 - of.view.theta_deg()), "--polar elevation"),
        (
            "light-elevations",
            |of| (90.0 - of.light.theta_deg(), of.view.theta_deg()),
            "--polar elevation-lights",
        ),
        (
            "view-elevations",
            |of| (of.light.theta_deg(), 90.0 - of.view.theta_deg()),
            "--polar elevation-views",
        ),
    ];
    let (right_folder, right) =
        pictures("25", "25", |of| labels(of, of.light.theta_deg(), of.view.theta_deg()));
    let right_store = right_folder.path().join("right.zarr");
    import(&right, &right_store, &[]);
    let right = Measurement::open(&right_store).unwrap();
    for (code, thetas, repair) in cases {
        let (folder, named) = pictures("25", "25", |of| {
            let (theta_i, theta_v) = thetas(of);
            labels(of, theta_i, theta_v)
        });
        assert_eq!(found(&named, &[]), [(code.to_owned(), Some(repair.to_owned()))]);
        let options: Vec<&str> = repair.split(' ').collect();
        assert_eq!(found(&named, &options), [], "{code}");
        let store = folder.path().join("s.zarr");
        let told = import(&named, &store, &options);
        assert!(told.contains(&format!("read with {repair}")), "{told}");
        let mended = Measurement::open(&store).unwrap();
        let [a, b] = [&right, &mended].map(Measurement::description);
        assert_eq!([sorted(&a.views), sorted(&a.lights)], [sorted(&b.views), sorted(&b.lights)]);
        // The image of a pair is that of the pair.
        let [view, light] = [a.views[7], a.lights[9]];
        let texels = |store: &Measurement| {
            let of = store.description();
            let place =
                |list: &[Direction], wanted: Direction| list.iter().position(|d| *d == wanted).unwrap();
            let samples = store.read_view(place(&of.views, view), of.size.window()).unwrap();
            let (first, lights) = (place(&of.lights, light), of.lights.len());
            let places = (0..of.size.texels()).map(|texel| (texel * lights + first) * 3);
            samples.select(places.map(|at| at..at + 3)).unwrap()
        };
        assert_eq!(texels(&right), texels(&mended));
    }
}

#[test]
fn of_one_frontal_view_only_lights_are_elevations() {
    // The first view only; nothing names it.
    let (folder, named) =
        pictures("1", "30", |of| format!("tl{}_pl{}", 90.0 - of.light.theta_deg(), of.light.phi_deg()));
    let codes: Vec<(String, Option<String>)> = found(&named, &[]);
    let suspected = ("light-elevations".to_owned(), Some("--polar elevation-lights".to_owned()));
    assert!(codes.contains(&suspected), "{codes:?}");
    for option in ["elevation", "elevation-lights", "elevation-views"] {
        let store = folder.path().join(format!("{option}.zarr"));
        import(&named, &store, &["--polar", option]);
        let description = Measurement::open(&store).unwrap().description().clone();
        assert_eq!(description.views[0].theta_rad, 0.0, "{option}");
        let above = description.lights.iter().any(|light| light.theta_rad == 0.0);
        assert_eq!(above, option != "elevation-views", "{option}");
    }
}

#[test]
fn two_directions_straight_above_are_refused() {
    let (_folder, named) =
        pictures("1", "7", |of| format!("tl{}_pl{}", 90.0 - of.light.theta_deg(), of.light.phi_deg()));
    let one = fs::read_dir(&named).unwrap().next().unwrap().unwrap().path();
    fs::copy(&one, named.join("tl90_pl45.jpg")).unwrap();
    let told = fail(btf().arg("info").arg(&named).args(["--polar", "elevation"]), 65);
    assert!(told.contains("both straight above"), "{told}");
    succeed(btf().arg("info").arg(&named));
}

/// The options that advice says to go on with.
fn advised(told: &str) -> Vec<String> {
    let advice = told.split("go on without: ").nth(1).unwrap_or_else(|| panic!("no way on in {told}"));
    let words: Vec<&str> = advice.split_whitespace().collect();
    let pairs = words.windows(2).filter(|pair| pair[0].starts_with("--drop"));
    pairs.flat_map(|pair| [pair[0].to_owned(), pair[1].to_owned()]).collect()
}

#[test]
fn what_a_missing_picture_spoils_can_be_left_out_by_the_option_that_is_advised() {
    let plain = |of: &ImageName| labels(of, of.light.theta_deg(), of.view.theta_deg());
    type Case = (&'static str, fn(usize, usize) -> bool, &'static str);
    let missing: [Case; 4] = [
        ("one picture", |view, light| (view, light) == (3, 2), "--drop-view 3"),
        ("some of a view", |view, light| view == 3 && light > 2, "--drop-view 3"),
        ("some of a light", |view, light| light == 2 && view % 2 == 0, "--drop-light 2"),
        (
            "two",
            |view, light| view == 3 && light < 4 || light == 5 && view > 4,
            "--drop-view 3 --drop-light 5",
        ),
    ];
    for (name, is_missing, expected) in missing {
        let (folder, named) = pictures("9", "7", plain);
        let whole = folder.path().join("whole.zarr");
        import(&named, &whole, &[]);
        let whole = Measurement::open(&whole).unwrap();
        let of = whole.description().clone();
        let place = |list: &[Direction], wanted: Direction| {
            list.iter()
                .position(|d| (d.theta_rad - wanted.theta_rad).hypot(d.phi_rad - wanted.phi_rad) < 1e-9)
                .unwrap()
        };
        for path in fs::read_dir(&named).unwrap().map(|entry| entry.unwrap().path()) {
            let angles = parse_name(path.to_str().unwrap()).unwrap();
            let at = (place(&of.views, angles.view.direction()), place(&of.lights, angles.light.direction()));
            if is_missing(at.0, at.1) {
                fs::remove_file(path).unwrap();
            }
        }
        for swap in [false, true] {
            let reading: &[&str] = if swap { &["--swap"] } else { &[] };
            let told = fail(btf().arg("info").arg(&named).args(reading), 65);
            let options = advised(&told);
            let shown = match swap {
                false => options.join(" "),
                true => options.join(" ").replace("view", "x").replace("light", "view").replace('x', "light"),
            };
            assert_eq!(shown, expected, "{name}, swap {swap}: {told}");
            let store = folder.path().join(format!("{swap}.zarr"));
            succeed(btf().arg("import").args([&named, &store]).args(reading).args(&options));
            succeed(btf().arg("verify").arg(&store).arg("--source").arg(&named));
            let left = Measurement::open(&store).unwrap().description().clone();
            let (views, lights) = if swap { (left.lights, left.views) } else { (left.views, left.lights) };
            let dropped = |what: &str| expected.matches(what).count();
            assert_eq!((views.len(), lights.len()), (9 - dropped("view"), 7 - dropped("light")), "{name}");
        }
    }
}

#[test]
fn a_light_is_left_out_of_every_kind_of_archive() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Measurement::open(&fixture().measurement()).unwrap();
    let array = folder.path().join("a.npy");
    succeed(btf().arg("export").args([&fixture().measurement(), &array]));
    for (number, archive) in [fixture().archive(), array].iter().enumerate() {
        let store = folder.path().join(format!("{number}.zarr"));
        import(archive, &store, &["--drop-light", "2", "--drop-light", "0", "--drop-light", "7"]);
        let less = Measurement::open(&store).unwrap();
        let kept: Vec<usize> =
            (0..whole.description().lights.len()).filter(|l| ![0, 2, 7].contains(l)).collect();
        let lights: Vec<Direction> = kept.iter().map(|&light| whole.description().lights[light]).collect();
        assert_eq!(sorted(&less.description().lights), sorted(&lights));
        let all = whole.read_view(4, whole.description().size.window()).unwrap();
        let (texels, of) = (whole.description().size.texels(), whole.description().lights.len());
        let expected = (0..texels).flat_map(|texel| kept.iter().map(move |light| (texel * of + light) * 3));
        let expected = all.select(expected.map(|at| at..at + 3)).unwrap();
        assert_eq!(
            less.read_view(4, less.description().size.window()).unwrap(),
            expected,
            "{}",
            archive.display()
        );
        let told = fail(btf().arg("info").arg(archive).args(["--drop-light", "99"]), 2);
        assert!(told.contains("there is no light 99 to drop: lights are numbered 0 to 18"), "{told}");
    }
}

#[test]
fn angles_that_no_direction_has_are_refused_by_the_name_of_the_picture() {
    let (folder, named) = pictures("3", "4", |of| labels(of, of.light.theta_deg(), of.view.theta_deg()));
    let one = fs::read_dir(&named).unwrap().next().unwrap().unwrap().path();
    let with = |name: &str, act: &dyn Fn()| {
        let path = named.join(name);
        fs::copy(&one, &path).unwrap();
        act();
        fs::remove_file(path).unwrap();
    };
    for name in ["tl095 pl000 tv000 pv000.jpg", "tl015 pl000 tv120 pv000.jpg", "tl-15 pl000 tv000 pv000.jpg"]
    {
        with(name, &|| {
            for options in [&[][..], &["--pattern", "tl{theta_i} pl{phi_i} tv{theta_v} pv{phi_v}"]] {
                let told = fail(btf().arg("info").arg(&named).args(options), 65);
                assert!(told.contains(name) && told.contains("no direction has"), "{options:?}: {told}");
            }
            // What is no image on purpose is left out.
            let table = folder.path().join("t.csv");
            let mut rows = "file,theta_i,phi_i,theta_v,phi_v\n".to_owned();
            for path in fs::read_dir(&named).unwrap().map(|entry| entry.unwrap().path()) {
                let file = path.file_name().unwrap().to_str().unwrap().to_owned();
                if let Some(ImageName { light, view, .. }) = parse_name(&file) {
                    let angles = [light.theta_deg(), light.phi_deg(), view.theta_deg(), view.phi_deg()];
                    rows += &format!("{file},{}\n", angles.map(|angle| angle.to_string()).join(","));
                }
            }
            fs::write(&table, rows).unwrap();
            let told = succeed(btf().arg("info").arg(&named).arg("--table").arg(&table));
            assert!(told.contains("left out") && told.contains(name), "{told}");
        });
    }
    with("mean.jpg", &|| {
        succeed(btf().arg("info").arg(&named));
    });
    // The first of all may be the one that is wrong, and the labels others.
    let (_folder, other) = pictures("3", "4", |of| {
        let theta = if of.light.theta_deg() == 0.0 { 91.0 } else { of.light.theta_deg() };
        format!("l{theta}_{}_v{}_{}", of.light.phi_deg(), of.view.theta_deg(), of.view.phi_deg())
    });
    let told = fail(btf().arg("info").arg(&other), 65);
    assert!(
        told.contains("3 pictures with angles that no direction has") && told.contains("theta 91"),
        "{told}"
    );
    // More than a whole turn is read, and stated.
    let (_folder, turned) = pictures("3", "4", |of| {
        format!(
            "l{}_{}_v{}_{}",
            of.light.theta_deg(),
            of.light.phi_deg() + 360.0,
            of.view.theta_deg(),
            of.view.phi_deg()
        )
    });
    let told = succeed(btf().arg("info").arg(&turned));
    assert!(told.contains("beyond 360 degrees"), "{told}");
}

#[test]
fn a_store_says_how_it_was_read_and_is_verified_so() {
    let folder = tempfile::tempdir().unwrap();
    let archive = fixture().archive();
    let options = ["--swap", "--azimuth", "mirrored", "--turn", "90", "--samples", "f16", "--drop-view", "2"];
    let store = folder.path().join("s.zarr");
    let told = import(&archive, &store, &options);
    let words = "read with --swap --azimuth mirrored --turn 90 --samples f16 --drop-view 2";
    assert!(told.contains(words), "{told}");
    let told = succeed(btf().arg("info").arg(&store));
    assert!(told.contains("read with") && told.contains("--turn 90 --samples f16"), "{told}");
    let told = succeed(btf().arg("info").arg(&store).arg("--json"));
    let about: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(about["read_with"][0], "--swap");
    let verify = |options: &[&str]| {
        let mut command = btf();
        command.arg("verify").arg(&store).arg("--source").arg(&archive).args(options);
        command
    };
    succeed(&mut verify(&[]));
    succeed(&mut verify(&options));
    let told = fail(&mut verify(&["--turn", "90"]), 65);
    assert!(told.contains("leave out the options"), "{told}");
    // A store that was read as it is says nothing, and of many images that differ it is said how many there are.
    let plain = fixture().measurement();
    assert!(!succeed(btf().arg("info").arg(&plain)).contains("read with"));
    let other = folder.path().join("other.zip");
    let sizes = ["--size", "56x48", "--views", "9", "--lights", "19", "--seed", "5"];
    succeed(btf().arg("sample").arg(&other).args(sizes));
    let output = btf().arg("verify").arg(&plain).arg("--source").arg(&other).output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.code() == Some(65) && told.contains("and 151 more"), "{told}");
    // What was found done is not looked at again, and that is said.
    let told = import(&archive, &store, &options);
    assert!(told.contains("was not read again: btf verify"), "{told}");
}

#[test]
fn lights_without_names_need_pictures_whose_order_is_plain() {
    let (folder, named) = pictures("1", "3", |of| format!("{}_{}", of.light.theta_deg(), of.light.phi_deg()));
    let mut files: Vec<PathBuf> = fs::read_dir(&named).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let told = |names: [&str; 3]| {
        let set = folder.path().join("set");
        fs::create_dir_all(&set).unwrap();
        for (from, name) in files.iter().zip(names) {
            fs::copy(from, set.join(name)).unwrap();
        }
        fs::write(set.join("lights.lp"), "3\n0 0 1\n0.5 0 0.8\n0 0.5 0.8\n").unwrap();
        let output = btf().arg("info").arg(&set).output().unwrap();
        fs::remove_dir_all(&set).unwrap();
        let text = [output.stdout, output.stderr].concat();
        (output.status.code().unwrap(), String::from_utf8_lossy(&text).into_owned())
    };
    for (names, words) in [
        (["left.jpg", "middle.jpg", "right.jpg"], "which has no number"),
        (["a1.jpg", "b2.jpg", "c3.jpg"], "differ in more than their numbers"),
        (["img0.5.jpg", "img0.10.jpg", "img0.9.jpg"], "may have a fraction"),
        (["img1.jpg", "img2_again.jpg", "img3.jpg"], "differ in more than their numbers"),
    ] {
        let (code, text) = told(names);
        assert!(code == 65 && text.contains(words) && text.contains("put the names"), "{names:?}: {text}");
    }
    for names in [["1.jpg", "2.jpg", "10.jpg"], ["IMG_0001.jpg", "IMG_0002.jpg", "img_0003.jpg"]] {
        let (code, text) = told(names);
        assert!(code == 0 && text.contains("in the order of the numbers"), "{names:?}: {text}");
    }
}

#[test]
fn pictures_whose_names_do_not_say_so_are_told_by_their_content() {
    let (_folder, named) = pictures("1", "3", |of| labels(of, of.light.theta_deg(), of.view.theta_deg()));
    for path in fs::read_dir(&named).unwrap().map(|entry| entry.unwrap().path()) {
        fs::rename(&path, path.with_extension("webp")).unwrap();
    }
    let told = fail(btf().arg("info").arg(&named), 65);
    assert!(told.contains("a JPEG by its content") && told.contains(".jpg"), "{told}");
}

//! `btf judge`: real crops come out as real, spoilt ones do not, and the command tells so.

use std::path::{Path, PathBuf};
use std::process::Command;

use btfkit::archive;
use btfkit::color::{LightnessCodes, Transfer};
use btfkit::likeness::{Judge, Judgement, Lightness};
use btfkit::random::Hash;
use btfkit::sample::{MaterialKind, Scene, Surface};
use btfkit::shape::{Size, Window};
use btfkit_formats::Samples;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use serde_json::Value;

use crate::fixture::{btf, fail, fixture, shared, succeed};

/// Side of the crops that are ranked.
const SIDE: usize = 128;

/// A material of 256x256 texels under one light, seen from above.
fn sample(kind: MaterialKind) -> Lightness {
    let light = [30f64, 40.0].map(f64::to_radians);
    let scene = Scene::new(Surface::new(kind, 256, 256, 1.0, 3).unwrap(), &[light]);
    let samples = Samples::U8(scene.view(0, [0.0, 0.0]).image(0).unwrap());
    lightness(&samples, &["R", "G", "B"].map(str::to_owned))
}

/// A measured one under a light that is neither high nor low.
fn measured(name: &str) -> Option<Lightness> {
    let source = archive::open(&[shared(name)?], &archive::Options::default()).unwrap();
    let contents = source.contents();
    let off = |n: &usize| (contents.lights[*n].degrees().0 - 30.0).abs();
    let light = (0..contents.lights.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
    let samples = source.read_images(0, light..light + 1).unwrap();
    Some(lightness(&samples, &contents.channels))
}

fn lightness(samples: &Samples, channels: &[String]) -> Lightness {
    let codes = LightnessCodes::new(Transfer::Srgb, samples.sample_type(), channels, 1.0).unwrap();
    let mut plane = vec![0; 256 * 256];
    codes.fill(samples, &mut plane);
    Lightness::of_codes(Size::new(256, 256), plane)
}

/// What each way of spoiling a crop leaves of it.
fn spoilt(crop: &Lightness) -> [(&'static str, Lightness); 4] {
    let hash = Hash::new(1, 0);
    let with = |values: Vec<f64>| Lightness::new(crop.size, values);
    let small = crop.part(Window { y: 0, x: 0, size: Size::new(32, 32) });
    let at = |y: usize, x: usize| crop.values[y % SIDE * SIDE + x % SIDE];
    let blurred = (0..SIDE * SIDE).map(|n| {
        let (y, x) = (n / SIDE, n % SIDE);
        (0..9).map(|k| at(y + k / 3 + SIDE - 1, x + k % 3 + SIDE - 1)).sum::<f64>() / 9.0
    });
    let mut order: Vec<usize> = (0..SIDE * SIDE).collect();
    order.sort_by_key(|&n| hash.words(n as u32, 0, 0));
    // The crop's amplitudes with the phases of noise.
    let amplitudes = spectrum(crop.values.iter().copied());
    let phases = spectrum((0..SIDE * SIDE).map(|n| hash.normals(n as u32, 1, 0)[0]));
    let mixed = amplitudes.iter().zip(&phases).map(|(a, p)| p / p.norm() * a.norm());
    // The transform of the conjugate is the inverse's conjugate.
    let back = transformed(mixed.map(|value| value.conj()).collect());
    let mean = crop.mean()
        - back.iter().map(|value| value.re).sum::<f64>() / (SIDE * SIDE) as f64 / (SIDE * SIDE) as f64;
    [
        ("a small tile repeated", small.repeated(0, 0, crop.size)),
        ("blur", with(blurred.collect())),
        ("shuffled texels", with(order.iter().map(|&n| crop.values[n]).collect())),
        ("random phase", with(back.iter().map(|value| value.re / (SIDE * SIDE) as f64 + mean).collect())),
    ]
}

fn spectrum(values: impl Iterator<Item = f64>) -> Vec<Complex<f64>> {
    transformed(values.map(|value| Complex::new(value, 0.0)).collect())
}

/// The two-dimensional transform, transposed twice.
fn transformed(mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let transform = FftPlanner::new().plan_fft_forward(SIDE);
    for _ in 0..2 {
        transform.process(&mut values);
        values = (0..SIDE * SIDE).map(|n| values[n % SIDE * SIDE + n / SIDE]).collect();
    }
    values
}

/// The last quadrant, and what is left of it when it is spoilt, judged by the other three.
fn judged(material: &Lightness) -> (Judgement, Vec<(&'static str, Judgement)>) {
    let quadrant =
        |n: usize| material.part(Window { y: n / 2 * SIDE, x: n % 2 * SIDE, size: Size::new(SIDE, SIDE) });
    let judge = Judge::new(&[0, 1, 2].map(quadrant)).unwrap();
    let held_out = quadrant(3);
    let spoilt = spoilt(&held_out).map(|(how, crop)| (how, judge.judge(&[crop]).unwrap()));
    (judge.judge(&[held_out]).unwrap(), spoilt.to_vec())
}

#[test]
fn of_every_material_a_held_out_crop_ranks_before_spoilt_ones() {
    let names = ["corduroy", "wallpaper", "impalla"].map(|name| format!("mlvq-btf/{name}/binary.btf"));
    let made = [("leather", MaterialKind::Leather), ("wood", MaterialKind::Wood)];
    let made = made.map(|(name, kind)| (name.to_owned(), Some(sample(kind))));
    let materials = made.into_iter().chain(names.map(|name| (name.clone(), measured(&name))));
    for (name, material) in materials.filter_map(|(name, material)| Some((name, material?))) {
        let (held_out, spoilt) = judged(&material);
        for (how, found) in spoilt {
            println!("{name}: held out J {:.2}; {how} J {:.2}, {}", held_out.j, found.j, found.worst.name());
            assert!(found.j > held_out.j, "{name}, {how}: {found:?}, held out {held_out:?}");
        }
        assert!(held_out.excess_peak < 0.2, "{name}: {held_out:?}");
    }
}

/// Leather, its model and an enlargement, in a folder.
struct Leather {
    folder: tempfile::TempDir,
}

impl Leather {
    fn new() -> Self {
        let leather = Self { folder: tempfile::tempdir().unwrap() };
        let [archive, store, model, big] =
            ["a.zip", "a.zarr", "a.model.zarr", "big.zarr"].map(|n| leather.at(n));
        let options = ["--material", "leather", "--size", "192x192", "--views", "3", "--lights", "9"];
        succeed(btf().arg("sample").arg(&archive).args(options));
        succeed(btf().arg("import").args([&archive, &store]));
        succeed(btf().arg("model").args([&store, &model]).args(["--clusters", "32"]));
        succeed(btf().arg("enlarge").args([&model, &big]).args(["--size", "288x256"]));
        leather
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn judge(&self, subject: &str) -> Command {
        let mut command = btf();
        command.arg("judge").arg(self.at(subject)).arg("--against").arg(self.at("a.zarr"));
        command
    }
}

/// The figures of a judgement.
fn figures(command: &mut Command) -> Value {
    serde_json::from_str(&succeed(command.arg("--json"))).unwrap()
}

#[test]
fn an_enlargement_is_judged_three_times_alike_on_any_number_of_threads() {
    let leather = Leather::new();
    let [(report, sheet), (again, other_sheet)] = ["1", "3"].map(|threads| {
        let sheet = leather.at(&format!("{threads}.png"));
        let mut command = leather.judge("big.zarr");
        command.arg("--picture").arg(&sheet).args(["--threads", threads]);
        (figures(&mut command), std::fs::read(sheet).unwrap())
    });
    assert!(report == again && sheet == other_sheet);
    let told = succeed(&mut leather.judge("big.zarr"));
    assert!(told.contains("quadrants of the measurement") && told.contains("enlargement alone"), "{told}");
    assert_eq!((&report["origin"], &report["crop"]), (&"quadrants".into(), &96.into()));
    assert_eq!(report["size"], serde_json::json!([256, 288]));
    let pairs = report["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 5);
    for rows in pairs.iter().chain([&report["mean"]]) {
        for row in ["own", "alone", "with_model"] {
            let j = rows[row]["j"].as_f64().unwrap();
            let worst = rows[row]["worst"].as_str().unwrap();
            assert!(j > 0.3 && j < 30.0 && rows[row]["measures"][worst].is_f64(), "{row}: {}", rows[row]);
        }
    }
    for component in ["x", "y"] {
        assert!(
            report["normals"][component]["enlarged"]["j"].as_f64().unwrap() > 0.3,
            "{}",
            report["normals"]
        );
    }
    let share = |name: &str| report["verdict"][name].as_f64().unwrap();
    assert!(share("shares") > 0.7 && share("shares") <= 1.0, "{}", report["verdict"]);
    assert!(share("largest_copy") > 0.0 && share("largest_copy") < 0.5, "{}", report["verdict"]);

    // A part of the endless plane from the same seed is the same surface.
    let plane = figures(leather.judge("a.model.zarr").args(["--size", "288x256"]));
    let (mut plane, mut stored) = (plane, report);
    for report in [&mut plane, &mut stored] {
        report.as_object_mut().unwrap().remove("subject");
    }
    assert_eq!(plane, stored);

    // The paper's method knows no sources.
    let paper = leather.at("paper.zarr");
    succeed(
        btf()
            .arg("enlarge")
            .arg(leather.at("a.model.zarr"))
            .arg(&paper)
            .args(["--size", "256x256", "--method", "paper"]),
    );
    let report = figures(leather.judge("paper.zarr").args(["--pair", "0,1", "--crop", "64"]));
    assert!(report["mean"]["alone"].is_null() && report["verdict"]["largest_copy"].is_null());
    assert!(report["normals"]["reason"].as_str().unwrap().contains("--keep-normals"));
    assert_eq!((report["pairs"].as_array().unwrap().len(), &report["crop"]), (1, &64.into()));

    for (arguments, code, part) in [
        (&["--pair", "3,0"][..], 2, "a view from 0 to 2"),
        (&["--pair", "3"], 2, "VIEW,LIGHT"),
        (&["--crop", "100"], 2, "multiple of 16"),
        (&["--size", "9x9"], 2, "--size is for a model"),
        (&["--picture", "sheet.exr"], 2, ".png"),
    ] {
        let told = fail(leather.judge("big.zarr").args(arguments), code);
        assert!(told.contains(part), "{told}");
    }
    assert!(fail(&mut leather.judge("a.model.zarr"), 2).contains("--size WIDTHxHEIGHT"));
    assert!(fail(&mut leather.judge("a.zarr"), 65).contains("a measurement, expected"));
    assert!(fail(&mut leather.judge("nothing.zarr"), 66).contains("no store here"));
    fail(leather.judge("a.model.zarr").args(["--size", "60x256"]), 65);
    let mut other = btf();
    other.arg("judge").arg(leather.at("big.zarr")).arg("--against").arg(fixture().measurement());
    assert!(fail(&mut other, 65).contains("another measurement"));
}

/// Runs parts of a judging in this order, each of so many, then puts them together: figures and picture are those of one.
fn shared_as_one(judge: impl Fn() -> Command, folder: &Path, shards: &[&str], parts: usize) {
    let told = |more: &[&str], picture: &str| {
        let picture = folder.join(picture);
        let told = succeed(judge().arg("--json").arg("--picture").arg(&picture).args(more));
        (told, std::fs::read(picture).ok())
    };
    let expected = told(&[], "one.png");
    let kept = folder.join("parts");
    let partial = ["--partial", kept.to_str().unwrap()];
    let reduce = [&partial[..], &["--reduce"]].concat();
    assert!(fail(judge().args(&reduce), 66).contains(&format!("0 of {parts} parts judged")));
    let (last, before) = shards.split_last().unwrap();
    for shard in before {
        let (told, picture) = told(&[&partial[..], &["--shard", shard]].concat(), "part.png");
        assert!(told.contains(&format!("of {parts} parts judged")) && picture.is_none(), "{told}");
        assert!(fail(judge().args(&reduce), 66).contains("--shard K/N"));
    }
    // Whoever comes last tells the figures.
    assert!(told(&[&partial[..], &["--shard", last, "--threads", "1"]].concat(), "last.png") == expected);
    assert!(told(&reduce, "reduced.png") == expected);
    // A damaged part counts as missing, and is made again.
    let files = crate::fixture::tree_names(&kept);
    assert_eq!(files.len(), parts);
    let bytes = std::fs::read(&files[1]).unwrap();
    std::fs::write(&files[1], &bytes[..bytes.len() / 2]).unwrap();
    assert!(fail(judge().args(&reduce), 66).contains(&format!("{} of {parts} parts", parts - 1)));
    assert!(told(&partial, "again.png") == expected);
    assert!(std::fs::read(&files[1]).unwrap() == bytes);
    std::fs::remove_dir_all(kept).unwrap();
}

#[test]
fn parts_of_a_judging_by_any_number_of_jobs_give_the_figures_of_one() {
    let leather = Leather::new();
    let one = tempfile::tempdir().unwrap();
    shared_as_one(|| leather.judge("big.zarr"), one.path(), &["2/3", "0/3", "2/3", "1/3"], 7);
    let other = tempfile::tempdir().unwrap();
    let plane = || {
        let mut command = leather.judge("a.model.zarr");
        command.args(["--size", "288x256", "--pair", "0,1", "--crop", "64"]);
        command
    };
    shared_as_one(plane, other.path(), &["5/7", "0/2", "4/7", "1/2"], 3);
    // What is judged otherwise shares nothing.
    let kept = other.path().join("parts");
    succeed(plane().arg("--partial").arg(&kept));
    for more in [&["--pair", "0,0"][..], &["--pair", "0,1", "--crop", "80"]] {
        let mut command = leather.judge("a.model.zarr");
        command.args(["--size", "288x256"]).args(more).arg("--partial").arg(&kept).arg("--reduce");
        assert!(fail(&mut command, 66).contains("0 of 3 parts"), "{more:?}");
    }
}

#[test]
fn a_measurement_that_is_too_small_is_named() {
    let mut command = btf();
    command.arg("judge").arg(fixture().enlarged()).arg("--against").arg(fixture().measurement());
    let told = fail(&mut command, 65);
    assert!(told.contains("48x56") || told.contains("56x48"), "{told}");
    assert!(told.contains("128x128"), "{told}");
}

/// A floor of square stones, 48 texels apart, of different greys: 192x192 texels, under four lights.
fn floor_of_stones(at: &Path) {
    const SIDE: usize = 192;
    const PERIOD: usize = 48;
    let hash = Hash::new(1, 0);
    let grey = |y: usize, x: usize, light: usize| {
        let noise = hash.uniforms(y as u32, x as u32, 0)[0];
        let stone = hash.uniforms((y / PERIOD) as u32, (x / PERIOD) as u32, 1)[0];
        let (in_y, in_x) = (y % PERIOD, x % PERIOD);
        let depth = if in_y.min(in_x) < 5 { 60.0 } else { 0.0 };
        let edge = if [in_y, in_x, PERIOD - 1 - in_y, PERIOD - 1 - in_x][light] == 5 { 40.0 } else { 0.0 };
        (130.0 + 30.0 * stone + 20.0 * noise + edge - depth) as u8
    };
    let light = |n: usize| (0..SIDE * SIDE).flat_map(move |at| [grey(at / SIDE, at % SIDE, n); 3]);
    let values: Vec<u8> = (0..4).flat_map(light).collect();
    let header = btfkit_formats::npy::header([1, 4, 192, 192, 3], btfkit_formats::SampleType::U8);
    std::fs::write(at.with_extension("npy"), [header, values].concat()).unwrap();
    let directions = |angles: &[[f64; 2]]| {
        let directions: Vec<_> =
            angles.iter().map(|&[theta, phi]| btfkit_formats::Direction::from_degrees(theta, phi)).collect();
        btfkit_formats::npy::directions_file(&directions)
    };
    std::fs::write(at.with_extension("views.npy"), directions(&[[0.0, 0.0]])).unwrap();
    let lights = [[45.0, 0.0], [45.0, 90.0], [45.0, 180.0], [45.0, 270.0]];
    std::fs::write(at.with_extension("lights.npy"), directions(&lights)).unwrap();
}

#[test]
fn where_an_enlargement_of_a_regular_material_begins_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, store, model] = ["a.npy", "a.zarr", "a.model.zarr"].map(|name| folder.path().join(name));
    floor_of_stones(&archive);
    succeed(btf().arg("import").args([&archive, &store]));
    succeed(btf().arg("tile").args([&store, &model]).args(["--tile", "none"]));
    succeed(btf().arg("cluster").args([&store, &model]).args(["--clusters", "64"]));
    succeed(btf().arg("appearance").arg(&model));
    // The four quadrants that it is judged by lie two periods apart, the middle and the last crops anywhere.
    let mut found = Vec::new();
    for size in ["288x288", "305x331"] {
        let mut command = btf();
        command
            .arg("judge")
            .arg(&model)
            .arg("--against")
            .arg(&store)
            .args(["--size", size])
            .args(["--pair", "0,0", "--pair", "0,1"]);
        let report = figures(&mut command);
        assert_eq!(report["in_phase_within"], serde_json::json!([48, 48]), "{size}");
        found.push(["own", "alone"].map(|row| report["mean"][row]["j"].as_f64().unwrap()));
        println!("{size}: {:?}", found.last());
    }
    // Whoever judges a part moves the crops to the same places.
    let judge = || {
        let mut command = btf();
        command.arg("judge").arg(&model).arg("--against").arg(&store).args(["--size", "305x331"]);
        command.args(["--pair", "0,0", "--pair", "0,1"]);
        command
    };
    shared_as_one(judge, folder.path(), &["2/4", "0/2", "3/4", "1/4"], 4);
    for [own, alone] in &found {
        assert!((own - found[0][0]).abs() < 0.05 && (alone - found[0][1]).abs() < 0.2, "{found:?}");
        assert!(*own < 1.3 && *alone < 2.3, "{found:?}");
    }
}

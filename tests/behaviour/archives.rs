//! Archives of every format become measurements, and measurements archives, without a changed sample.

use std::path::{Path, PathBuf};

use btfkit::store::measurement::Measurement;
use btfkit_formats::picture::{self, Picture};
use btfkit_formats::{SampleType, Samples, f16};

use crate::fixture::{assert_same, btf, fail, fixture, model_of, succeed, tree, unpack};

/// Samples of a measurement's view.
fn view(store: &Path, view: usize) -> Samples {
    let measurement = Measurement::open(store).unwrap();
    measurement.read_reflectance(view, measurement.description().size.window()).unwrap()
}

fn import(archives: &[&Path], store: &Path, options: &[&str]) -> String {
    succeed(btf().arg("import").args(archives).arg(store).args(options))
}

/// A value for every sample of a small measurement of 2 views, 3 lights, 5 rows, 4 columns.
fn value(view: usize, light: usize, y: usize, x: usize, channel: usize) -> f32 {
    (view * 7 + light * 5 + y * 3 + x * 2 + channel) as f32 / 64.0
}

/// Writes that measurement as pictures named by a pattern; returns the folder.
fn pictures(
    folder: &Path,
    extension: &str,
    channels: &[&str],
    name: impl Fn(usize, usize) -> String,
) -> PathBuf {
    let root = folder.join(format!("pictures-{extension}"));
    std::fs::create_dir_all(&root).unwrap();
    for v in 0..2 {
        for l in 0..3 {
            let values = (0..5).flat_map(|y| {
                (0..4).flat_map(move |x| (0..channels.len()).map(move |c| value(v, l, y, x, c)))
            });
            let samples = match extension {
                "exr" => Samples::F16(values.map(f16::from_f32).collect()),
                _ => Samples::U8(values.map(|value| (255.0 * value) as u8).collect()),
            };
            let channels = channels.iter().map(ToString::to_string).collect();
            let picture = Picture { width: 4, height: 5, channels, samples };
            let bytes = match extension {
                "exr" => picture::exr::encode(&picture, picture::exr::Compression::Zip).unwrap(),
                _ => picture::png::encode(&picture).unwrap(),
            };
            std::fs::write(root.join(format!("{}.{extension}", name(v, l))), bytes).unwrap();
        }
    }
    root
}

#[test]
fn exports_that_are_lossless_come_back_sample_by_sample() {
    let folder = tempfile::tempdir().unwrap();
    let measured = fixture().measurement();
    for (format, output) in [("npy", "m.npy"), ("png", "m-png"), ("exr", "m-exr"), ("hdf5", "m.h5")] {
        if format == "hdf5" && !cfg!(feature = "hdf5") {
            continue;
        }
        let archive = folder.path().join(output);
        let again = folder.path().join(format!("{format}.zarr"));
        succeed(btf().arg("export").args([&measured, &archive]).args(["--to", format]));
        // Pictures of halves hold 8-bit sRGB values linearly; made 8-bit sRGB again they are the same.
        let options: &[&str] = if format == "exr" { &["--samples", "f16"] } else { &[] };
        import(&[&archive], &again, options);
        let told = succeed(btf().arg("verify").arg(&again).arg("--source").arg(&archive).args(options));
        assert!(told.contains("unlike the archive's"), "{told}");
        for v in [0, 5] {
            let (found, expected) = (view(&again, v), view(&measured, v));
            if format == "exr" {
                let codes =
                    (0..found.len()).map(|at| btfkit::color::srgb_encode_u8(found.value(at).unwrap()));
                assert_eq!(Samples::U8(codes.collect()), expected);
            } else {
                assert_eq!(found, expected, "{format}, view {v}");
            }
        }
        let directions = |store: &Path| {
            let d = Measurement::open(store).unwrap().description().clone();
            d.views.iter().chain(&d.lights).map(|d| d.vector()).collect::<Vec<_>>()
        };
        for (a, b) in directions(&again).iter().zip(directions(&measured)) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{format}: {a:?} {b:?}");
        }
    }
}

#[test]
fn containers_of_bonn_are_exact_at_full_rank_and_near_at_a_lower_one() {
    let folder = tempfile::tempdir().unwrap();
    let small = folder.path().join("small.zip");
    succeed(btf().arg("sample").arg(&small).args(["--size", "9x7", "--views", "5", "--lights", "8"]));
    let measured = folder.path().join("small.zarr");
    import(&[&small], &measured, &[]);
    let linear = |samples: &Samples| -> Vec<f64> {
        let curve = match samples.sample_type() {
            SampleType::U8 => btfkit::color::Transfer::Srgb,
            _ => btfkit::color::Transfer::Linear,
        };
        (0..samples.len()).map(|at| curve.decode(samples.value(at).unwrap())).collect()
    };
    for (format, rank, most) in
        [("dfmf", None, 5e-4), ("fmf", None, 5e-4), ("dfmf", Some("12"), 0.2), ("fmf", Some("20"), 0.2)]
    {
        let archive = folder.path().join(format!("{format}-{}.btf", rank.unwrap_or("full")));
        let again = archive.with_extension("zarr");
        let mut export = btf();
        export.arg("export").args([&measured, &archive]).args(["--to", format]);
        rank.map(|rank| export.args(["--rank", rank]));
        succeed(&mut export);
        import(&[&archive], &again, &[]);
        for v in 0..5 {
            let [found, expected] = [linear(&view(&again, v)), linear(&view(&measured, v))];
            let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst <= most, "{format} {rank:?} view {v}: {worst}");
        }
    }
}

#[test]
fn pictures_are_found_by_names_pattern_table_and_light_list() {
    let folder = tempfile::tempdir().unwrap();
    let expect = |store: &Path, l: usize| {
        let Samples::U8(found) = view(store, 1) else { panic!("not 8-bit") };
        // Row 2, column 3 of light l: [y, x, light, channel].
        let at = ((2 * 4 + 3) * 3 + l) * 3;
        assert_eq!(found[at + 1], (255.0 * value(1, l, 2, 3, 1)) as u8);
    };
    let angles = |v: usize, l: usize| (30 * v, 15 * (l + 1), 90 * l);
    let rgb = ["R", "G", "B"];
    let labelled = pictures(&folder.path().join("a"), "png", &rgb, |v, l| {
        let (tv, ti, pi) = angles(v, l);
        format!("wool thetaI={ti} phiI={pi} thetaV={tv} phiV=0")
    });
    let by_label = folder.path().join("label.zarr");
    import(&[&labelled], &by_label, &[]);
    expect(&by_label, 2);
    let bare = pictures(&folder.path().join("b"), "png", &rgb, |v, l| {
        let (tv, ti, pi) = angles(v, l);
        format!("{tv}_0_{ti}_{pi}")
    });
    let told = fail(btf().arg("info").arg(&bare), 65);
    assert!(told.contains("--pattern"), "{told}");
    let by_pattern = folder.path().join("pattern.zarr");
    import(&[&bare], &by_pattern, &["--pattern", "{theta_v}_{phi_v}_{theta_i}_{phi_i}.png"]);
    expect(&by_pattern, 1);
    let mut table = "file,theta_i,phi_i,theta_v,phi_v\n".to_owned();
    let numbered = pictures(&folder.path().join("c"), "png", &rgb, |v, l| format!("shot-{v}{l}"));
    for v in 0..2 {
        for l in 0..3 {
            let (tv, ti, pi) = angles(v, l);
            table += &format!("shot-{v}{l}.png,{ti},{pi},{tv},0\n");
        }
    }
    let list = numbered.join("table.csv");
    std::fs::write(&list, table).unwrap();
    let by_table = folder.path().join("table.zarr");
    import(&[&numbered], &by_table, &["--table", list.to_str().unwrap()]);
    expect(&by_table, 0);
    let lamps = "3\nshot-00.png 0 0 1\nshot-01.png 1 0 1\nshot-02.png 0 1 1\n";
    std::fs::write(numbered.join("lamps.lp"), lamps).unwrap();
    let by_list = folder.path().join("list.zarr");
    import(&[&numbered.join("lamps.lp")], &by_list, &[]);
    let measurement = Measurement::open(&by_list).unwrap();
    assert_eq!((measurement.description().views.len(), measurement.description().lights.len()), (1, 3));
}

#[test]
fn spectral_pictures_keep_their_channels_and_have_a_luminance() {
    let folder = tempfile::tempdir().unwrap();
    let channels = ["450nm", "550nm", "650nm", "750nm"];
    let root =
        pictures(folder.path(), "exr", &channels, |v, l| format!("tv{}_pv0_tl30_pl{}", 15 * v, 120 * l));
    let store = folder.path().join("spectral.zarr");
    import(&[&root], &store, &[]);
    let measurement = Measurement::open(&store).unwrap();
    assert_eq!(measurement.description().channels, channels);
    assert_eq!(measurement.description().sample_type, SampleType::F16);
    let Samples::F16(found) = view(&store, 1) else { panic!("not halves") };
    assert_eq!(found[(2 * 4 + 1) * 12 + 4 + 3].to_f32(), f16::from_f32(value(1, 1, 2, 1, 3)).to_f32());
    succeed(btf().arg("verify").arg(&store).arg("--source").arg(&root));
}

#[test]
fn floats_go_through_the_whole_method() {
    let folder = tempfile::tempdir().unwrap();
    let archive = fixture().archive();
    let [store, model, big] = ["f.zarr", "f.model.zarr", "f.big.zarr"].map(|name| folder.path().join(name));
    import(&[&archive], &store, &["--samples", "f32"]);
    succeed(&mut model_of(&store, &model));
    succeed(btf().arg("enlarge").args([&model, &big]).args(["--size", "64x64"]));
    succeed(
        btf()
            .arg("image")
            .arg(&big)
            .args(["--light", "15,0", "--view", "0,0", "--out"])
            .arg(folder.path().join("f.png")),
    );
    succeed(btf().arg("compare").args([&model, &store]));
    // The same codes, so the same clusters as the 8-bit samples.
    let index = |model: &Path| tree(&model.join("index"));
    assert!(index(&model) == index(&fixture().model()));
}

#[test]
fn repairs_are_applied_and_kept_in_the_recipe() {
    let folder = tempfile::tempdir().unwrap();
    let archive = fixture().archive();
    let plain = fixture().measurement();
    let mended = folder.path().join("mended.zarr");
    let options = ["--azimuth", "mirrored-lights", "--transpose", "--drop-view", "1"];
    import(&[&archive], &mended, &options);
    let [a, b] = [&plain, &mended].map(|store| Measurement::open(store).unwrap().description().clone());
    assert_eq!(b.views.len(), a.views.len() - 1);
    assert_eq!((b.size.width, b.size.height), (a.size.height, a.size.width));
    let turned = (b.lights[3].phi_rad + a.lights[3].phi_rad).rem_euclid(std::f64::consts::TAU);
    assert!(turned.abs() < 1e-9 || (turned - std::f64::consts::TAU).abs() < 1e-9, "{turned}");
    let (Samples::U8(first), Samples::U8(second)) = (view(&plain, 2), view(&mended, 1)) else { panic!() };
    let texel = a.texel_samples();
    let at = |y: usize, x: usize, width: usize| (y * width + x) * texel + 7;
    assert_eq!(first[at(5, 9, a.size.width)], second[at(9, 5, b.size.width)]);
    let told = fail(btf().arg("import").args([&archive, &mended]), 65);
    assert!(told.contains("another recipe"), "{told}");
    succeed(btf().arg("verify").arg(&mended).arg("--source").arg(&archive).args(options));
}

#[test]
fn many_archives_go_in_one_run_and_a_bad_one_does_not_stop_them() {
    let folder = tempfile::tempdir().unwrap();
    let stores = folder.path().join("stores");
    let [good, bad, other] = ["good.zip", "bad.zip", "other.zip"].map(|name| folder.path().join(name));
    std::fs::copy(fixture().archive(), &good).unwrap();
    std::fs::copy(fixture().archive(), &other).unwrap();
    std::fs::write(&bad, &std::fs::read(&good).unwrap()[..5000]).unwrap();
    let output = btf().arg("import").args([&good, &bad, &other]).arg("--into").arg(&stores).output().unwrap();
    assert_eq!(output.status.code(), Some(65));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("failed") && told.contains("views written"), "{told}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("bad.zip") && told.contains("2 done, 1 failed: "), "{said}");
    assert_same(&stores.join("good.zarr"), &fixture().measurement());
    assert_same(&stores.join("other.zarr"), &fixture().measurement());
    assert!(!stores.join("bad.zarr").exists());
}

#[test]
fn pieces_of_one_measurement_are_joined() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    unpack(&fixture().archive(), &images);
    // A zip for each view.
    let zips = folder.path().join("zips");
    std::fs::create_dir_all(&zips).unwrap();
    let mut pieces = Vec::new();
    for entry in std::fs::read_dir(&images).unwrap() {
        let view = entry.unwrap().path();
        let mut zip = btfkit_formats::zip::ZipWriter::new(Vec::new());
        for file in std::fs::read_dir(&view).unwrap() {
            let file = file.unwrap().path();
            zip.write_entry(file.file_name().unwrap().to_str().unwrap(), &std::fs::read(&file).unwrap())
                .unwrap();
        }
        let piece = zips.join(format!("{}.zip", view.file_name().unwrap().to_str().unwrap()));
        std::fs::write(&piece, zip.finish().unwrap()).unwrap();
        pieces.push(piece);
    }
    let (by_folder, by_list) = (folder.path().join("a.zarr"), folder.path().join("b.zarr"));
    import(&[&zips], &by_folder, &[]);
    import(&pieces.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &by_list, &[]);
    assert_same(&by_folder, &fixture().measurement());
    assert_same(&by_list, &fixture().measurement());
}

#[test]
fn info_tells_what_an_archive_is_and_how_large_its_store_will_be() {
    let told = succeed(btf().arg("info").arg(fixture().archive()));
    for part in ["UBO2003", "9, theta 0.0 to 75.0", "48", "R G B, uint8", "srgb", "store, about"] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

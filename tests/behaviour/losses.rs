//! What a format does not hold of what is put into it is said.

use std::path::Path;

use btfkit_formats::picture::{Picture, exr};
use btfkit_formats::{Samples, picture};

use crate::fixture::{btf, fixture, succeed};

/// A folder of EXRs of three lights, with values beyond white, below 0, and NaN.
fn measurement(folder: &Path, channels: &[&str], beyond: bool) -> std::path::PathBuf {
    let pictures = folder.join("pictures");
    std::fs::create_dir_all(&pictures).unwrap();
    for (number, phi) in [0, 90, 180].into_iter().enumerate() {
        let values: Vec<f32> =
            (0..64 * channels.len()).map(|n| 0.1 + (n % (7 + number)) as f32 / 20.0).collect();
        let mut samples = values;
        if beyond {
            samples[..4 * channels.len()].fill(1.5);
            samples[4 * channels.len()..5 * channels.len()].fill(-0.5);
            samples[5 * channels.len()..6 * channels.len()].fill(f32::NAN);
        }
        let picture = Picture {
            width: 8,
            height: 8,
            channels: channels.iter().map(|&name| name.to_owned()).collect(),
            samples: Samples::F32(samples),
        };
        let bytes = exr::encode(&picture, picture::exr::Compression::Zip).unwrap();
        std::fs::write(pictures.join(format!("tv0_pv0_tl30_pl{phi}.exr")), bytes).unwrap();
    }
    let store = folder.join("m.zarr");
    succeed(btf().arg("import").args([&pictures, &store]));
    store
}

#[test]
fn floats_and_spectra_that_become_display_values_are_counted_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let store = measurement(folder.path(), &["R", "G", "B"], true);
    let at = |name: &str| folder.path().join(name);
    let told = succeed(btf().arg("export").arg(&store).arg(at("e.zip")));
    assert!(told.contains("note: not held: float32 samples became 8-bit sRGB codes"), "{told}");
    let counted = "36 values above white (1), stored as white; 9 values below 0, stored as black; 9 values not finite, stored as black";
    assert!(told.contains(counted), "{told}");
    // Said again of what is found done.
    let again = succeed(btf().arg("export").arg(&store).arg(at("e.zip")));
    assert!(again.contains("found done") && again.contains(counted), "{again}");
    for name in ["i.png", "i.jpg", "i.webp", "i.tif", "i.dzi"] {
        let mut command = btf();
        match name.ends_with("dzi") {
            true => command.arg("export").arg(&store).arg(at(name)).args(["--light", "30,0"]),
            false => command.arg("image").arg(&store).args(["--light", "30,0", "--out"]).arg(at(name)),
        };
        let told = succeed(&mut command);
        assert!(
            told.contains("12 values above white (1)") && told.contains("3 values below 0"),
            "{name}: {told}"
        );
    }
    // What holds everything says nothing.
    let mut keeps = vec!["e.npy", "e-exr"];
    if cfg!(feature = "hdf5") {
        keeps.push("e.h5");
    }
    for name in keeps {
        let mut command = btf();
        command.arg("export").arg(&store).arg(at(name));
        if name == "e-exr" {
            command.args(["--to", "exr"]);
        }
        let told = succeed(&mut command);
        assert!(!told.contains("not held"), "{name}: {told}");
    }
    // A picture of linear values holds all but what is no number.
    let told = succeed(btf().arg("image").arg(&store).args(["--light", "30,0", "--out"]).arg(at("i.exr")));
    assert!(told.contains("note: not held: 3 values not finite, stored as black"), "{told}");
}

#[test]
fn wavelengths_and_components_that_are_left_out_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let store = measurement(folder.path(), &["450nm", "550nm", "650nm", "700nm"], false);
    let told = succeed(btf().arg("export").arg(&store).arg(folder.path().join("e.zip")));
    assert!(
        told.contains("not held: the wavelengths of 4 channels, 450nm to 700nm; they became R, G and B"),
        "{told}"
    );
    let told = succeed(
        btf()
            .arg("export")
            .arg(fixture().measurement())
            .arg(folder.path().join("e.btf"))
            .args(["--rank", "2"]),
    );
    assert!(told.contains("not held: all but 2 components of"), "{told}");
    let told = succeed(btf().arg("export").arg(fixture().measurement()).arg(folder.path().join("e8.zip")));
    assert!(!told.contains("note"), "{told}");
}

/// Of samples that are no numbers the ratio of signal and noise is taken without them, and says so; of nothing else
/// there is none.
#[test]
fn a_comparison_leaves_out_what_is_no_number_and_counts_it() {
    let folder = tempfile::tempdir().unwrap();
    let compare = |store: &Path, clusters: &str| -> serde_json::Value {
        let model = store.with_extension(format!("{clusters}.model.zarr"));
        let mut tile = btf();
        succeed(tile.arg("tile").args([store, &model]).args(["--tile", "none"]));
        succeed(btf().arg("cluster").args([store, &model]).args(["--clusters", clusters]));
        // In either order: what they are tells which is which.
        let [told, swapped] = [[store, model.as_path()], [&model, store]]
            .map(|named| succeed(btf().arg("compare").args(named).arg("--json")));
        assert_eq!(told, swapped);
        serde_json::from_str::<serde_json::Value>(&told).unwrap()["all"].clone()
    };
    // One texel of 64 under 3 lights holds none, of 3 channels.
    let some = folder.path().join("some");
    let store = measurement(&some, &["R", "G", "B"], true);
    let all = compare(&store, "4");
    assert_eq!(all["samples_left_out"], 9, "{all}");
    assert_eq!(all["samples"], "different", "{all}");
    assert!(all["psnr_db"].as_f64().is_some_and(f64::is_finite), "{all}");
    let told = succeed(btf().arg("compare").arg(store.with_extension("4.model.zarr")).arg(&store));
    assert!(told.contains("9 samples"), "{told}");
    // A cluster for every texel: equal.
    let none = folder.path().join("none");
    let all = compare(&measurement(&none, &["R", "G", "B"], false), "64");
    assert_eq!((&all["samples_left_out"], &all["samples"]), (&0.into(), &"equal".into()), "{all}");
    assert!(all["psnr_db"].is_null(), "{all}");
}

/// Clusters are formed by lightness: texels of one lightness and two hues share one, and the comparison warns of it.
#[test]
fn hues_that_clusters_do_not_tell_apart_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let compare = |name: &str, halves: [[f32; 3]; 2]| {
        let pictures = folder.path().join(name);
        std::fs::create_dir_all(&pictures).unwrap();
        for phi in [0, 90, 180] {
            let samples = (0..64).flat_map(|texel| halves[texel % 2]).collect();
            let channels = ["R", "G", "B"].map(str::to_owned).to_vec();
            let picture = Picture { width: 8, height: 8, channels, samples: Samples::F32(samples) };
            let bytes = exr::encode(&picture, exr::Compression::Zip).unwrap();
            std::fs::write(pictures.join(format!("tv0_pv0_tl30_pl{phi}.exr")), bytes).unwrap();
        }
        let [store, model] = ["zarr", "model.zarr"].map(|ending| pictures.with_extension(ending));
        succeed(btf().arg("import").args([&pictures, &store]));
        succeed(btf().arg("tile").args([&store, &model]).args(["--tile", "none"]));
        succeed(btf().arg("cluster").args([&store, &model]).args(["--clusters", "1"]));
        let figures = succeed(btf().arg("compare").args([&model, &store]).arg("--json"));
        let figures: serde_json::Value = serde_json::from_str(&figures).unwrap();
        (succeed(btf().arg("compare").args([&model, &store])), figures["all"].clone())
    };
    // Red and green of one luminance.
    let (told, all) = compare("hues", [[0.6, 0.1, 0.1], [0.1, 0.2486, 0.1]]);
    assert!(told.contains("warning: colours are off by") && told.contains("--clusters"), "{told}");
    // One half is the representative; of the other half each is far away, so that 95 % are not nearer than that.
    let [mean, most] = ["ciede2000", "ciede2000_95"].map(|name| all[name].as_f64().unwrap());
    assert!(mean > 15.0 && (most - 2.0 * mean).abs() < 0.1, "{all}");
    assert!(all["lightness"].as_f64().unwrap() < 0.5, "{all}");
    // Two lightnesses of one hue are as far apart in colour as in lightness.
    let (told, all) = compare("greys", [[0.2, 0.2, 0.2], [0.4, 0.4, 0.4]]);
    assert!(!told.contains("warning"), "{told} {all}");
}

//! Real measurements, where they are at hand beside the project; their licences keep them out of it.

use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use serde_json::Value;

use crate::fixture::{btf, shared, succeed};

#[test]
fn original_photographs_are_imported_and_have_upright_normals() {
    let Some(archive) = shared("ubo2003-wallpaper-view0/MANYFILES") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = (folder.path().join("wallpaper.zarr"), folder.path().join("wallpaper.model.zarr"));
    succeed(btf().arg("import").args([&archive, &store]));
    let measurement = Measurement::open(&store).unwrap();
    assert_eq!((measurement.description().views.len(), measurement.description().lights.len()), (1, 81));
    // Means of the 8-bit values by light elevation, as found by another decoder.
    let samples = measurement.read_reflectance(0, measurement.description().size.window()).unwrap();
    let btfkit_formats::Samples::U8(samples) = samples else { panic!("not 8-bit") };
    for (light, expected) in [(0, 150.0), (60, 52.0)] {
        let values = samples.chunks_exact(3).skip(light).step_by(81).flatten().map(|&s| f64::from(s));
        let mean = values.sum::<f64>() / (256.0 * 256.0 * 3.0);
        assert!((mean - expected).abs() < 8.0, "light {light}: {mean}");
    }
    succeed(btf().arg("tile").args([&store, &model]));
    succeed(btf().arg("normals").args([&store, &model]));
    let report: Value =
        Value::Object(Model::open(&model).unwrap().report(btfkit::store::model::Stage::Normals).unwrap());
    assert!(report["mean"][2].as_f64().unwrap() > 0.98, "{report}");
}

#[test]
fn virtual_leather_has_the_normals_that_it_was_rendered_with() {
    let (Some(archive), Some(truth)) =
        (shared("virtual-leather/VLEATHER64.zip"), shared("virtual-leather/normals.npy"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (store, model) = (folder.path().join("leather.zarr"), folder.path().join("leather.model.zarr"));
    succeed(btf().arg("import").args([&archive, &store]));
    succeed(btf().arg("model").args([&store, &model]).args(["--tile", "periodic", "--clusters", "64"]));
    let bytes = std::fs::read(truth).unwrap();
    let truth: Vec<f32> = bytes[bytes.len() - 64 * 64 * 12..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let model = Model::open(&model).unwrap();
    let angle = |(found, truth): (&[f32; 3], &[f32])| {
        let cosine: f32 = found.iter().zip(truth).map(|(a, b)| a * b).sum();
        f64::from(cosine.clamp(-1.0, 1.0)).acos().to_degrees()
    };
    let normals = model.normals().unwrap();
    let mean = normals.iter().zip(truth.chunks_exact(3)).map(angle).sum::<f64>() / (64.0 * 64.0);
    // The data's own figure for plain least squares on linear luminance is 4.11 degrees.
    assert!((mean - 4.11).abs() < 0.05, "{mean}");
    let report: Value = Value::Object(model.report(btfkit::store::model::Stage::Cluster).unwrap());
    let error =
        report["passes"].as_array().unwrap().last().unwrap()["mean_lightness_error"].as_f64().unwrap();
    // L1 K-means with 64 centres reaches 5.296 by the data's own figure; medians do better.
    assert!(error < 5.296, "{error}");
}

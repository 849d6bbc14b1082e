//! Pictures at measured directions are the stored samples themselves.

use std::path::Path;

use btfkit::color::Transfer;
use btfkit::store::enlarged::Enlarged;
use btfkit::store::measurement::Measurement;
use btfkit::store::model::Model;
use btfkit_formats::Samples;

use crate::fixture::{btf, fixture, succeed};

/// The 8-bit pixels of `btf image` at view 4 and light 11 of the fixture.
fn pixels(source: &Path, view: usize, light: usize) -> Vec<u8> {
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let angles = |direction: btfkit_formats::Direction| {
        let (theta, phi) = direction.degrees();
        format!("{theta},{phi}")
    };
    let [view, light] =
        [measurement.description().views[view], measurement.description().lights[light]].map(angles);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.png");
    succeed(btf().arg("image").arg(source).args(["--view", &view, "--light", &light]).arg("--out").arg(&out));
    let file = std::io::BufReader::new(std::fs::File::open(&out).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut samples).unwrap();
    samples
}

#[test]
fn the_measurement_shows_its_samples() {
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let lights = measurement.description().lights.len();
    let stored = measurement.read_reflectance(4, measurement.description().size.window()).unwrap();
    let Samples::U8(stored) = stored else { panic!("not 8-bit") };
    let expected: Vec<u8> =
        stored.chunks_exact(lights * 3).flat_map(|texel| &texel[33..36]).copied().collect();
    assert_eq!(pixels(&fixture().measurement(), 4, 11), expected);
}

#[test]
fn tile_and_enlarged_index_show_the_samples_of_the_representatives() {
    let model = Model::open(&fixture().model()).unwrap();
    let representatives = model.representatives().unwrap();
    let [_, views, lights, channels] = representatives.shape;
    assert_eq!(representatives.transfer, Transfer::Srgb);
    let Samples::U8(samples) = &representatives.samples else { panic!("not 8-bit") };
    let sample = |cluster: &u16| {
        let at = ((usize::from(*cluster) * views + 7) * lights + 2) * channels;
        &samples[at..at + channels]
    };
    let expected: Vec<u8> = model.index().unwrap().iter().flat_map(sample).copied().collect();
    assert_eq!(pixels(&fixture().model(), 7, 2), expected);
    let enlarged = Enlarged::open(&fixture().enlarged()).unwrap();
    let index = enlarged.read(enlarged.size().window()).unwrap();
    let expected: Vec<u8> = index.iter().flat_map(sample).copied().collect();
    assert_eq!(pixels(&fixture().enlarged(), 7, 2), expected);
}

#[test]
fn a_window_is_a_part_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let image = |name: &str, window: &[&str]| {
        let out = folder.path().join(name);
        succeed(
            btf()
                .arg("image")
                .arg(fixture().enlarged())
                .args(["--what", "index"])
                .args(window)
                .arg("--out")
                .arg(&out),
        );
        let file = std::io::BufReader::new(std::fs::File::open(&out).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut samples).unwrap();
        (samples, info.width as usize)
    };
    let (whole, width) = image("whole.png", &[]);
    let (part, part_width) = image("part.png", &["--window", "500,490,20,50"]);
    assert_eq!(part_width, 20);
    for y in 0..50 {
        let at = ((490 + y) * width + 500) * 3;
        assert_eq!(part[y * 60..(y + 1) * 60], whole[at..at + 60]);
    }
}

#[test]
fn more_than_256_clusters_work_to_the_last_picture() {
    let folder = tempfile::tempdir().unwrap();
    let [model, big, out] = ["wide.model.zarr", "wide.zarr", "wide.png"].map(|name| folder.path().join(name));
    succeed(btf().arg("model").args([&fixture().measurement(), &model]).args(["--clusters", "300"]));
    succeed(btf().arg("enlarge").args([&model, &big]).args(["--size", "40x30"]));
    succeed(btf().arg("image").arg(&big).arg("--out").arg(&out));
    let index = Model::open(&model).unwrap().index().unwrap();
    assert!(
        index.iter().any(|&cluster| cluster >= 256),
        "the index must need 16 bits for this test to mean anything"
    );
}

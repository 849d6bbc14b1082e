//! The examples of the library do what they say.

use btfkit::Direction;
use btfkit::shape::{Size, Window};
use btfkit::store::enlarged::Enlarged;

use crate::fixture::{btf, fixture, succeed};

#[allow(dead_code)]
#[path = "../../examples/convert.rs"]
mod convert;
#[allow(dead_code)]
#[path = "../../examples/enlarge_many.rs"]
mod enlarge_many;
#[allow(dead_code)]
#[path = "../../examples/read_window.rs"]
mod read_window;

#[test]
fn an_archive_is_converted_as_the_program_does() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, by_example, by_program] =
        ["a.zip", "example.zarr", "program.zarr"].map(|name| folder.path().join(name));
    succeed(btf().arg("sample").arg(&archive).args(["--size", "32x24", "--views", "7", "--lights", "7"]));
    convert::convert(&archive, &by_example).unwrap();
    succeed(btf().arg("import").args([&archive, &by_program]));
    assert_eq!(crate::fixture::tree(&by_example), crate::fixture::tree(&by_program));
}

#[test]
fn enlargements_of_several_seeds_differ_and_a_window_has_the_colour_of_its_clusters() {
    let folder = tempfile::tempdir().unwrap();
    let model = fixture().model();
    let made = enlarge_many::enlarge_many(&model, folder.path(), 2).unwrap();
    let window = Window { y: 100, x: 200, size: Size::new(64, 64) };
    let [first, second] = [0, 1].map(|n| Enlarged::open(&made[n]).unwrap().read(window).unwrap());
    assert_ne!(first, second);
    let [view, light] = [Direction::from_degrees(0.0, 0.0), Direction::from_degrees(30.0, 90.0)];
    let color = read_window::mean_color(&made[0], &model, window, view, light).unwrap();
    let picture = folder.path().join("window.exr");
    let options = ["--window", "200,100,64,64", "--light", "30,90", "--out"];
    let mut image = btf();
    succeed(image.arg("image").arg(&made[0]).arg("--model").arg(&model).args(options).arg(&picture));
    let pixels = exr::prelude::read_first_rgba_layer_from_file(
        &picture,
        |size, _| vec![[0f32; 3]; size.area()],
        |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * 64 + at.x()] = [r, g, b],
    );
    let pixels = pixels.unwrap().layer_data.channel_data.pixels;
    for (channel, mean) in color.into_iter().enumerate() {
        let expected = pixels.iter().map(|pixel| pixel[channel]).sum::<f32>() / pixels.len() as f32;
        assert!((mean - expected).abs() < 1e-4, "{color:?}, expected {expected} in channel {channel}");
    }
}

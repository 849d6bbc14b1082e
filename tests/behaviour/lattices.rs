//! Lattices of real materials, where they are at hand beside the project.

use btfkit::archive;
use btfkit::color::LightnessCodes;
use btfkit::lattice::{Detection, Lattice, WaveCounts, detect, largest_whole_cells, wave_counts};
use btfkit::method::components::leading;
use btfkit::shape::Size;
use btfkit::stage::tile::Report;
use btfkit::store::model::{Model, Stage};
use btfkit_formats::Samples;

use crate::fixture::{btf, shared, succeed};

/// Directions from which a measurement is looked at.
const SPREAD: usize = 6;

/// Leading components of the L* codes of an archive under some views and lights.
fn of_archive(name: &str, wraps: bool) -> Option<Detection> {
    let path = shared(name)?;
    let source = archive::open(&[path], &archive::Options::default()).unwrap();
    let contents = source.contents();
    let size = Size::new(contents.height as usize, contents.width as usize);
    let spread = |all: usize| (0..SPREAD.min(all)).map(move |n| n * all / SPREAD.min(all));
    let mut planes = Vec::new();
    for view in spread(contents.views.len()) {
        for light in spread(contents.lights.len()) {
            let images = source.read_images(view, light..light + 1).unwrap();
            planes.push(codes_of(&images, &contents.channels));
        }
    }
    let codes: Vec<u8> = (0..size.texels()).flat_map(|n| planes.iter().map(move |plane| plane[n])).collect();
    Some(of_codes(size, &codes, planes.len(), wraps))
}

fn codes_of(images: &Samples, channels: &[String]) -> Vec<u8> {
    let kind = images.sample_type();
    let codes = LightnessCodes::new(btfkit::color::Transfer::Srgb, kind, channels, 1.0).unwrap();
    let mut plane = vec![0; images.len() / channels.len()];
    codes.fill(images, &mut plane);
    plane
}

fn of_codes(size: Size, codes: &[u8], count: usize, wraps: bool) -> Detection {
    let (features, dims) = leading(codes, count, 8).unwrap();
    detect(size, dims, &features, wraps)
}

fn of_picture(name: &str, wraps: bool) -> Option<Detection> {
    let path = shared(&format!("textures/{name}.png"))?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let size = Size::new(info.height as usize, info.width as usize);
    let count = bytes.len() / size.texels();
    Some(of_codes(size, &bytes, count, wraps))
}

/// Ribs of about this period, nearly upright.
fn assert_ribs(found: &Detection, period: f64) {
    let Lattice::OneDirection { period: [dy, dx] } = found.lattice else { panic!("{found:?}") };
    assert!(dy.abs() < 0.2 && (dx - period).abs() < 0.1, "{found:?}");
}

#[test]
fn corduroy_has_ribs_and_its_weave_along_them_does_not_count() {
    // In a seamless tile the period was 23.12: 208 texels of 9 ribs. Here the plane tells.
    if let Some(found) = of_archive("mlvq-btf/corduroy/binary.btf", false) {
        assert_ribs(&found, 23.36);
    }
    if let Some(found) = of_archive("ubo2003-corduroy-128/UBO_CORDUROY128_decoded.zip", false) {
        assert_ribs(&found, 23.39);
    }
}

#[test]
fn tiles_of_impalla_are_found_although_only_four_fit_the_plane() {
    let Some(found) = of_archive("mlvq-btf/impalla/binary.btf", false) else { return };
    let Lattice::TwoDirections(vectors) = found.lattice else { panic!("{found:?}") };
    for [long, short] in [vectors[0], [vectors[1][1], vectors[1][0]]] {
        assert!((long - 128.0).abs() < 0.6 && short.abs() < 0.6, "{found:?}");
    }
    let whole = Size::new(256, 256);
    assert_eq!(largest_whole_cells(&found.lattice, whole).map(|window| window.size), Some(whole));
    assert_eq!(wave_counts(&found.lattice, whole), Some(WaveCounts(vec![[2, 0], [0, 2]])));
    assert_eq!(wave_counts(&found.lattice, Size::new(152, 184)), None);
}

#[test]
fn the_plane_of_impalla_and_tiles_cut_from_it_hold_whole_cells() {
    let Some(archive) = shared("mlvq-btf/impalla/binary.btf") else { return };
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("impalla.zarr");
    succeed(btf().arg("import").args([&archive, &store]));
    for (choice, size, cells) in [("auto", [256, 256], 4), ("none", [256, 256], 4), ("cut", [128, 128], 1)] {
        let model = folder.path().join(choice);
        let told = succeed(btf().arg("tile").args([&store, &model]).args(["--tile", choice]));
        let report: Report = Model::open(&model).unwrap().report(Stage::Tile).unwrap();
        assert_eq!(
            (report.size, WaveCounts(report.cells.clone()).cells()),
            (size, cells),
            "{choice}: {told}"
        );
        let Lattice::TwoDirections(mut vectors) = report.lattice else { panic!("{told}") };
        vectors.sort_by(|a, b| b[0].total_cmp(&a[0]));
        for [long, short] in [vectors[0], [vectors[1][1], vectors[1][0]]] {
            assert!((long - 128.0).abs() < 0.6 && short.abs() < 0.6, "{choice}: {told}");
        }
        assert_eq!(told.contains("25 % of what was measured"), choice == "cut", "{told}");
    }
}

#[test]
fn borders_of_planes_that_were_made_to_join_are_found_to_join() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["mlvq-btf/corduroy/binary.btf", "virtual-leather/VLEATHER64.zip"] {
        let Some(archive) = shared(name) else { continue };
        let store = folder.path().join(name.replace('/', "-") + ".zarr");
        succeed(btf().arg("import").args([&archive, &store]));
        let told = succeed(btf().arg("tile").args([&store, &store.with_extension("model")]));
        assert!(told.contains("the whole measurement; step across its borders"), "{name}: {told}");
    }
}

#[test]
fn prints_leather_stones_and_wood_have_none() {
    let archives = [
        ("mlvq-btf/wallpaper/binary.btf", false),
        ("ubo2003-wallpaper-64/UBO_WALLPAPER64_decoded.zip", false),
        ("ubo2003-wallpaper-view0/MANYFILES", false),
        ("virtual-leather/VLEATHER64.zip", true),
    ];
    let tileable =
        ["burlwood", "wood1", "wood2", "leather", "granite1", "stone33"].map(|name| format!("gimp/{name}"));
    let photographs = ["brick", "gravel"].map(|name| format!("scikit-image/{name}"));
    let found = archives.iter().map(|(name, wraps)| (name.to_string(), of_archive(name, *wraps)));
    let found = found.chain(tileable.map(|name| (name.clone(), of_picture(&name, true))));
    for (name, found) in found.chain(photographs.map(|name| (name.clone(), of_picture(&name, false)))) {
        assert!(found.is_none_or(|found| found.lattice == Lattice::None), "{name}: {found:?}");
    }
}

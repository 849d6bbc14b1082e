//! What the stores hold agrees with a plain reading of the equations.

use btfkit::method::stereo::Stereo;
use btfkit::random::Hash;
use btfkit::sample::{MaterialKind, Scene, Surface};
use btfkit::store::enlarged::Enlarged;
use btfkit::store::model::Model;
use btfkit_formats::Direction;

use crate::fixture::fixture;

/// Of 200 random texels of an enlarged index, first row and column included, the choice is the true
/// minimiser of (25) by brute force over all normals of the tile.
#[test]
fn the_enlarged_index_minimises_equation_25() {
    const CANDIDATES: usize = 16;
    let model = Model::open(&fixture().model()).unwrap();
    let (index, normals, distance) =
        (model.index().unwrap(), model.normals().unwrap(), model.distance().unwrap());
    let clusters = distance.len().isqrt();
    let enlarged = Enlarged::open(&fixture().enlarged()).unwrap();
    let size = enlarged.size();
    let chosen = enlarged.read(size.window()).unwrap();
    let synthesised = enlarged.read_normals(size.window()).unwrap().unwrap();
    let hash = Hash::new(42, 0);
    let d = |a: u16, b: u16| f64::from(distance[usize::from(a) * clusters + usize::from(b)]);
    for n in 0..200 {
        let (y, x) = match n {
            0 => (0, 0),
            1..20 => (0, hash.below(size.width as u64, n, 0, 0) as usize),
            20..40 => (hash.below(size.height as u64, n, 0, 0) as usize, 0),
            _ => (
                hash.below(size.height as u64, n, 0, 0) as usize,
                hash.below(size.width as u64, n, 1, 0) as usize,
            ),
        };
        let at = y * size.width + x;
        let mut order: Vec<(f64, usize)> = normals
            .iter()
            .enumerate()
            .map(|(texel, normal)| {
                let squares =
                    normal.iter().zip(synthesised[at]).map(|(&a, b)| (f64::from(a) - f64::from(b)).powi(2));
                (squares.sum(), texel)
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let cost = |texel: usize| {
            let left = if x > 0 { d(index[texel], chosen[at - 1]) } else { 0.0 };
            let above = if y > 0 { d(index[texel], chosen[at - size.width]) } else { 0.0 };
            left + above
        };
        let candidates = order[..CANDIDATES].iter().map(|&(_, texel)| texel);
        let best = candidates.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap();
        assert_eq!(chosen[at], index[best], "row {y}, column {x}");
    }
}

/// Photometric stereo on rendered pictures of a known surface finds its normals, the right way round.
#[test]
fn a_rendered_height_field_gives_back_its_normals() {
    let lights: Vec<Direction> = btfkit_formats::ubo2003::directions_81()
        .iter()
        .map(|angles| Direction::from_degrees(angles.theta_deg(), angles.phi_deg()))
        .collect();
    let surface = Surface::new(MaterialKind::Leather, 48, 48, 1.0, 3).unwrap();
    let truth = surface.normals();
    let scene =
        Scene::new(surface, &lights.iter().map(|light| [light.theta_rad, light.phi_rad]).collect::<Vec<_>>());
    let points = scene.view(0, [0.0, 0.0]);
    let images: Vec<Vec<u8>> = (0..lights.len()).map(|light| points.image(light).unwrap()).collect();
    let stereo = Stereo::new(&lights).unwrap();
    let curve = btfkit::color::Transfer::Srgb;
    let degrees = |a: [f32; 3], b: [f32; 3]| {
        let cosine: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        f64::from(cosine.clamp(-1.0, 1.0)).acos().to_degrees()
    };
    let (mut error, mut flat) = (0.0, 0.0);
    for (texel, &normal) in truth.iter().enumerate() {
        let intensities: Vec<f64> =
            images.iter().map(|image| luminance(&image[texel * 3..texel * 3 + 3], curve)).collect();
        error += degrees(stereo.normal(&intensities), normal);
        flat += degrees([0.0, 0.0, 1.0], normal);
    }
    let (error, flat) = (error / truth.len() as f64, flat / truth.len() as f64);
    assert!(error < 5.0 && flat > 10.0, "mean angle {error} degrees, of a flat guess {flat}");
}

/// Every sample of the store is the decoded image's at its place, every code that of its colour.
#[test]
fn the_store_holds_the_decoded_images() {
    let bytes = std::fs::read(fixture().archive()).unwrap();
    let limits = btfkit_formats::Limits::default();
    let index = btfkit_formats::zip::ZipIndex::open(&bytes, &limits).unwrap();
    let names = index.entries().iter().map(btfkit_formats::zip::ZipEntry::name);
    let catalogue = btfkit_formats::Catalogue::from_names(names).unwrap();
    let measurement = btfkit::store::measurement::Measurement::open(&fixture().measurement()).unwrap();
    let description = measurement.description();
    for view in 0..description.views.len() {
        let samples = measurement.read_reflectance(view, description.size.window()).unwrap();
        let btfkit_formats::Samples::U8(samples) = samples else { panic!("not 8-bit") };
        let codes = measurement.read_luminance(view, description.size.window()).unwrap();
        for light in 0..description.lights.len() {
            let entry = index.read(&bytes, catalogue.image(view, light).unwrap()).unwrap();
            let image = btfkit_formats::jpeg::decode(&entry, &limits).unwrap();
            for (texel, sample) in image.samples.chunks_exact(3).enumerate() {
                let at = texel * description.lights.len() + light;
                assert_eq!(&samples[at * 3..at * 3 + 3], sample, "view {view}, light {light}, texel {texel}");
                let y = luminance(sample, description.transfer);
                assert_eq!(codes[at], btfkit::color::lightness_code(y));
            }
        }
    }
}

/// Luminance of an 8-bit colour.
fn luminance(sample: &[u8], curve: btfkit::color::Transfer) -> f64 {
    let linear = sample.iter().map(|&s| curve.decode(f64::from(s) / 255.0));
    linear.zip(btfkit::color::LUMINANCE_WEIGHTS).map(|(value, weight)| weight * value).sum()
}

//! What a synthetic measurement promises, checked on both materials and on
//! plain shapes whose pictures are known.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;

const KINDS: [MaterialKind; 2] = [MaterialKind::Wood, MaterialKind::Leather];
const SIZE: usize = 40;

/// Dull grey of a height given by a function of column and row, texels; `bright` where albedo is 0.6.
struct Shape<H, B> {
    height: H,
    bright: B,
    origin: [f64; 2],
}

impl<H: Fn(f64, f64) -> f64 + Sync, B: Fn(f64, f64) -> bool + Sync> Material for Shape<H, B> {
    fn matter(&self, x: f64, y: f64) -> Matter {
        let (column, row) = (x - self.origin[0] - 0.5, y - self.origin[1] - 0.5);
        let albedo = if (self.bright)(column, row) { 0.6 } else { 0.2 };
        Matter {
            height: (self.height)(column, row),
            coat_height: 0.0,
            albedo: [albedo; 3],
            alpha: 0.5,
            coat: 0.3,
            fibre: 0.0,
            fibre_dive: 0.0,
            fibre_turn: 0.0,
        }
    }
}

/// The picture (green channel, [y, x]) of a shape under one light from one view.
fn picture(
    height: impl Fn(f64, f64) -> f64 + Sync,
    bright: impl Fn(f64, f64) -> bool + Sync,
    light: [f64; 2],
    view: [f64; 2],
) -> Vec<f64> {
    let origin = surface::Lattice::new(MaterialKind::Leather, 1.0, 1).origin;
    let shape = Shape { height, bright, origin };
    let surface = Surface::sampled(&shape, MaterialKind::Leather, [SIZE, SIZE], 1.0, 1);
    let scene = Scene::new(surface, &[light]);
    let bytes = scene.view(0, view).image(0).unwrap();
    bytes.chunks(3).map(|rgb| f64::from(rgb[1])).collect()
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// Directions of a coarse hemisphere, the steepest at 75 degrees.
fn directions() -> Vec<[f64; 2]> {
    [[0.0, 0.0], [30.0, 60.0], [45.0, 180.0], [60.0, 315.0], [75.0, 0.0], [75.0, 90.0], [75.0, 217.0]]
        .map(|angles| angles.map(f64::to_radians))
        .to_vec()
}

fn bytes(surface: Surface) -> Vec<Vec<u8>> {
    let directions = directions();
    let scene = Scene::new(surface, &directions);
    let views = directions.iter().enumerate().map(|(number, &view)| scene.view(number as u32, view));
    views
        .flat_map(|view| (0..directions.len()).map(|light| view.image(light).unwrap()).collect::<Vec<_>>())
        .collect()
}

#[test]
fn normals_agree_with_the_differences_of_the_heights() {
    for kind in KINDS {
        let surface = Surface::new(kind, SIZE, SIZE, 1.0, 11).unwrap();
        let (heights, normals) = (surface.heights(), surface.normals());
        for n in (1..SIZE - 1).flat_map(|row| (1..SIZE - 1).map(move |column| row * SIZE + column)) {
            let [x, y, z] = normals[n];
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5 && z > 0.0);
            assert!((0.5 * (heights[n + 1] - heights[n - 1]) + x / z).abs() < 1e-4);
            assert!((0.5 * (heights[n + SIZE] - heights[n - SIZE]) - y / z).abs() < 1e-4);
        }
    }
}

#[test]
fn a_slope_is_brightest_under_the_light_that_it_faces() {
    let brightness = |height: fn(f64, f64) -> f64, phi: f64| {
        mean(picture(height, |_, _| false, [PI / 4.0, phi], [0.0, 0.0]))
    };
    // Low ridges, gentle enough to cast no shadow: they fall to the right, and to the top.
    let faces_right: fn(f64, f64) -> f64 = |column, _| -0.1 * (column - 20.0);
    let faces_up: fn(f64, f64) -> f64 = |_, row| 0.1 * (row - 20.0);
    assert!(brightness(faces_right, 0.0) > brightness(faces_right, PI) + 5.0);
    assert!(brightness(faces_up, FRAC_PI_2) > brightness(faces_up, 3.0 * FRAC_PI_2) + 5.0);
    assert!((brightness(faces_right, FRAC_PI_2) - brightness(faces_right, 3.0 * FRAC_PI_2)).abs() < 1.0);
}

#[test]
fn the_wall_of_a_pit_towards_the_light_shadows_its_floor() {
    let inside = |column: f64, row: f64| (column - 20.0).abs() < 6.0 && (row - 20.0).abs() < 6.0;
    let pit = |column: f64, row: f64| if inside(column, row) { -2.0 } else { 0.0 };
    let grazing = |phi: f64| picture(pit, |_, _| false, [70.0_f64.to_radians(), phi], [0.0, 0.0]);
    let at = |picture: &[f64], row: usize, column: usize| picture[row * SIZE + column];
    let (right, top) = (grazing(0.0), grazing(FRAC_PI_2));
    let flat = at(&right, 5, 5);
    // Depth 2 under light of 70 degrees: a shadow of 5.5 texels beside the wall at the light's side.
    assert!(at(&right, 20, 23) < 0.5 * flat && at(&right, 20, 18) > 0.8 * flat);
    assert!(at(&top, 17, 20) < 0.5 * flat && at(&top, 22, 20) > 0.8 * flat);
    assert!(at(&right, 20, 23) > 0.0, "light from around reaches a shadow");
}

#[test]
fn the_flattest_light_comes_to_an_end() {
    let level = |theta: f64| mean(picture(|_, _| 0.0, |_, _| false, [theta.to_radians(), 0.1], [0.0, 0.0]));
    assert!(level(89.9) < level(75.0) && level(75.0) < level(60.0));
}

#[test]
fn raised_parts_move_away_from_the_camera_by_their_height() {
    // A bright patch on a plane that lies 1.5 over the mean plane.
    let patch = |column: f64, row: f64| (column - 20.0).abs() < 4.0 && (row - 20.0).abs() < 4.0;
    let centre = |height: f64, view: [f64; 2]| {
        let picture = picture(move |_, _| height, patch, [0.0, 0.0], view);
        let dark = picture[0];
        let weight: f64 = picture.iter().map(|v| v - dark).sum();
        let moment = |axis: fn(usize) -> usize| {
            picture.iter().enumerate().map(|(n, v)| axis(n) as f64 * (v - dark)).sum::<f64>() / weight
        };
        [moment(|n| n % SIZE), moment(|n| n / SIZE)]
    };
    let theta = 60.0_f64.to_radians();
    let shift = 1.5 * theta.tan();
    for (height, view, expected) in [
        (0.0, [theta, 0.3], [20.0, 20.0]),
        (1.5, [0.0, 0.0], [20.0, 20.0]),
        (1.5, [theta, 0.0], [20.0 - shift, 20.0]),
        (1.5, [theta, FRAC_PI_2], [20.0, 20.0 + shift]),
        (-1.5, [theta, FRAC_PI_2], [20.0, 20.0 - shift]),
    ] {
        let found = centre(height, view);
        let near = (0..2).all(|axis| (found[axis] - expected[axis]).abs() < 0.25);
        assert!(near, "{height} {view:?}: {found:?} against {expected:?}");
    }
}

#[test]
fn light_and_view_may_be_exchanged() {
    let linear = |level: f64| libm::pow((level / 255.0 + 0.055) / 1.055, 2.4);
    let reflectance = |light: f64, view: f64| {
        let picture = picture(|_, _| 0.0, |_, _| false, [light, 0.0], [view, 2.0]);
        linear(mean(picture)) / light.cos()
    };
    for (a, b) in [(0.2, 0.9), (0.0, 1.2), (0.6, 1.3)] {
        let (there, back) = (reflectance(a, b), reflectance(b, a));
        assert!((there / back - 1.0).abs() < 0.05, "{a} {b}: {there} against {back}");
    }
}

#[test]
fn the_seed_alone_decides_the_bytes() {
    for kind in KINDS {
        let made = |seed: u64, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bytes(Surface::new(kind, 24, 17, 1.0, seed).unwrap()))
        };
        let first = made(3, 1);
        assert_eq!(first[0].len(), 24 * 17 * 3);
        assert!(first == made(3, 3));
        assert!(first.iter().zip(made(4, 1)).all(|(a, b)| *a != b));
    }
}

#[test]
fn a_larger_surface_shows_the_same_and_more() {
    for kind in KINDS {
        let small = bytes(Surface::new(kind, 20, 12, 1.0, 8).unwrap());
        let large = bytes(Surface::new(kind, 45, 30, 1.0, 8).unwrap());
        for (image, (small, large)) in small.iter().zip(&large).enumerate() {
            for row in 0..12 {
                let (a, b) = (&small[row * 60..][..60], &large[row * 135..][..60]);
                assert_eq!(a, b, "{kind:?} image {image} row {row}");
            }
        }
    }
}

#[test]
fn scale_makes_features_larger_and_as_much_higher() {
    for kind in KINDS {
        let (one, three) =
            (Surface::new(kind, 20, 20, 1.0, 8).unwrap(), Surface::new(kind, 60, 60, 3.0, 8).unwrap());
        let (one, three) = (one.heights(), three.heights());
        // The middle of three texels lies where the one texel does.
        for (n, height) in one.iter().enumerate() {
            let same = three[(3 * (n / 20) + 1) * 60 + 3 * (n % 20) + 1];
            assert!((3.0 * height - same).abs() < 1e-4, "{kind:?} {n}: {height} {same}");
        }
    }
}

#[test]
fn heights_are_about_the_mean_plane_and_within_their_bound() {
    for kind in KINDS {
        for seed in 0..3 {
            let heights = Surface::new(kind, 200, 200, 1.0, seed).unwrap().heights();
            let mean = mean(heights.iter().map(|&h| f64::from(h)));
            let highest = heights.iter().fold(0.0_f64, |highest, &h| highest.max(f64::from(h).abs()));
            assert!(mean.abs() < 0.15, "{kind:?} {seed}: {mean}");
            assert!(highest < kind.relief() && highest > 0.3 * kind.relief(), "{kind:?} {seed}: {highest}");
        }
    }
}

#[test]
fn pictures_are_well_exposed() {
    for kind in KINDS {
        let lights = [[0.0, 0.0], [75.0_f64.to_radians(), 0.0]];
        let scene = Scene::new(Surface::new(kind, 100, 100, 1.0, 2).unwrap(), &lights);
        let view = scene.view(0, [0.0, 0.0]);
        let level = |light: usize| mean(view.image(light).unwrap().into_iter().map(f64::from));
        let share = |light: usize, byte: u8| {
            let image = view.image(light).unwrap();
            image.iter().filter(|&&b| b == byte).count() as f64 / image.len() as f64
        };
        assert!((90.0..175.0).contains(&level(0)), "{kind:?} {}", level(0));
        assert!((25.0..80.0).contains(&level(1)), "{kind:?} {}", level(1));
        assert!(share(0, 255) < 0.005 && share(1, 0) < 0.02, "{kind:?} {} {}", share(0, 255), share(1, 0));
    }
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let made = |width, height, scale| Surface::new(MaterialKind::Wood, width, height, scale, 0).is_ok();
    assert!(made(1, 1, 0.25));
    assert!(!made(0, 8, 1.0) && !made(8, 0, 1.0) && !made(8, 70_000, 1.0));
    assert!(!made(8, 8, 0.0) && !made(8, 8, f64::NAN) && !made(8, 8, 9.0));
    let scene = Scene::new(Surface::new(MaterialKind::Wood, 4, 4, 1.0, 0).unwrap(), &[[0.0, 0.0]]);
    assert!(scene.view(0, [0.5, 0.0]).image(1).is_none());
}

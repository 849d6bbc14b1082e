//! Lattices of made textures, which are known.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::random::Hash;
use crate::shape::Size;

/// A plane of two dimensions made texel by texel.
fn plane(size: Size, texel: impl Fn(f64, f64) -> [f64; 2]) -> Vec<f32> {
    let places = (0..size.height).flat_map(|y| (0..size.width).map(move |x| (y as f64, x as f64)));
    places.flat_map(|(y, x)| texel(y, x)).map(|n| n as f32).collect()
}

/// Smooth noise without a period: values hashed at every third texel, interpolated.
fn noise(seed: u64, y: f64, x: f64) -> f64 {
    const SPACING: f64 = 3.0;
    let hash = Hash::new(seed, 77);
    let (y, x) = (y / SPACING + 1000.0, x / SPACING + 1000.0);
    let ([i, j], [b, d]) = ([y.floor(), x.floor()], [y.fract(), x.fract()]);
    let at = |i: f64, j: f64| hash.normals(i as u32, j as u32, 0)[0];
    let row = |i: f64| at(i, j) * (1.0 - d) + at(i, j + 1.0) * d;
    row(i) * (1.0 - b) + row(i + 1.0) * b
}

/// A texture in one cell, by lattice coordinates: noise that joins at the borders of the cell.
fn cell(seed: u64, a: f64, b: f64) -> f64 {
    let hash = Hash::new(seed, 78);
    (0..12)
        .map(|n| {
            let [amplitude, phase, ..] = hash.uniforms(n, 0, 0);
            // Waves of up to two cycles a cell; the first ones are a cell long.
            let (i, j) = [
                (1, 0),
                (0, 1),
                (1, 1),
                (1, -1),
                (2, 0),
                (0, 2),
                (2, 1),
                (1, 2),
                (2, 2),
                (2, -1),
                (1, -2),
                (2, -2),
            ][n as usize];
            let angle = std::f64::consts::TAU * (f64::from(i) * a + f64::from(j) * b + phase);
            (0.3 + amplitude) * angle.sin()
        })
        .sum()
}

/// A material with a lattice of two directions, and some noise.
fn cells(size: Size, lattice: &Lattice, noisy: f64) -> Vec<f32> {
    let waves = lattice.waves();
    plane(size, |y, x| {
        let [a, b] = [0, 1].map(|k| dot(waves[k], [y, x]));
        [cell(1, a, b) + noisy * noise(1, y, x), 0.5 * cell(2, a, b) + noisy * noise(2, y, x)]
    })
}

/// Ribs of this period, along which the texture is noise.
fn ribs(size: Size, period: [f64; 2], noisy: f64) -> Vec<f32> {
    let waves = Lattice::OneDirection { period }.waves();
    plane(size, |y, x| {
        let phase = dot(waves[0], [y, x]);
        [cell(3, phase, 0.25) + noisy * noise(3, y, x), noisy * noise(4, y, x)]
    })
}

/// Whether two vectors are the same lattice's shortest ones, to within `error` texels, up to order and sign.
fn same(found: &Lattice, expected: &Lattice, error: f64) -> bool {
    let near = |a: [f64; 2], b: [f64; 2]| {
        [1.0, -1.0].iter().any(|sign| length([a[0] - sign * b[0], a[1] - sign * b[1]]) <= error)
    };
    match (*found, *expected) {
        (Lattice::None, Lattice::None) => true,
        (Lattice::OneDirection { period: a }, Lattice::OneDirection { period: b }) => near(a, b),
        (Lattice::TwoDirections(a), Lattice::TwoDirections(b)) => {
            let (a, b) = (reduced(a), reduced(b));
            (near(a[0], b[0]) && near(a[1], b[1])) || (near(a[0], b[1]) && near(a[1], b[0]))
        }
        _ => false,
    }
}

fn lattice(text: &str) -> Lattice {
    text.parse().unwrap()
}

#[test]
fn cells_are_found_to_a_part_of_a_texel() {
    let size = Size::new(200, 240);
    for text in
        ["15.2,0;0,18.4", "31.7,0.4;-0.3,27.1", "6.04,-8.14;12.64,7.66", "9,20;17,-11.5", "90,3;-5,100"]
    {
        for noisy in [0.1, 0.8] {
            let expected = lattice(text);
            let found = detect(size, 2, &cells(size, &expected, noisy), false);
            assert!(same(&found.lattice, &expected, 0.12), "{text} with noise {noisy}: {found:?}");
            assert!(found.mean_over_lattice > 0.4 && found.strongest_peak <= 1.0, "{found:?}");
        }
    }
}

#[test]
fn a_plane_that_wraps_gets_exact_cells() {
    let size = Size::new(152, 184);
    for counts in [[[10, 0], [0, 10]], [[8, 3], [-2, 7]], [[2, 0], [0, 2]]] {
        let expected = WaveCounts(counts.to_vec()).lattice(size);
        let features = cells(size, &expected, 0.3);
        let found = detect(size, 2, &features, true);
        assert!(same(&found.lattice, &expected, 1e-9), "{counts:?}: {found:?}");
        let cells = (counts[0][0] * counts[1][1] - counts[0][1] * counts[1][0]).unsigned_abs();
        assert_eq!(wave_counts(&found.lattice, size).unwrap().cells(), u64::from(cells));
    }
}

#[test]
fn ribs_are_found_in_any_direction() {
    let size = Size::new(220, 180);
    for degrees in [0.0f64, 90.0, 17.3, 45.0, 71.0, 120.5, 155.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        for period in [7.3, 23.12] {
            let expected = Lattice::OneDirection { period: [period * sin, period * cos] };
            for noisy in [0.0, 0.7] {
                let found = detect(size, 2, &ribs(size, [period * sin, period * cos], noisy), false);
                assert!(
                    same(&found.lattice, &expected, 0.1),
                    "{degrees} degrees, {period}, noise {noisy}: {found:?}"
                );
            }
        }
    }
    let wrapping = Lattice::OneDirection { period: [0.0, 180.0 / 8.0] };
    let found = detect(size, 2, &ribs(size, [0.0, 22.5], 0.5), true);
    assert!(same(&found.lattice, &wrapping, 1e-9), "{found:?}");
    assert_eq!(wave_counts(&found.lattice, size), Some(WaveCounts(vec![[0, 8]])));
}

#[test]
fn random_materials_have_none() {
    let size = Size::new(200, 160);
    for seed in 0..6 {
        for wraps in [false, true] {
            let white = plane(size, |y, x| {
                Hash::new(seed, 0).normals(y as u32, x as u32, 0)[..2].try_into().unwrap()
            });
            let smooth =
                plane(size, |y, x| [noise(seed, y / 2.0, x / 2.0), noise(seed + 50, y / 3.0, x / 3.0)]);
            for features in [white, smooth] {
                assert_eq!(detect(size, 2, &features, wraps).lattice, Lattice::None, "seed {seed}, {wraps}");
            }
        }
    }
}

/// Cells as leather has: of one size, but nowhere in order.
#[test]
fn cells_without_order_have_none() {
    let size = Size::new(192, 192);
    for seed in 0..4 {
        let hash = Hash::new(seed, 9);
        let points: Vec<[f64; 2]> = (0..18 * 18)
            .map(|n| {
                let [a, b, ..] = hash.uniforms(n, 0, 0);
                [f64::from(n / 18) * 12.0 - 12.0 + 14.0 * a, f64::from(n % 18) * 12.0 - 12.0 + 14.0 * b]
            })
            .collect();
        let features = plane(size, |y, x| {
            let mut nearest = [f64::MAX; 2];
            for &[v, u] in &points {
                let distance = length([v - y, u - x]);
                if distance < nearest[0] {
                    nearest = [distance, nearest[0]];
                } else if distance < nearest[1] {
                    nearest[1] = distance;
                }
            }
            [(nearest[1] - nearest[0]).min(3.0), 0.0]
        });
        for wraps in [false, true] {
            let found = detect(size, 2, &features, wraps);
            assert_eq!(found.lattice, Lattice::None, "seed {seed}: {found:?}");
        }
    }
}

#[test]
fn what_changes_little_along_ribs_leaves_them_ribs() {
    // Twill-like: strong ribs and a weave along them that hardly shows.
    let size = Size::new(208, 224);
    let features = plane(size, |y, x| {
        let rib = cell(5, x / 22.4, 0.1);
        [rib + 0.15 * (std::f64::consts::TAU * y / 9.7).sin(), 0.3 * noise(5, y, x)]
    });
    let found = detect(size, 2, &features, false);
    assert!(same(&found.lattice, &lattice("0,22.4"), 0.1), "{found:?}");
}

#[test]
fn nothing_is_found_in_nothing() {
    let nothing = Detection { lattice: Lattice::None, strongest_peak: 0.0, mean_over_lattice: 0.0 };
    for (size, features) in [
        (Size::new(32, 32), vec![1.0; 1024]),
        (Size::new(32, 32), vec![f32::NAN; 1024]),
        (Size::new(32, 32), vec![1.0; 5]),
        (Size::new(3, 32), (0..96).map(|n| (n * 7919 % 31) as f32).collect()),
    ] {
        for wraps in [false, true] {
            assert_eq!(detect(size, 1, &features, wraps), nothing);
        }
    }
    assert_eq!(detect(Size::new(32, 32), 0, &[], false), nothing);
}

#[test]
fn of_a_long_plane_the_middle_is_enough() {
    let size = Size::new(40, 1400);
    let expected = lattice("8,0;0,14");
    let found = detect(size, 2, &cells(size, &expected, 0.3), true);
    assert!(same(&found.lattice, &expected, 1e-9), "{found:?}");
}

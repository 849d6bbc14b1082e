//! What must hold of any evaluation, whatever the material.
#![allow(clippy::unwrap_used)]

use btfkit_formats::Direction;

use super::evaluator::{Evaluator, Whole, look_up, tinted};
use super::locate::Locator;
use super::table::{ClusterTable, Mixture};
use super::triangulation::{Interpolator, triangulate};
use crate::random::Hash;
use crate::shape::Size;

/// Directions of different layouts: the 81 of Bonn, a half dome, a sparse and a random one, one ring, two, one.
fn layouts() -> Vec<Vec<Direction>> {
    let at = |list: Vec<(f64, f64)>| -> Vec<Direction> {
        list.into_iter().map(|(theta, phi)| Direction::from_degrees(theta, phi)).collect()
    };
    let bonn = btfkit_formats::ubo2003::directions_81().into_iter().map(|a| (a.theta_deg(), a.phi_deg()));
    let half = (0..7).flat_map(|k| [30.0, 60.0].map(|theta| (theta, 30.0 * f64::from(k))));
    let hash = Hash::new(3, 5);
    let random = (0..60).map(|n| {
        let [a, b, ..] = hash.uniforms(n, 0, 0);
        ((1.0 - 0.9 * a).acos().to_degrees(), 360.0 * b)
    });
    let ring = (0..9).map(|k| (40.0, 40.0 * f64::from(k)));
    vec![
        at(bonn.collect()),
        at(half.chain([(0.0, 0.0)]).collect()),
        at(random.collect()),
        at(ring.chain([(0.0, 0.0)]).collect()),
        at(vec![(0.0, 0.0), (45.0, 0.0), (45.0, 90.0), (45.0, 180.0), (45.0, 270.0)]),
        at(vec![(10.0, 0.0), (40.0, 0.0), (70.0, 0.0)]),
        at(vec![(0.0, 0.0), (30.0, 10.0)]),
        at(vec![(20.0, 50.0)]),
    ]
}

/// Random directions above the surface, some of them grazing.
fn asked(count: u32) -> impl Iterator<Item = [f32; 3]> {
    let hash = Hash::new(1, 2);
    (0..count).map(move |n| {
        let [a, b, ..] = hash.uniforms(n, 7, 0);
        let (z, phi) = (if n % 5 == 0 { 0.1 * a } else { a }, std::f64::consts::TAU * b);
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z].map(|value| value as f32)
    })
}

fn weights(count: usize, terms: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
    let mut weights = vec![0.0; count];
    terms.for_each(|(number, weight)| weights[number] += weight);
    weights
}

#[test]
fn the_fast_way_finds_what_the_exhaustive_search_does() {
    for (layout, directions) in layouts().iter().enumerate() {
        let triangles = triangulate(directions);
        let (rule, fast) = (Interpolator::new(directions, &triangles), Locator::new(directions, &triangles));
        let measured = directions.iter().map(|direction| direction.vector().map(|value| value as f32));
        for target in asked(20_000).chain(measured) {
            let (found, expected) = (fast.locate(target), rule.mix_of(target.map(f64::from)));
            let shares = found.shares.iter().map(|s| (usize::from(s.number), f64::from(s.weight)));
            let sum: f64 = shares.clone().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-6, "layout {layout}: {target:?}: weights sum to {sum}");
            assert!(shares.clone().all(|(_, weight)| (0.0..=1.0).contains(&weight)));
            let found_weights = weights(directions.len(), shares);
            let expected_weights = weights(directions.len(), expected.terms.iter().copied());
            for (found, expected) in found_weights.iter().zip(&expected_weights) {
                assert!((found - expected).abs() < 1e-4, "layout {layout}: {target:?}: {found} {expected}");
            }
            assert!((f64::from(found.cosine_ratio) - expected.cosine_ratio).abs() < 1e-4, "{target:?}");
        }
    }
}

#[test]
fn a_measured_direction_is_itself_exactly() {
    for directions in layouts() {
        let locator = Locator::new(&directions, &triangulate(&directions));
        for (number, direction) in directions.iter().enumerate() {
            let found = locator.locate(direction.vector().map(|value| value as f32));
            let counted = found.shares.iter().filter(|share| share.weight > 0.0);
            let counted: Vec<_> = counted.map(|share| (usize::from(share.number), share.weight)).collect();
            assert_eq!((counted, found.cosine_ratio), (vec![(number, 1.0)], 1.0));
        }
    }
}

/// A material of random values and a random index, with the least and the greatest of its values.
fn material(directions: &[Direction], clusters: u32, size: Size) -> (Evaluator, Vec<u16>) {
    let hash = Hash::new(9, 9);
    let pairs = directions.len() * directions.len();
    let mut table = ClusterTable::new(directions.len(), directions.len());
    for cluster in 0..clusters {
        let color = |n: usize| hash.uniforms(cluster, n as u32, 1);
        table.push_colors((0..pairs).map(|n| [0, 1, 2].map(|c| color(n)[c] as f32)));
    }
    let triangles = triangulate(directions);
    let index = (0..size.texels() as u32).map(|n| hash.below(u64::from(clusters), n, 0, 2) as u16).collect();
    (Evaluator::new((directions, &triangles), (directions, &triangles), table), index)
}

#[test]
fn values_are_exact_where_measured_continuous_between_and_within_bounds() {
    let directions = &layouts()[0];
    let size = Size::new(5, 7);
    let (evaluator, index) = material(directions, 6, size);
    let mut texels = Whole::new(size, true, &index).unwrap();
    let vector = |number: usize| directions[number].vector().map(|value| value as f32);
    let stored = |entry: usize, view: u16, light: u16| {
        use super::{
            locate::Share,
            table::{Tinted, Values},
        };
        let lights = [Tinted { number: light, weights: [1.0; 4] }];
        evaluator
            .values()
            .of(entry, &Mixture { views: &[Share { number: view, weight: 1.0 }], lights: &lights })
    };
    for (n, &entry) in index.iter().enumerate() {
        let place = [(n % size.width) as f64 + 0.5, (n / size.width) as f64 + 0.5];
        let (view, light) = (n * 7 % 81, n * 11 % 81);
        let value = evaluator.value(&mut texels, place, vector(view), vector(light)).unwrap();
        assert_eq!(value, stored(usize::from(entry), view as u16, light as u16));
    }
    // A small step changes little, wherever it leads: across edges of triangles, over the rim, between texels, around
    // the tile; and no value leaves the range of those stored.
    let moved = |[x, y, z]: [f32; 3]| {
        let moved = [x + 2e-4, y - 1e-4, (z + 1e-4).max(0.0)];
        let length = moved.iter().map(|value| value * value).sum::<f32>().sqrt();
        moved.map(|value| value / length)
    };
    let pairs: Vec<[f32; 3]> = asked(40_000).collect();
    for (n, pair) in pairs.chunks_exact(2).enumerate() {
        let place = [n as f64 * 0.37 - 40.0, n as f64 * 0.61 - 90.0];
        let value = evaluator.value(&mut texels, place, pair[0], pair[1]).unwrap();
        let near = [place[0] + 1e-4, place[1] - 1e-4];
        let beside = evaluator.value(&mut texels, near, moved(pair[0]), moved(pair[1])).unwrap();
        for (value, beside) in value.iter().zip(beside) {
            assert!((0.0..=1.0).contains(value), "{pair:?}: {value}");
            assert!((value - beside).abs() < 0.03, "{pair:?}: {value} {beside}");
        }
    }
}

#[test]
fn a_white_material_is_white_and_falls_with_the_cosine_beyond_the_rim() {
    let directions = &layouts()[0];
    let mut table = ClusterTable::new(81, 81);
    table.push_colors((0..81 * 81).map(|_| [1.0; 3]));
    let triangles = triangulate(directions);
    let evaluator = Evaluator::new((directions, &triangles), (directions, &triangles), table);
    let mut texels = Whole::new(Size::new(1, 1), true, &[0]).unwrap();
    let rim = 75f64.to_radians().cos() as f32;
    for pair in asked(4000).collect::<Vec<_>>().chunks_exact(2) {
        let value = evaluator.value(&mut texels, [0.1, 0.9], pair[0], pair[1]).unwrap();
        let expected = (pair[1][2] / rim).min(1.0);
        // Along a great circle between two lights of the ring elevations are a little higher than at them.
        assert!(
            value.iter().all(|v| (v - expected).abs() < 0.04),
            "{pair:?}: {value:?}, expected {expected}"
        );
        assert!(value.iter().all(|&v| v <= 1.00001));
    }
}

#[test]
fn a_texture_repeats_or_its_border_goes_on() {
    use super::evaluator::Texels;
    let index: Vec<u16> = (0..6).collect();
    let mut wraps = Whole::new(Size::new(2, 3), true, &index).unwrap();
    let mut clamps = Whole::new(Size::new(2, 3), false, &index).unwrap();
    for (place, around, beside) in [([-1, 0], 2, 0), ([3, 2], 0, 5), ([-4, -3], 5, 0), ([1, 1], 4, 4)] {
        assert_eq!(wraps.entry(place[0], place[1]).unwrap(), around, "{place:?}");
        assert_eq!(clamps.entry(place[0], place[1]).unwrap(), beside, "{place:?}");
    }
    assert!(Whole::new(Size::new(2, 2), true, &index).is_err());
}

#[test]
fn a_flat_picture_is_what_the_evaluator_says_of_each_texel() {
    let directions = &layouts()[0];
    let size = Size::new(9, 4);
    let (evaluator, index) = material(directions, 300, size);
    let mut texels = Whole::new(size, true, &index).unwrap();
    let asked: Vec<[f32; 3]> = asked(2).collect();
    let (view, light) = (evaluator.view(asked[0]), evaluator.light(asked[1]));
    let mixture = Mixture { views: &view.shares, lights: &tinted(&light, [1.0; 3]) };
    let palette = evaluator.palette(&mixture);
    let mut picture = vec![[0.0; 3]; size.texels()];
    look_up(&index, &palette, &mut picture).unwrap();
    for (n, pixel) in picture.iter().enumerate() {
        let place = [(n % size.width) as f64 + 0.5, (n / size.width) as f64 + 0.5];
        assert_eq!(*pixel, evaluator.value(&mut texels, place, asked[0], asked[1]).unwrap());
    }
    let told = look_up(&[3, 300], &palette, &mut picture[..2]).unwrap_err().to_string();
    assert!(told.contains("cluster 300, beyond the 300"), "{told}");
}

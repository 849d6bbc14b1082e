//! The evaluator: questions a second for random directions and places, and a flat picture of fixed directions.
#![allow(clippy::unwrap_used)]

use btfkit::Direction;
use btfkit::method::value::evaluator::{Evaluator, Whole, look_up, tinted};
use btfkit::method::value::table::{ClusterTable, Mixture};
use btfkit::random::Hash;
use btfkit::shape::Size;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use rayon::prelude::*;

/// Questions of a round.
const QUESTIONS: usize = 1 << 20;

fn main() {
    divan::main();
}

/// 256 clusters of random values under the 81 directions of Bonn, and an index of 1024 x 1024 texels.
fn material() -> (Evaluator, Vec<u16>, Size) {
    let angles = btfkit_formats::ubo2003::directions_81();
    let directions: Vec<Direction> =
        angles.iter().map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg())).collect();
    let triangles = btfkit::method::value::triangles(&directions);
    let hash = Hash::new(1, 1);
    let mut table = ClusterTable::new(81, 81);
    table.push_colors((0..256 * 6561).map(|n| [0, 1, 2].map(|c| hash.uniforms(n, 0, 0)[c] as f32)));
    let size = Size::new(1024, 1024);
    let index = (0..size.texels() as u32).map(|n| hash.below(256, n, 0, 1) as u16).collect();
    (Evaluator::new((&directions, &triangles), (&directions, &triangles), table), index, size)
}

/// Places at the middle of texels, where the value is that of one texel, with random views and lights.
fn questions() -> Vec<([f64; 2], [f32; 3], [f32; 3])> {
    let hash = Hash::new(2, 2);
    let direction = |z: f64, turn: f64| {
        let (r, phi) = ((1.0 - z * z).sqrt(), std::f64::consts::TAU * turn);
        [r * phi.cos(), r * phi.sin(), z].map(|value| value as f32)
    };
    let question = |n: u32| {
        let ([a, b, c, d], [x, y, ..]) = (hash.uniforms(n, 0, 0), hash.uniforms(n, 1, 0));
        let place = [x, y].map(|share| (share * 1024.0).floor() + 0.5);
        (place, direction(a, b), direction(c, d))
    };
    (0..QUESTIONS as u32).map(question).collect()
}

#[divan::bench(args = [1, 2])]
fn random_directions(bencher: Bencher<'_, '_>, threads: usize) {
    let ((evaluator, index, size), questions) = (material(), questions());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    bencher.counter(ItemsCount::new(QUESTIONS)).bench_local(|| {
        pool.install(|| {
            questions
                .par_chunks(1 << 14)
                .map(|part| {
                    let mut texels = Whole::new(size, true, &index).unwrap();
                    let mut sum = 0.0;
                    for &(place, view, light) in part {
                        sum += evaluator.value(&mut texels, place, view, light).unwrap()[0];
                    }
                    sum
                })
                .sum::<f32>()
        })
    });
}

#[divan::bench]
fn flat_picture(bencher: Bencher<'_, '_>) {
    let (evaluator, index, _) = material();
    let (view, light) = (evaluator.view([0.1, 0.2, 0.97]), evaluator.light([0.5, 0.0, 0.866]));
    let mut picture = vec![[0u8; 4]; index.len()];
    bencher.bench_local(|| {
        let mixture = Mixture { views: &view.shares, lights: &tinted(&light, [1.0; 3]) };
        let palette = evaluator.palette(&mixture);
        let colors: Vec<[u8; 4]> = palette
            .iter()
            .map(|rgb| {
                let [r, g, b] = rgb.map(|value| btfkit::color::srgb_encode_u8(f64::from(value)));
                [r, g, b, 255]
            })
            .collect();
        look_up(&index, &colors, black_box(&mut picture)).unwrap();
    });
}

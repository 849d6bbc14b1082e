#![allow(clippy::unwrap_used)]
use super::tree::squared_distance;
use super::*;
use crate::random::Hash;

const TEXELS: u32 = 3000;

fn unit(vector: [f64; 3]) -> [f32; 3] {
    let length = vector.map(|v| v * v).iter().sum::<f64>().sqrt();
    vector.map(|v| (v / length) as f32)
}

/// Unit vectors whose slopes are spread by `x` and `y`, rounded to multiples of `step` if that is not 0.
fn normals(count: u32, [x, y]: [f64; 2], step: f64, domain: u32) -> Vec<[f32; 3]> {
    let hash = Hash::new(3, domain);
    let round = |v: f64| if step > 0.0 { (v / step).round() * step } else { v };
    (0..count)
        .map(|n| {
            let u = hash.normals(n, 0, 0);
            unit([round(x * u[0]), round(y * u[1]), 1.0])
        })
        .collect()
}

fn brute_force(normals: &[[f32; 3]], query: [f32; 3], count: usize) -> Vec<u32> {
    let mut all: Vec<(f64, u32)> =
        normals.iter().zip(0..).map(|(&normal, texel)| (squared_distance(query, normal), texel)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all[..count].iter().map(|&(_, texel)| texel).collect()
}

/// Every kernel finds what brute force finds. Returns the share of queries that did not need the tree.
fn check(normals: &[[f32; 3]], queries: &[[f32; 3]], count: usize) -> f64 {
    let mut share = 0.0;
    for kernel in Kernel::available() {
        let nearest = NearestNormals::new(normals, count, kernel);
        assert!(nearest.memory_bytes() <= NearestNormals::most_bytes(normals.len()));
        let mut found = vec![7; queries.len() * count];
        nearest.find_row(queries, &mut found);
        for (&query, found) in queries.iter().zip(found.chunks_exact(count)) {
            assert_eq!(found, brute_force(normals, query, count), "{kernel:?} {query:?}");
        }
        let looked_up = queries.iter().filter(|&&query| nearest.candidates(query).is_some()).count();
        share = looked_up as f64 / queries.len() as f64;
    }
    share
}

#[test]
fn normals_that_pile_up_and_normals_all_over() {
    for spread in [[0.15, 0.08], [0.6, 0.5], [0.004, 0.003]] {
        let normals = normals(TEXELS, spread, 0.0, 0);
        let queries = self::normals(333, spread, 0.0, 1);
        assert!(check(&normals, &queries, 16) > 0.97, "{spread:?}");
    }
}

#[test]
fn ties_of_rounded_and_equal_normals_go_to_the_smaller_texel_number() {
    for step in [1.0 / 16.0, 1.0 / 64.0] {
        let normals = normals(TEXELS, [0.25, 0.25], step, 0);
        // Both at normals and in the middle between them.
        for step in [step, step / 2.0, 0.0] {
            let queries = self::normals(150, [0.25, 0.25], step, 1);
            check(&normals, &queries, 16);
            check(&normals, &queries, 17); // all by the tree
        }
    }
    check(&vec![[0.0, 0.0, 1.0]; 40], &normals(32, [0.1, 0.1], 0.0, 1), 16);
}

#[test]
fn any_number_of_neighbours() {
    let normals = normals(300, [0.3, 0.2], 0.0, 0);
    let queries = self::normals(47, [0.3, 0.2], 0.0, 1);
    for count in [1, 2, 15, 16, 17, 60, 300] {
        check(&normals, &queries, count);
    }
    check(&normals[..16], &queries, 16);
}

#[test]
fn queries_at_the_borders_of_cells_and_their_parts() {
    let normals = normals(TEXELS, [0.15, 0.08], 0.0, 0);
    let mut queries = Vec::new();
    for n in 0..160i16 {
        // Multiples of 1/1024 and the numbers next to them.
        let (x, y) = (f32::from(n - 80) / 512.0, f32::from((n * 7) % 160 - 80) / 1024.0);
        for x in [x.next_down(), x, x.next_up()] {
            queries.push([x, y, (1.0 - x * x - y * y).sqrt()]);
        }
    }
    assert!(check(&normals, &queries, 16) > 0.97);
}

#[test]
fn queries_of_any_length_and_side() {
    let mut normals = normals(TEXELS, [0.5, 0.5], 0.0, 0);
    normals.extend(normals.clone().iter().take(200).map(|&[x, y, z]| [x, y, -z]));
    normals.extend(normals.clone().iter().take(200).map(|&[x, y, z]| [z, y, x.abs()]));
    let mut queries = vec![
        [0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, -0.0],
        [0.6, 0.0, 0.8001],
        [0.6, 0.0, 0.79999],
        [1e20, -1e20, 3.0],
        [f32::MAX, f32::MIN, 0.0],
        [1e-40, 0.0, 1.0],
    ];
    for n in 0..300 {
        let [x, y, z, length] = Hash::new(4, 0).normals(n, 0, 0);
        let flat = if n % 2 == 0 { 0.02 * z } else { z };
        queries.push(unit([x, y, flat]).map(|v| if n % 3 == 0 { v * length as f32 } else { v }));
    }
    check(&normals, &queries, 16);
}

#[test]
fn normals_nearer_to_each_other_than_f32_can_tell() {
    // Steps of the last place around a query: squares of differences that are equal in f32 but not in f64.
    let hash = Hash::new(5, 0);
    let normals: Vec<[f32; 3]> = (0..500)
        .map(|n| {
            let [x, y, z, _] = hash.words(n, 0, 0).map(|word| (word % 64) as f32 * 2.0f32.powi(-24));
            [0.1 + x, 0.2 + y, 0.97 + z]
        })
        .collect();
    let queries: Vec<[f32; 3]> = (0..100)
        .map(|n| {
            let [x, y, ..] = hash.uniforms(n, 1, 0).map(|u| 0.01 * u);
            unit([0.1 + x, 0.2 + y, 0.97])
        })
        .collect();
    check(&normals, &queries, 16);
}

#[test]
fn a_tile_too_large_for_the_tables_is_searched_by_the_tree() {
    let normals = normals(100_000, [0.1, 0.1], 0.0, 0);
    let nearest = NearestNormals::new(&normals, 16, Kernel::fastest());
    assert!(nearest.leaves.as_ref().is_some_and(|leaves| leaves.memory_bytes() < 64 << 20));
    let queries = self::normals(40, [0.1, 0.1], 0.0, 1);
    let mut found = vec![7; queries.len() * 16];
    nearest.find_row(&queries, &mut found);
    for (&query, found) in queries.iter().zip(found.chunks_exact(16)) {
        assert_eq!(found, brute_force(&normals, query, 16));
    }
}

#[test]
fn fewer_threads_build_the_same() {
    let normals = normals(TEXELS, [0.15, 0.08], 0.0, 0);
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| NearestNormals::new(&normals, 16, Kernel::Plain).memory_bytes())
    };
    assert_eq!(build(1), build(3));
}

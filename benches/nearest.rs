//! The search for nearest normals and the scan, beside kiddo's k-d tree: `cargo bench --bench nearest`.
//!
//! Times are those of the processor in nanoseconds, medians of some runs, all in one thread.
#![allow(clippy::expect_used, clippy::print_stdout)]

mod processor;

use std::hint::black_box;
use std::num::NonZero;

use btfkit::kernel::Kernel;
use btfkit::method::index::nearest::NearestNormals;
use btfkit::method::index::nearest::tree::{Neighbour, Tree};
use btfkit::method::index::scan::{Neighbours, Scan};
use btfkit::random::Hash;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use processor::median_ns;

/// As many as a tile of 137 x 142 has.
const NORMALS: u32 = 137 * 142;
const QUERIES: u32 = 1 << 18;
const RANKS: usize = 16;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    pool.install(|| {
        for (name, spread) in [("piled", [0.15, 0.08]), ("broad", [0.45, 0.45]), ("very piled", [0.03, 0.02])]
        {
            nearest(name, spread);
        }
        for clusters in [256, 1024] {
            scan(clusters);
        }
    });
}

/// Slopes spread by two Gaussians; queries are normals with noise of 0.015 added.
fn nearest(name: &str, [x, y]: [f64; 2]) {
    let hash = Hash::new(2, 0);
    let normals: Vec<[f32; 3]> = (0..NORMALS)
        .map(|n| {
            let u = hash.normals(n, 0, 0);
            unit([x * u[0], y * u[1], 1.0])
        })
        .collect();
    let queries: Vec<[f32; 3]> = (0..QUERIES)
        .map(|n| {
            let normal = normals[hash.below(NORMALS.into(), n, 1, 0) as usize];
            let noise = hash.normals(n, 2, 0);
            unit([0, 1, 2].map(|axis| f64::from(normal[axis]) + 0.015 * noise[axis]))
        })
        .collect();
    let count = f64::from(QUERIES);

    let kiddo: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&normals).expect("normals");
    let ranks = NonZero::new(RANKS).expect("not 0");
    report(name, "kiddo", count, || {
        for query in &queries {
            black_box(kiddo.query(query).nearest_n::<SquaredEuclidean<f32>>(ranks).execute());
        }
    });
    let tree = Tree::new(normals.iter().copied().zip(0..).collect());
    report(name, "own tree", count, || {
        let mut found = [Neighbour::NONE; RANKS];
        for &query in &queries {
            tree.find(query, black_box(&mut found));
        }
    });
    let mut found = vec![0; queries.len() * RANKS];
    for kernel in Kernel::available() {
        report(name, &format!("building, {kernel:?}, a normal"), f64::from(NORMALS), || {
            black_box(NearestNormals::new(&normals, RANKS, kernel));
        });
        let nearest = NearestNormals::new(&normals, RANKS, kernel);
        report(name, &format!("{kernel:?}"), count, || nearest.find_row(&queries, black_box(&mut found)));
        let candidates: Vec<usize> = queries.iter().filter_map(|&query| nearest.candidates(query)).collect();
        if kernel == Kernel::Plain {
            println!(
                "{name}: {} KiB, {:.1} candidates a query, {:.3} % of queries by the tree",
                nearest.memory_bytes() >> 10,
                candidates.iter().sum::<usize>() as f64 / candidates.len() as f64,
                100.0 * (1.0 - candidates.len() as f64 / count)
            );
        }
    }
}

/// Rows of 1024 texels with random clusters, as hard on the memory as can be.
fn scan(clusters: u32) {
    const WIDTH: usize = 1024;
    const HEIGHT: usize = 512;
    let hash = Hash::new(9, 0);
    let index = (0..NORMALS).map(|texel| hash.below(clusters.into(), texel, 0, 0) as u16).collect();
    let distance: Vec<f32> = (0..clusters)
        .flat_map(|a| (0..clusters).map(move |b| hash.uniforms(a.min(b), a.max(b), 1)[0] as f32))
        .collect();
    let candidates: Vec<u32> =
        (0..(WIDTH * HEIGHT * RANKS) as u32).map(|n| hash.below(NORMALS.into(), n, 2, 0) as u32).collect();
    let scan = Scan::new(index, &distance);
    let mut sources = vec![0; WIDTH];
    report("scan", &format!("{clusters} clusters"), (WIDTH * HEIGHT) as f64, || {
        let mut above = vec![0; WIDTH];
        for candidates in candidates.chunks_exact(WIDTH * RANKS) {
            let neighbours = Neighbours { above: Some(&above), ..Neighbours::default() };
            scan.choose_row(candidates, neighbours, black_box(&mut sources));
            above = sources.iter().map(|&texel| scan.cluster(texel)).collect();
        }
    });
}

fn unit(vector: [f64; 3]) -> [f32; 3] {
    let length = vector.map(|v| v * v).iter().sum::<f64>().sqrt();
    vector.map(|v| (v / length) as f32)
}

/// Prints the median time of some runs, divided by `count`.
fn report(data: &str, what: &str, count: f64, run: impl FnMut()) {
    println!("{data}: {what}: {:.1} ns", median_ns(count as usize, run));
}

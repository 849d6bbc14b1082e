//! Clustering of BRDFs under (1), exact in whole numbers and therefore the same whatever the
//! threads and kernels.

pub mod centre;
pub mod lloyd;
pub mod points;
pub mod seeding;

use crate::texel::cluster::points::Arrangement;

/// Distances D of (26) between BRDFs of L* codes [brdf, view, light], in L* units: symmetric, row by row.
pub fn distance_matrix(brdfs: &[u8], arrangement: &Arrangement) -> Vec<f32> {
    use rayon::prelude::*;
    let (views, lights) = (arrangement.cosines().len(), arrangement.lights());
    let rows: Vec<&[u8]> = brdfs.chunks_exact(views * lights).collect();
    let distance = |a: &[u8], b: &[u8]| {
        let pairs = a.chunks_exact(lights).zip(b.chunks_exact(lights)).zip(arrangement.cosines());
        let codes: f64 = pairs
            .map(|((a, b), cosine)| {
                let sum: u32 = a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum();
                f64::from(sum) * cosine
            })
            .sum();
        (codes / 2.55) as f32
    };
    rows.par_iter().flat_map_iter(|a| rows.iter().map(move |b| distance(a, b))).collect()
}

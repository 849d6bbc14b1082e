//! Clustering of BRDFs under (1), exact in whole numbers and therefore the same whatever the
//! threads and kernels.

pub mod assign;
pub mod bounds;
pub mod centre;
pub mod choice;
pub mod lloyd;
pub(crate) mod middle;
pub mod nearest;
pub mod points;
pub mod search;
pub mod seeding;
pub(crate) mod selection;
pub(crate) mod tally;

use bounds::Centres;
use points::Arrangement;

/// Sum of the distances of texels [texel, stride] from the centres, or what stands for them, of their clusters.
pub(crate) fn total_distance(points: &[u8], index: &[u16], centres: &Centres<'_>) -> u64 {
    use rayon::prelude::*;
    let (stride, groups) = (centres.arrangement.stride(), centres.arrangement.groups());
    let texels = points.par_chunks_exact(stride).zip(index);
    texels
        .map(|(point, &cluster)| centres.kernel.row_distances(point, [centres.vector(cluster)], groups)[0])
        .sum()
}

/// Distances D of (26) between BRDFs of L* codes [brdf, view, light], in L* units: symmetric, row by row.
pub(crate) fn distance_matrix(brdfs: &[u8], arrangement: &Arrangement) -> Vec<f32> {
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

//! Features of clusters: the leading principal components of their centres and two opponent colours.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::method::coherent::appearance::FEATURES;

/// Principal directions are those of the most frequent clusters, so many at the most.
const LEADING: usize = 512;

/// A difference of one in a* or b* counts as much as this difference in L*.
const OPPONENT: f64 = 0.5;

/// The first feature spans so many standard deviations to each side.
const DEVIATIONS: f64 = 4.0;

/// What is known of clusters.
#[derive(Clone, Copy, Debug)]
pub struct Clusters<'a> {
    /// Centres [cluster, view, light], L* codes.
    pub centres: &'a [u8],
    /// Cosine of the elevation of each view: its weight, as in (1).
    pub view_weights: &'a [f64],
    /// Lights of a view.
    pub lights: usize,
    /// Mean a* and b* of each cluster's representative.
    pub opponents: &'a [[f64; 2]],
    /// Texels of each cluster in the exemplar.
    pub counts: &'a [u64],
}

/// Features of every cluster, one scale for all.
pub fn features(clusters: &Clusters<'_>) -> Vec<[i8; FEATURES]> {
    let mut order: Vec<usize> = (0..clusters.counts.len()).collect();
    order.sort_by_key(|&cluster| (std::cmp::Reverse(clusters.counts[cluster]), cluster));
    order.retain(|&cluster| clusters.counts[cluster] > 0);
    order.truncate(LEADING);
    let total = order.iter().map(|&cluster| clusters.counts[cluster]).sum::<u64>().max(1) as f64;
    let shares: Vec<f64> = order.iter().map(|&cluster| clusters.counts[cluster] as f64 / total).collect();
    let mut leading: Vec<Vec<f64>> = order.iter().map(|&cluster| clusters.point(cluster)).collect();
    let mut mean = vec![0.0; leading.first().map_or(0, Vec::len)];
    for (point, share) in leading.iter().zip(&shares) {
        mean.iter_mut().zip(point).for_each(|(mean, value)| *mean += share * value);
    }
    for point in &mut leading {
        point.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
    }
    let directions = principal_directions(&leading, &shares);
    let features = |cluster: usize| -> [f64; FEATURES] {
        let point = clusters.point(cluster);
        let along = |direction: &Vec<f64>| {
            direction.iter().zip(&point).zip(&mean).map(|((d, value), mean)| d * (value - mean)).sum()
        };
        std::array::from_fn(|n| directions.get(n).map_or(0.0, along))
    };
    let exact: Vec<[f64; FEATURES]> = (0..clusters.counts.len()).into_par_iter().map(features).collect();
    let variance: f64 = order.iter().zip(&shares).map(|(&c, share)| share * exact[c][0] * exact[c][0]).sum();
    let gain = if variance > 0.0 { 127.0 / (DEVIATIONS * variance.sqrt()) } else { 0.0 };
    exact
        .iter()
        .map(|feature| feature.map(|value| (value * gain).round().clamp(-127.0, 127.0) as i8))
        .collect()
}

impl Clusters<'_> {
    /// Weighted L* under all directions, and two opponent colours.
    fn point(&self, cluster: usize) -> Vec<f64> {
        let values = self.view_weights.len() * self.lights;
        let centre = &self.centres[cluster * values..(cluster + 1) * values];
        let views = centre.chunks_exact(self.lights).zip(self.view_weights);
        let lightness = views.flat_map(|(lights, weight)| {
            let weight = weight.max(0.0).sqrt() / 2.55;
            lights.iter().map(move |&code| f64::from(code) * weight)
        });
        let opponent = OPPONENT * (values as f64).sqrt();
        lightness.chain(self.opponents[cluster].map(|value| opponent * value)).collect()
    }
}

/// The leading principal directions of weighted points around 0, by the eigenvectors of their Gram matrix.
fn principal_directions(points: &[Vec<f64>], shares: &[f64]) -> Vec<Vec<f64>> {
    let count = points.len();
    let rows: Vec<Vec<f64>> = (0..count)
        .into_par_iter()
        .map(|i| {
            let product = |j: usize| points[i].iter().zip(&points[j]).map(|(a, b)| a * b).sum::<f64>();
            (0..=i).map(|j| product(j) * (shares[i] * shares[j]).sqrt()).collect()
        })
        .collect();
    let gram = DMatrix::from_fn(count, count, |i, j| rows[i.max(j)][i.min(j)]);
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let most = order.first().map_or(0.0, |&first| eigen.eigenvalues[first]);
    order.truncate(FEATURES);
    // What is left of rounding is no direction.
    order.retain(|&component| eigen.eigenvalues[component] > 1e-9 * most);
    order
        .iter()
        .map(|&component| {
            let vector = eigen.eigenvectors.column(component);
            let largest =
                vector.iter().copied().fold(0.0, |most: f64, v| if v.abs() > most.abs() { v } else { most });
            let scale = largest.signum() / eigen.eigenvalues[component].sqrt();
            let mut direction = vec![0.0; points[0].len()];
            for ((point, share), along) in points.iter().zip(shares).zip(vector.iter()) {
                let weight = along * share.sqrt() * scale;
                direction.iter_mut().zip(point).for_each(|(d, value)| *d += weight * value);
            }
            direction
        })
        .collect()
}

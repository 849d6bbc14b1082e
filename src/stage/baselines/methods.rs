//! The representations, each as it gives the samples of a view.

use btfkit_formats::{Direction, Samples};
use nalgebra::{DMatrix, SymmetricEigen};

use crate::color::curve;
use crate::error::Result;
use crate::method::cluster::choice::Representation;
use crate::method::cluster::middle;
use crate::method::value::components::Components;
use crate::run::Context;
use crate::stage::pack;
use crate::store::measurement::Description;
use crate::store::model::{Clusters, Model};

/// Name of this program's own.
pub(super) const PACKED: &str = "packed";

/// Components of a view that are kept, a row each.
const RANKS: [usize; 4] = [1, 2, 4, 8];

/// Most values of a texel under a view that its components are found of.
const MOST_VALUES: usize = 1024;

/// Coefficients of a polynomial of the light: x^2, y^2, x y, x, y, 1.
const TERMS: usize = 6;

/// A representation at one or several sizes.
pub(super) enum Method {
    /// An index, and a BRDF a cluster.
    Clusters { name: &'static str, index: Vec<u16>, clusters: usize, samples: Samples, bytes: u64 },
    /// An index, and the middle of each cluster's texels, found view by view.
    Groups { name: &'static str, rule: Representation, groups: Vec<Vec<u32>>, index: Vec<u16>, bytes: u64 },
    /// A mean and components.
    Components { name: &'static str, setting: String, components: Components, bytes: u64 },
    /// Components of each view by itself; bytes of each rank.
    PerView { ranks: Vec<(usize, u64)> },
    /// Polynomials of the light's direction at each texel, view and channel: the values of the terms, and what turns
    /// values into coefficients.
    Polynomials { terms: Vec<[f64; TERMS]>, fit: DMatrix<f64>, bytes: u64 },
}

fn of_clusters(rule: Representation) -> &'static str {
    match rule {
        Representation::Texel => "clusters, texel",
        Representation::Mean => "clusters, mean",
        Representation::Median => "clusters, median",
    }
}

impl Method {
    /// The clusters of a model as they are.
    pub(super) fn of_model(rule: Representation, clusters: &Clusters, bytes: u64) -> Self {
        Self::Clusters {
            name: of_clusters(rule),
            index: clusters.index.clone(),
            clusters: clusters.sources.len(),
            samples: clusters.representatives.samples.clone(),
            bytes,
        }
    }

    /// The same clusters with means or medians.
    pub(super) fn of_groups(rule: Representation, index: &[u16], count: usize, bytes: u64) -> Self {
        let mut groups = vec![Vec::new(); count];
        for (texel, &cluster) in index.iter().enumerate() {
            groups[usize::from(cluster)].push(texel as u32);
        }
        Self::Groups { name: of_clusters(rule), rule, groups, index: index.to_vec(), bytes }
    }

    /// The strongest components, in 8 bits with a scale each; the mean in 16.
    pub(super) fn principal(whole: &Components, rank: usize) -> Self {
        let count = whole.count();
        let kept = |values: &[f32]| {
            let mut kept: Vec<f32> =
                values.chunks_exact(count.max(1)).flat_map(|values| &values[..rank]).copied().collect();
            (0..rank).for_each(|k| in_eight_bits(kept.iter_mut().skip(k).step_by(rank)));
            kept
        };
        let (brdf, texels) = (whole.mean.len(), whole.size.texels());
        Self::Components {
            name: "PCA",
            setting: format!("rank {rank}"),
            bytes: (2 * brdf + rank * (brdf + texels + 2 * size_of::<f32>())) as u64,
            components: Components {
                basis: kept(&whole.basis),
                coefficients: kept(&whole.coefficients),
                ..whole.clone()
            },
        }
    }

    /// Components of each view; none where a view has too many values.
    pub(super) fn principal_per_view(description: &Description, texels: usize) -> Option<Self> {
        let (values, views) = (description.texel_samples(), description.views.len());
        let most = values.min(texels);
        let bytes = |rank: usize| views * (2 * values + rank * (values + texels + 2 * size_of::<f32>()));
        let ranks = RANKS.iter().filter(|&&rank| rank <= most).map(|&rank| (rank, bytes(rank) as u64));
        (values <= MOST_VALUES).then(|| Self::PerView { ranks: ranks.collect() })
    }

    /// Polynomials; none of fewer lights than they have terms.
    pub(super) fn polynomials(description: &Description, texels: usize) -> Option<Self> {
        let term = |light: &Direction| {
            let [x, y, _] = light.vector();
            [x * x, y * y, x * y, x, y, 1.0]
        };
        let terms: Vec<[f64; TERMS]> = description.lights.iter().map(term).collect();
        let matrix = DMatrix::from_row_iterator(terms.len(), TERMS, terms.iter().flatten().copied());
        // Directions on one ring do not tell all terms apart: the shortest coefficients are taken.
        let fit = matrix.pseudo_inverse(1e-9).ok()?;
        let (channels, views) = (description.n_channels(), description.views.len());
        let bytes = views * channels * TERMS * (texels + size_of::<f32>());
        (terms.len() >= TERMS).then_some(Self::Polynomials { terms, fit, bytes: bytes as u64 })
    }

    /// A packed file of at most so many bytes; none where that is too few.
    pub(super) fn packed(model: &Model, size: u64, context: &Context<'_>) -> Result<Option<Self>> {
        let Some((components, bytes)) = pack::packed_and_unpacked(model, size, context)? else {
            return Ok(None);
        };
        let setting = format!("{} components", components.count());
        Ok(Some(Self::Components { name: PACKED, setting, components, bytes }))
    }

    /// Setting, bytes and name of each of its rows.
    pub(super) fn rows(&self) -> Vec<(String, u64, &'static str)> {
        match self {
            Self::Clusters { name, clusters, bytes, .. } => vec![(clusters.to_string(), *bytes, name)],
            Self::Groups { name, groups, bytes, .. } => vec![(groups.len().to_string(), *bytes, name)],
            Self::Components { name, setting, bytes, .. } => vec![(setting.clone(), *bytes, name)],
            Self::PerView { ranks } => {
                let row = |&(rank, bytes): &(usize, u64)| (format!("rank {rank}"), bytes, "PCA per view");
                ranks.iter().map(row).collect()
            }
            Self::Polynomials { bytes, .. } => vec![("6 terms".to_owned(), *bytes, "polynomials")],
        }
    }

    /// Bytes of each of its rows.
    pub(super) fn bytes(&self) -> Vec<u64> {
        self.rows().into_iter().map(|(_, bytes, _)| bytes).collect()
    }

    /// Samples of all texels under a view, [texel, light, channel], of each of its rows. `values` are the measured
    /// samples on the curve.
    pub(super) fn of_view(
        &self,
        view: usize,
        measured: &Samples,
        values: &[f32],
        description: &Description,
    ) -> Vec<Samples> {
        let texel = description.texel_samples();
        let (sample_type, transfer) = (description.sample_type, description.transfer);
        let looked_up = |samples: &Samples, index: &[u16], place: &dyn Fn(usize) -> usize| {
            let starts = index.iter().map(|&cluster| place(usize::from(cluster)) * texel);
            let found = samples.select(starts.map(|start| start..start + texel));
            found.unwrap_or_else(|| Samples::none(sample_type))
        };
        match self {
            Self::Clusters { index, samples, .. } => {
                let views = description.views.len();
                vec![looked_up(samples, index, &|cluster| cluster * views + view)]
            }
            Self::Groups { rule, groups, index, .. } => {
                let samples = middle::of_groups(*rule, measured, texel, groups);
                vec![looked_up(&samples, index, &|cluster| cluster)]
            }
            Self::Components { components, .. } => {
                let (lights, window) = (0..description.lights.len(), components.size.window());
                vec![components.samples(view, lights, window, sample_type, transfer)]
            }
            Self::PerView { ranks } => per_view(ranks, values, texel)
                .into_iter()
                .map(|values| curve::samples(&values, sample_type, transfer))
                .collect(),
            Self::Polynomials { terms, fit, .. } => {
                let values = polynomials(terms, fit, values, description.n_channels());
                vec![curve::samples(&values, sample_type, transfer)]
            }
        }
    }
}

/// Rounds values to 255 steps of a scale of their own.
fn in_eight_bits<'a>(values: impl Iterator<Item = &'a mut f32>) {
    let values: Vec<&mut f32> = values.collect();
    let largest = values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
    let scale = largest / 127.0;
    if scale > 0.0 {
        values.into_iter().for_each(|value| *value = (*value / scale).round() * scale);
    }
}

/// Values [texel, value] by the strongest components of each number, in 8 bits.
fn per_view(ranks: &[(usize, u64)], values: &[f32], length: usize) -> Vec<Vec<f32>> {
    let texels = values.len() / length.max(1);
    let mut rows = DMatrix::from_row_slice(texels, length, values);
    let mean = rows.row_mean();
    rows.row_iter_mut().for_each(|mut row| row -= &mean);
    let covariance = rows.tr_mul(&rows).map(f64::from);
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..length).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let most = ranks.iter().map(|&(rank, _)| rank).max().unwrap_or(0);
    let mut basis = DMatrix::from_fn(length, most, |value, k| eigen.eigenvectors[(value, order[k])] as f32);
    let mut coefficients = &rows * &basis;
    basis.column_iter_mut().for_each(|mut column| in_eight_bits(column.iter_mut()));
    coefficients.column_iter_mut().for_each(|mut column| in_eight_bits(column.iter_mut()));
    let of_rank = |&(rank, _): &(usize, u64)| {
        // The transpose lies as the values do: a column a texel.
        let mut found = basis.columns(0, rank) * coefficients.columns(0, rank).transpose();
        found.column_iter_mut().for_each(|mut texel| texel += mean.transpose());
        found.as_slice().to_vec()
    };
    ranks.iter().map(of_rank).collect()
}

/// Values [texel, light, channel] by the polynomials that fit them, whose coefficients have 8 bits each.
fn polynomials(terms: &[[f64; TERMS]], fit: &DMatrix<f64>, values: &[f32], channels: usize) -> Vec<f32> {
    let lights = terms.len();
    let texels = values.len() / (lights * channels).max(1);
    let mut found = vec![0.0; values.len()];
    for channel in 0..channels {
        let at = |texel: usize, light: usize| (texel * lights + light) * channels + channel;
        let measured = DMatrix::from_fn(lights, texels, |light, texel| f64::from(values[at(texel, light)]));
        let mut coefficients = (fit * measured).map(|value| value as f32);
        coefficients.row_iter_mut().for_each(|mut row| in_eight_bits(row.iter_mut()));
        for (texel, coefficients) in coefficients.column_iter().enumerate() {
            for (light, terms) in terms.iter().enumerate() {
                let products = terms.iter().zip(coefficients.iter()).map(|(term, c)| term * f64::from(*c));
                found[at(texel, light)] = products.sum::<f64>() as f32;
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn components_of_a_view_give_values_back_that_have_no_more() {
        let [a, b]: [fn(usize) -> f32; 2] =
            [|n| (n as f32 * 0.7).sin() * 40.0, |n| (n as f32 * 1.9).cos() * 9.0];
        let values: Vec<f32> =
            (0..30).flat_map(|t| (0..12).map(move |v| 100.0 + a(t) * a(v) / 40.0 + b(t) * b(v))).collect();
        let found = per_view(&[(1, 0), (2, 0)], &values, 12);
        let worst =
            |found: &[f32]| found.iter().zip(&values).fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
        assert!(
            worst(&found[0]) > 5.0 && worst(&found[1]) < 1.5,
            "{} {}",
            worst(&found[0]),
            worst(&found[1])
        );
    }

    #[test]
    fn polynomials_give_quadratic_values_back() {
        let lights: Vec<[f64; 2]> =
            (0..9).map(|n| [f64::from(n % 3) * 0.4 - 0.4, f64::from(n / 3) * 0.3]).collect();
        let terms: Vec<[f64; TERMS]> =
            lights.iter().map(|[x, y]| [x * x, y * y, x * y, *x, *y, 1.0]).collect();
        let matrix = DMatrix::from_row_iterator(9, TERMS, terms.iter().flatten().copied());
        let fit = matrix.pseudo_inverse(1e-9).unwrap();
        let value = |texel: usize, [x, y]: [f64; 2], channel: usize| {
            (100.0 + texel as f64 * x * y - 30.0 * x + channel as f64 * y * y * 20.0) as f32
        };
        let values: Vec<f32> = (0..5)
            .flat_map(|t| lights.iter().flat_map(move |&l| (0..2).map(move |c| value(t, l, c))))
            .collect();
        let found = polynomials(&terms, &fit, &values, 2);
        assert!(found.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1.0), "{found:?} {values:?}");
    }
}

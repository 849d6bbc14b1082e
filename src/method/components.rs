//! The leading principal components of texels' codes: as little of them as tells texels apart.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::field::{Field, karhunen_loeve};
use crate::error::Result;

/// Most texels whose codes the components are found from; of more, evenly spread ones.
const MOST_SAMPLED: usize = 1 << 14;

/// The `dims` leading principal components of codes [texel, code], `count` (at least 1) of a texel; at most as many as
/// there are codes. Returns [texel, dim], L* codes less the mean, and the number of dims.
///
/// # Errors
/// Where there is no texel.
pub fn leading(codes: &[u8], count: usize, dims: usize) -> Result<(Vec<f32>, usize)> {
    let step = (codes.len() / count).div_ceil(MOST_SAMPLED).max(1);
    let sampled: Vec<f64> =
        codes.chunks_exact(count).step_by(step).flatten().map(|&code| f64::from(code)).collect();
    let (centred, mean) = Field::new(1, sampled.len() / count, count, sampled)?.centred();
    let transform = karhunen_loeve::transform(&centred)?;
    let dims = dims.min(count);
    let rows: Vec<Vec<f64>> = (0..dims).map(|row| row_of(&transform, row)).collect();
    let mut components = vec![0.0; codes.len() / count * dims];
    components.par_chunks_exact_mut(dims).zip(codes.par_chunks_exact(count)).for_each(|(to, codes)| {
        for (to, row) in to.iter_mut().zip(&rows) {
            let parts = codes.iter().zip(&mean).zip(row);
            *to = parts.map(|((&code, mean), weight)| (f64::from(code) - mean) * weight).sum::<f64>() as f32;
        }
    });
    Ok((components, dims))
}

fn row_of(matrix: &DMatrix<f64>, row: usize) -> Vec<f64> {
    matrix.row(row).iter().copied().collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::Hash;

    #[test]
    fn two_components_say_what_two_causes_did_to_many_codes() {
        let (hash, count) = (Hash::new(3, 0), 6);
        let weights = [[9.0, 5.0, -3.0, 8.0, 2.0, 7.0], [-2.0, 4.0, 6.0, 1.0, 3.0, -5.0]];
        let cause = |n: u32| hash.normals(n, 0, 0);
        let codes: Vec<u8> = (0..20_000)
            .flat_map(|n| {
                let [a, b, ..] = cause(n);
                (0..count).map(move |k| (128.0 + a * weights[0][k] + b * weights[1][k]).round() as u8)
            })
            .collect();
        let (components, dims) = leading(&codes, count, 2).unwrap();
        assert_eq!((components.len(), dims), (40_000, 2));
        let variance = |values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<f64> = values.collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64
        };
        let of = |dim: usize| variance(&mut components.iter().skip(dim).step_by(2).map(|&n| f64::from(n)));
        let all: f64 = (0..count)
            .map(|code| variance(&mut codes.iter().skip(code).step_by(count).map(|&n| f64::from(n))))
            .sum();
        // What is left is the rounding to whole codes: a twelfth each.
        assert!(of(0) > of(1) && (all - of(0) - of(1) - 4.0 / 12.0).abs() < 0.1, "{all} {} {}", of(0), of(1));
        assert_eq!(leading(&codes, count, 9).unwrap().1, 6);
        assert!(leading(&[], 3, 2).is_err());
    }
}

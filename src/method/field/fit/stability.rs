//! Stability of a causal half-plane autoregressive field.
//!
//! The field is BIBO stable if and only if (Huang 1972; DeCarlo, Murray and Saeks 1977; Strintzis 1977) its recursion
//! along a row is stable and, at every horizontal frequency w, so is the recursion from row to row, whose
//! coefficients are (I - A_0(w))^-1 A_dy(w) with A_dy(w) = sum over dx of A_(dy,dx) e^(-i w dx).

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use super::neighbourhood::{is_causal, reach};
use crate::error::{Error, Result};

/// Frequencies around the circle; real coefficients need half of them only.
const FREQUENCIES: usize = 256;

/// Squarings in Gelfand's formula: the radius is that of the 65536th power, too large by a factor of at most
/// (norm of a non-normal transient)^(1/65536).
const SQUARINGS: usize = 16;

/// A field counts as stable below this radius: a disturbance is down to a fiftieth after 977 texels. Closer to 1 margins
/// would be longer, the grids of frequencies here and in `spectrum` might miss a peak, and no tile is large enough for
/// such a field to be estimated from.
pub(crate) const STABLE_RADIUS: f64 = 0.996;

type Matrix = DMatrix<Complex<f64>>;

/// The larger of the spectral radii along the row and from row to row (the most over all frequencies): below 1 the
/// field is stable, and a disturbance decays about as radius^distance.
///
/// `gamma` is `[channels, channels * sites]` of (9). Infinite if `gamma` is not finite.
///
/// # Errors
/// When the shape of `gamma` does not fit the sites, or a site is not causal.
pub(crate) fn radius(gamma: &DMatrix<f64>, sites: &[[i32; 2]]) -> Result<f64> {
    let channels = gamma.nrows();
    if gamma.ncols() != channels * sites.len() {
        return Err(Error::input(format!(
            "a parameter matrix of {channels} x {} does not fit {} neighbours",
            gamma.ncols(),
            sites.len()
        )));
    }
    if let Some([dy, dx]) = sites.iter().find(|&&site| !is_causal(site)) {
        return Err(Error::input(format!("neighbour ({dy}, {dx}) is not causal")));
    }
    let along_row = row_radius(gamma, sites);
    // An unstable row already settles it, and I - A_0(w) need not have an inverse then.
    if along_row >= 1.0 {
        return Ok(along_row);
    }
    let mut largest = along_row;
    for k in 0..=FREQUENCIES / 2 {
        largest = largest.max(down_radius(gamma, sites, TAU * k as f64 / FREQUENCIES as f64)?);
    }
    Ok(largest)
}

/// Radius of the recursion along a row.
pub(in crate::method::field) fn row_radius(gamma: &DMatrix<f64>, sites: &[[i32; 2]]) -> f64 {
    let channels = gamma.nrows();
    let [_, side] = reach(sites);
    let mut blocks = vec![Matrix::zeros(channels, channels); side];
    for (s, &[dy, dx]) in sites.iter().enumerate() {
        if dy == 0 {
            blocks[dx as usize - 1] += complex_block(gamma, s);
        }
    }
    spectral_radius(companion(&blocks, channels))
}

/// Radius of the recursion from row to row at horizontal frequency `omega_rad` (radians a texel).
fn down_radius(gamma: &DMatrix<f64>, sites: &[[i32; 2]], omega_rad: f64) -> Result<f64> {
    let channels = gamma.nrows();
    let [rows, _] = reach(sites);
    let mut blocks = vec![Matrix::zeros(channels, channels); rows + 1];
    for (s, &[dy, dx]) in sites.iter().enumerate() {
        let angle = -omega_rad * f64::from(dx);
        blocks[dy as usize] += complex_block(gamma, s) * Complex::new(libm::cos(angle), libm::sin(angle));
    }
    let same_row = Matrix::identity(channels, channels) - blocks.remove(0);
    let inverse =
        same_row.try_inverse().ok_or_else(|| Error::input("a same-row recursion has no inverse"))?;
    let blocks: Vec<_> = blocks.iter().map(|block| &inverse * block).collect();
    Ok(spectral_radius(companion(&blocks, channels)))
}

/// A_s, the block of `gamma` for site number `s`.
fn complex_block(gamma: &DMatrix<f64>, s: usize) -> Matrix {
    let channels = gamma.nrows();
    gamma.columns(s * channels, channels).map(|value| Complex::new(value, 0.0))
}

/// The matrix that takes p past values to p values one step later, for coefficients B_1 ... B_p.
fn companion(blocks: &[Matrix], channels: usize) -> Matrix {
    let order = blocks.len() * channels;
    let mut matrix = Matrix::zeros(order, order);
    for (p, block) in blocks.iter().enumerate() {
        matrix.view_mut((0, p * channels), (channels, channels)).copy_from(block);
    }
    for i in channels..order {
        matrix[(i, i - channels)] = Complex::new(1.0, 0.0);
    }
    matrix
}

/// Gelfand's formula by repeated squaring, rescaled at each step.
fn spectral_radius(mut matrix: Matrix) -> f64 {
    let mut log_radius = 0.0;
    let mut weight = 1.0;
    for _ in 0..=SQUARINGS {
        let norm = matrix.norm();
        if norm == 0.0 {
            return 0.0;
        }
        if !norm.is_finite() {
            return f64::INFINITY;
        }
        log_radius += weight * libm::log(norm);
        weight /= 2.0;
        matrix.unscale_mut(norm);
        matrix = &matrix * &matrix;
    }
    libm::exp(log_radius)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn scalar(coefficients: &[f64], sites: &[[i32; 2]]) -> f64 {
        radius(&DMatrix::from_row_slice(1, coefficients.len(), coefficients), sites).unwrap()
    }

    #[test]
    fn one_coefficient_is_its_own_radius_wherever_it_stands() {
        for site in [[0, 1], [1, 0], [1, 1], [1, -1], [1, -3]] {
            for a in [0.9, 1.1, -0.9, -1.1] {
                assert!((scalar(&[a], &[site]) - a.abs()).abs() < 1e-12, "{a} at {site:?}");
            }
        }
        // Two steps back: the root.
        for site in [[0, 2], [2, 0], [2, -1]] {
            for a in [0.9_f64, 1.1] {
                assert!((scalar(&[a], &[site]) - a.sqrt()).abs() < 1e-4, "{a} at {site:?}");
            }
        }
    }

    #[test]
    fn the_largest_root_of_a_longer_recursion_counts() {
        // (1 - 0.9 z)(1 - 0.5 z)(1 + 0.3 z), along the row, down, and along a diagonal.
        let coefficients = [1.1, -0.03, -0.135];
        for sites in [[[0, 1], [0, 2], [0, 3]], [[1, 0], [2, 0], [3, 0]], [[1, -1], [2, -2], [3, -3]]] {
            assert!((scalar(&coefficients, &sites) - 0.9).abs() < 1e-4, "{sites:?}");
        }
    }

    #[test]
    fn a_row_recursion_amplifies_the_recursion_from_row_to_row() {
        // At w = 0 the row gain is 1 / (1 - 0.5), so 0.4 above becomes 0.8 and 0.6 becomes 1.2.
        let sites = [[0, 1], [1, 0]];
        assert!((scalar(&[0.5, 0.4], &sites) - 0.8).abs() < 1e-12);
        assert!((scalar(&[0.5, 0.6], &sites) - 1.2).abs() < 1e-12);
        // With a negative row coefficient the worst frequency is pi.
        assert!((scalar(&[-0.5, 0.4], &sites) - 0.8).abs() < 1e-12);
    }

    #[test]
    fn separable_coefficients_have_the_larger_factor_as_radius() {
        // (1 - a z1)(1 - b z2): coefficients a, b and -a b.
        let sites = [[0, 1], [1, 0], [1, 1]];
        assert!((scalar(&[0.7, 0.95, -0.7 * 0.95], &sites) - 0.95).abs() < 1e-12);
        assert!((scalar(&[0.95, 0.7, -0.7 * 0.95], &sites) - 0.95).abs() < 1e-12);
        assert!(scalar(&[0.95, 1.02, -0.95 * 1.02], &sites) > 1.0);
    }

    #[test]
    fn channels_that_feed_each_other_are_judged_together() {
        // Two channels exchanged at each step with gains 2 and 0.3: the radius is sqrt(0.6).
        let gamma = DMatrix::from_row_slice(2, 2, &[0.0, 2.0, 0.3, 0.0]);
        for site in [[0, 1], [1, 0]] {
            assert!((radius(&gamma, &[site]).unwrap() - 0.6_f64.sqrt()).abs() < 1e-4);
        }
        // One-way coupling, however strong, keeps the radius of the diagonal.
        let gamma = DMatrix::from_row_slice(2, 2, &[0.5, 100.0, 0.0, 0.4]);
        assert!((radius(&gamma, &[[1, 0]]).unwrap() - 0.5).abs() < 1e-3);
    }

    #[test]
    fn shapes_and_sites_are_checked() {
        let gamma = DMatrix::from_row_slice(1, 2, &[0.1, 0.1]);
        assert!(radius(&gamma, &[[0, 1]]).is_err());
        assert!(radius(&gamma, &[[0, 1], [0, -1]]).is_err());
        assert_eq!(scalar(&[0.0, 0.0], &[[0, 1], [1, 0]]), 0.0);
    }
}

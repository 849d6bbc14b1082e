//! Randomness hashed from place and seed: Philox 4x32-10 (Salmon et al. 2011),
//! so that a value depends on its counter and key and on nothing else.

use crate::kernel::philox::philox4x32;
use crate::kernel::{Kernel, noise};

/// A keyed stream of hashes: one per user of randomness, told apart by `domain`.
#[derive(Clone, Copy, Debug)]
pub struct Hash {
    key: [u32; 2],
    domain: u32,
}

impl Hash {
    /// The hash family of a seed for one purpose.
    pub fn new(seed: u64, domain: u32) -> Self {
        Self { key: [seed as u32, (seed >> 32) as u32], domain }
    }

    /// Four words of the place (a, b, c).
    #[inline]
    pub fn words(&self, a: u32, b: u32, c: u32) -> [u32; 4] {
        philox4x32([a, b, c, self.domain], self.key)
    }

    /// Four numbers of the place (a, b, c), evenly spread in (0, 1).
    #[inline]
    pub fn uniforms(&self, a: u32, b: u32, c: u32) -> [f64; 4] {
        self.words(a, b, c).map(unit_interval)
    }

    /// Four standard normals of the place (a, b, c).
    #[inline]
    pub fn normals(&self, a: u32, b: u32, c: u32) -> [f64; 4] {
        self.uniforms(a, b, c).map(normal_quantile)
    }

    /// Standard normals of columns `first_column ..` of a row in one channel: see [`noise::normals`].
    pub fn normal_row(&self, kernel: Kernel, row: i32, first_column: i32, channel: u32, out: &mut [f32]) {
        let Self { key, domain } = *self;
        noise::normals(kernel, noise::Site { key, domain, row, first_column, channel }, out);
    }

    /// A whole number below `bound` (which must not be 0), from the place (a, b, c).
    #[inline]
    pub fn below(&self, bound: u64, a: u32, b: u32, c: u32) -> u64 {
        let [w0, w1, ..] = self.words(a, b, c);
        let word = (u64::from(w1) << 32) | u64::from(w0);
        ((u128::from(word) * u128::from(bound)) >> 64) as u64
    }
}

/// Maps a word to the middle of its cell in (0, 1).
#[inline]
pub(crate) fn unit_interval(word: u32) -> f64 {
    (f64::from(word) + 0.5) / 4_294_967_296.0
}

/// Quantile of the standard normal, relative error below 1e-15
/// (Wichura 1988, algorithm AS 241, PPND16). `libm` keeps the tails equal on every machine.
#[inline]
#[allow(clippy::excessive_precision)] // digits as published
pub(crate) fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * ratio(
            r,
            &[
                2509.0809287301226727,
                33430.575583588128105,
                67265.770927008700853,
                45921.953931549871457,
                13731.693765509461125,
                1971.5909503065514427,
                133.14166789178437745,
                3.387132872796366608,
            ],
            &[
                5226.495278852545925,
                28729.085735721942674,
                39307.89580009271061,
                21213.794301586595867,
                5394.1960214247511077,
                687.1870074920579083,
                42.313330701600911252,
                1.0,
            ],
        );
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    let r = (-libm::log(tail)).sqrt();
    let magnitude = if r <= 5.0 {
        ratio(
            r - 1.6,
            &[
                7.7454501427834140764e-4,
                0.0227238449892691845833,
                0.24178072517745061177,
                1.27045825245236838258,
                3.64784832476320460504,
                5.7694972214606914055,
                4.6303378461565452959,
                1.42343711074968357734,
            ],
            &[
                1.05075007164441684324e-9,
                5.475938084995344946e-4,
                0.0151986665636164571966,
                0.14810397642748007459,
                0.68976733498510000455,
                1.6763848301838038494,
                2.05319162663775882187,
                1.0,
            ],
        )
    } else {
        ratio(
            r - 5.0,
            &[
                2.01033439929228813265e-7,
                2.71155556874348757815e-5,
                0.0012426609473880784386,
                0.026532189526576123093,
                0.29656057182850489123,
                1.7848265399172913358,
                5.4637849111641143699,
                6.6579046435011037772,
            ],
            &[
                2.04426310338993978564e-15,
                1.4215117583164458887e-7,
                1.8463183175100546818e-5,
                7.868691311456132591e-4,
                0.0148753612908506148525,
                0.13692988092273580531,
                0.59983220655588793769,
                1.0,
            ],
        )
    };
    if q < 0.0 { -magnitude } else { magnitude }
}

/// Quotient of two polynomials, coefficients from the highest power down.
#[inline]
fn ratio(x: f64, numerator: &[f64; 8], denominator: &[f64; 8]) -> f64 {
    let horner = |c: &[f64; 8]| c.iter().fold(0.0, |sum, &a| sum * x + a);
    horner(numerator) / horner(denominator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn philox_agrees_with_the_published_vectors_of_random123() {
        assert_eq!(philox4x32([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox4x32([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn the_normal_quantile_agrees_with_tabulated_values() {
        for (p, z) in [
            (0.5, 0.0),
            (0.975, 1.959_963_984_540_054),
            (0.001, -3.090_232_306_167_813_5),
            (1e-10, -6.361_340_902_404_056),
            (1e-20, -9.262_340_089_798_409),
        ] {
            assert!((normal_quantile(p) - z).abs() < 1e-13, "{p}: {} against {z}", normal_quantile(p));
        }
    }

    #[test]
    fn normals_have_the_moments_of_the_standard_normal() {
        let hash = Hash::new(7, 0);
        let values: Vec<f64> = (0..50_000).flat_map(|i| hash.normals(i, 1, 2)).collect();
        let moment = |k: i32| values.iter().map(|v| v.powi(k)).sum::<f64>() / values.len() as f64;
        assert!(moment(1).abs() < 0.01 && (moment(2) - 1.0).abs() < 0.01);
        assert!(moment(3).abs() < 0.03 && (moment(4) - 3.0).abs() < 0.08);
    }
}

//! Rows of standard normals hashed from their places: Philox 4x32-10, then the inverse of the normal distribution, in
//! f32 with one order of fused multiply-adds, so that every kernel gives the same bits.

use super::compiled_for_each_kernel;
use super::philox::{MULTIPLIER, WEYL};

/// Where a row of normals lies.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Key of the hash.
    pub key: [u32; 2],
    /// Domain of the hash.
    pub domain: u32,
    /// Row, any.
    pub row: i32,
    /// Column of the first normal, any.
    pub first_column: i32,
    /// Channel.
    pub channel: u32,
}

/// Successive columns that one hash gives.
const GROUP: usize = 4;

/// Columns made together: few enough to stay in the first-level cache, and a little more than the strip of a field.
const STRIP: usize = 384;

/// Columns hashed together: every vector times [`GROUP`] divides them.
const HASHED: usize = 64;

/// Columns looked over together for tails: in most parts there is none.
const PART: usize = 32;

#[inline(always)]
fn normals_body(place: Site, out: &mut [f32]) {
    let mut words = [0; STRIP];
    let mut group = (place.first_column >> 2) as u32;
    // The row may begin inside a group.
    let mut skip = place.first_column.rem_euclid(GROUP as i32) as usize;
    let mut rest = out;
    while !rest.is_empty() {
        let count = rest.len().min(STRIP - skip);
        let (here, after) = rest.split_at_mut(count);
        let groups = (skip + count).next_multiple_of(HASHED) / GROUP;
        hash(place, group, groups, &mut words);
        let words = &words[skip..skip + count];
        for (normal, &word) in here.iter_mut().zip(words) {
            *normal = central(word);
        }
        for (normals, words) in here.chunks_mut(PART).zip(words.chunks(PART)) {
            if normals.iter().fold(false, |found, normal| found | normal.is_nan()) {
                // One by one: in a plain loop the compiler would make the tail of all words, to keep it of few.
                while let Some(n) = normals.iter().position(|normal| normal.is_nan()) {
                    normals[n] = tail(words[n]);
                }
            }
        }
        (rest, skip) = (after, 0);
        group = group.wrapping_add((STRIP / GROUP) as u32);
    }
}

/// The words of `groups` groups. As [`philox4x32`], on 64-bit lanes: products need no shuffles, and what is left in the
/// upper halves does not count.
#[inline(always)]
fn hash(place: Site, first: u32, groups: usize, words: &mut [u32; STRIP]) {
    let mut planes = [[0_u32; STRIP / GROUP]; GROUP];
    let [w0, w1, w2, w3] = &mut planes;
    for (g, (((w0, w1), w2), w3)) in w0[..groups].iter_mut().zip(w1).zip(w2).zip(w3).enumerate() {
        let low = |value: u64| value & 0xFFFF_FFFF;
        let (mut c0, mut c1) = (u64::from(place.row as u32), u64::from(first.wrapping_add(g as u32)));
        let (mut c2, mut c3) = (u64::from(place.channel), u64::from(place.domain));
        let [mut k0, mut k1] = place.key;
        for _ in 0..10 {
            let (p0, p1) = (low(c0) * MULTIPLIER[0], low(c2) * MULTIPLIER[1]);
            (c0, c1, c2, c3) = ((p1 >> 32) ^ c1 ^ u64::from(k0), p1, (p0 >> 32) ^ c3 ^ u64::from(k1), p0);
            (k0, k1) = (k0.wrapping_add(WEYL[0]), k1.wrapping_add(WEYL[1]));
        }
        (*w0, *w1, *w2, *w3) = (c0 as u32, c1 as u32, c2 as u32, c3 as u32);
    }
    for (g, words) in words.as_chunks_mut::<GROUP>().0.iter_mut().take(groups).enumerate() {
        *words = [planes[0][g], planes[1][g], planes[2][g], planes[3][g]];
    }
}

/// Up to here [`QUANTILE`] holds, in -ln(1 - x^2): up to |z| = 2.93, for 997 words of 1000.
const CENTRAL: f32 = 5.0;

/// z(p) / x, where x = 2 p - 1, as a polynomial of -ln(1 - x^2) - 2.5; the highest power first (a minimax fit with
/// relative error 1e-7; the form is Giles's, "Approximating the erfinv function", 2010).
const QUANTILE: [f32; 9] = [
    4.035_463_4e-8,
    4.861_039_3e-7,
    -4.990_565e-6,
    -6.217_993e-6,
    3.091_502e-4,
    -1.773_010_2e-3,
    -5.908_171e-3,
    3.488_026_6e-1,
    2.123_313_6,
];

/// Beyond, the same as a polynomial of the root of -ln(1 - x^2) less 3.3, to the last word (relative error 3e-7).
const TAIL: [f32; 9] = [
    -2.887_472_5e-5,
    -2.282_965_4e-4,
    1.213_639_6e-3,
    -2.271_761_7e-3,
    2.984_849e-3,
    -4.556_104e-3,
    6.845_68e-3,
    1.422_361_7,
    4.432_374,
];

/// ln(1 + r) / r for 1 + r from sqrt(1/2) to sqrt(2), the highest power first (a minimax fit with relative error 3e-8).
const LOGARITHM: [f32; 9] = [
    8.722_349e-2,
    -1.436_684e-1,
    1.495_226_8e-1,
    -1.656_239_4e-1,
    1.995_683_4e-1,
    -2.500_207_4e-1,
    3.333_418_6e-1,
    -4.999_998_8e-1,
    9.999_999_7e-1,
];

#[inline(always)]
fn polynomial(coefficients: &[f32; 9], x: f32) -> f32 {
    coefficients[1..].iter().fold(coefficients[0], |sum, &c| sum.mul_add(x, c))
}

/// The sign bit of x, its magnitude, and -ln(1 - x^2).
#[inline(always)]
fn scale(word: u32) -> (u32, f32, f32) {
    const HALF_UNIT: f32 = 1.0 / 4_294_967_296.0;
    const UNIT: f32 = 2.0 * HALF_UNIT;
    const ROOT_HALF: u32 = 0x3f35_04f3;
    let signed = (word ^ SIGN) as i32;
    let magnitude = signed ^ (signed >> 31);
    let x = (magnitude as f32).mul_add(UNIT, HALF_UNIT);
    // 1 less the magnitude of x, not from x, of which f32 keeps too little in the tails.
    let left = ((magnitude ^ i32::MAX) as f32).mul_add(UNIT, HALF_UNIT);
    let bits = (left * (2.0 - left)).to_bits();
    let exponent = (bits.wrapping_sub(ROOT_HALF) as i32) >> 23;
    let r = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32)) - 1.0;
    let logarithm = -(exponent as f32).mul_add(std::f32::consts::LN_2, r * polynomial(&LOGARITHM, r));
    (signed as u32 & SIGN, x, logarithm)
}

const SIGN: u32 = 0x8000_0000;

/// The quantile of a word up to [`CENTRAL`], NaN beyond.
#[inline(always)]
fn central(word: u32) -> f32 {
    let (sign, x, logarithm) = scale(word);
    let z = x * polynomial(&QUANTILE, logarithm - 2.5);
    f32::from_bits(if logarithm < CENTRAL { z } else { f32::NAN }.to_bits() | sign)
}

/// The quantile of a word beyond [`CENTRAL`].
#[inline(always)]
fn tail(word: u32) -> f32 {
    let (sign, x, logarithm) = scale(word);
    f32::from_bits((x * polynomial(&TAIL, logarithm.sqrt() - 3.3)).to_bits() | sign)
}

compiled_for_each_kernel! {
    /// Standard normals of successive columns of a row, each within 1e-6 of the exact quantile of its word, and at most
    /// 6.4 in magnitude. Word `c % 4` of the hash of (row, c / 4 rounded down, channel, domain) belongs to column c.
    pub fn normals(place: Site, out: &mut [f32]) = normals_body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::kernel::philox::philox4x32;
    use crate::random::{normal_quantile, unit_interval};

    fn place(row: i32, first_column: i32) -> Site {
        Site { key: [7, 9], domain: 3, row, first_column, channel: 1 }
    }

    #[test]
    fn every_kernel_gives_the_quantiles_of_the_words_wherever_a_row_begins() {
        for (first, count) in [(0, 1), (-7, 1000), (5, 255), (i32::MAX - 8, 9), (i32::MIN, 300), (2, 382)] {
            for kernel in Kernel::available() {
                let mut found = vec![0.0; count];
                normals(kernel, place(-4, first), &mut found);
                for (n, z) in found.into_iter().enumerate() {
                    let column = first.wrapping_add(n as i32);
                    let words = philox4x32([-4_i32 as u32, (column >> 2) as u32, 1, 3], [7, 9]);
                    let expected = normal_quantile(unit_interval(words[(column & 3) as usize]));
                    let error = (f64::from(z) - expected).abs();
                    assert!(
                        error < 1e-6 * expected.abs().max(1.0),
                        "{kernel:?}, column {column}: {z}, {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn every_kernel_gives_the_same_bits() {
        let bits = |kernel| {
            let mut found = vec![0.0; 200_003];
            normals(kernel, place(11, -33), &mut found);
            found.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let plain = bits(Kernel::Plain);
        for kernel in Kernel::available() {
            assert!(bits(kernel) == plain, "{kernel:?}");
        }
    }

    /// The words at the ends of the range, at its middle and about the end of the polynomial.
    #[test]
    fn quantiles_are_accurate_and_odd_everywhere() {
        let mut worst = 0.0_f64;
        for n in 0..=1_000_000_u32 {
            for word in [n, n * 4000, 0x7fff_ffff - n * 2000, 0x7fff_ffff - n] {
                let quantile = |word| if central(word).is_nan() { tail(word) } else { central(word) };
                let (z, exact) = (quantile(word), normal_quantile(unit_interval(word)));
                assert_eq!(z, -quantile(!word));
                worst = worst.max((f64::from(z) - exact).abs() / exact.abs());
            }
        }
        assert!(worst < 7e-7, "{worst}");
        assert!(tail(0) > -6.4);
    }

    #[test]
    fn normals_have_the_moments_of_the_standard_normal() {
        let mut values = vec![0.0; 1 << 20];
        normals(Kernel::fastest(), place(0, 0), &mut values);
        let moment = |k: i32| values.iter().map(|&v| f64::from(v).powi(k)).sum::<f64>() / values.len() as f64;
        assert!(moment(1).abs() < 0.004 && (moment(2) - 1.0).abs() < 0.006);
        assert!(moment(3).abs() < 0.015 && (moment(4) - 3.0).abs() < 0.04);
    }
}

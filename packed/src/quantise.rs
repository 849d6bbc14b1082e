//! Whole numbers of a step, nested: half as many of twice the step are the same with their last bit cut off.

/// Where in its interval a value is taken to lie. The first interval has twice the width and gives 0.
const WITHIN: f64 = 0.42;

/// Most bits of a magnitude.
pub(crate) const MOST_PLANES: u32 = 28;

/// `floor(|value| / step)` with the value's sign.
pub(crate) fn quantised(values: &[f64], step: f64) -> Vec<i32> {
    let most = f64::from((1u32 << MOST_PLANES) - 1);
    values.iter().map(|value| (value / step).clamp(-most, most) as i32).collect()
}

/// The value of a magnitude in units of `step`.
pub(crate) fn value(magnitude: u32, negative: bool, step: f64) -> f64 {
    if magnitude == 0 {
        return 0.0;
    }
    let size = (f64::from(magnitude) + WITHIN) * step;
    if negative { -size } else { size }
}

/// Binary places of the strengths of components.
const STRENGTH_PLACES: f64 = 256.0;

/// Strengths from 2^-64 to nearly 2^192.
const STRENGTH_ZERO: f64 = 64.0;

/// A strength as it is stored: its binary logarithm.
pub(crate) fn strength_code(strength: f64) -> u16 {
    let code = (libm::log2(strength.max(f64::MIN_POSITIVE)) + STRENGTH_ZERO) * STRENGTH_PLACES;
    libm::round(code.clamp(0.0, f64::from(u16::MAX))) as u16
}

/// The strength of a code.
pub(crate) fn strength(code: u16) -> f64 {
    libm::exp2(f64::from(code) / STRENGTH_PLACES - STRENGTH_ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarser_numbers_are_finer_ones_with_bits_cut_off() {
        let values: Vec<f64> = (-300..300).map(|n| f64::from(n) * 0.37).collect();
        let (fine, coarse) = (quantised(&values, 1.0), quantised(&values, 4.0));
        for ((fine, coarse), given) in fine.iter().zip(coarse).zip(&values) {
            assert_eq!(fine.signum() * (fine.abs() >> 2), coarse);
            let back = value(coarse.unsigned_abs(), coarse < 0, 4.0);
            assert!((back - given).abs() <= 4.0 && back * given >= 0.0);
        }
        for given in [1e-3, 1.0, 5e6] {
            assert!((strength(strength_code(given)) / given - 1.0).abs() < 0.0014);
        }
    }
}

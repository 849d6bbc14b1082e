//! 8-bit display values of linear ones by a table: those of the sRGB curve, without a power for every value.

use std::sync::LazyLock;

use super::srgb_encode_u8;

/// Leading bits of a value that its code is guessed from. Near black, where the curve is steepest, two
/// guesses in a row differ by one code at most.
const GUESS_BITS: u32 = 12;

struct Codes {
    /// Least value of each code; the last one is never reached.
    threshold: [f32; 257],
    /// The code of the least value with these leading bits.
    guess: Vec<u8>,
}

static CODES: LazyLock<Codes> = LazyLock::new(|| {
    let threshold = std::array::from_fn(|code| match code {
        0 => 0.0,
        256 => f32::INFINITY,
        code => least(code as u8),
    });
    let guess = |lead: u32| srgb_encode_u8(f64::from(lead) / f64::from(1 << GUESS_BITS));
    Codes { threshold, guess: (0..=1 << GUESS_BITS).map(guess).collect() }
});

/// The least value of a code. Bits of floats from 0 to 1 are in the order of the floats.
fn least(code: u8) -> f32 {
    let (mut below, mut at_least) = (0.0f32.to_bits(), 1.0f32.to_bits());
    while at_least - below > 1 {
        let middle = below + (at_least - below) / 2;
        if srgb_encode_u8(f64::from(f32::from_bits(middle))) < code {
            below = middle;
        } else {
            at_least = middle;
        }
    }
    f32::from_bits(at_least)
}

/// [`srgb_encode_u8`] of every value.
pub fn srgb_encode_all(linear: impl IntoIterator<Item = f32>, codes: &mut [u8]) {
    let table = &*CODES;
    for (value, code) in linear.into_iter().zip(codes) {
        // What is no number is black.
        let value = if value > 0.0 { value.min(1.0) } else { 0.0 };
        let guess = table.guess[(value * (1 << GUESS_BITS) as f32) as usize];
        *code = guess + u8::from(value >= table.threshold[usize::from(guess) + 1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_codes_of_the_curve() {
        let thresholds = CODES.threshold[..256].iter().flat_map(|t| [t.next_down(), *t, t.next_up()]);
        let spread = (0..=1_000_003u32).map(|n| n as f32 / 1_000_003.0);
        let odd = [-1.0, -0.0, 1.0f32.next_up(), 7.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40];
        let values: Vec<f32> = thresholds.chain(spread).chain(odd).collect();
        let mut codes = vec![99; values.len()];
        srgb_encode_all(values.iter().copied(), &mut codes);
        for (value, code) in values.iter().zip(codes) {
            assert_eq!(code, srgb_encode_u8(f64::from(*value)), "{value}");
        }
    }
}

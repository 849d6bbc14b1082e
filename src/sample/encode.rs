//! From linear reflectance to the bytes of a photograph: sRGB curve
//! (IEC 61966-2-1) by table, sensor noise hashed from the place.

use super::noise::DOMAIN;
use crate::random::Hash;

/// Steps of the table; between them the curve is straight to within 0.01 levels.
const STEPS: usize = 4096;

/// Turns linear values into noisy 8-bit levels.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
    table: Vec<f32>,
    hash: Hash,
    /// Levels of 255 per unit of a sum of five bytes.
    noise: f32,
}

impl Encoder {
    /// `noise` is the standard deviation of the sensor noise in levels of 255.
    pub(super) fn new(seed: u64, noise: f32) -> Self {
        // The sum of five even bytes has the variance 5 (256² - 1) / 12.
        const DEVIATION: f32 = 165.246;
        let level = |step: usize| (255.0 * srgb(step.min(STEPS) as f64 / STEPS as f64)) as f32;
        Self {
            table: (0..STEPS + 2).map(level).collect(),
            hash: Hash::new(seed, DOMAIN + 0xFF),
            noise: noise / DEVIATION,
        }
    }

    /// The RGB bytes of a linear colour at pixel (row, column) of image number `image`.
    pub(super) fn bytes(&self, linear: [f32; 3], row: u32, column: u32, image: u32) -> [u8; 3] {
        let words = self.hash.words(row, column, image);
        std::array::from_fn(|channel| {
            let scaled = linear[channel].clamp(0.0, 1.0) * STEPS as f32;
            let step = scaled as usize;
            let level = self.table[step] + (self.table[step + 1] - self.table[step]) * (scaled - step as f32);
            // Four bytes of the channel's own word and one of the word that is left.
            let sum = words[channel].to_le_bytes().into_iter().map(u32::from).sum::<u32>()
                + u32::from(words[3].to_le_bytes()[channel]);
            let noise = (sum as f32 - 637.5) * self.noise;
            (level + noise + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}

/// The sRGB curve, 0 to 1 on both sides.
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_curve() {
        let encoder = Encoder::new(1, 0.0);
        for n in 0..=10_000 {
            let linear = f64::from(n) / 10_000.0;
            let [byte, ..] = encoder.bytes([linear as f32; 3], 0, 0, 0);
            assert!((f64::from(byte) - 255.0 * srgb(linear)).abs() < 0.52, "{linear}: {byte}");
        }
        assert_eq!(encoder.bytes([-1.0, 2.0, f32::NAN], 0, 0, 0), [0, 255, 0]);
    }

    #[test]
    fn noise_has_the_deviation_asked_for_and_is_its_own_for_every_image() {
        let (quiet, noisy) = (Encoder::new(4, 0.0), Encoder::new(4, 2.0));
        let reference = f64::from(quiet.bytes([0.2; 3], 0, 0, 0)[0]);
        let levels = |image: u32| -> Vec<f64> {
            (0..20_000)
                .map(|n| f64::from(noisy.bytes([0.2; 3], n / 100, n % 100, image)[0]) - reference)
                .collect()
        };
        let (a, b) = (levels(1), levels(2));
        let product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
        // The rounding to whole levels adds its variance of 1/12.
        assert!((product(&a, &a).sqrt() - 2.0).abs() < 0.15, "{}", product(&a, &a).sqrt());
        assert!(product(&a, &b).abs() < 0.25, "{}", product(&a, &b));
    }
}

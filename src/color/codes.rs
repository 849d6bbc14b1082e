//! L* codes of samples by whole-number arithmetic: the same on every machine.

use btfkit_formats::{SampleType, Samples, f16};

use super::{Transfer, Weights, inverse_lightness, weights};
use crate::error::Result;

/// Luminance is summed in units of 2^-40 of white, so the code of an 8-bit colour equals that of the f64 formula.
const LUMINANCE_BITS: u32 = 40;
const WHITE: i64 = 1 << LUMINANCE_BITS;

/// Leading bits that a code is guessed from. Two guesses in a row differ by one code at most.
const GUESS_BITS: u32 = 12;

/// Turns samples into L* codes, as fast as a few table reads.
pub struct LightnessCodes {
    transfer: Transfer,
    /// Luminance of each 8- or 16-bit sample in each channel; empty for f32.
    weighted: Vec<Vec<i64>>,
    weights: Weights,
    white: f64,
    /// Least luminance of each code, in the same unit; the last one is never reached.
    threshold: [i64; 257],
    /// The code of the least luminance with these leading bits.
    guess: Vec<u8>,
}

/// What was found wrong with samples while they were coded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Remarkable {
    /// Samples brighter than white, which have the code of L* = 100.
    pub clipped: u64,
    /// Samples with a component that is no finite number; it counts as 0.
    pub not_finite: u64,
    /// Samples with a negative component.
    pub negative: u64,
}

impl std::ops::AddAssign for Remarkable {
    fn add_assign(&mut self, other: Self) {
        self.clipped += other.clipped;
        self.not_finite += other.not_finite;
        self.negative += other.negative;
    }
}

impl LightnessCodes {
    /// For samples of a type with these channels; `white` is the reflectance that counts as L* = 100.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub fn new(transfer: Transfer, sample_type: SampleType, channels: &[String], white: f64) -> Result<Self> {
        let weights = weights(channels)?;
        let value = |sample: u16| match sample_type {
            SampleType::U8 => f64::from(sample) / 255.0,
            SampleType::U16 => f64::from(sample) / 65535.0,
            SampleType::F16 | SampleType::F32 => f16::from_bits(sample).to_f64(),
        };
        let last = match sample_type {
            SampleType::U8 => Some(255u16),
            SampleType::U16 | SampleType::F16 => Some(u16::MAX),
            SampleType::F32 => None,
        };
        let weighted = weights.luminance.iter().map(|&weight| {
            let entry = |sample: u16| fixed(weight * transfer.decode(value(sample)) / white);
            last.map_or_else(Vec::new, |last| (0..=last).map(entry).collect())
        });
        let threshold: [i64; 257] = std::array::from_fn(|code| match code {
            0 => i64::MIN,
            256 => i64::MAX,
            code => (inverse_lightness((code as f64 - 0.5) / 2.55) * WHITE as f64).ceil() as i64,
        });
        let code_of = |y: i64| (threshold.partition_point(|&least| least <= y) - 1) as u8;
        let guess =
            (0..=1i64 << GUESS_BITS).map(|lead| code_of(lead << (LUMINANCE_BITS - GUESS_BITS))).collect();
        Ok(Self { transfer, weighted: weighted.collect(), weights, white, threshold, guess })
    }

    /// The code of a luminance, and whether it exceeds white.
    #[inline]
    fn code_of(&self, sum: i64) -> (u8, bool) {
        let y = sum.clamp(0, WHITE);
        let guess = self.guess[(y >> (LUMINANCE_BITS - GUESS_BITS)) as usize];
        let code = guess + u8::from(y >= self.threshold[usize::from(guess) + 1]);
        // Rounding of the weights may lift white itself by a unit or two.
        (code, sum > WHITE + 4)
    }

    /// The code of the sample whose first channel is number `at`.
    #[inline]
    pub fn code(&self, samples: &Samples, at: usize) -> u8 {
        let channels = self.weights.luminance.len();
        let mut code = [0];
        let mut one = |sum| code[0] = self.code_of(sum).0;
        match samples {
            Samples::U8(list) => one(self.sum(list[at..at + channels].iter().map(|&s| usize::from(s)))),
            Samples::U16(list) => one(self.sum(list[at..at + channels].iter().map(|&s| usize::from(s)))),
            Samples::F16(list) => {
                one(self.sum(list[at..at + channels].iter().map(|&s| usize::from(s.to_bits()))));
            }
            Samples::F32(list) => one(self.sum_f32(&list[at..at + channels])),
        }
        code[0]
    }

    /// The codes of all samples, one for every pair of a texel and a light.
    pub(crate) fn of(&self, samples: &Samples) -> Vec<u8> {
        let mut codes = vec![0; samples.len() / self.weights.luminance.len()];
        self.fill(samples, &mut codes);
        codes
    }

    /// Codes of all samples, one for every `channels` of them.
    pub fn fill(&self, samples: &Samples, codes: &mut [u8]) -> Remarkable {
        let channels = self.weights.luminance.len();
        let mut found = Remarkable::default();
        match samples {
            Samples::U8(list) => match self.weighted.as_slice() {
                [r, g, b] => {
                    for (sample, code) in list.as_chunks::<3>().0.iter().zip(codes) {
                        let [r, g, b] =
                            [r[usize::from(sample[0])], g[usize::from(sample[1])], b[usize::from(sample[2])]];
                        let over;
                        (*code, over) = self.code_of(r + g + b);
                        found.clipped += u64::from(over);
                    }
                }
                _ => self.fill_by(list, channels, codes, &mut found, |&s| usize::from(s)),
            },
            Samples::U16(list) => self.fill_by(list, channels, codes, &mut found, |&s| usize::from(s)),
            Samples::F16(list) => {
                self.fill_by(list, channels, codes, &mut found, |&s| usize::from(s.to_bits()));
                for sample in list.chunks_exact(channels) {
                    found.not_finite += u64::from(sample.iter().any(|s| !s.is_finite()));
                    found.negative += u64::from(sample.iter().any(|s| *s < f16::ZERO));
                }
            }
            Samples::F32(list) => {
                for (sample, code) in list.chunks_exact(channels).zip(codes) {
                    let over;
                    (*code, over) = self.code_of(self.sum_f32(sample));
                    found.clipped += u64::from(over);
                    found.not_finite += u64::from(sample.iter().any(|s| !s.is_finite()));
                    found.negative += u64::from(sample.iter().any(|s| *s < 0.0));
                }
            }
        }
        found
    }

    fn fill_by<T>(
        &self,
        list: &[T],
        channels: usize,
        codes: &mut [u8],
        found: &mut Remarkable,
        entry: impl Fn(&T) -> usize,
    ) {
        for (sample, code) in list.chunks_exact(channels).zip(codes) {
            let over;
            (*code, over) = self.code_of(self.sum(sample.iter().map(&entry)));
            found.clipped += u64::from(over);
        }
    }

    #[inline]
    fn sum(&self, entries: impl Iterator<Item = usize>) -> i64 {
        self.weighted.iter().zip(entries).fold(0i64, |sum, (table, at)| sum.saturating_add(table[at]))
    }

    fn sum_f32(&self, sample: &[f32]) -> i64 {
        let value = |s: f32, weight: f64| fixed(weight * self.transfer.decode(f64::from(s)) / self.white);
        let terms = sample.iter().zip(&self.weights.luminance).map(|(&s, &weight)| value(s, weight));
        terms.fold(0i64, i64::saturating_add)
    }
}

/// A luminance in units of 2^-40, far beyond white at most; 0 for what is no number.
fn fixed(luminance: f64) -> i64 {
    if luminance.is_finite() { (luminance * WHITE as f64).round().clamp(-1e17, 1e17) as i64 } else { 0 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::{LUMINANCE_WEIGHTS, lightness, lightness_code};
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn every_8_bit_colour_has_the_code_of_the_formula() {
        let codes =
            LightnessCodes::new(Transfer::Srgb, SampleType::U8, &names(&["R", "G", "B"]), 1.0).unwrap();
        let linear: Vec<f64> = (0..256).map(|s| Transfer::Srgb.decode(f64::from(s) / 255.0)).collect();
        let mut colours = Vec::new();
        for r in (0..=255u8).step_by(5) {
            for g in 0..=255u8 {
                colours.extend((0..=255u8).step_by(3).flat_map(|b| [r, g, b]));
            }
        }
        let samples = Samples::U8(colours.clone());
        let mut found = vec![0; colours.len() / 3];
        assert_eq!(codes.fill(&samples, &mut found), Remarkable::default());
        for (at, (colour, &code)) in colours.chunks_exact(3).zip(&found).enumerate() {
            let y: f64 = colour.iter().zip(LUMINANCE_WEIGHTS).map(|(&s, w)| w * linear[usize::from(s)]).sum();
            assert_eq!(code, lightness_code(y), "at {colour:?}");
            assert_eq!(code, codes.code(&samples, 3 * at));
        }
    }

    #[test]
    fn samples_of_every_type_have_the_code_of_the_formula() {
        for white in [1.0, 0.5] {
            let values: Vec<f32> = (0..2000).map(|n| n as f32 / 1999.0).collect();
            let lists = [
                Samples::U16(values.iter().map(|v| (v * 65535.0).round() as u16).collect()),
                Samples::F16(values.iter().map(|&v| f16::from_f32(v)).collect()),
                Samples::F32(values.clone()),
            ];
            for samples in lists {
                let codes =
                    LightnessCodes::new(Transfer::Linear, samples.sample_type(), &names(&["Y"]), white)
                        .unwrap();
                let mut found = vec![0; samples.len()];
                let remarkable = codes.fill(&samples, &mut found);
                let exact: Vec<f64> = samples.to_f32().iter().map(|&v| f64::from(v) / white).collect();
                for (&y, &code) in exact.iter().zip(&found) {
                    let exact_code = 2.55 * lightness(y).clamp(0.0, 100.0);
                    // At a threshold the fixed-point sum may fall on the other side.
                    let tie = (exact_code.fract() - 0.5).abs() < 1e-6;
                    assert!(tie || code == lightness_code(y), "{y}: {code}");
                }
                assert_eq!(remarkable.clipped, exact.iter().filter(|&&y| y > 1.0 + 1e-11).count() as u64);
            }
        }
    }

    #[test]
    fn bad_floats_are_counted_and_coded_as_black() {
        let codes = LightnessCodes::new(Transfer::Linear, SampleType::F32, &names(&["Y"]), 1.0).unwrap();
        let samples = Samples::F32(vec![f32::NAN, -1.0, f32::INFINITY, 2.0, f32::NEG_INFINITY]);
        let mut found = [9; 5];
        let remarkable = codes.fill(&samples, &mut found);
        assert_eq!(found, [0, 0, 0, 255, 0]);
        assert_eq!(remarkable, Remarkable { clipped: 1, not_finite: 3, negative: 2 });
        let halves = Samples::F16(vec![
            f16::NAN,
            f16::from_f32(-1.0),
            f16::INFINITY,
            f16::from_f32(2.0),
            f16::NEG_INFINITY,
        ]);
        let codes = LightnessCodes::new(Transfer::Linear, SampleType::F16, &names(&["Y"]), 1.0).unwrap();
        assert_eq!(codes.fill(&halves, &mut found), remarkable);
        assert_eq!(found, [0, 0, 0, 255, 0]);
    }
}

//! The curve on which principal components are found: the sRGB curve times 255, whatever the samples are.
//!
//! Squared errors on it are as visible in the dark as in the light, which they are not in linear light. It goes on above
//! white and is straight below black, so that high dynamic range keeps its order. Samples that are not finite are 0.

use std::ops::Range;

use btfkit_formats::{SampleType, Samples, f16};

use super::{Transfer, srgb_decode};

/// White on the curve.
pub(crate) const WHITE: f32 = 255.0;

/// The largest value, in both directions: 65 thousand times as bright as white is no reflectance, and sums of products
/// must stay finite.
const LARGEST: f32 = (1 << 24) as f32;

/// From samples to the curve.
pub(crate) struct Curve {
    /// The value of each sample, of those types whose samples are few.
    table: Vec<f32>,
    transfer: Transfer,
}

impl Curve {
    pub(crate) fn new(sample_type: SampleType, transfer: Transfer) -> Self {
        let table = match sample_type {
            SampleType::U8 => (0..=u8::MAX).map(|code| on_curve(f64::from(code) / 255.0, transfer)).collect(),
            SampleType::U16 => {
                (0..=u16::MAX).map(|code| on_curve(f64::from(code) / 65535.0, transfer)).collect()
            }
            SampleType::F16 => {
                (0..=u16::MAX).map(|bits| on_curve(f16::from_bits(bits).to_f64(), transfer)).collect()
            }
            SampleType::F32 => vec![],
        };
        Self { table, transfer }
    }

    /// Values of a run of samples.
    pub(crate) fn values(&self, samples: &Samples, range: Range<usize>, to: &mut [f32]) {
        match samples {
            Samples::U8(list) => {
                to.iter_mut().zip(&list[range]).for_each(|(to, &code)| *to = self.table[usize::from(code)]);
            }
            Samples::U16(list) => {
                to.iter_mut().zip(&list[range]).for_each(|(to, &code)| *to = self.table[usize::from(code)]);
            }
            Samples::F16(list) => {
                let of = |sample: f16| self.table[usize::from(sample.to_bits())];
                to.iter_mut().zip(&list[range]).for_each(|(to, &sample)| *to = of(sample));
            }
            Samples::F32(list) => {
                let of = |sample: f32| on_curve(f64::from(sample), self.transfer);
                to.iter_mut().zip(&list[range]).for_each(|(to, &sample)| *to = of(sample));
            }
        }
    }
}

/// Steps of the table of [`Linear`] within one of 255: linear between them, it is within 3e-8.
const STEPS: usize = 16;

/// From the curve to linear reflectance, many times.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Linear {
    table: Vec<f32>,
}

impl Linear {
    pub(crate) fn new() -> Self {
        let steps = WHITE as usize * STEPS;
        let of = |step: usize| srgb_decode(step as f64 / steps as f64) as f32;
        Self { table: (0..=steps).map(of).collect() }
    }

    /// Of one value; what is no finite number is 0.
    #[inline]
    pub(crate) fn of(&self, value: f32) -> f32 {
        if !(0.0..WHITE).contains(&value) {
            let linear = srgb_decode(f64::from(value) / f64::from(WHITE)) as f32;
            return if linear.is_finite() { linear } else { 0.0 };
        }
        let place = value * STEPS as f32;
        let step = (place as usize).min(self.table.len() - 2);
        self.table[step] + (place - step as f32) * (self.table[step + 1] - self.table[step])
    }
}

/// Samples that the curve does not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unheld {
    /// Beyond its range.
    pub(crate) beyond: u64,
    /// No finite numbers: they are 0 on it.
    pub(crate) not_finite: u64,
}

impl std::ops::AddAssign for Unheld {
    fn add_assign(&mut self, other: Self) {
        self.beyond += other.beyond;
        self.not_finite += other.not_finite;
    }
}

impl Curve {
    /// How many of a run of samples the curve does not hold.
    pub(crate) fn unheld(&self, samples: &Samples, range: Range<usize>) -> Unheld {
        let mut unheld = Unheld::default();
        let [least, largest] = self.range();
        let mut count = |sample: f64| {
            if !sample.is_finite() {
                unheld.not_finite += 1;
            } else if !(least..=largest).contains(&sample) {
                unheld.beyond += 1;
            }
        };
        match samples {
            Samples::U8(_) | Samples::U16(_) => {}
            Samples::F16(list) => list[range].iter().for_each(|sample| count(sample.to_f64())),
            Samples::F32(list) => list[range].iter().for_each(|&sample| count(f64::from(sample))),
        }
        unheld
    }

    /// The least and the largest sample that the curve holds.
    pub(crate) fn range(&self) -> [f64; 2] {
        let value = f64::from(LARGEST) / f64::from(WHITE);
        [-value, value].map(|value| match self.transfer {
            Transfer::Srgb => value,
            Transfer::Linear => srgb_decode(value),
        })
    }
}

fn on_curve(sample: f64, transfer: Transfer) -> f32 {
    let value = match transfer {
        Transfer::Srgb => sample,
        Transfer::Linear => Transfer::Srgb.encode(sample),
    };
    let value = (f64::from(WHITE) * value) as f32;
    if value.is_finite() { value.clamp(-LARGEST, LARGEST) } else { 0.0 }
}

/// Values as samples of a type: rounded, and within what it holds.
pub(crate) fn samples(values: &[f32], sample_type: SampleType, transfer: Transfer) -> Samples {
    let scaled = |value: &f32| {
        let value = f64::from(*value) / f64::from(WHITE);
        match transfer {
            Transfer::Srgb => value,
            Transfer::Linear => srgb_decode(value),
        }
    };
    let whole = |value: &f32, most: f64| (scaled(value).clamp(0.0, 1.0) * most).round();
    match sample_type {
        SampleType::U8 => Samples::U8(values.iter().map(|value| whole(value, 255.0) as u8).collect()),
        SampleType::U16 => Samples::U16(values.iter().map(|value| whole(value, 65535.0) as u16).collect()),
        SampleType::F16 => Samples::F16(values.iter().map(|value| f16::from_f64(scaled(value))).collect()),
        SampleType::F32 => Samples::F32(values.iter().map(|value| scaled(value) as f32).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_every_type_and_curve_come_back_from_it() {
        let halves: Vec<f16> = [-0.25f32, 0.0, 0.1, 1.0, 7.5].map(f16::from_f32).to_vec();
        for (given, near) in [
            (Samples::U8((0..=255).collect()), 0.0),
            (Samples::U16((0..1000).map(|n| n * 65).collect()), 1e-9),
            (Samples::F16(halves), 1e-9),
            (Samples::F32(vec![-0.25, 0.0, 1e-3, 1.0, 40.0]), 1e-5),
        ] {
            for transfer in [Transfer::Srgb, Transfer::Linear] {
                let mut values = vec![0.0; given.len()];
                Curve::new(given.sample_type(), transfer).values(&given, 0..given.len(), &mut values);
                assert!(values.is_sorted());
                let back = samples(&values, given.sample_type(), transfer);
                for at in 0..given.len() {
                    let (a, b) = (given.value(at), back.value(at));
                    assert!(
                        a.zip(b).is_some_and(|(a, b)| (a - b).abs() <= near * a.abs().max(1.0)),
                        "{a:?} {b:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_table_is_the_curve() {
        let linear = Linear::new();
        for k in -3000..12_000 {
            let value = k as f32 * 0.0301;
            let exact = srgb_decode(f64::from(value) / 255.0);
            let off = (f64::from(linear.of(value)) - exact).abs();
            assert!(off <= 2e-7 * exact.abs().max(1.0), "{value}: {off}");
        }
        assert_eq!((linear.of(255.0), linear.of(f32::NAN), linear.of(f32::INFINITY)), (1.0, 0.0, 0.0));
    }

    #[test]
    fn what_is_not_finite_is_black() {
        let mut values = [1.0; 4];
        let given = Samples::F32(vec![f32::NAN, f32::INFINITY, 0.5, -3e30]);
        Curve::new(SampleType::F32, Transfer::Srgb).values(&given, 0..4, &mut values);
        assert_eq!(values, [0.0, 0.0, 127.5, -LARGEST]);
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            let curve = Curve::new(SampleType::F32, transfer);
            let most = curve.range()[1] as f32;
            let given =
                Samples::F32(vec![f32::NAN, f32::NEG_INFINITY, 0.999 * most, 1.001 * most, -3e30, 2.0]);
            assert_eq!(curve.unheld(&given, 0..6), Unheld { beyond: 2, not_finite: 2 });
            assert_eq!(curve.unheld(&given, 2..3), Unheld::default());
        }
        // Below black the curve is straight and steep, so it ends earlier there.
        let halves = Samples::F16(vec![f16::MAX, f16::NAN, f16::from_f32(-5e3), f16::MIN]);
        for (transfer, beyond) in [(Transfer::Srgb, 0), (Transfer::Linear, 1)] {
            let found = Curve::new(SampleType::F16, transfer).unheld(&halves, 0..4);
            assert_eq!(found, Unheld { beyond, not_finite: 1 });
        }
    }
}

//! The middle of the texels of a cluster, sample by sample: their mean or their median.

use btfkit_formats::{Samples, f16};

use super::choice::Representation;

/// A type of samples.
trait Sample: Copy {
    fn to_f64(self) -> f64;
    /// The nearest sample of this type.
    fn of_f64(value: f64) -> Self;
}

impl Sample for u8 {
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn of_f64(value: f64) -> Self {
        value.round() as Self
    }
}

impl Sample for u16 {
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn of_f64(value: f64) -> Self {
        value.round() as Self
    }
}

impl Sample for f16 {
    fn to_f64(self) -> f64 {
        self.to_f64()
    }
    fn of_f64(value: f64) -> Self {
        Self::from_f64(value)
    }
}

impl Sample for f32 {
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn of_f64(value: f64) -> Self {
        value as Self
    }
}

/// What stands for groups of texels, [group, sample]. `samples` are runs of `length`, and `groups` say at which runs
/// the texels of each group lie. What is not finite is left out; where nothing is left, the result is no number (of
/// integers, which are all finite, and of a group without texels, 0).
pub(crate) fn of_groups(
    rule: Representation,
    samples: &Samples,
    length: usize,
    groups: &[Vec<u32>],
) -> Samples {
    match samples {
        Samples::U8(list) => Samples::U8(middles(rule, list, length, groups)),
        Samples::U16(list) => Samples::U16(middles(rule, list, length, groups)),
        Samples::F16(list) => Samples::F16(middles(rule, list, length, groups)),
        Samples::F32(list) => Samples::F32(middles(rule, list, length, groups)),
    }
}

fn middles<T: Sample>(rule: Representation, list: &[T], length: usize, groups: &[Vec<u32>]) -> Vec<T> {
    let mut found = Vec::with_capacity(groups.len() * length);
    let mut values = Vec::new();
    for group in groups {
        for sample in 0..length {
            values.clear();
            let of_group = group.iter().map(|&run| list[run as usize * length + sample].to_f64());
            values.extend(of_group.filter(|value| value.is_finite()));
            found.push(T::of_f64(middle(rule, &mut values)));
        }
    }
    found
}

/// The mean, or the lower median.
fn middle(rule: Representation, values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    match rule {
        Representation::Mean => values.iter().sum::<f64>() / values.len() as f64,
        Representation::Median | Representation::Texel => {
            let lower = (values.len() - 1) / 2;
            *values.select_nth_unstable_by(lower, f64::total_cmp).1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_medians_are_those_of_the_finite_samples_of_each_group() {
        // Runs of two samples: four texels, in two groups and an empty one.
        let groups = [vec![0, 2, 3], vec![1], vec![]];
        let eight = Samples::U8(vec![10, 0, 99, 98, 20, 1, 60, 200]);
        let of = |rule, samples: &Samples| of_groups(rule, samples, 2, &groups);
        assert_eq!(of(Representation::Mean, &eight), Samples::U8(vec![30, 67, 99, 98, 0, 0]));
        assert_eq!(of(Representation::Median, &eight), Samples::U8(vec![20, 1, 99, 98, 0, 0]));
        let floats = Samples::F32(vec![1.0, f32::NAN, f32::INFINITY, 3.0, 4.0, 5.0, 10.0, f32::NAN]);
        let Samples::F32(means) = of(Representation::Mean, &floats) else { unreachable!() };
        assert_eq!(means[..2], [5.0, 5.0]);
        assert!(means[2].is_nan() && means[3] == 3.0);
        let Samples::F32(medians) = of(Representation::Median, &floats) else { unreachable!() };
        assert_eq!(medians[..2], [4.0, 5.0]);
        let sixteen = Samples::U16(vec![1, 2, 0, 0, 2, 3, 3, 7]);
        assert_eq!(of(Representation::Mean, &sixteen), Samples::U16(vec![2, 4, 0, 0, 0, 0]));
    }
}

//! BTF values of components: a mean, and a sum of products a channel.
//!
//! They lie on the curve of [`crate::color::curve`], [`btfkit_formats::Samples`] of sRGB times 255.

use std::ops::Range;

use btfkit_formats::{SampleType, Samples};
use rayon::prelude::*;

use super::evaluate::Appearance;
use super::table::{Mixture, Values};
use crate::color::curve::{self, Linear};
use crate::color::{Transfer, weights};
use crate::error::Result;
use crate::shape::{Size, Window};

/// Texels whose colours a thread makes at a time.
const TOGETHER: usize = 64;

/// Products that are summed side by side; their order is the same everywhere.
const LANES: usize = 8;

/// Components as they are evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Components {
    /// Size of the tile.
    pub size: Size,
    /// Views and lights.
    pub brdf: [usize; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Mean BRDF [view, light, channel].
    pub mean: Vec<f32>,
    /// BRDFs [view, light, channel, component].
    pub basis: Vec<f32>,
    /// Weights [y, x, component].
    pub coefficients: Vec<f32>,
}

impl Components {
    /// Number of components.
    pub fn count(&self) -> usize {
        self.coefficients.len() / self.size.texels().max(1)
    }

    /// One value: of a texel, at a place of its BRDF.
    #[inline]
    fn value(&self, coefficients: &[f32], place: usize) -> f32 {
        let basis = &self.basis[place * coefficients.len()..][..coefficients.len()];
        self.mean[place] + products(coefficients, basis)
    }

    fn of_texel(&self, texel: usize) -> &[f32] {
        let count = self.count();
        &self.coefficients[texel * count..][..count]
    }

    /// The texels of a window under one view and some lights as samples of a type and curve, [y, x, light, channel]. The
    /// window lies within the tile.
    pub fn samples(
        &self,
        view: usize,
        lights: Range<usize>,
        window: Window,
        sample_type: SampleType,
        transfer: Transfer,
    ) -> Samples {
        let (channels, width) = (self.channels.len(), window.size.width.max(1));
        let length = lights.len() * channels;
        let first = (view * self.brdf[1] + lights.start) * channels;
        let mut values = vec![0.0; window.size.texels() * length];
        values.par_chunks_exact_mut(length.max(1)).enumerate().for_each(|(number, values)| {
            let (row, column) = (window.y + number / width, window.x + number % width);
            let coefficients = self.of_texel(row * self.size.width + column);
            values.iter_mut().zip(first..).for_each(|(to, place)| *to = self.value(coefficients, place));
        });
        curve::samples(&values, sample_type, transfer)
    }
}

/// Sum of the products of two lists of one length.
#[inline]
fn products(a: &[f32], b: &[f32]) -> f32 {
    let ((a, rest_a), (b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0f32; LANES];
    for (a, b) in a.iter().zip(b) {
        sums = std::array::from_fn(|lane| sums[lane] + a[lane] * b[lane]);
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    let halves: [f32; LANES / 2] = std::array::from_fn(|lane| sums[lane] + sums[lane + LANES / 2]);
    (halves[0] + halves[2]) + (halves[1] + halves[3]) + rest
}

/// Components with what turns their values into linear RGB. An entry is a texel of the tile.
pub struct ComponentTable {
    components: Components,
    /// What each channel adds to linear R, G and B.
    weights: Vec<[f32; 3]>,
    linear: Linear,
}

impl ComponentTable {
    /// Of components.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub fn new(components: Components) -> Result<Self> {
        let weights = weights(&components.channels)?.rgb;
        let weights = weights.into_iter().map(|rgb| rgb.map(|weight| weight as f32)).collect();
        Ok(Self { components, weights, linear: Linear::new() })
    }

    /// The components.
    pub fn components(&self) -> &Components {
        &self.components
    }

    /// Linear RGB of a texel under a measured pair of directions.
    #[inline]
    fn rgb(&self, coefficients: &[f32], view: usize, light: usize) -> [f32; 3] {
        let first = (view * self.components.brdf[1] + light) * self.weights.len();
        let mut rgb = [0.0; 3];
        for (place, weights) in (first..).zip(&self.weights) {
            let value = self.linear.of(self.components.value(coefficients, place));
            rgb = std::array::from_fn(|c| rgb[c] + weights[c] * value);
        }
        rgb
    }

    /// Linear RGB of all texels, mixed between measured directions in linear light.
    pub(crate) fn colors(&self, appearance: &Appearance) -> Vec<[f32; 3]> {
        let mut colors = vec![[0.0; 3]; self.entries()];
        colors.par_chunks_mut(TOGETHER).enumerate().for_each(|(piece, colors)| {
            for (number, color) in colors.iter_mut().enumerate() {
                let coefficients = self.components.of_texel(piece * TOGETHER + number);
                let mut sum = [0.0f64; 3];
                for &(view, light, weight) in &appearance.terms {
                    let rgb = self.rgb(coefficients, view, light);
                    sum = std::array::from_fn(|c| sum[c] + weight * f64::from(rgb[c]));
                }
                *color = sum.map(|value| value as f32);
            }
        });
        colors
    }
}

impl Values for ComponentTable {
    #[inline]
    fn of(&self, entry: usize, mixture: &Mixture<'_>) -> [f32; 3] {
        let coefficients = self.components.of_texel(entry);
        let mut sum = [0.0f32; 3];
        for view in mixture.views.iter().filter(|view| view.weight > 0.0) {
            for light in mixture.lights.iter().filter(|light| light.weights != [0.0; 4]) {
                let rgb = self.rgb(coefficients, usize::from(view.number), usize::from(light.number));
                sum = std::array::from_fn(|c| sum[c] + view.weight * light.weights[c] * rgb[c]);
            }
        }
        sum
    }

    fn entries(&self) -> usize {
        self.components.size.texels()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::locate::Share;
    use super::super::table::Tinted;
    use super::*;

    #[test]
    fn a_value_is_the_mean_and_the_sum_of_products_under_every_curve() {
        let components = Components {
            size: Size::new(1, 2),
            brdf: [2, 1],
            channels: ["R", "G", "B"].map(String::from).to_vec(),
            mean: vec![10.0, 20.0, 30.0, 100.0, 110.0, 120.0],
            // Of each place the first, then the second component.
            basis: vec![1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0],
            coefficients: vec![0.0, 0.0, 5.0, -7.0],
        };
        assert_eq!(components.count(), 2);
        let whole = components.size.window();
        let of_view = |view| components.samples(view, 0..1, whole, SampleType::U8, Transfer::Srgb);
        assert_eq!(of_view(0), Samples::U8(vec![10, 20, 30, 15, 13, 28]));
        assert_eq!(of_view(1), Samples::U8(vec![100, 110, 120, 110, 96, 120]));
        let appearance = Appearance { terms: vec![(0, 0, 0.25), (1, 0, 0.75)] };
        let linear = |code: f64| Transfer::Srgb.decode(code / 255.0);
        let expected = 0.25 * linear(15.0) + 0.75 * linear(110.0);
        let linear_samples = components.samples(1, 0..1, whole, SampleType::F32, Transfer::Linear);
        assert!((linear_samples.value(3).unwrap() - linear(110.0)).abs() < 1e-6);
        let right = Window { y: 0, x: 1, size: Size::new(1, 1) };
        let part = components.samples(0, 0..1, right, SampleType::U8, Transfer::Srgb);
        assert_eq!(part, Samples::U8(vec![15, 13, 28]));
        let table = ComponentTable::new(components).unwrap();
        let colors = table.colors(&appearance);
        assert!((f64::from(colors[1][0]) - expected).abs() < 1e-6);
        // The evaluator has the same values.
        let share = |number, weight| Share { number, weight };
        let (views, lights) =
            ([share(0, 0.25), share(1, 0.75)], [Tinted { number: 0, weights: [1.0, 0.5, 0.0, 0.0] }]);
        let found = table.of(1, &Mixture { views: &views, lights: &lights });
        let wanted = [colors[1][0], 0.5 * colors[1][1], 0.0];
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {wanted:?}");
    }

    #[test]
    fn products_of_any_number_are_all_summed() {
        for count in 0..40u16 {
            let list: Vec<f32> = (0..count).map(|n| f32::from(n) + 1.0).collect();
            let sum = f32::from(count) * (f32::from(count) + 1.0) * (2.0 * f32::from(count) + 1.0) / 6.0;
            assert_eq!(products(&list, &list), sum);
        }
    }
}

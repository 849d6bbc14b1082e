//! BTF values of components: a mean, and a sum of products a channel.
//!
//! They lie on the curve of [`crate::color::curve`], [`btfkit_formats::Samples`] of sRGB times 255.

use btfkit_formats::{SampleType, Samples};
use rayon::prelude::*;

use super::evaluate::{Appearance, add};
use crate::color::curve::{self, WHITE};
use crate::color::{Decoder, Transfer};
use crate::error::Result;
use crate::shape::Size;

/// Texels whose colours a thread makes at a time.
const TOGETHER: usize = 64;

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
        self.mean[place] + coefficients.iter().zip(basis).map(|(c, b)| c * b).sum::<f32>()
    }

    fn of_texel(&self, texel: usize) -> &[f32] {
        let count = self.count();
        &self.coefficients[texel * count..][..count]
    }

    /// All texels under one view as samples of a type and curve, [y, x, light, channel].
    pub fn samples_of_view(&self, view: usize, sample_type: SampleType, transfer: Transfer) -> Samples {
        let length = self.brdf[1] * self.channels.len();
        let mut values = vec![0.0; self.size.texels() * length];
        values.par_chunks_exact_mut(length).enumerate().for_each(|(texel, values)| {
            let coefficients = self.of_texel(texel);
            let places = view * length..;
            values.iter_mut().zip(places).for_each(|(to, place)| *to = self.value(coefficients, place));
        });
        curve::samples(&values, sample_type, transfer)
    }

    /// Linear RGB of all texels, mixed between measured directions in linear light.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub(crate) fn colors(&self, appearance: &Appearance) -> Result<Vec<[f32; 3]>> {
        let decoder = Decoder::new(Transfer::Srgb, SampleType::F32, &self.channels)?;
        let (lights, channels) = (self.brdf[1], self.channels.len());
        let mut colors = vec![[0.0; 3]; self.size.texels()];
        colors.par_chunks_mut(TOGETHER).enumerate().for_each(|(piece, colors)| {
            for (number, color) in colors.iter_mut().enumerate() {
                let coefficients = self.of_texel(piece * TOGETHER + number);
                let mut sum = [0.0; 3];
                for &(view, light, weight) in &appearance.terms {
                    let first = (view * lights + light) * channels;
                    let of_channel = |place| self.value(coefficients, place) / WHITE;
                    let values = Samples::F32((first..first + channels).map(of_channel).collect());
                    add(&mut sum, weight, decoder.rgb(&values, 0));
                }
                *color = sum.map(|value| value as f32);
            }
        });
        Ok(colors)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
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
        let of_view = |view| components.samples_of_view(view, SampleType::U8, Transfer::Srgb);
        assert_eq!(of_view(0), Samples::U8(vec![10, 20, 30, 15, 13, 28]));
        assert_eq!(of_view(1), Samples::U8(vec![100, 110, 120, 110, 96, 120]));
        let appearance = Appearance { terms: vec![(0, 0, 0.25), (1, 0, 0.75)] };
        let linear = |code: f64| Transfer::Srgb.decode(code / 255.0);
        let colors = components.colors(&appearance).unwrap();
        let expected = 0.25 * linear(15.0) + 0.75 * linear(110.0);
        assert!((f64::from(colors[1][0]) - expected).abs() < 1e-6);
        let Samples::F32(values) = components.samples_of_view(1, SampleType::F32, Transfer::Linear) else {
            unreachable!()
        };
        assert!((f64::from(values[3]) - linear(110.0)).abs() < 1e-6);
    }
}

//! Values under any light and view, equation (27), mixed between measured directions in linear light.

use btfkit_formats::Samples;

use super::triangulation::Interpolator;
use crate::color::Decoder;
use btfkit_formats::Direction;

/// Which measured direction pairs stand for another pair, and with what weights.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Appearance {
    /// (view, light, weight); weights sum to 1, times the cosine ratio beyond the outer ring of lights.
    pub terms: Vec<(usize, usize, f64)>,
}

impl Appearance {
    /// Mixes the three views and three lights of the enclosing triangles.
    pub(crate) fn new(
        views: &Interpolator,
        lights: &Interpolator,
        view: Direction,
        light: Direction,
    ) -> Self {
        let (view, light) = (views.mix(view), lights.mix(light));
        let terms = view
            .terms
            .iter()
            .flat_map(|&(v, wv)| light.terms.iter().map(move |&(i, wi)| (v, i, wv * wi * light.cosine_ratio)))
            .collect();
        Self { terms }
    }

    /// Linear RGB of BRDFs laid out [brdf, view, light, channel].
    pub(crate) fn of_brdfs(&self, brdfs: &Samples, shape: [usize; 4], decoder: &Decoder) -> Vec<[f32; 3]> {
        let [count, views, lights, channels] = shape;
        (0..count)
            .map(|brdf| {
                let mut sum = [0.0; 3];
                for &(view, light, weight) in &self.terms {
                    let at = ((brdf * views + view) * lights + light) * channels;
                    add(&mut sum, weight, decoder.rgb(brdfs, at));
                }
                sum.map(|value| value as f32)
            })
            .collect()
    }
}

/// Adds a colour times `weight`.
#[inline]
pub(crate) fn add(sum: &mut [f64; 3], weight: f64, rgb: [f64; 3]) {
    sum.iter_mut().zip(rgb).for_each(|(sum, value)| *sum += weight * value);
}

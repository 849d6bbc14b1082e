//! Values under any light and view, equation (27), mixed between measured directions in linear light.

use crate::color::Transfer;
use crate::texel::direction::Direction;
use crate::texel::triangulation::Interpolator;

/// Which measured direction pairs stand for another pair, and with what weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// (view, light, weight); weights sum to 1, times the cosine ratio beyond the outer ring of lights.
    pub terms: Vec<(usize, usize, f64)>,
}

impl Appearance {
    /// Mixes the three views and three lights of the enclosing triangles.
    pub fn new(views: &Interpolator, lights: &Interpolator, view: Direction, light: Direction) -> Self {
        let (view, light) = (views.mix(view), lights.mix(light));
        let terms = view
            .terms
            .iter()
            .flat_map(|&(v, wv)| light.terms.iter().map(move |&(i, wi)| (v, i, wv * wi * light.cosine_ratio)))
            .collect();
        Self { terms }
    }

    /// Linear RGB of BRDFs laid out [brdf, view, light, channel].
    pub fn of_brdfs(&self, brdfs: &[u8], shape: [usize; 4], transfer: Transfer) -> Vec<[f32; 3]> {
        let [_, views, lights, channels] = shape;
        let linear = transfer.table();
        brdfs
            .chunks_exact(views * lights * channels)
            .map(|brdf| {
                let mut sum = [0.0; 3];
                for &(view, light, weight) in &self.terms {
                    let at = (view * lights + light) * channels;
                    add(&mut sum, weight, &brdf[at..at + channels], &linear);
                }
                sum.map(|value| value as f32)
            })
            .collect()
    }
}

/// Adds the linear values of a texel's samples, times `weight`; a single channel counts as grey.
#[inline]
pub fn add(sum: &mut [f64; 3], weight: f64, samples: &[u8], linear: &[f64; 256]) {
    for (channel, sum) in sum.iter_mut().enumerate() {
        *sum += weight * linear[usize::from(samples[channel.min(samples.len() - 1)])];
    }
}

//! Values of clusters under all measured directions, decoded once, laid out for many random questions.

use std::ops::Range;

use btfkit_formats::Samples;

use super::components::ComponentTable;
use super::locate::Share;
use crate::color::Decoder;

/// A term of a mix of lights, each with a colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tinted {
    /// Number of the light.
    pub number: u16,
    /// Factors on linear red, green and blue; the fourth is not used.
    pub weights: [f32; 4],
}

/// Some measured views and lights that stand for what is seen and lit.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<'a> {
    /// Views.
    pub views: &'a [Share],
    /// Lights, as many as there are: one light takes three, an environment all.
    pub lights: &'a [Tinted],
}

/// A model's values, however it keeps them.
pub trait Values: Sync {
    /// Linear RGB of an entry (a cluster, say) for a mix of measured views and lights.
    fn of(&self, entry: usize, mixture: &Mixture<'_>) -> [f32; 3];
    /// How many entries there are.
    fn entries(&self) -> usize;
}

/// Values of either kind.
pub enum Table {
    /// Of clusters: an entry is a cluster.
    Clusters(ClusterTable),
    /// Of components: an entry is a texel of the tile.
    Components(ComponentTable),
}

impl Values for Table {
    #[inline]
    fn of(&self, entry: usize, mixture: &Mixture<'_>) -> [f32; 3] {
        match self {
            Self::Clusters(table) => table.of(entry, mixture),
            Self::Components(table) => table.of(entry, mixture),
        }
    }

    fn entries(&self) -> usize {
        match self {
            Self::Clusters(table) => table.entries(),
            Self::Components(table) => table.entries(),
        }
    }
}

/// The clusters' representatives as linear RGB, [cluster, view, light]: what is asked for together lies together.
pub struct ClusterTable {
    views: usize,
    lights: usize,
    /// A fourth value makes an element 16 bytes, which is what one load takes.
    values: Vec<[f32; 4]>,
    not_finite: u64,
}

impl ClusterTable {
    /// An empty table for so many views and lights.
    pub fn new(views: usize, lights: usize) -> Self {
        Self { views, lights, values: Vec::new(), not_finite: 0 }
    }

    /// Bytes of a table of so many clusters.
    pub fn bytes([clusters, views, lights]: [usize; 3]) -> u64 {
        [clusters, views, lights]
            .iter()
            .fold(size_of::<[f32; 4]>() as u64, |bytes, &n| bytes.saturating_mul(n as u64))
    }

    /// Appends clusters, whose samples are laid out [cluster, view, light, channel]. What is no finite number counts
    /// as 0.
    pub fn push(&mut self, samples: &Samples, decoder: &Decoder) {
        let finite = |value: f64, not_finite: &mut u64| {
            if value.is_finite() {
                return value as f32;
            }
            *not_finite += 1;
            0.0
        };
        for at in (0..samples.len()).step_by(decoder.channels().max(1)) {
            let [r, g, b] = decoder.rgb(samples, at).map(|value| finite(value, &mut self.not_finite));
            self.values.push([r, g, b, 0.0]);
        }
    }

    /// Appends a cluster by its colours [view, light].
    pub fn push_colors(&mut self, colors: impl IntoIterator<Item = [f32; 3]>) {
        self.values.extend(colors.into_iter().map(|[r, g, b]| [r, g, b, 0.0]));
    }

    /// Numbers that were none, and count as 0.
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// Where an entry lies.
    #[inline]
    fn place(&self, entry: usize) -> Range<usize> {
        let stride = self.views * self.lights;
        entry * stride..(entry + 1) * stride
    }
}

impl Values for ClusterTable {
    #[inline]
    fn of(&self, entry: usize, mixture: &Mixture<'_>) -> [f32; 3] {
        let entry = &self.values[self.place(entry)];
        let mut sum = [0.0f32; 4];
        for view in mixture.views {
            let lights = &entry[usize::from(view.number) * self.lights..][..self.lights];
            let mut part = [0.0f32; 4];
            for light in mixture.lights {
                let value = &lights[usize::from(light.number)];
                part = std::array::from_fn(|c| part[c] + light.weights[c] * value[c]);
            }
            sum = std::array::from_fn(|c| sum[c] + view.weight * part[c]);
        }
        [sum[0], sum[1], sum[2]]
    }

    fn entries(&self) -> usize {
        self.values.len() / (self.views * self.lights).max(1)
    }
}

//! Whether a synthesis is like its tile: distribution, autocorrelation and spectrum of both normal maps.

use serde::Serialize;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::method::field::fit::second_order::{Autocovariance, Lags, variances};
use crate::method::field::{Boundary, Coordinates, Extent, Field, Surface, Synthesis, pyramid};
use crate::shape::Size;

/// Names of the components.
pub const COMPONENTS: [&str; 3] = ["n_x", "n_y", "n_z"];

/// Rows and columns of the synthesis that is looked at.
const PROBE: Size = Size { height: 512, width: 512 };

/// A level of the pyramid that is told of has at least this many texels along its shorter side.
const LEAST_SIDE: usize = 8;

/// A normal map and its statistics.
pub struct Statistics {
    /// Rows and columns.
    pub size: Size,
    /// The normals, row by row.
    pub normals: Vec<[f32; 3]>,
    /// Of n_x, n_y and n_z.
    pub components: [Distribution; 3],
    /// R(d) of the normals less their mean.
    pub autocovariance: Autocovariance,
    /// Standard deviation of each component in each band of the pyramid, the finest first.
    pub bands: Vec<[f64; 3]>,
}

/// How the values of a component are distributed.
pub struct Distribution {
    /// All values from the least up.
    pub sorted: Vec<f32>,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub spread: f64,
    /// Their third standardised moment; 0 where all are equal.
    pub skewness: f64,
}

impl Distribution {
    fn of(values: impl Iterator<Item = f32>) -> Self {
        let mut sorted: Vec<f32> = values.collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let count = sorted.len() as f64;
        let mean = sorted.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
        let moment = |n| sorted.iter().map(|&v| (f64::from(v) - mean).powi(n)).sum::<f64>() / count;
        let spread = moment(2).sqrt();
        let skewness = if spread > 0.0 { moment(3) / spread.powi(3) } else { 0.0 };
        Self { mean, spread, skewness, sorted }
    }

    /// The Wasserstein distance to another: how far values must be moved on average for the distributions to agree.
    fn distance(&self, other: &Self) -> f64 {
        let count = self.sorted.len().max(other.sorted.len());
        let at = |sorted: &[f32], n: usize| sorted[(2 * n + 1) * sorted.len() / (2 * count)];
        let differences = (0..count).map(|n| f64::from((at(&self.sorted, n) - at(&other.sorted, n)).abs()));
        differences.sum::<f64>() / count as f64
    }
}

impl Statistics {
    fn of(size: Size, normals: Vec<[f32; 3]>, boundary: Boundary, lags: Lags, levels: usize) -> Result<Self> {
        let (field, _) = Coordinates::Normals.field(size, &normals)?.centred();
        let bands = pyramid::decompose(&field, levels, boundary)?;
        let spread = |band: &Field| {
            let variances = variances(band);
            [0, 1, 2].map(|axis| variances[axis].sqrt())
        };
        Ok(Self {
            size,
            components: [0, 1, 2].map(|axis| Distribution::of(normals.iter().map(|n| n[axis]))),
            autocovariance: Autocovariance::of_field(&field, boundary, lags),
            bands: bands.iter().map(spread).collect(),
            normals,
        })
    }
}

/// A tile and a synthesis of its model.
pub struct Comparison {
    /// What was measured.
    pub tile: Statistics,
    /// What the model makes of it.
    pub synthesis: Statistics,
}

/// The figures of a [`Comparison`].
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Of n_x, n_y and n_z.
    pub components: Vec<ComponentFigures>,
    /// Root mean square difference of the autocovariances, in units of the tile's variances.
    pub autocovariance_error: f64,
    /// Correlation of n_x and n_y in the tile, and in the synthesis.
    pub correlation: [f64; 2],
    /// Standard deviation of each component in each band: of the tile, and of the synthesis.
    pub bands: Vec<[[f64; 3]; 2]>,
}

/// Figures of one component, those of the tile first.
#[derive(Clone, Debug, Serialize)]
pub struct ComponentFigures {
    /// Means.
    pub mean: [f64; 2],
    /// Standard deviations.
    pub spread: [f64; 2],
    /// Third standardised moments.
    pub skewness: [f64; 2],
    /// Wasserstein distance of the distributions.
    pub distance: f64,
}

impl Comparison {
    /// Synthesises 512 x 512 texels and looks at both normal maps.
    ///
    /// # Errors
    /// Those of a synthesis.
    pub fn of(surface: &Surface, size: Size, normals: Vec<[f32; 3]>, boundary: Boundary) -> Result<Self> {
        let Size { height, width } = PROBE;
        let mut field = Synthesis::new(&surface.field, 1, height, width, Extent::Endless, Kernel::fastest())?;
        let mut synthesised = vec![[0.0; 3]; PROBE.texels()];
        surface.next_rows(&mut field, width, &mut synthesised)?;
        let lags = Lags::of(size.height, size.width);
        let sizes = pyramid::sizes(size.height, size.width, usize::BITS as usize);
        let levels = sizes.iter().take_while(|side| side[0].min(side[1]) >= LEAST_SIDE).count().max(1);
        Ok(Self {
            tile: Statistics::of(size, normals, boundary, lags, levels)?,
            synthesis: Statistics::of(PROBE, synthesised, Boundary::Mirrored, lags, levels)?,
        })
    }

    /// What the pictures show, in figures.
    pub fn figures(&self) -> Figures {
        let both = [&self.tile, &self.synthesis];
        let component = |axis: usize| {
            let [tile, synthesis] = both.map(|one| &one.components[axis]);
            ComponentFigures {
                mean: [tile.mean, synthesis.mean],
                spread: [tile.spread, synthesis.spread],
                skewness: [tile.skewness, synthesis.skewness],
                distance: tile.distance(synthesis),
            }
        };
        let correlation = both.map(|one| {
            let covariance = one.autocovariance.covariance();
            let scale = (covariance[(0, 0)] * covariance[(1, 1)]).sqrt();
            if scale > 0.0 { covariance[(0, 1)] / scale } else { 0.0 }
        });
        Figures {
            components: (0..3).map(component).collect(),
            autocovariance_error: self.synthesis.autocovariance.error(&self.tile.autocovariance),
            correlation,
            bands: self.tile.bands.iter().zip(&self.synthesis.bands).map(|(a, b)| [*a, *b]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_distances_of_small_distributions() {
        let one = Distribution::of([0.0, 0.0, 0.0, 4.0].into_iter());
        assert_eq!((one.mean, one.spread), (1.0, 3.0_f64.sqrt()));
        // (3 * -1 + 27) / 4 / 3^1.5
        assert!((one.skewness - 6.0 / 3.0_f64.powf(1.5)).abs() < 1e-12);
        let other = Distribution::of([1.0, 5.0].into_iter());
        assert_eq!([one.distance(&one), one.distance(&other), other.distance(&one)], [0.0, 2.0, 2.0]);
        assert_eq!(Distribution::of([0.5, 0.5].into_iter()).skewness, 0.0);
    }
}

use serde::{Deserialize, Serialize};

use super::autocorrelation::far_peak;
use super::bands::BandStatistics;
use super::co_occurrence::{self, Edges, co_occurrence};
use super::{Lightness, patches, spectrum};

/// A way to tell how far two pictures are from each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Which grey levels neighbour each other.
    CoOccurrence,
    /// Statistics of a steerable pyramid.
    Pyramid,
    /// STSIM-2.
    Stsim,
    /// Power in rings and directions.
    Spectrum,
    /// The distribution of 7 x 7 patches at three scales.
    Patches,
}

impl Measure {
    /// All of them, in the order in which distances are given.
    pub const ALL: [Self; 5] =
        [Self::CoOccurrence, Self::Pyramid, Self::Stsim, Self::Spectrum, Self::Patches];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::CoOccurrence => "co-occurrence",
            Self::Pyramid => "pyramid",
            Self::Stsim => "stsim",
            Self::Spectrum => "spectrum",
            Self::Patches => "patches",
        }
    }
}

/// What the measures compare of a picture.
#[derive(Clone, Debug)]
pub struct Statistics {
    deviation: f64,
    co_occurrence: Vec<f64>,
    bands: BandStatistics,
    spectrum: Vec<f64>,
    patches: Vec<Vec<f64>>,
    peak: f64,
}

impl Statistics {
    /// Of a picture of at least [`super::LEAST_SIDE`] texels a side; `edges` are those of the grey levels, from
    /// [`co_occurrence::edges`] of a real crop.
    pub fn of(picture: &Lightness, edges: &Edges) -> Self {
        Self {
            deviation: picture.deviation(),
            co_occurrence: co_occurrence(picture, edges),
            bands: BandStatistics::of(picture),
            spectrum: spectrum::spectrum(picture),
            patches: patches::projections(picture),
            peak: far_peak(picture),
        }
    }

    /// Distances to another picture's, in the order of [`Measure::ALL`]. That of patches is in the other's standard
    /// deviations.
    pub fn distances(&self, other: &Self) -> [f64; Measure::ALL.len()] {
        Measure::ALL.map(|measure| match measure {
            Measure::CoOccurrence => co_occurrence::distance(&self.co_occurrence, &other.co_occurrence),
            Measure::Pyramid => self.bands.distance(&other.bands),
            Measure::Stsim => self.bands.dissimilarity(&other.bands),
            Measure::Spectrum => spectrum::distance(&self.spectrum, &other.spectrum),
            Measure::Patches => patches::distance(&self.patches, &other.patches) / other.deviation,
        })
    }

    /// The largest autocorrelation at a far shift.
    pub fn peak(&self) -> f64 {
        self.peak
    }
}

//! What a judging found, for JSON and for the table.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::crops::Origin;
use crate::likeness::verdict::Verdict;
use crate::likeness::{Judgement, Measure};
use crate::names::serialize_path;

/// What a judging found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What was judged.
    #[serde(serialize_with = "serialize_path")]
    pub subject: PathBuf,
    /// Its rows and columns.
    pub size: [usize; 2],
    /// The measurement that it was judged by.
    #[serde(serialize_with = "serialize_path")]
    pub measurement: PathBuf,
    /// The digest of that measurement.
    pub measurement_digest: String,
    /// First row and column of the exemplar in the tile, its rows and columns.
    pub exemplar: [usize; 4],
    /// Where real crops come from.
    pub origin: Origin,
    /// Side of all crops in texels.
    pub crop: usize,
    /// Row and column of each real crop in the measurement.
    pub real_crops: Vec<[usize; 2]>,
    /// Row and column of each crop of the subject.
    pub crops: Vec<[usize; 2]>,
    /// Rows and columns, a cell of the lattice, within which crops of a regular material were moved so that each is in
    /// phase with one real crop, its partner: crop n with real crop n modulo their number.
    pub in_phase_within: Option<[usize; 2]>,
    /// Under each pair of directions.
    pub pairs: Vec<Pair>,
    /// Means over the pairs.
    pub mean: Rows,
    /// The components n_x and n_y of the normal maps, as far as they could be judged.
    pub normals: Normals,
    /// Over the whole of the subject.
    pub verdict: Verdict,
    /// Largest correlation, in any pair, of the rows' means with those one side of the exemplar away, and of the
    /// columns' means; absent where the subject has less than two sides.
    pub bands: [Option<f64>; 2],
    /// The same of bands that wave, under the first pair, in a window in the middle.
    pub wavy_bands: [Option<f64>; 2],
    /// Of a model with a lattice.
    pub lattice: Option<LatticePeak>,
}

/// Under one pair of directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Number of the view.
    pub view: usize,
    /// Number of the light.
    pub light: usize,
    /// Elevation and azimuth of the view, degrees.
    pub view_deg: [f64; 2],
    /// Elevation and azimuth of the light, degrees.
    pub light_deg: [f64; 2],
    /// Mean distance between real crops: what is 1 in the rows.
    pub floor: BTreeMap<String, f64>,
    /// The three rows.
    #[serde(flatten)]
    pub rows: Rows,
}

/// The same judged three times, so that one can tell whose fault a distance is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rows {
    /// The exemplar merely repeated, with measured values: what the choice of the exemplar costs.
    pub own: Row,
    /// The enlargement with the values measured where its texels come from; absent without sources.
    pub alone: Option<Row>,
    /// The enlargement with the values of the model's clusters.
    pub with_model: Row,
}

/// A judgement by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Distances in units of those between real crops.
    pub measures: BTreeMap<String, f64>,
    /// The largest of them; of means, the mean of the largest.
    pub j: f64,
    /// Name of the largest.
    pub worst: String,
    /// By how much the far autocorrelation exceeds that of real crops.
    pub excess_peak: f64,
}

/// The normal map's components n_x and n_y, as pictures, against normals of the real crops by photometric stereo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Normals {
    /// As judged.
    Judged {
        /// By what they were judged: normals of the real crops.
        against: String,
        /// n_x.
        x: Box<NormalRows>,
        /// n_y.
        y: Box<NormalRows>,
    },
    /// Why they were not.
    Absent {
        /// In words.
        reason: String,
    },
}

/// One component of the normal map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NormalRows {
    /// Of the exemplar merely repeated.
    pub own: Row,
    /// Of the enlargement.
    pub enlarged: Row,
}

/// Autocorrelation at the periods of a regular material's lattice, mean over periods and pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticePeak {
    /// Of the subject.
    pub enlarged: f64,
    /// Of the exemplar repeated.
    pub own: f64,
}

impl From<&Judgement> for Row {
    fn from(judgement: &Judgement) -> Self {
        Self {
            measures: by_name(&judgement.measures),
            j: judgement.j,
            worst: judgement.worst.name().to_owned(),
            excess_peak: judgement.excess_peak,
        }
    }
}

/// Values of the measures by their names.
pub(super) fn by_name(values: &[f64; Measure::ALL.len()]) -> BTreeMap<String, f64> {
    Measure::ALL.iter().zip(values).map(|(measure, &value)| (measure.name().to_owned(), value)).collect()
}

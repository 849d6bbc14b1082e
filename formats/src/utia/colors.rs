//! What the planes of an image are.

use super::Number;
use crate::{Assumption, SampleType};

/// Names of the planes, and the value that floats have where reflectance is 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Colors {
    pub(crate) channels: Vec<String>,
    pub(crate) unit: f32,
    pub(crate) assumptions: Vec<String>,
}

impl Colors {
    /// Of a colour space by name, and of labels of all planes if the file has them.
    pub(crate) fn new(planes: usize, space: &str, labels: Option<Vec<String>>) -> Colors {
        let three = |names: [&str; 3]| names.map(String::from).to_vec();
        let channels = match (labels, planes) {
            (Some(labels), _) => labels,
            (None, 1) => vec!["Y".to_owned()],
            (None, 3) if space.to_ascii_uppercase().contains("XYZ") => three(["X", "Y", "Z"]),
            (None, 3) => three(["R", "G", "B"]),
            (None, _) => (0..planes).map(|plane| plane.to_string()).collect(),
        };
        let is_xyz = channels == ["X", "Y", "Z"];
        let mut assumptions = Vec::new();
        if is_xyz {
            assumptions.push(
                "X, Y, Z are CIE 1931 (2 degrees, D65), and floats on a scale of 100, as in the published viewer: they are divided by 100."
                    .to_owned(),
            );
        }
        Colors { channels, unit: if is_xyz { 100.0 } else { 1.0 }, assumptions }
    }

    /// The type that samples of `numbers` are read as: those that are divided, as f32.
    pub(crate) fn sample_type(&self, numbers: impl IntoIterator<Item = Number>) -> SampleType {
        match Number::common_sample_type(numbers) {
            SampleType::F16 if self.unit != 1.0 => SampleType::F32,
            other => other,
        }
    }
}

/// Whether samples of a type are proportional to reflectance, and how that is known.
pub(crate) fn transfer(sample_type: SampleType) -> (bool, Assumption) {
    let (linear, text) = match sample_type {
        SampleType::U8 => {
            (false, "8-bit samples are display values through the sRGB curve; the format does not say.")
        }
        _ => (true, "Samples are proportional to reflectance; the format does not say."),
    };
    (linear, Assumption::transfer(text))
}

//! How an archive was read when a measurement was imported: what recipes hold of it.

use btfkit_formats::SampleType;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::color::Transfer;

/// Whose directions are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Those of lights and views.
    Both,
    /// Those of lights.
    Lights,
    /// Those of views.
    Views,
}

impl Side {
    /// The side that is lights, or views, or both; none of neither.
    pub fn of(lights: bool, views: bool) -> Option<Self> {
        match (lights, views) {
            (true, true) => Some(Self::Both),
            (true, false) => Some(Self::Lights),
            (false, true) => Some(Self::Views),
            (false, false) => None,
        }
    }

    /// Whether lights, and whether views are meant.
    pub fn lights_and_views(side: Option<Self>) -> [bool; 2] {
        [Self::Lights, Self::Views].map(|one| side.is_some_and(|side| side == Self::Both || side == one))
    }
}

/// What is to be done to every image and direction of an archive. The default does nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Adaptation {
    /// Views of the archive that are left out.
    pub drop_views: Vec<usize>,
    /// Lights that are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drop_lights: Vec<usize>,
    /// What the archive calls light is the view, and the other way round.
    pub swap: bool,
    /// What the archive calls theta is the elevation above the surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elevations: Option<Side>,
    /// Azimuths run clockwise.
    pub mirrored: Option<Side>,
    /// Counter-clockwise turn of all directions, degrees: a multiple of 90.
    pub turn_deg: u16,
    /// Rows and columns of the images are exchanged.
    pub transpose: bool,
    /// The cosine of the light angle is not in the archive's values: it is multiplied in.
    pub cosine_excluded: bool,
    /// The transfer curve of the archive's samples, where its own word is not taken.
    pub transfer: Option<Transfer>,
    /// Samples are converted to this type.
    pub samples: Option<Type>,
}

/// A sample type by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Type {
    /// 8-bit.
    U8,
    /// 16-bit.
    U16,
    /// Half precision.
    F16,
    /// Single precision.
    F32,
}

impl From<Type> for SampleType {
    fn from(name: Type) -> Self {
        match name {
            Type::U8 => Self::U8,
            Type::U16 => Self::U16,
            Type::F16 => Self::F16,
            Type::F32 => Self::F32,
        }
    }
}

/// How an archive is read, as recipes hold it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Reading {
    /// What is mended.
    #[serde(flatten)]
    pub adaptation: Adaptation,
    /// The published list or order that was named.
    pub order: Option<String>,
    /// Whether rows of Bonn containers begin with the bottom one.
    pub bottom_row_first: bool,
    /// Whether scan lines of Radiance pictures that are columns are read as rows.
    pub columns_as_rows: bool,
}

impl Reading {
    /// The reading that a recipe holds. A recipe that is older than an option does not name it.
    ///
    /// # Errors
    /// What no reading has: another name, another type, views out of order, a turn that is not by right angles.
    pub(crate) fn parse(stored: &Value) -> std::result::Result<Self, String> {
        let reading: Self = serde_json::from_value(stored.clone()).map_err(|error| error.to_string())?;
        let known = serde_json::to_value(&reading).map_err(|error| error.to_string())?;
        let unknown = |name: &&String| known.get(name.as_str()).is_none();
        if let Some(name) = stored.as_object().into_iter().flat_map(|members| members.keys()).find(unknown) {
            return Err(format!("unknown field `{name}`"));
        }
        let Adaptation { drop_views, turn_deg, .. } = &reading.adaptation;
        if !drop_views.is_sorted_by(|a, b| a < b) {
            return Err(format!("drop_views: got {drop_views:?}, expected each once, in order"));
        }
        if *turn_deg >= 360 || turn_deg % 90 != 0 {
            return Err(format!("turn_deg: got {turn_deg}, expected 0, 90, 180 or 270"));
        }
        Ok(reading)
    }
}

//! What a picture is of, as recipes hold it.

use serde::{Deserialize, Serialize};

use crate::method::coherent::JITTER_ONE;
use crate::shape::Area;

/// Longest side of a picture.
pub(crate) const MOST_SIDE: usize = 1 << 24;

/// What tells the pixels of a picture apart from those of another source; its name is the kind of the store.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum SceneRecipe {
    /// A measurement.
    Measurement(Stored),
    /// The tile of a model.
    Model(Stored),
    /// An enlarged index.
    Enlarged(Stored),
    /// An endless plane of a model.
    Plane(Endless),
    /// The tile of a packed model.
    Packed(Packed),
}

/// The tile of a packed model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Packed {
    /// Digest of the file.
    pub digest: String,
    /// The part that is shown: x, y, width, height.
    pub window: [i64; 4],
}

/// A plane that is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// Digest of what made it: of a model, of the stage that is shown.
    pub digest: String,
    /// Rows and columns of all of it.
    pub size: [usize; 2],
    /// The part that is shown, where it is not all: x, y, width, height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<[i64; 4]>,
    /// Where values come from, where it is not the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<ValuesName>,
}

/// An endless plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Endless {
    /// Digest of the stages of the model.
    pub digest: String,
    /// Its seed.
    pub seed: u32,
    /// Its jitter, of [`JITTER_ONE`].
    pub jitter: u32,
    /// The part that is shown: x, y, width, height.
    pub window: [i64; 4],
    /// Where values come from.
    pub values: ValuesName,
}

/// Where the values of texels come from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ValuesName {
    /// The representatives of the clusters.
    Model,
    /// The measurement.
    Measured,
    /// The components of this digest.
    Components(String),
}

/// A part of a plane: x, y, width, height.
pub(super) fn window_of(area: Area) -> [i64; 4] {
    [area.x, area.y, area.size.width as i64, area.size.height as i64]
}

impl SceneRecipe {
    /// Rows and columns of the picture.
    ///
    /// # Errors
    /// A picture that no store has: sides beyond their range, a part beyond what is stored, a jitter beyond 1.
    pub(crate) fn picture_size(&self) -> Result<[usize; 2], String> {
        let (window, stored) = match self {
            Self::Measurement(stored) | Self::Model(stored) | Self::Enlarged(stored) => {
                (stored.window, Some(stored.size))
            }
            Self::Plane(plane) if plane.jitter > JITTER_ONE => {
                return Err(format!("source: jitter: got {}, expected 0 to {JITTER_ONE}", plane.jitter));
            }
            Self::Plane(plane) => (Some(plane.window), None),
            Self::Packed(packed) => (Some(packed.window), None),
        };
        let [height, width] = match (window, stored) {
            (Some([_, _, width, height]), _) => {
                [height, width].map(|side| usize::try_from(side).unwrap_or(0))
            }
            (None, Some(size)) => size,
            (None, None) => [0, 0],
        };
        if let Some(side) = [height, width]
            .iter()
            .chain(stored.iter().flatten())
            .find(|side| !(1..=MOST_SIDE).contains(*side))
        {
            return Err(format!("source: got a side of {side}, expected 1 to {MOST_SIDE}"));
        }
        if let (Some(part @ [x, y, ..]), Some([rows, columns])) = (window, stored) {
            let fits = |start: i64, length: usize, all: usize| {
                usize::try_from(start).is_ok_and(|start| start <= all && length <= all - start)
            };
            if !fits(x, width, columns) || !fits(y, height, rows) {
                return Err(format!("source: window: got {part:?} of {columns}x{rows}"));
            }
        }
        Ok([height, width])
    }
}

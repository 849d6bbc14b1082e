//! How a tile was cut, as the attributes of a model say it.

use btfkit_formats::SampleType;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::color::Transfer;
use crate::lattice::Lattice;
use crate::method::tile::Patch;
use crate::shape::Size;
use crate::zarr::SAMPLE_TYPES;

/// Longest side of a plane.
const MOST_SIDE: usize = 1 << 24;

/// How a tile was cut.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TileReport {
    /// Rows and columns of the tile.
    pub size: [usize; 2],
    /// Whether its borders join.
    pub wraps: bool,
    /// Where it was cut; absent where the whole measurement is the tile.
    pub patch: Option<Patch>,
    /// Step across the seams relative to that between ordinary neighbours (1: cannot be told).
    pub seam_visibility: f64,
    /// The same for the patch repeated without cutting.
    pub uncut_visibility: f64,
    /// Transfer curve of the measurement's samples.
    pub transfer: Transfer,
    /// Rows and columns of the measurement.
    pub measurement_size: [usize; 2],
    /// Names of the measurement's channels; not in the oldest layout.
    #[serde(default)]
    pub channels: Option<Vec<String>>,
    /// Type of the measurement's samples; not in the oldest layout.
    #[serde(default)]
    pub samples: Option<String>,
    /// The lattice that was found in the plane, or given.
    #[serde(default)]
    pub lattice: Lattice,
    /// Cycles of each of its waves down and across the tile (of one whose borders do not join, its largest part of
    /// whole cells); none where the tile holds no whole number of cells.
    #[serde(default)]
    pub cells: Vec<[i32; 2]>,
}

impl TileReport {
    /// Rows and columns of the tile.
    pub fn size(&self) -> Size {
        let [height, width] = self.size;
        Size::new(height, width)
    }

    /// Names of the channels and type of the samples, where they are known.
    pub(super) fn values(&self) -> Option<(Vec<String>, SampleType)> {
        let samples =
            SAMPLE_TYPES.into_iter().find(|samples| self.samples.as_deref() == Some(samples.name()))?;
        Some((self.channels.clone()?, samples))
    }

    /// Checks the parts against each other and against the recipe.
    pub(super) fn check(&self, recipe: &Value) -> Result<(), String> {
        let sides = self.size.iter().chain(&self.measurement_size);
        if !sides.clone().all(|side| (1..=MOST_SIDE).contains(side)) {
            return Err(format!("got sides {:?}, expected 1 to {MOST_SIDE}", sides.collect::<Vec<_>>()));
        }
        match &self.patch {
            Some(patch) if [patch.height, patch.width] != self.size || !self.wraps => {
                return Err(format!(
                    "got a patch of {}x{}, which is not the tile that wraps",
                    patch.width, patch.height
                ));
            }
            None if self.size != self.measurement_size => {
                return Err("got no patch of a tile that is not the whole measurement".to_owned());
            }
            _ => {}
        }
        let asked = recipe.get("tile").and_then(Value::as_str).unwrap_or_default();
        let wraps = match asked {
            "none" => Some(false),
            "periodic" => Some(true),
            _ => None,
        };
        if wraps.is_some_and(|wraps| wraps != self.wraps) {
            return Err(format!("wraps: got {}, the recipe says tile {asked}", self.wraps));
        }
        Ok(())
    }
}

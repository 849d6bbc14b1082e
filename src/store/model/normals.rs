//! The normal map of a model.

use serde::{Deserialize, Serialize};

use super::{Model, Stage};
use crate::error::Result;
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::zarr::Layout;

/// How far from 1 the length of a unit normal in f32 may be.
pub(crate) const UNIT_TOLERANCE: f32 = 1e-4;

/// What a normal map depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NormalsRecipe {
    /// Digest of the tile.
    pub tile: String,
    /// Whether the darkest and the brightest lights of a texel were left out.
    pub robust: bool,
}

impl Recipe for NormalsRecipe {
    const STAGE: &'static str = Stage::Normals.name();
}

/// How an estimation of normals went.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NormalsReport {
    /// Number of the view that was used.
    pub view: usize,
    /// Number of lights.
    pub lights: usize,
    /// Mean of the normals.
    pub mean: [f64; 3],
    /// Root mean square angle between a normal and the mean normal, degrees.
    pub spread_deg: f64,
}

impl Model {
    /// How the estimation of normals went.
    ///
    /// # Errors
    /// Where it has not been run, or what it says is impossible.
    pub fn normals_report(&self) -> Result<NormalsReport> {
        let report: NormalsReport = self.report(Stage::Normals)?;
        let _: NormalsRecipe = self.recipe(Stage::Normals)?;
        let [views, lights] = self.directions()?.map(|list| list.len());
        let length = report.mean.iter().map(|value| value * value).sum::<f64>().sqrt();
        let what = if report.view >= views {
            format!("view: got {} of {views}", report.view)
        } else if report.lights != lights {
            format!("lights: got {}, expected {lights}", report.lights)
        } else if !(0.0..=1.0 + f64::from(UNIT_TOLERANCE)).contains(&length) {
            format!("mean: got {:?}, no mean of unit vectors", report.mean)
        } else if !(0.0..=180.0).contains(&report.spread_deg) {
            format!("spread_deg: got {}, expected 0 to 180", report.spread_deg)
        } else {
            return Ok(report);
        };
        Err(self.damaged_report(Stage::Normals, &what))
    }

    /// Writes the normal map [y, x, 3], unit vectors.
    pub(crate) fn write_normals(&self, size: Size, normals: &[[f32; 3]]) -> Result<()> {
        self.store.write("normals", &normals_layout(size), normals.as_flattened())
    }

    /// The normal map.
    pub fn normals(&self) -> Result<Vec<[f32; 3]>> {
        let layout = normals_layout(self.tile_report()?.size());
        let values = self.read::<f32>(Stage::Normals, "normals", &layout)?;
        let normals = values.as_chunks::<3>().0;
        match normals.iter().position(|normal| !is_unit(normal)) {
            None => Ok(normals.to_vec()),
            Some(at) => {
                Err(self.damaged("normals", &format!("texel {at} has {:?}, no unit vector", normals[at])))
            }
        }
    }
}

/// Whether a vector is a unit vector, as far as f32 goes.
pub(crate) fn is_unit(normal: &[f32; 3]) -> bool {
    let length = normal.iter().map(|value| value * value).sum::<f32>().sqrt();
    (length - 1.0).abs() <= UNIT_TOLERANCE
}

pub(super) fn normals_layout(size: Size) -> Layout<'static> {
    Layout::small::<f32>(&["y", "x", "xyz"], &[size.height, size.width, 3])
        .with("frame", "x right, y up, z out of the surface")
}

//! What a pyramid depends on, and what the file beside its tiles says of it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::TILE_SIDES;
use crate::picture::deepzoom::Encoding;
use crate::picture::deepzoom::pyramid::Pyramid;
use crate::run::recipe::{Made, Recipe};
use crate::shape::Size;
use crate::stage::image::recipe::SceneRecipe;

/// Largest angle from the normal, degrees: 90, and what lists round.
const LARGEST_THETA_DEG: f64 = 90.01;

/// What a pyramid depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PyramidRecipe {
    /// What is shown.
    pub source: SceneRecipe,
    /// Theta and phi of the view in degrees.
    pub view: [f64; 2],
    /// Theta and phi of the light in degrees.
    pub light: [f64; 2],
    /// Factor on the linear values.
    pub exposure: f64,
    /// Format of the tiles.
    pub tiles: Encoding,
    /// Side of a tile without its overlap.
    pub tile_side: usize,
    /// Pixels of its neighbours that a tile holds.
    pub overlap: usize,
}

impl Recipe for PyramidRecipe {
    const STAGE: &'static str = "deepzoom";
}

impl PyramidRecipe {
    /// The levels and tiles that follow from it.
    ///
    /// # Errors
    /// Where it is the recipe of no pyramid.
    pub(super) fn pyramid(&self) -> Result<Pyramid, String> {
        let [height, width] = self.source.picture_size()?;
        let (side, overlap) = (self.tile_side, self.overlap);
        if !TILE_SIDES.contains(&side) || overlap > side / 2 {
            return Err(format!("tile_side, overlap: got {side} and {overlap}, sizes that no pyramid has"));
        }
        if let Encoding::Jpeg(quality) = self.tiles
            && !(1..=100).contains(&quality)
        {
            return Err(format!("tiles: got a quality of {quality}, expected 1 to 100"));
        }
        if !(self.exposure.is_finite() && self.exposure > 0.0) {
            return Err(format!("exposure: got {}, expected a factor above 0", self.exposure));
        }
        for (name, [theta, phi]) in [("view", self.view), ("light", self.light)] {
            if !(0.0..=LARGEST_THETA_DEG).contains(&theta) || !phi.is_finite() {
                return Err(format!("{name}: got {theta},{phi} degrees, expected theta from 0 to 90"));
            }
        }
        Ok(Pyramid { size: Size::new(height, width), side, overlap })
    }
}

/// What the file beside the tiles says. The oldest had neither version nor layout format nor seal.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct State {
    /// What it is of.
    kind: Kind,
    /// The recipe as it is stored.
    pub recipe: Value,
    /// Its digest.
    pub digest: String,
    /// Version of the layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<u64>,
    /// Version of the program that began it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// Digest of the rest, written with it.
    #[serde(default, skip_serializing, rename = "seal")]
    _seal: Option<String>,
    /// Of a pyramid that is finished, of the tiles: for each level, digits for each row of tiles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checksums: Option<Vec<String>>,
    /// What the tiles of a finished pyramid do not hold, a sentence each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<Vec<String>>,
}

/// The attribute `kind` of a pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// A Deep Zoom pyramid.
    DeepZoom,
}

impl State {
    /// That of a pyramid that begins.
    pub(super) fn new(recipe: &Value, digest: String, format: u64) -> Self {
        Self {
            kind: Kind::DeepZoom,
            recipe: recipe.clone(),
            digest,
            format: Some(format),
            version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            _seal: None,
            checksums: None,
            notes: None,
        }
    }

    /// By what it was made.
    pub(super) fn made(&self) -> Made<'_> {
        Made { digest: &self.digest, recipe: &self.recipe }
    }
}

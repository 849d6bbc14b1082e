//! How an enlarged index was made, as its attributes say it.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use super::KIND;
use crate::error::{Error, Result};
use crate::run::recipe::Recipe;
use crate::store::model::Stage;
use crate::zarr::Store;
use crate::zarr::metadata::OLDEST_FORMAT;

/// Longest side of an index, as of every [`Size`] that is given as text.
const MOST_SIDE: usize = 1 << 24;

/// Most clusters: the index is u16.
pub(super) const MOST_CLUSTERS: usize = 1 << 16;

/// How an index was enlarged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Nearest normals of a random field, chosen by (25): the paper's. Recipes that name no method mean it.
    #[default]
    Paper,
    /// Source positions that continue their neighbours, from coarse to fine.
    Coherent,
    /// The tile again and again.
    Repeat,
    /// Tiles of one border, laid at random.
    Tiles,
    /// Patches of the tile at random places, stitched on a grid.
    Roller,
    /// Image quilting.
    Quilt,
}

impl Method {
    /// The stages of a model that it depends on.
    pub fn stages(self) -> &'static [Stage] {
        match self {
            Self::Paper => &[Stage::Cluster, Stage::Fit],
            Self::Coherent => &[Stage::Cluster, Stage::Appearance],
            Self::Repeat | Self::Tiles | Self::Roller | Self::Quilt => &[Stage::Cluster],
        }
    }

    fn is_paper(&self) -> bool {
        *self == Self::Paper
    }
}

/// What an enlarged index depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnlargeRecipe {
    /// Digest of the stages of the model.
    pub model: String,
    /// Rows and columns.
    pub size: [usize; 2],
    /// Seed of all that was drawn at random.
    pub seed: u64,
    /// Whether it joins at its borders.
    pub tileable: bool,
    /// By what it was enlarged. The paper's method came first, and its recipes name none.
    #[serde(default, skip_serializing_if = "Method::is_paper")]
    pub rule: Method,
    /// Whether the source of each texel is kept; of methods that know it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<bool>,
    /// Whether normals are kept.
    #[serde(default)]
    pub keep_normals: bool,
    /// Nearest normals that were candidates, by the paper's method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub candidates: Option<usize>,
    /// Jitter of the coherent rule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter: Option<u32>,
    /// Number of tiles, by the method that lays them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tiles: Option<usize>,
}

impl Recipe for EnlargeRecipe {
    const STAGE: &'static str = "enlarge";
}

/// Attributes, as far as they are needed; the seal covers them all.
#[derive(Deserialize)]
pub(super) struct Facts {
    #[serde(deserialize_with = "recipe_of")]
    pub(super) recipe: EnlargeRecipe,
    pub(super) version: String,
    #[serde(default)]
    pub(super) model_name: Option<String>,
    /// Number of clusters of the model; not in the oldest layout.
    pub(super) clusters: Option<usize>,
    /// Rows and columns of the tile; not in the oldest layout.
    pub(super) tile: Option<[usize; 2]>,
}

fn recipe_of<'de, D: Deserializer<'de>>(stored: D) -> std::result::Result<EnlargeRecipe, D::Error> {
    EnlargeRecipe::from_value(&Value::deserialize(stored)?).map_err(D::Error::custom)
}

impl Facts {
    /// Reads the attributes, and checks what does not need arrays.
    pub(super) fn read(store: &Store) -> Result<Self> {
        let refused = |what: String| {
            Error::input(format!("{}: attributes of btfkit: {what}", store.path().display()))
                .hint("enlarge anew, under another name")
        };
        let attributes = Value::Object(store.expect(KIND)?);
        let facts: Self = serde_json::from_value(attributes)
            .map_err(|error| refused(format!("recipe or what lies beside it: {error}")))?;
        let is_new = store.format() > OLDEST_FORMAT;
        if is_new && (facts.clusters.is_none() || facts.tile.is_none()) {
            return Err(refused("clusters or tile: none".to_owned()));
        }
        if let Some(clusters) = facts.clusters
            && !(1..=MOST_CLUSTERS).contains(&clusters)
        {
            return Err(refused(format!("clusters: got {clusters}, expected 1 to {MOST_CLUSTERS}")));
        }
        let sides = facts.recipe.size.iter().chain(facts.tile.iter().flatten());
        match sides.clone().find(|side| !(1..=MOST_SIDE).contains(*side)) {
            None => Ok(facts),
            Some(side) => {
                Err(refused(format!("size or tile: got a side of {side}, expected 1 to {MOST_SIDE}")))
            }
        }
    }
}

//! How an enlarged index was made, as its attributes say it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::KIND;
use crate::error::{Error, Result};
use crate::method::baseline::MOST_TILES;
use crate::method::coherent::JITTER_ONE;
use crate::run::recipe::{self, Recipe};
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

impl EnlargeRecipe {
    /// Checks that it says what its method needs and nothing that only others know, each within its range.
    fn check(&self, tile: Option<[usize; 2]>, is_new: bool) -> std::result::Result<(), String> {
        let rule = self.rule;
        let most_candidates = tile.map_or(usize::MAX, |[height, width]| height * width);
        let members = [
            ("source", rule != Method::Paper, self.source.map(|_| true), "true or false".to_owned()),
            (
                "candidates",
                rule == Method::Paper,
                self.candidates.map(|count| (1..=most_candidates).contains(&count)),
                format!("1 to {most_candidates}"),
            ),
            (
                "jitter",
                rule == Method::Coherent,
                self.jitter.map(|jitter| jitter <= JITTER_ONE),
                format!("0 to {JITTER_ONE}"),
            ),
            (
                "tiles",
                rule == Method::Tiles,
                self.tiles.map(|count| (1..=MOST_TILES).contains(&count)),
                format!("1 to {MOST_TILES}"),
            ),
        ];
        for (name, belongs, found, expected) in members {
            match found {
                Some(_) if !belongs => {
                    let rule = format!("{rule:?}").to_lowercase();
                    return Err(format!("{name}: got one, which --method {rule} has not"));
                }
                Some(false) => return Err(format!("{name}: expected {expected}")),
                None if belongs && is_new => return Err(format!("{name}: got none, expected {expected}")),
                _ => {}
            }
        }
        let joins = |tile: [usize; 2]| self.size.iter().zip(tile).all(|(side, of)| side.is_multiple_of(of));
        let laid = matches!(rule, Method::Repeat | Method::Tiles);
        match tile.filter(|tile| self.tileable && laid && !joins(*tile)) {
            None => Ok(()),
            Some([height, width]) => Err(format!(
                "tileable: {}x{} holds no whole tiles of {width}x{height}",
                self.size[1], self.size[0]
            )),
        }
    }
}

impl Recipe for EnlargeRecipe {
    const STAGE: &'static str = "enlarge";
}

/// Attributes, as far as they are needed; the seal covers them all.
#[derive(Deserialize)]
pub(super) struct Facts {
    #[serde(deserialize_with = "recipe::stored")]
    pub(super) recipe: EnlargeRecipe,
    pub(super) digest: String,
    pub(super) version: String,
    #[serde(default)]
    pub(super) model_name: Option<String>,
    /// Number of clusters of the model; not in the oldest layout.
    pub(super) clusters: Option<usize>,
    /// Rows and columns of the tile; not in the oldest layout.
    pub(super) tile: Option<[usize; 2]>,
}

impl Facts {
    /// Reads the attributes, and checks what does not need arrays.
    pub(super) fn read(store: &Store) -> Result<Self> {
        let refused = |what: String| {
            Error::input(format!("{}: attributes of btfkit: {what}", store.path().display()))
                .hint("enlarge anew, under another name")
        };
        let attributes = Value::Object(store.expect(KIND)?);
        let facts: Self = serde_json::from_value(attributes).map_err(|error| refused(error.to_string()))?;
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
        if let Some(side) = sides.clone().find(|side| !(1..=MOST_SIDE).contains(*side)) {
            return Err(refused(format!("size or tile: got a side of {side}, expected 1 to {MOST_SIDE}")));
        }
        let checked = facts.recipe.check(facts.tile, is_new);
        checked.map_err(|what| refused(format!("recipe: {what}")))?;
        Ok(facts)
    }
}

//! The stages of an analysis, in the order of the data flow.

use serde::{Deserialize, Serialize};

/// The stages of an analysis, in the order of the data flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Cut a tile.
    Tile,
    /// Cluster its BRDFs.
    Cluster,
    /// Estimate its normal map.
    Normals,
    /// Fit the random field.
    Fit,
    /// How the exemplar looks, for the coherent rule.
    Appearance,
    /// The mean and principal components of all samples: a model of values beside the clusters.
    Components,
}

impl Stage {
    /// Its name, as a command and as an entry in the attributes.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tile => "tile",
            Self::Cluster => "cluster",
            Self::Normals => "normals",
            Self::Fit => "fit",
            Self::Appearance => "appearance",
            Self::Components => "components",
        }
    }

    /// Those that `btf model` runs, in the order of the data flow.
    pub const ALL: [Self; 5] = [Self::Tile, Self::Cluster, Self::Normals, Self::Fit, Self::Appearance];

    /// Those that are run by themselves only.
    pub const OPTIONAL: [Self; 1] = [Self::Components];

    /// The stages that build on it, directly or not, in the order of the data flow.
    pub(super) fn builders(self) -> &'static [Self] {
        match self {
            Self::Tile => &[Self::Cluster, Self::Normals, Self::Fit, Self::Appearance, Self::Components],
            Self::Cluster => &[Self::Appearance],
            Self::Normals => &[Self::Fit],
            Self::Fit | Self::Appearance | Self::Components => &[],
        }
    }

    /// The stage that it works on the result of.
    pub fn input(self) -> Option<Self> {
        match self {
            Self::Tile => None,
            Self::Cluster | Self::Normals | Self::Components => Some(Self::Tile),
            Self::Fit => Some(Self::Normals),
            Self::Appearance => Some(Self::Cluster),
        }
    }
}

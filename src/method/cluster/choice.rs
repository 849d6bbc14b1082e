//! What a clustering is asked for: how many clusters, and from where its first centres come.

use serde::{Deserialize, Serialize};

/// How many clusters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Amount {
    /// 256, or as many as there are texels where those are fewer. Recipes have the number.
    Usual,
    /// This many, n_c.
    Clusters(usize),
    /// The fewest whose weighted mean |dL*| from the representatives, which are what is stored, is at most this. Recipes
    /// by older versions, where it was that from the centres, have another name for it.
    #[serde(rename = "error_of_representatives", alias = "error")]
    Error(f64),
    /// The most that leave representatives and index this many times smaller than the raw measurement.
    Ratio(f64),
}

/// What stands for the texels of a cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Representation {
    /// The measured texel nearest to the centre, as in the paper.
    #[default]
    Texel,
    /// The mean of each stored sample.
    Mean,
    /// The lower median of each stored sample.
    Median,
}

impl Representation {
    /// Whether it is that of the paper.
    pub(crate) fn is_texel(&self) -> bool {
        *self == Self::Texel
    }
}

/// Where the first centres of the passes over all texels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum First {
    /// A sample without preference that fits in memory.
    Sample,
    /// Mini-batches that grow, from a sample of the first.
    Minibatch,
}

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

/// Where the first centres of the passes over all texels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum First {
    /// A sample without preference that fits in memory.
    Sample,
    /// Mini-batches that grow, from a sample of the first.
    Minibatch,
}

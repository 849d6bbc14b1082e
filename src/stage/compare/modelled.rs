//! What a model says the samples of its tile are.

use std::borrow::Cow;

use btfkit_formats::Samples;
use serde::Serialize;

use crate::error::Result;
use crate::method::value::components::Components;
use crate::run::Context;
use crate::stage::image::of_stage;
use crate::store::measurement::Description;
use crate::store::model::{Model, Stage};

/// What of a model is compared: each gives the tile's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Index and representatives of the clusters.
    Clusters,
    /// The components.
    Components,
}

impl By {
    /// What a model has, clusters if it has both.
    ///
    /// # Errors
    /// Those of reading the model's attributes.
    pub fn of(model: &Model) -> Result<Self> {
        let only_components = !model.has(Stage::Cluster)? && model.has(Stage::Components)?;
        Ok(if only_components { Self::Components } else { Self::Clusters })
    }

    /// The stage that it comes of.
    pub(super) fn stage(self) -> Stage {
        match self {
            Self::Clusters => Stage::Cluster,
            Self::Components => Stage::Components,
        }
    }
}

/// The tile's samples as a model has them.
pub(super) enum Modelled {
    Clusters { index: Vec<u16>, samples: Samples },
    Components(Components),
}

impl Modelled {
    pub(super) fn open(model: &Model, by: By, context: &Context<'_>) -> Result<Self> {
        Ok(match by {
            By::Clusters => Self::Clusters {
                index: of_stage(model, Stage::Cluster, Model::index)?,
                samples: of_stage(model, Stage::Cluster, Model::representatives)?.samples,
            },
            By::Components => Self::Components(of_stage(model, Stage::Components, |model| {
                context.require("comparing components", model.components_bytes()?)?;
                model.components()
            })?),
        })
    }

    /// Bytes that [`Self::of_view`] makes for a texel.
    pub(super) fn bytes_of_texel(&self, description: &Description) -> usize {
        match self {
            Self::Clusters { .. } => 0,
            // Samples, and the values that they are rounded from.
            Self::Components(_) => description.texel_bytes() + description.texel_samples() * size_of::<f32>(),
        }
    }

    /// Samples that hold those of all texels under a view, and where each texel's begin.
    pub(super) fn of_view(&self, view: usize, description: &Description) -> (Cow<'_, Samples>, Vec<usize>) {
        let texel = description.texel_samples();
        match self {
            Self::Clusters { index, samples } => {
                let start = |&cluster: &u16| (usize::from(cluster) * description.views.len() + view) * texel;
                (Cow::Borrowed(samples), index.iter().map(start).collect())
            }
            Self::Components(components) => {
                let samples = components.samples_of_view(view, description.sample_type, description.transfer);
                (Cow::Owned(samples), (0..components.size.texels()).map(|number| number * texel).collect())
            }
        }
    }
}

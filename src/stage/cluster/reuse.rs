//! Clusters taken from another model of the same measurement, whose tile holds every texel of this one: the plane is
//! clustered once, and any tile that is cut from it is indexed already.

use std::collections::HashMap;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::recipe::Recipe;
use crate::stage::cluster::{Report, measurement_of};
use crate::store::model::clusters::TakenRecipe;
use crate::store::model::{Model, Stage};

/// Which clusters to take.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model that takes them.
    pub model: PathBuf,
    /// The model that has them.
    pub from: PathBuf,
}

/// Clusters to be taken.
pub struct Plan {
    model: Model,
    from: Model,
    recipe: Value,
}

/// Checks that both models are of one measurement.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let from = Model::open(&options.from)?;
    let tile = model.stage_digest(Stage::Tile)?;
    let clusters = from.stage_digest(Stage::Cluster)?;
    if measurement_of(&model)? != measurement_of(&from)? {
        return Err(Error::recipe(format!(
            "{} was cut from another measurement than {}",
            from.path().display(),
            model.path().display()
        )));
    }
    let recipe = TakenRecipe { tile, clusters_of: clusters }.to_value()?;
    Ok(Plan { model, from, recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "cluster", "model": self.model.path().display().to_string(),
            "clusters_of": self.from.path().display().to_string(), "recipe": self.recipe})
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Cluster, &self.recipe).unwrap_or(false)
    }

    /// Takes the clusters, unless that is done.
    ///
    /// # Errors
    /// Where a texel of the tile is not in the other one.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Some(_lock) = self.model.begin(Stage::Cluster, &self.recipe, context)? else {
            return self.model.cluster_report();
        };
        let (tile, other) = (self.model.tile()?, self.from.tile()?);
        let mut clusters = self.from.read_clusters()?;
        let known: HashMap<[u32; 2], u16> =
            other.source.iter().copied().zip(clusters.index.iter().copied()).collect();
        let cluster = |source: &[u32; 2]| {
            known.get(source).copied().ok_or_else(|| {
                Error::usage(format!(
                    "row {}, column {} of the measurement is not in the tile of {}",
                    source[0],
                    source[1],
                    self.from.path().display()
                ))
                .hint("take the clusters of a model of the whole measurement: btf tile --tile none, then btf cluster")
            })
        };
        clusters.index = tile.source.iter().map(cluster).collect::<Result<_>>()?;
        clusters.size = tile.size;
        self.model.write_clusters(&clusters)?;
        let of_other = self.from.cluster_report()?;
        let name = self.from.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
        let texels = tile.size.texels() as u64;
        let report = Report {
            taken_from: Some(of_other.taken_from.clone().unwrap_or((name, other.size.texels()))),
            index_bytes: clusters.index_bytes(),
            tile_bytes: of_other.tile_bytes / (other.size.texels() as u64) * texels,
            ..of_other
        };
        self.model.finish(Stage::Cluster, &self.recipe, &report, context)?;
        Ok(report)
    }
}

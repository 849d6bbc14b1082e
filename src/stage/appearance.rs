//! Model to appearance: how the exemplar looks at every level, from which the coherent rule synthesises.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::coherent::fit::{Clusters, features, fit};
use crate::coherent::{MOST_SIDE, WaveCounts};
use crate::color::lab;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::shape::Window;
use crate::store::appearance::AppearanceReport;
use crate::store::model::{Model, Stage};
use crate::texel::tile::Tile;

/// How to describe an exemplar.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
}

/// A description, ready to be made.
pub struct Plan {
    model: Model,
    tile: Tile,
    recipe: Value,
}

/// Checks that the model has clusters.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let cluster = model.stage_digest(Stage::Cluster)?;
    let tile = model.tile()?;
    if tile.size.height.max(tile.size.width) > MOST_SIDE {
        return Err(Error::usage(format!(
            "a tile of {} is too large, at most {MOST_SIDE} texels a side",
            tile.size
        )));
    }
    let recipe = json!({"stage": "appearance", "method": METHOD, "cluster": cluster});
    Ok(Plan { model, tile, recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "appearance", "model": self.model.path(), "recipe": self.recipe})
    }

    /// Fits the appearance, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<AppearanceReport> {
        let Some(_lock) = self.model.begin(Stage::Appearance, &self.recipe)? else {
            return self.model.report(Stage::Appearance);
        };
        context.progress.begin("appearance", 1, Counted::Items("exemplar"));
        let exemplar = self.tile.size.window();
        let texels = part(&self.model.index()?, self.tile.size.width, exemplar);
        let features = self.features(&texels, context)?;
        let appearance =
            context.install(|| fit(exemplar, self.tile.wraps, &texels, features, WaveCounts::default()));
        self.model.write_appearance(&appearance)?;
        let report = AppearanceReport::new(&appearance);
        self.model.finish(Stage::Appearance, &self.recipe, &report)?;
        context.progress.advance(1);
        context.progress.end();
        Ok(report)
    }

    /// Features of every cluster.
    fn features(
        &self,
        texels: &[u16],
        context: &Context<'_>,
    ) -> Result<Vec<[i8; crate::coherent::FEATURES]>> {
        let [views, lights] = self.model.directions()?;
        let view_weights: Vec<f64> = views.iter().map(|view| libm::cos(view.theta_rad)).collect();
        let centres = self.model.centres()?;
        let mut opponents = Vec::new();
        for clusters in self.model.representative_chunks()? {
            context.check_stop()?;
            let representatives = self.model.representatives_of(clusters)?;
            let decoder = representatives.decoder()?;
            let [count, _, _, channels] = representatives.shape;
            let pairs = views.len() * lights.len();
            opponents.extend((0..count).map(|cluster| {
                let mut mean = [0.0f64; 3];
                for pair in cluster * pairs..(cluster + 1) * pairs {
                    let rgb = decoder.rgb(&representatives.samples, pair * channels);
                    mean.iter_mut().zip(rgb).for_each(|(mean, value)| *mean += value / pairs as f64);
                }
                let [_, a, b] = lab(mean);
                [a, b]
            }));
        }
        let mut counts = vec![0; opponents.len()];
        texels.iter().for_each(|&cluster| counts[usize::from(cluster)] += 1);
        let clusters = Clusters {
            centres: &centres,
            view_weights: &view_weights,
            lights: lights.len(),
            opponents: &opponents,
            counts: &counts,
        };
        Ok(context.install(|| features(&clusters)))
    }
}

/// The clusters of a part of a tile.
fn part(index: &[u16], width: usize, window: Window) -> Vec<u16> {
    let rows = index.chunks_exact(width).skip(window.y).take(window.size.height);
    rows.flat_map(|row| &row[window.x..window.x + window.size.width]).copied().collect()
}

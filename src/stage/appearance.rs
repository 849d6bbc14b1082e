//! Model to appearance: how the exemplar looks at every level, from which the coherent rule synthesises.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::color::lab;
use crate::error::{Error, Result};
use crate::lattice::{Lattice, LatticeChoice, WaveCounts, detect, largest_whole_cells, wave_counts};
use crate::method::coherent::fit::{Clusters, features, fit};
use crate::method::coherent::{FEATURES, MOST_SIDE};
use crate::method::tile::Tile;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::shape::{Size, Window};
use crate::store::model::appearance::AppearanceRecipe;
use crate::store::model::appearance::AppearanceReport;
use crate::store::model::{Model, Stage};

/// How to describe an exemplar.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
    /// The lattice of a regular material.
    pub lattice: LatticeChoice,
}

impl Options {
    /// With the lattice that was found in the picture, if any.
    pub fn new(model: impl Into<PathBuf>) -> Self {
        Self { model: model.into(), lattice: LatticeChoice::Auto }
    }
}

/// A description, ready to be made.
pub struct Plan {
    model: Model,
    tile: Tile,
    lattice: LatticeChoice,
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
    let lattice = options.lattice;
    let recipe = AppearanceRecipe { cluster, lattice: lattice.to_string() }.to_value()?;
    Ok(Plan { model, tile, lattice, recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "appearance", "model": self.model.path().display().to_string(), "recipe": self.recipe})
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Appearance, &self.recipe).unwrap_or(false)
    }

    /// Fits the appearance, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<AppearanceReport> {
        let Some(_lock) = self.model.begin(Stage::Appearance, &self.recipe, context)? else {
            return self.model.appearance_report();
        };
        context.progress.begin("appearance", 1, Counted::Items("exemplar"));
        let index = self.model.index()?;
        let size = self.tile.size;
        let all = self.features(&index, context)?;
        let (found, strongest_peak) = context.compute(|| self.lattice(&index, &all));
        let (exemplar, counts) = exemplar(&found, size, self.tile.wraps);
        let texels = part(&index, size.width, exemplar);
        let features = if exemplar.size == size { all } else { self.features(&texels, context)? };
        let appearance = context.compute(|| fit(exemplar, self.tile.wraps, &texels, features, counts));
        self.model.write_appearance(&appearance)?;
        let report = AppearanceReport::new(&appearance, &found, strongest_peak);
        self.model.finish(Stage::Appearance, &self.recipe, &report, context)?;
        context.progress.advance(1);
        context.progress.end();
        Ok(report)
    }

    /// The lattice that was given, or that the features of the tile's texels have; and their strongest peak.
    fn lattice(&self, index: &[u16], features: &[[i8; FEATURES]]) -> (Lattice, f64) {
        let texels = index.iter().flat_map(|&cluster| features[usize::from(cluster)]);
        let values: Vec<f32> = texels.map(f32::from).collect();
        let detection = detect(self.tile.size, FEATURES, &values, self.tile.wraps);
        let lattice = match &self.lattice {
            LatticeChoice::Auto => detection.lattice,
            LatticeChoice::Given(lattice) => *lattice,
        };
        (lattice, detection.strongest_peak)
    }

    /// Features of every cluster, by how often it occurs in some texels.
    fn features(&self, texels: &[u16], context: &Context<'_>) -> Result<Vec<[i8; FEATURES]>> {
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
        Ok(context.compute(|| features(&clusters)))
    }
}

/// The part of a tile that is taken as the exemplar, and its lattice: a tile that wraps as it is, one that does not
/// cut to whole cells. Where that cannot be, the lattice is not used.
fn exemplar(lattice: &Lattice, tile: Size, wraps: bool) -> (Window, WaveCounts) {
    let whole = tile.window();
    let exemplar = if wraps { Some(whole) } else { largest_whole_cells(lattice, tile) };
    let counted = exemplar.and_then(|part| Some((part, wave_counts(lattice, part.size)?)));
    counted.unwrap_or((whole, WaveCounts::default()))
}

/// The clusters of a part of a tile.
fn part(index: &[u16], width: usize, window: Window) -> Vec<u16> {
    let rows = index.chunks_exact(width).skip(window.y).take(window.size.height);
    rows.flat_map(|row| &row[window.x..window.x + window.size.width]).copied().collect()
}

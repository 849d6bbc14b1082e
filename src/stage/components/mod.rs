//! Tile to components: the mean and the principal components of all its samples, in passes over its chunks.

mod pass;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::color::curve::Unheld;
use crate::error::{Error, Result};
use crate::method::cluster::selection::{Order, Selection};
use crate::method::principal::{self, ITERATIONS, PROBES_MORE, Projected, Space, TOGETHER};
use crate::method::tile::Tile;
use crate::run::Context;
use crate::run::budget::OWN_BYTES;
use crate::run::progress::Counted;
use crate::run::read_ahead;
use crate::run::recipe::Recipe;
use crate::stage::cluster::open_measurement_of;
use crate::store::measurement::Measurement;
pub use crate::store::model::components::ComponentsReport as Report;
use crate::store::model::components::{ComponentsRecipe, Found};
use crate::store::model::{Model, Stage};
use crate::words::counted;
use pass::Pass;

/// Components where no number is given.
pub const USUAL_COMPONENTS: usize = 32;

/// Most components.
pub const MOST_COMPONENTS: usize = 1024;

/// Seed of the range finder; the result hardly depends on it.
const SEED: u64 = 1;

/// The largest value on the curve that the peak signal-to-noise ratio is of.
const PEAK: f64 = 255.0;

/// How to find components.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement that the tile was cut from.
    pub measurement: PathBuf,
    /// The model with the tile.
    pub model: PathBuf,
    /// How many, at most; fewer where the tile has no more.
    pub components: usize,
}

/// A search for components, ready to run.
pub struct Plan {
    measurement: Measurement,
    model: Model,
    tile: Tile,
    components: usize,
    selection: Selection,
    recipe: Value,
}

/// Checks options against the tile.
///
/// # Errors
/// A model without a tile, or of another measurement, and numbers beyond 1 to [`MOST_COMPONENTS`].
pub fn plan(options: &Options) -> Result<Plan> {
    if !(1..=MOST_COMPONENTS).contains(&options.components) {
        return Err(Error::usage(format!(
            "{} components were asked for, expected 1 to {MOST_COMPONENTS}",
            options.components
        )));
    }
    let model = Model::open(&options.model)?;
    let tile_digest = model.stage_digest(Stage::Tile)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let tile = model.tile()?;
    let recipe =
        ComponentsRecipe { tile: tile_digest, components: options.components, seed: SEED, packed: None };
    let selection = Selection::new(&tile.source, measurement.description().chunk_side(), Order::Rows);
    Ok(Plan {
        components: options.components,
        recipe: recipe.to_value()?,
        measurement,
        model,
        tile,
        selection,
    })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "components",
            "model": self.model.path().display().to_string(),
            "texels": self.tile.size.texels(),
            "components_at_most": self.components,
            "passes": 2 + ITERATIONS,
            "recipe": self.recipe,
        })
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        self.model.is_done(Stage::Components, &self.recipe).unwrap_or(false)
    }

    /// Numbers of a BRDF.
    fn brdf(&self) -> usize {
        let description = self.measurement.description();
        description.views.len() * description.texel_samples()
    }

    fn probes(&self) -> usize {
        (self.components + PROBES_MORE).min(self.brdf()).min(self.tile.size.texels())
    }

    /// Bytes of a block's samples.
    fn block_bytes(&self) -> u64 {
        let description = self.measurement.description();
        let texels = self.selection.blocks().iter().flat_map(|block| &block.windows);
        let texels = texels.map(|window| window.size.texels()).max().unwrap_or(0);
        (texels * description.texel_bytes() * description.views.len()) as u64
    }

    /// Memory beside the blocks.
    fn beside_bytes(&self, threads: usize) -> u64 {
        let (brdf, texels, probes) = (self.brdf(), self.tile.size.texels(), self.probes());
        // The space, its product and how that is made orthonormal; texels in it, and the components.
        let space = brdf * probes * (4 + 8 * 4);
        let projected = texels * probes * 4 + (texels + brdf) * self.components.min(probes) * 10;
        OWN_BYTES + (space + projected + threads * brdf * TOGETHER * 4) as u64
    }

    /// Finds the components, unless that is done.
    ///
    /// # Errors
    /// Too little memory, and those of reading and writing.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Some(_lock) = self.model.begin(Stage::Components, &self.recipe, context)? else {
            return self.model.report(Stage::Components);
        };
        let (block, beside) = (self.block_bytes(), self.beside_bytes(context.threads));
        let what = format!("finding components of {}", counted(self.tile.size.texels(), "texel"));
        context.memory().require(&what, beside + block, "choose fewer components (--components)")?;
        let in_flight = read_ahead::in_flight(context.memory_bytes.saturating_sub(beside), block);
        let passes = (2 + ITERATIONS) as u64;
        context.progress.begin(
            "components",
            passes * self.selection.texels() as u64,
            Counted::Items("texels"),
        );
        let pass = Pass::new(&self.measurement, &self.selection, in_flight);
        let texels = self.selection.texels();
        let views = self.measurement.description().views.len();

        let mut sums = vec![vec![0.0; self.brdf() / views]; views];
        let mut unheld = Unheld::default();
        pass.for_each(context, |block| {
            unheld += block.unheld();
            principal::add_to_sums(&mut sums, block);
        })?;
        if unheld.beyond > 0 {
            context.progress.end();
            return Err(self.beyond(unheld.beyond, pass.range()));
        }
        let mean: Vec<f32> = sums.iter().flatten().map(|sum| (sum / texels as f64) as f32).collect();
        let mut space = Space::random(mean.clone(), views, self.probes(), SEED);
        for _ in 0..ITERATIONS {
            let mut product = space.no_product();
            pass.for_each(context, |block| space.multiply(block, &mut product))?;
            space = context.compute(|| space.of_product(&product));
        }
        let mut projected = space.nothing_projected(texels);
        pass.for_each(context, |block| space.project(block, &mut projected))?;
        context.progress.end();
        self.finish(mean, &space, &projected, unheld.not_finite, context)
    }

    /// That samples are beyond what components hold: how far these are from them could not be said.
    fn beyond(&self, count: u64, [least, largest]: [f64; 2]) -> Error {
        Error::input(format!(
            "{}: {} out of range, expected {least:.3e} to {largest:.3e}, which components hold",
            self.measurement.path().display(),
            counted(count, "sample")
        ))
        .hint("no material is like that: import it again without these texels; clusters take any value (btf cluster)")
    }

    /// Writes the arrays, then how it went.
    fn finish(
        &self,
        mean: Vec<f32>,
        space: &Space,
        projected: &Projected,
        not_finite: u64,
        context: &Context<'_>,
    ) -> Result<Report> {
        let found = context.compute(|| space.components(projected, self.components));
        let kept: f64 = found.strengths.iter().map(|strength| strength * strength).sum();
        let squared_error = (projected.energy - kept).max(0.0);
        let values = (self.tile.size.texels() * self.brdf()) as f64;
        let ratio = PEAK * PEAK * values / squared_error;
        let components = found.strengths.len();
        let coefficients: Vec<Vec<f64>> =
            found.coefficients.iter().map(|list| self.selection.by_number(list)).collect();
        self.model.write_components(&Found { mean, bases: found.bases, coefficients })?;
        let description = self.measurement.description();
        let report = Report {
            components,
            strengths: found.strengths,
            squared_error: Some(squared_error),
            not_finite,
            psnr_db: ratio.is_finite().then(|| 10.0 * ratio.log10()),
            bytes: self.model.bytes_of_components(components)?,
            tile_bytes: description.bytes_of(self.tile.size.texels()),
            texts: BTreeMap::new(),
        };
        self.model.finish(Stage::Components, &self.recipe, &report, context)?;
        Ok(report)
    }
}

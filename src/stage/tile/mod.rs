//! Measurement to tile: the whole plane, or a patch of it whose borders can be made to join.

mod choice;
mod features;

use std::path::PathBuf;

use serde_json::{Value, json};

pub use choice::Choice;
pub(crate) use features::features;

use crate::error::{Error, Result};
use crate::lattice::{Lattice, LatticeChoice};
use crate::method::tile::{Features, Patch, SearchRange, Tile, borders_join, cut, seam_visibility, search};
use crate::run::budget::OWN_BYTES;
use crate::run::recipe::Recipe;
use crate::run::{Context, Existing};
use crate::shape::Size;
use crate::stage::cluster::expect_measurement;
use crate::stage::{cluster, fit};
use crate::store::measurement::{Description, Measurement};
pub use crate::store::model::tile::TileReport as Report;
use crate::store::model::tile::{TileRecipe, cells};
use crate::store::model::{Model, Stage, measurement_name};
use crate::store::origin;
use features::lattice_of;

/// Memory of a texel of the plane: its codes under some directions, their components, and the transforms in which a
/// lattice is looked for (measured).
const TEXEL_BYTES: u64 = 290;

/// How to cut a tile.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement.
    pub measurement: PathBuf,
    /// The model to begin.
    pub model: PathBuf,
    /// What to take.
    pub choice: Choice,
    /// The lattice of a regular material, of which a tile is cut to whole cells.
    pub lattice: LatticeChoice,
    /// Seed of the search.
    pub seed: u64,
}

impl Options {
    /// As large a tile as is good for up to 256 texels a side, of whole cells where the material is regular; seed 1.
    pub fn new(measurement: impl Into<PathBuf>, model: impl Into<PathBuf>) -> Self {
        Self {
            measurement: measurement.into(),
            model: model.into(),
            choice: Choice::Auto,
            lattice: LatticeChoice::Auto,
            seed: 1,
        }
    }
}

/// A cut, ready to be made.
pub struct Plan {
    measurement: Measurement,
    model: PathBuf,
    /// Never `Auto`.
    choice: Choice,
    lattice: LatticeChoice,
    seed: u64,
    recipe: Value,
}

/// Checks that the measurement can give such a tile.
pub fn plan(options: &Options) -> Result<Plan> {
    let measurement = Measurement::open(&options.measurement)?;
    let plane = measurement.description().size;
    let choice = options.choice.resolved(plane);
    range(choice, plane, &Lattice::None, false)?;
    // Of other tiles only the report tells the lattice.
    let names_lattice =
        matches!(choice, Choice::Cut | Choice::Largest) || options.lattice != LatticeChoice::Auto;
    let recipe = TileRecipe {
        measurement: measurement.digest().to_owned(),
        tile: choice.to_string(),
        seed: options.seed,
        lattice: names_lattice.then(|| options.lattice.to_string()),
    };
    let recipe = recipe.to_value()?;
    Ok(Plan {
        measurement,
        model: options.model.clone(),
        choice,
        lattice: options.lattice,
        seed: options.seed,
        recipe,
    })
}

/// What to search for a tile of a plane, whose borders may join; `None` where the whole plane is it.
fn range(choice: Choice, plane: Size, lattice: &Lattice, joins: bool) -> Result<Option<SearchRange>> {
    match choice {
        Choice::Largest if !joins => Ok(SearchRange::nearly_all(plane, lattice)),
        Choice::Largest => Ok(None),
        Choice::Plane | Choice::None | Choice::Periodic => Ok(None),
        Choice::Sized(size) => SearchRange::of_size(size, plane).map(Some).map_err(|overlap| {
            Error::usage(format!(
                "a tile of {size} needs {overlap} more rows and columns to cut its seams in and at least 8 a side, the measurement has {plane}"
            ))
        }),
        Choice::Auto | Choice::Cut => SearchRange::for_plane(plane, lattice).map(Some).ok_or_else(|| {
            Error::usage(format!("a measurement of {plane} is too small to cut a seamless tile from"))
                .hint("use --tile plane, which takes all of it")
        }),
    }
}

/// Memory that is enough for every stage of a model of such a tile, as far as can be told before there is one.
pub fn enough_for_model(
    description: &Description,
    choice: Choice,
    clusters: &cluster::Options,
    threads: usize,
) -> u64 {
    let texels = match choice {
        Choice::Sized(size) => size.texels(),
        _ => description.size.texels(),
    };
    let clustering = cluster::enough_bytes(clusters, description, texels, threads);
    clustering.max(OWN_BYTES + memory_bytes(description).max(fit::memory_bytes(texels)))
}

/// Share of a tile's texels that are black under all directions that are looked at, as a backdrop is; none where
/// nothing is much lighter.
fn black(features: &Features, tile: &Tile) -> f64 {
    /// L* codes of a backdrop, of 255: the noise of a black one stays below.
    const BLACK: u8 = 12;
    /// An L* code that something else has.
    const LIGHT: u8 = 60;
    if features.codes.iter().all(|&code| code < LIGHT) {
        return 0.0;
    }
    let width = features.size.width;
    let is_black = |&&[row, column]: &&[u32; 2]| {
        let at = (row as usize * width + column as usize) * features.count;
        features.codes[at..at + features.count].iter().all(|&code| code <= BLACK)
    };
    tile.source.iter().filter(is_black).count() as f64 / tile.source.len().max(1) as f64
}

/// Memory that choosing a tile of a measurement takes.
fn memory_bytes(description: &Description) -> u64 {
    description.size.texels() as u64 * (TEXEL_BYTES + description.lights.len() as u64)
}

impl Plan {
    /// As [`enough_for_model`], for this tile.
    pub fn enough_for_model(&self, clusters: &cluster::Options, threads: usize) -> u64 {
        enough_for_model(self.measurement.description(), self.choice, clusters, threads)
    }

    fn memory_bytes(&self) -> u64 {
        memory_bytes(self.measurement.description())
    }

    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "tile", "model": self.model.display().to_string(), "recipe": self.recipe})
    }

    /// Whether a run would find it done. What a run would refuse, or make anew by force, is not done.
    pub fn is_done(&self) -> bool {
        Model::open(&self.model).is_ok_and(|model| model.is_done(Stage::Tile, &self.recipe).unwrap_or(false))
    }

    /// Cuts the tile, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let description = self.measurement.description();
        let plane = description.size;
        // Nothing is begun that cannot be done.
        if !self.is_done() {
            context.require(&format!("choosing a tile from a plane of {plane}"), self.memory_bytes())?;
        }
        let model = Model::create(&self.model, context)?;
        if context.existing == Existing::Keep {
            expect_measurement(&model, &self.measurement)?;
        }
        let begun = model.begin(Stage::Tile, &self.recipe, context)?;
        let name = measurement_name(&self.model);
        origin::note(&self.model, origin::MEASUREMENT, self.measurement.path(), name.to_str())?;
        let Some(_lock) = begun else {
            return model.tile_report();
        };
        let features = features(&self.measurement, context)?;
        let (tile, patch, lattice) = context.compute(|| self.tile(&features))?;
        let report = Report {
            size: [tile.size.height, tile.size.width],
            wraps: tile.wraps,
            patch,
            seam_visibility: if tile.wraps { seam_visibility(&features, &tile) } else { 1.0 },
            uncut_visibility: patch.map_or(1.0, |patch| seam_visibility(&features, &patch.uncut())),
            transfer: description.transfer,
            channels: Some(description.channels.clone()),
            samples: Some(description.sample_type.name().to_owned()),
            measurement_size: [plane.height, plane.width],
            lattice,
            cells: cells(&lattice, tile.size, tile.wraps),
            black: black(&features, &tile),
        };
        model.write_directions(description)?;
        model.write_tile(&tile)?;
        model.finish(Stage::Tile, &self.recipe, &report, context)?;
        Ok(report)
    }

    /// The tile, where it was cut, and the lattice of the plane.
    fn tile(&self, features: &Features) -> Result<(Tile, Option<Patch>, Lattice)> {
        let wraps = match self.choice {
            Choice::Plane | Choice::Largest => borders_join(features),
            choice => choice == Choice::Periodic,
        };
        let lattice = match self.lattice {
            LatticeChoice::Auto => lattice_of(features, wraps)?,
            LatticeChoice::Given(lattice) => lattice,
        };
        let Some(range) = range(self.choice, features.size, &lattice, wraps)? else {
            return Ok((Tile::whole(features.size, wraps), None, lattice));
        };
        let cut = cut(features, search(features, &range, self.seed));
        Ok((cut.tile, Some(cut.patch), lattice))
    }
}

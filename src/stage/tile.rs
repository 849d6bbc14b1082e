//! Measurement to tile: find a patch whose borders can be made to join, and cut it.

use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::shape::Size;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
use crate::texel::tile::{Features, Patch, SearchRange, Tile, cut, seam_visibility, search};

/// Views by which seams are judged.
const FEATURE_VIEWS: usize = 6;

/// Lights of each of them.
const FEATURE_LIGHTS: usize = 8;

/// What to take as the tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Search origin and size.
    Auto,
    /// Search the origin of a tile of this size.
    Sized(Size),
    /// The whole measurement, whose borders do not join.
    None,
    /// The whole measurement, which is a seamless tile already.
    Periodic,
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::None),
            "periodic" => Ok(Self::Periodic),
            _ => text
                .parse()
                .map(Self::Sized)
                .map_err(|_| format!("expected auto, none, periodic or WIDTHxHEIGHT, got {text:?}")),
        }
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::None => f.write_str("none"),
            Self::Periodic => f.write_str("periodic"),
            Self::Sized(size) => write!(f, "{size}"),
        }
    }
}

/// How to cut a tile.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement.
    pub measurement: PathBuf,
    /// The model to begin.
    pub model: PathBuf,
    /// What to take.
    pub choice: Choice,
    /// Seed of the search.
    pub seed: u64,
}

/// How a tile was cut.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Rows and columns of the tile.
    pub size: [usize; 2],
    /// Whether its borders join.
    pub wraps: bool,
    /// Where it was cut; absent where the whole measurement is the tile.
    pub patch: Option<Patch>,
    /// Step across the seams relative to that between ordinary neighbours (1: cannot be told).
    pub seam_visibility: f64,
    /// The same for the patch repeated without cutting.
    pub uncut_visibility: f64,
    /// Transfer curve of the measurement's samples.
    pub transfer: Transfer,
    /// Rows and columns of the measurement.
    pub measurement_size: [usize; 2],
}

/// A cut, ready to be made.
pub struct Plan {
    measurement: Measurement,
    model: PathBuf,
    choice: Choice,
    range: Option<SearchRange>,
    seed: u64,
    recipe: Value,
}

/// Checks that the measurement can give such a tile.
pub fn plan(options: &Options) -> Result<Plan> {
    let measurement = Measurement::open(&options.measurement)?;
    let plane = measurement.description().size;
    let range = match options.choice {
        Choice::None | Choice::Periodic => None,
        Choice::Sized(size) => Some(range_of(size, plane)?),
        Choice::Auto => Some(SearchRange::for_plane(plane).ok_or_else(|| {
            Error::usage(format!("a measurement of {plane} is too small to cut a seamless tile from"))
                .hint("use --tile none, or --tile periodic if its borders join already")
        })?),
    };
    let recipe = json!({
        "stage": "tile", "method": METHOD,
        "measurement": measurement.digest(),
        "tile": options.choice.to_string(),
        "seed": options.seed,
    });
    Ok(Plan {
        measurement,
        model: options.model.clone(),
        choice: options.choice,
        range,
        seed: options.seed,
        recipe,
    })
}

/// The search range of a tile of one size.
fn range_of(size: Size, plane: Size) -> Result<SearchRange> {
    let overlap = (size.height.min(size.width) / 8).clamp(2, 48);
    let sides = [size.height, size.width];
    let fits = size.height + overlap <= plane.height && size.width + overlap <= plane.width;
    if !fits || sides.iter().any(|&n| n < 8) {
        return Err(Error::usage(format!(
            "a tile of {size} needs {overlap} more rows and columns to cut its seams in and at least 8 a side, the measurement has {plane}"
        )));
    }
    Ok(SearchRange { least: sides, most: sides, multiple: 1, overlap })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({"stage": "tile", "model": self.model, "recipe": self.recipe})
    }

    /// Cuts the tile, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let model = Model::create(&self.model)?;
        let Some(_lock) = model.begin(Stage::Tile, &self.recipe)? else {
            return model.report(Stage::Tile);
        };
        let description = self.measurement.description();
        let plane = description.size;
        let features = features(&self.measurement, context)?;
        let (tile, patch) = context.install(|| match &self.range {
            None => (Tile::whole(plane, self.choice == Choice::Periodic), None),
            Some(range) => {
                let cut = cut(&features, search(&features, range, self.seed));
                (cut.tile, Some(cut.patch))
            }
        });
        let report = Report {
            size: [tile.size.height, tile.size.width],
            wraps: tile.wraps,
            patch,
            seam_visibility: if tile.wraps { seam_visibility(&features, &tile) } else { 1.0 },
            uncut_visibility: patch.map_or(1.0, |patch| seam_visibility(&features, &patch.uncut())),
            transfer: description.transfer,
            measurement_size: [plane.height, plane.width],
        };
        model.write_directions(description)?;
        model.write_tile(&tile)?;
        model.finish(Stage::Tile, &self.recipe, &report)?;
        Ok(report)
    }
}

/// L* codes of the plane under a spread of direction pairs.
pub(crate) fn features(measurement: &Measurement, context: &Context<'_>) -> Result<Features> {
    let description = measurement.description();
    let spread = |count: usize, all: usize| -> Vec<usize> {
        let count = count.min(all);
        (0..count).map(|n| n * all / count).collect()
    };
    let views = spread(FEATURE_VIEWS, description.views.len());
    let lights = spread(FEATURE_LIGHTS, description.lights.len());
    let count = views.len() * lights.len();
    let mut codes = vec![0; description.size.texels() * count];
    context.progress.begin("tile", views.len() as u64, Counted::Items("views"));
    for (number, &view) in views.iter().enumerate() {
        context.check_stop()?;
        let luminance = measurement.read_luminance(view, description.size.window())?;
        for (texel, to) in luminance.chunks_exact(description.lights.len()).zip(codes.chunks_exact_mut(count))
        {
            for (to, &light) in to[number * lights.len()..].iter_mut().zip(&lights) {
                *to = texel[light];
            }
        }
        context.progress.advance(1);
    }
    context.progress.end();
    Ok(Features { size: description.size, count, codes })
}

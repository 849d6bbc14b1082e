//! The appearance of a model store: the arrays under `appearance/` and what the attributes say of them.
//!
//! | array | shape | type | |
//! | --- | --- | --- | --- |
//! | `appearance/features` | [cluster, feature] | i8 | principal components of the centres |
//! | `appearance/level_<k>/basis` | [input, dim] | i16 | weights of the 3 x 3 surroundings, 2^k texels apart |
//! | `appearance/level_<k>/offset` | [dim] | i32 | taken away before the shift |

use serde::{Deserialize, Serialize};
use serde_json::Map;

use super::{Model, Stage};
use crate::error::{Error, Result};
use crate::lattice::{Lattice, LatticeChoice, WaveCounts};
use crate::method::coherent::{Appearance, Basis, FEATURES, INPUTS, LEVELS_MOST, dims_of};
use crate::run::recipe::Recipe;
use crate::shape::{Size, Window};
use crate::zarr::{Layout, Store};

/// Largest peak of an autocorrelation: 1, and what is rounded.
const LARGEST_PEAK: f64 = 1.001;

/// What an appearance depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AppearanceRecipe {
    /// Digest of the clusters.
    pub cluster: String,
    /// The lattice that was asked for, as on the command line.
    pub lattice: String,
}

impl Recipe for AppearanceRecipe {
    const STAGE: &'static str = Stage::Appearance.name();
}

/// What the attributes of stage `appearance` say, beside its arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AppearanceReport {
    /// The part of the tile that is the exemplar: first row, first column, rows, columns.
    pub exemplar: [usize; 4],
    /// Whether the exemplar's borders join.
    pub wraps: bool,
    /// Cycles of a regular material down the exemplar's height and across its width; a row for each direction.
    pub lattice: Vec<[i32; 2]>,
    /// The lattice that was found or given, in texels as `dy,dx;dy,dx`, whether or not the exemplar holds whole cells.
    pub found: String,
    /// Highest peak of the autocorrelation of the features, at least 3 texels from 0; of 1.
    pub strongest_peak: f64,
    /// The levels, the finest first.
    pub levels: Vec<LevelReport>,
}

/// One level of an [`AppearanceReport`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelReport {
    /// Texels between neighbours of the level.
    pub spacing: usize,
    /// Numbers of a texel's appearance.
    pub dims: usize,
    /// Binary places of the basis and the offset.
    pub shift: u32,
    /// Passes of correction.
    pub passes: usize,
    /// What a site one side of the exemplar away costs that comes from the same row or column.
    pub repetition: i32,
}

impl AppearanceReport {
    /// The report of an appearance.
    pub fn new(appearance: &Appearance, found: &Lattice, strongest_peak: f64) -> Self {
        let Window { y, x, size } = appearance.exemplar;
        let levels = appearance.levels.iter().enumerate();
        let level = |(number, basis): (usize, &Basis)| LevelReport {
            spacing: 1 << number,
            dims: basis.dims,
            shift: basis.shift,
            passes: basis.passes,
            repetition: basis.repetition,
        };
        Self {
            exemplar: [y, x, size.height, size.width],
            wraps: appearance.wraps,
            lattice: appearance.lattice.0.clone(),
            found: found.to_string(),
            strongest_peak,
            levels: levels.map(level).collect(),
        }
    }
}

/// The arrays of an appearance of so many clusters.
pub(super) fn arrays(report: &AppearanceReport, clusters: usize) -> Vec<(String, Layout<'static>)> {
    let levels = report.levels.len();
    let of_level = |level: usize| {
        let dims = dims_of(level, levels);
        [(basis_name(level), basis_layout(dims)), (offset_name(level), offset_layout(dims))]
    };
    let features = ("appearance/features".to_owned(), features_layout(clusters));
    std::iter::once(features).chain((0..levels).flat_map(of_level)).collect()
}

fn basis_name(level: usize) -> String {
    format!("appearance/level_{level}/basis")
}

fn offset_name(level: usize) -> String {
    format!("appearance/level_{level}/offset")
}

fn features_layout(clusters: usize) -> Layout<'static> {
    Layout::small::<i8>(&["cluster", "feature"], &[clusters, FEATURES])
}

fn basis_layout(dims: usize) -> Layout<'static> {
    Layout::small::<i16>(&["input", "dim"], &[INPUTS, dims])
}

fn offset_layout(dims: usize) -> Layout<'static> {
    Layout::small::<i32>(&["dim"], &[dims])
}

impl Model {
    /// Writes how the exemplar looks.
    pub(crate) fn write_appearance(&self, appearance: &Appearance) -> Result<()> {
        write(&self.store, appearance)
    }

    /// How the appearance was worked out.
    ///
    /// # Errors
    /// Where it has not been run, or what it says is impossible.
    pub fn appearance_report(&self) -> Result<AppearanceReport> {
        let report: AppearanceReport = self.report(Stage::Appearance)?;
        let recipe: AppearanceRecipe = self.recipe(Stage::Appearance)?;
        let what = if report.found.parse::<Lattice>().is_err() {
            format!("found: got {:?}, no lattice", report.found)
        } else if recipe.lattice.parse::<LatticeChoice>().is_err() {
            format!("lattice: the recipe says {:?}, no lattice", recipe.lattice)
        } else if !report.strongest_peak.is_finite() || report.strongest_peak.abs() > LARGEST_PEAK {
            format!("strongest_peak: got {}, expected at most {LARGEST_PEAK}", report.strongest_peak)
        } else {
            return Ok(report);
        };
        Err(self.damaged_report(Stage::Appearance, &what))
    }

    /// How the exemplar looks.
    pub fn appearance(&self) -> Result<Appearance> {
        let report = self.appearance_report()?;
        let tile = self.tile_report()?;
        let clusters = self.clusters()?;
        for (name, layout) in arrays(&report, clusters) {
            self.open_array(Stage::Appearance, &name, &layout)?;
        }
        read(&self.store, &report, tile.size(), tile.wraps, clusters)
    }
}

fn write(store: &Store, appearance: &Appearance) -> Result<()> {
    store.write_group("appearance", Map::new())?;
    let layout = features_layout(appearance.features.len());
    store.write("appearance/features", &layout, appearance.features.as_flattened())?;
    for (number, basis) in appearance.levels.iter().enumerate() {
        store.write_group(&format!("appearance/level_{number}"), Map::new())?;
        store.write(&basis_name(number), &basis_layout(basis.dims), &basis.weights)?;
        store.write(&offset_name(number), &offset_layout(basis.dims), &basis.offset)?;
    }
    Ok(())
}

/// Reads the appearance of a model of so many clusters, whose tile wraps or does not.
fn read(
    store: &Store,
    report: &AppearanceReport,
    tile: Size,
    wraps: bool,
    clusters: usize,
) -> Result<Appearance> {
    let refused = |what: String| {
        Error::input(format!("{}: appearance: {what}", store.path().display()))
            .hint("run `btf appearance` on it again")
    };
    if report.levels.len() > LEVELS_MOST {
        return Err(refused(format!("got {} levels, expected at most {LEVELS_MOST}", report.levels.len())));
    }
    for (number, level) in report.levels.iter().enumerate() {
        let expected = (1 << number, dims_of(number, report.levels.len()));
        if (level.spacing, level.dims) != expected {
            let (spacing, dims) = (level.spacing, level.dims);
            return Err(refused(format!(
                "level {number}: got a spacing of {spacing} and {dims} dimensions, expected {} and {}",
                expected.0, expected.1
            )));
        }
    }
    let [y, x, height, width] = report.exemplar;
    let exemplar = Window { y, x, size: Size::new(height, width) };
    if report.wraps != wraps || (wraps && exemplar != tile.window()) {
        return Err(refused(format!(
            "got the exemplar {exemplar}, wraps {}, of a tile of {tile} with wraps {wraps}",
            report.wraps
        )));
    }
    let features = store.read_array::<i8>("appearance/features", &features_layout(clusters))?;
    let (features, _) = features.as_chunks::<FEATURES>();
    let level = |(number, level): (usize, &LevelReport)| {
        let dims = dims_of(number, report.levels.len());
        let weights = store.read_array::<i16>(&basis_name(number), &basis_layout(dims))?;
        let offset = store.read_array::<i32>(&offset_name(number), &offset_layout(dims))?;
        let LevelReport { shift, passes, repetition, .. } = *level;
        Ok(Basis { dims, weights, offset, shift, passes, repetition })
    };
    let appearance = Appearance {
        exemplar,
        wraps: report.wraps,
        features: features.to_vec(),
        levels: report.levels.iter().enumerate().map(level).collect::<Result<_>>()?,
        lattice: WaveCounts(report.lattice.clone()),
    };
    let fits = |error: Error| error.context(store.path().display()).hint("run `btf appearance` on it again");
    appearance.check(tile).map_err(fits)?;
    Ok(appearance)
}

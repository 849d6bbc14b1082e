//! The appearance of a model store: the arrays under `appearance/` and what the attributes say of them.
//!
//! | array | shape | type | |
//! | --- | --- | --- | --- |
//! | `appearance/features` | [cluster, feature] | i8 | principal components of the centres |
//! | `appearance/level_<k>/basis` | [input, dim] | i16 | weights of the 3 x 3 surroundings, 2^k texels apart |
//! | `appearance/level_<k>/offset` | [dim] | i32 | taken away before the shift |

use serde::{Deserialize, Serialize};
use serde_json::Map;

use crate::coherent::{Appearance, Basis, FEATURES, INPUTS, dims_of};
use crate::error::{Error, Result};
use crate::lattice::{Lattice, WaveCounts};
use crate::shape::{Size, Window};
use crate::store::{Layout, Store};

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

/// Names of the arrays of some levels.
pub(super) fn arrays(levels: usize) -> Vec<String> {
    let of_level = |level: usize| ["basis", "offset"].map(|name| format!("appearance/level_{level}/{name}"));
    std::iter::once("appearance/features".to_owned()).chain((0..levels).flat_map(of_level)).collect()
}

pub(super) fn write(store: &Store, appearance: &Appearance) -> Result<()> {
    store.write_group("appearance", Map::new())?;
    let layout = Layout::small::<i8>(&["cluster", "feature"], &[appearance.features.len(), FEATURES]);
    store.write("appearance/features", &layout, appearance.features.as_flattened())?;
    for (number, basis) in appearance.levels.iter().enumerate() {
        let group = format!("appearance/level_{number}");
        store.write_group(&group, Map::new())?;
        let layout = Layout::small::<i16>(&["input", "dim"], &[INPUTS, basis.dims]);
        store.write(&format!("{group}/basis"), &layout, &basis.weights)?;
        let layout = Layout::small::<i32>(&["dim"], &[basis.dims]);
        store.write(&format!("{group}/offset"), &layout, &basis.offset)?;
    }
    Ok(())
}

/// Reads the appearance of a model of so many clusters.
pub(super) fn read(
    store: &Store,
    report: &AppearanceReport,
    tile: Size,
    clusters: usize,
) -> Result<Appearance> {
    let [y, x, height, width] = report.exemplar;
    let (_, features) = store.read::<i8>("appearance/features", &[clusters, FEATURES])?;
    let (features, _) = features.as_chunks::<FEATURES>();
    let level = |(number, level): (usize, &LevelReport)| {
        let dims = dims_of(number, report.levels.len());
        let group = format!("appearance/level_{number}");
        let (_, weights) = store.read::<i16>(&format!("{group}/basis"), &[INPUTS, dims])?;
        let (_, offset) = store.read::<i32>(&format!("{group}/offset"), &[dims])?;
        let LevelReport { shift, passes, repetition, .. } = *level;
        Ok(Basis { dims, weights, offset, shift, passes, repetition })
    };
    let appearance = Appearance {
        exemplar: Window { y, x, size: Size::new(height, width) },
        wraps: report.wraps,
        features: features.to_vec(),
        levels: report.levels.iter().enumerate().map(level).collect::<Result<_>>()?,
        lattice: WaveCounts(report.lattice.clone()),
    };
    let fits = |error: Error| error.context(store.path().display()).hint("run `btf appearance` on it again");
    appearance.check(tile).map_err(fits)?;
    Ok(appearance)
}

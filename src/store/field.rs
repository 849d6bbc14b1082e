//! The random field of a model store: the arrays under `mrf/` and what the attributes tell of them.
//!
//! | array | shape | |
//! | --- | --- | --- |
//! | `mrf/mean` | [channel] | of the data |
//! | `mrf/transform` | [component, channel] | T of (15), 2D only |
//! | `mrf/covariance` | [channel, channel] | of a synthesis |
//! | `mrf/gain` | [level] | what each level is multiplied by |
//! | `mrf/marginals` | [z1, z2, 2] | (n_x, n_y) of standardised values, where matched |
//! | `mrf/level_<k>/gamma`, `sigma`, `neighbourhood` | | (9) or (18) |

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use serde_json::{Map, json};

use crate::error::{Error, Result};
use crate::mrf::car::Prior;
use crate::mrf::marginals::{Marginals, Matching, NODES};
use crate::mrf::{Coordinates, Kind, Level, Model, Surface};
use crate::store::{Layout, Store};

/// Farthest site that a stored neighbourhood may have: rows as far back are kept in memory.
const FARTHEST_SITE: u32 = 64;

/// What the attributes of stage `fit` tell of the field, beside its arrays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FieldReport {
    /// `3d` or `2d`.
    pub mrf: Kind,
    /// What the channels are.
    pub field: Coordinates,
    /// What of the tile's distribution is given to a synthesis.
    pub marginals: Option<Matching>,
    /// Root mean square difference of the autocovariance of a synthesis from the data's, in units of the channels'
    /// variances.
    pub autocovariance_error: f64,
    /// Level 0 is the finest.
    pub levels: Vec<LevelReport>,
}

/// One level of a [`FieldReport`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LevelReport {
    /// Height and width of the level that was fitted.
    pub size: [usize; 2],
    /// Number of sites of the neighbourhood.
    pub eta: usize,
    /// What the level is multiplied by.
    pub gain: f64,
    /// Log evidence of that neighbourhood.
    pub log_evidence: f64,
    /// Spectral radius of the recursion; below 1 is stable.
    pub radius: f64,
    /// What had to be done to make it stable.
    pub note: Option<String>,
    /// Diagonal of V_XX(0).
    pub prior_v_xx: f64,
    /// Diagonal of V_YY(0).
    pub prior_v_yy: f64,
    /// beta(0).
    pub prior_beta: f64,
    /// Degrees of freedom of the inverse Wishart prior, for the evidence.
    pub prior_degrees: f64,
}

impl FieldReport {
    /// The report of a fitted surface.
    pub fn new(surface: &Surface) -> Self {
        let level = |level: &Level| LevelReport {
            size: level.size,
            eta: level.neighbourhood.len(),
            gain: level.gain,
            log_evidence: level.log_evidence,
            radius: level.radius,
            note: level.note.clone(),
            prior_v_xx: level.prior.xx,
            prior_v_yy: level.prior.yy,
            prior_beta: level.prior.beta,
            prior_degrees: level.prior.degrees,
        };
        Self {
            mrf: surface.field.kind,
            field: surface.coordinates,
            marginals: surface.marginals.as_ref().map(Marginals::matching),
            autocovariance_error: surface.field.autocovariance_error,
            levels: surface.field.levels.iter().map(level).collect(),
        }
    }
}

/// Names of the arrays of some levels.
pub(super) fn arrays(levels: usize) -> Vec<String> {
    let of_level =
        |level: usize| ["gamma", "sigma", "neighbourhood"].map(|name| format!("mrf/level_{level}/{name}"));
    std::iter::once("mrf/mean".to_owned()).chain((0..levels).flat_map(of_level)).collect()
}

/// Writes a surface's model under `mrf/`.
pub(super) fn write(store: &Store, surface: &Surface) -> Result<()> {
    let field = &surface.field;
    store.write_group("mrf", Map::new())?;
    let channels = field.channels();
    store.write("mrf/mean", &Layout::small::<f64>(&["channel"], &[channels]), &field.mean)?;
    if let Some(transform) = &field.transform {
        let layout = Layout::small::<f64>(&["component", "channel"], &[channels, channels]);
        store.write("mrf/transform", &layout, &rows(transform))?;
    }
    let square = Layout::small::<f64>(&["channel", "channel_other"], &[channels, channels]);
    store.write("mrf/covariance", &square, &rows(&field.covariance))?;
    let gains: Vec<f64> = field.levels.iter().map(|level| level.gain).collect();
    store.write("mrf/gain", &Layout::small::<f64>(&["level"], &[gains.len()]), &gains)?;
    if let Some(marginals) = &surface.marginals {
        let mut layout = Layout::small::<f32>(&["z1", "z2", "xy"], &[NODES, NODES, 2]);
        layout.attributes.insert("z".to_owned(), json!("-4 to 4 in steps of 1/16"));
        let table: Vec<f32> = marginals.table().iter().flatten().copied().collect();
        store.write("mrf/marginals", &layout, &table)?;
    }
    for (number, level) in field.levels.iter().enumerate() {
        let group = format!("mrf/level_{number}");
        store.write_group(&group, Map::new())?;
        let layout =
            Layout::small::<f64>(&["channel", "coefficient"], &[level.gamma.nrows(), level.gamma.ncols()]);
        store.write(&format!("{group}/gamma"), &layout, &rows(&level.gamma))?;
        let layout = match field.kind {
            Kind::Car3d => Layout::small::<f64>(&["channel", "channel_other"], &[channels, channels]),
            Kind::Car2d => Layout::small::<f64>(&["channel"], &[channels]),
        };
        store.write(&format!("{group}/sigma"), &layout, &rows(&level.sigma))?;
        let sites: Vec<i32> = level.neighbourhood.iter().flatten().copied().collect();
        let layout = Layout::small::<i32>(&["site", "dy_dx"], &[level.neighbourhood.len(), 2]);
        store.write(&format!("{group}/neighbourhood"), &layout, &sites)?;
    }
    Ok(())
}

/// Reads a surface's model; `report` is that of stage `fit`.
pub(super) fn read(store: &Store, report: &FieldReport) -> Result<Surface> {
    let (kind, coordinates) = (report.mrf, report.field);
    let channels = coordinates.channels();
    let square = |name: &str| -> Result<DMatrix<f64>> {
        let (_, values) = store.read::<f64>(name, &[channels, channels])?;
        Ok(DMatrix::from_row_slice(channels, channels, &values))
    };
    let (_, mean) = store.read::<f64>("mrf/mean", &[channels])?;
    let transform = (kind == Kind::Car2d).then(|| square("mrf/transform")).transpose()?;
    let covariance = square("mrf/covariance")?;
    let (_, gains) = store.read::<f64>("mrf/gain", &[report.levels.len()])?;
    let levels = report
        .levels
        .iter()
        .zip(gains)
        .enumerate()
        .map(|(number, (report, gain))| read_level(store, number, gain, kind, channels, report))
        .collect::<Result<Vec<Level>>>()?;
    let autocovariance_error = report.autocovariance_error;
    let field = Model { kind, mean, transform, levels, covariance, autocovariance_error };
    field.check().map_err(|error| error.context(store.path().display()))?;
    let read_marginals = |matching| {
        let (_, values) = store.read::<f32>("mrf/marginals", &[NODES, NODES, 2])?;
        let table = values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        Marginals::from_table(matching, table, &field.mean, &field.covariance)
            .map_err(|error| error.context(format!("{}: mrf/marginals", store.path().display())))
    };
    let marginals = report.marginals.map(read_marginals).transpose()?;
    Ok(Surface { coordinates, field, marginals })
}

fn read_level(
    store: &Store,
    number: usize,
    gain: f64,
    kind: Kind,
    channels: usize,
    report: &LevelReport,
) -> Result<Level> {
    let group = format!("mrf/level_{number}");
    let (_, sites) = store.read::<i32>(&format!("{group}/neighbourhood"), &[0, 2])?;
    let neighbourhood: Vec<[i32; 2]> = sites.chunks_exact(2).map(|s| [s[0], s[1]]).collect();
    let near = |[dy, dx]: &[i32; 2]| dy.unsigned_abs().max(dx.unsigned_abs()) <= FARTHEST_SITE;
    if neighbourhood.is_empty() || !neighbourhood.iter().all(near) {
        return Err(Error::input(format!(
            "{}: {group}/neighbourhood: expected at least one site, none farther than {FARTHEST_SITE}",
            store.path().display()
        )));
    }
    let (columns, sigma_shape) = match kind {
        Kind::Car3d => (channels * neighbourhood.len(), vec![channels, channels]),
        Kind::Car2d => (neighbourhood.len(), vec![channels]),
    };
    let (_, gamma) = store.read::<f64>(&format!("{group}/gamma"), &[channels, columns])?;
    let (_, sigma) = store.read::<f64>(&format!("{group}/sigma"), &sigma_shape)?;
    Ok(Level {
        neighbourhood,
        gamma: DMatrix::from_row_slice(channels, columns, &gamma),
        sigma: DMatrix::from_row_slice(channels, sigma.len() / channels, &sigma),
        gain,
        prior: Prior {
            xx: report.prior_v_xx,
            yy: report.prior_v_yy,
            beta: report.prior_beta,
            degrees: report.prior_degrees,
        },
        log_evidence: report.log_evidence,
        radius: report.radius,
        size: report.size,
        note: report.note.clone(),
    })
}

/// Elements of a matrix row by row.
fn rows(matrix: &DMatrix<f64>) -> Vec<f64> {
    matrix.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>()).collect()
}

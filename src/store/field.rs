//! The random field of a model store: the arrays under `mrf/` and what the attributes tell of them.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use serde_json::Map;

use crate::error::{Error, Result};
use crate::mrf::car::Prior;
use crate::mrf::{Kind, Level, Model};
use crate::store::{Layout, Store};

/// Channels of a field of normals.
const NORMAL_COMPONENTS: usize = 3;

/// Farthest site that a stored neighbourhood may have: rows as far back are kept in memory.
const FARTHEST_SITE: u32 = 64;

/// What the attributes of stage `fit` tell of the field, beside its arrays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FieldReport {
    /// `3d` or `2d`.
    pub mrf: String,
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
    /// The report of a fitted field.
    pub fn new(field: &Model) -> Self {
        let level = |level: &Level| LevelReport {
            size: level.size,
            eta: level.neighbourhood.len(),
            log_evidence: level.log_evidence,
            radius: level.radius,
            note: level.note.clone(),
            prior_v_xx: level.prior.xx,
            prior_v_yy: level.prior.yy,
            prior_beta: level.prior.beta,
            prior_degrees: level.prior.degrees,
        };
        let mrf = if field.kind == Kind::Car2d { "2d" } else { "3d" };
        Self { mrf: mrf.to_owned(), levels: field.levels.iter().map(level).collect() }
    }

    fn kind(&self) -> Kind {
        if self.mrf == "2d" { Kind::Car2d } else { Kind::Car3d }
    }
}

/// Writes a field model under `mrf/`.
pub(super) fn write(store: &Store, field: &Model) -> Result<()> {
    store.write_group("mrf", Map::new())?;
    let channels = field.mean.len();
    store.write("mrf/mean", &Layout::small::<f64>(&["channel"], &[channels]), &field.mean)?;
    if let Some(transform) = &field.transform {
        let layout = Layout::small::<f64>(&["component", "channel"], &[channels, channels]);
        store.write("mrf/transform", &layout, &rows(transform))?;
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

/// Reads a field model; `report` is that of stage `fit`.
pub(super) fn read(store: &Store, report: &FieldReport) -> Result<Model> {
    let (_, mean) = store.read::<f64>("mrf/mean", &[0])?;
    let channels = mean.len();
    if channels != NORMAL_COMPONENTS {
        return Err(Error::input(format!(
            "{}: mrf/mean: got {channels} channels, expected {NORMAL_COMPONENTS}",
            store.path().display()
        )));
    }
    let kind = report.kind();
    let transform = match kind {
        Kind::Car3d => None,
        Kind::Car2d => {
            let (_, values) = store.read::<f64>("mrf/transform", &[channels, channels])?;
            Some(DMatrix::from_row_slice(channels, channels, &values))
        }
    };
    let levels = report
        .levels
        .iter()
        .enumerate()
        .map(|(number, report)| read_level(store, number, kind, channels, report))
        .collect::<Result<Vec<Level>>>()?;
    let field = Model { kind, mean, transform, levels };
    field.check().map_err(|error| error.context(store.path().display()))?;
    Ok(field)
}

fn read_level(
    store: &Store,
    number: usize,
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

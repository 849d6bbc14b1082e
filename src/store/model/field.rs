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

use super::{Model, Stage};
use crate::error::{Error, Result};
use crate::method::field::fit::car::Prior;
use crate::method::field::marginals::{Marginals, Matching, NODES};
use crate::method::field::pyramid;
use crate::method::field::{self, CarKind, Coordinates, Gains, Level, Surface};
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::words::counted;
use crate::zarr::{Layout, Store};

/// Farthest site that a stored neighbourhood may have: rows as far back are kept in memory.
const FARTHEST_SITE: u32 = 64;

/// Most sites of a stored neighbourhood, and most levels: more than any fit makes.
const MOST_SITES: usize = 4096;
const MOST_LEVELS: usize = 32;

/// What a fit depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FitRecipe {
    /// Digest of the normals.
    pub normals: String,
    /// `3d` or `2d`.
    pub mrf: CarKind,
    /// Levels of the pyramid, where given.
    pub levels: Option<usize>,
    /// What the channels are.
    pub field: Coordinates,
    /// How loud each level is.
    pub gains: Gains,
    /// What of the tile's distribution is given to a synthesis.
    pub marginals: Option<Matching>,
}

impl Recipe for FitRecipe {
    const STAGE: &'static str = Stage::Fit.name();
}

/// What the attributes of stage `fit` tell of the field, beside its arrays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FieldReport {
    /// `3d` or `2d`.
    pub mrf: CarKind,
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

impl LevelReport {
    fn check(&self, size: [usize; 2]) -> std::result::Result<(), String> {
        if !(1..=MOST_SITES).contains(&self.eta) {
            return Err(format!("got {} sites, expected 1 to {MOST_SITES}", self.eta));
        }
        if self.size != size {
            return Err(format!("size: got {:?}, expected {size:?}, that of the tile's pyramid", self.size));
        }
        let numbers = [
            ("gain", self.gain, 0.0),
            ("log_evidence", self.log_evidence, f64::NEG_INFINITY),
            ("radius", self.radius, 0.0),
            ("prior_v_xx", self.prior_v_xx, 0.0),
            ("prior_v_yy", self.prior_v_yy, 0.0),
            ("prior_beta", self.prior_beta, 0.0),
            ("prior_degrees", self.prior_degrees, 0.0),
        ];
        match numbers.into_iter().find(|(_, found, least)| !(found.is_finite() && found >= least)) {
            None => Ok(()),
            Some((name, found, least)) => {
                Err(format!("{name}: got {found}, expected a number from {least} on"))
            }
        }
    }
}

impl FieldReport {
    /// Checks the report against the recipe, which decides what is fitted.
    fn check(&self, recipe: &FitRecipe, tile: Size) -> std::result::Result<(), String> {
        for (name, found, expected) in [
            ("mrf", json!(self.mrf), json!(recipe.mrf)),
            ("field", json!(self.field), json!(recipe.field)),
            ("marginals", json!(self.marginals), json!(recipe.marginals)),
        ] {
            if found != expected {
                return Err(format!("{name}: got {found}, the recipe says {expected}"));
            }
        }
        let levels = recipe.levels;
        if levels.is_some_and(|levels| levels != self.levels.len())
            || !(1..=MOST_LEVELS).contains(&self.levels.len())
        {
            return Err(format!("got {}, the recipe says {levels:?}", counted(self.levels.len(), "level")));
        }
        if !(self.autocovariance_error.is_finite() && self.autocovariance_error >= 0.0) {
            return Err(format!("autocovariance_error: got {}", self.autocovariance_error));
        }
        let sizes = pyramid::sizes(tile.height, tile.width, self.levels.len());
        for (k, (level, expected)) in self.levels.iter().zip(sizes).enumerate() {
            level.check(expected).map_err(|what| format!("level {k}: {what}"))?;
        }
        Ok(())
    }

    fn channels(&self) -> usize {
        self.field.channels()
    }
}

/// The arrays of a field.
pub(super) fn arrays(report: &FieldReport) -> Vec<(String, Layout<'static>)> {
    let channels = report.channels();
    let mut arrays = vec![
        ("mrf/mean".to_owned(), mean_layout(channels)),
        ("mrf/covariance".to_owned(), square_layout(channels)),
        ("mrf/gain".to_owned(), gain_layout(report.levels.len())),
    ];
    if report.mrf == CarKind::Car2d {
        arrays.push(("mrf/transform".to_owned(), transform_layout(channels)));
    }
    if report.marginals.is_some() {
        arrays.push(("mrf/marginals".to_owned(), marginals_layout()));
    }
    for (number, level) in report.levels.iter().enumerate() {
        let group = level_group(number);
        arrays.push((format!("{group}/gamma"), gamma_layout(report.mrf, channels, level.eta)));
        arrays.push((format!("{group}/sigma"), sigma_layout(report.mrf, channels)));
        arrays.push((format!("{group}/neighbourhood"), neighbourhood_layout(level.eta)));
    }
    arrays
}

fn level_group(number: usize) -> String {
    format!("mrf/level_{number}")
}

// The channels of the field are not those of the samples, so they have another name.

fn mean_layout(channels: usize) -> Layout<'static> {
    Layout::small::<f64>(&["field_channel"], &[channels])
}

fn square_layout(channels: usize) -> Layout<'static> {
    Layout::small::<f64>(&["field_channel", "field_channel_other"], &[channels, channels])
}

fn transform_layout(channels: usize) -> Layout<'static> {
    Layout::small::<f64>(&["component", "field_channel"], &[channels, channels])
}

fn gain_layout(levels: usize) -> Layout<'static> {
    Layout::small::<f64>(&["level"], &[levels])
}

fn marginals_layout() -> Layout<'static> {
    Layout::small::<f32>(&["z1", "z2", "xy"], &[NODES, NODES, 2]).with("z", "-4 to 4 in steps of 1/16")
}

fn gamma_layout(kind: CarKind, channels: usize, sites: usize) -> Layout<'static> {
    let columns = if kind == CarKind::Car3d { channels * sites } else { sites };
    Layout::small::<f64>(&["field_channel", "coefficient"], &[channels, columns])
}

fn sigma_layout(kind: CarKind, channels: usize) -> Layout<'static> {
    if kind == CarKind::Car3d { square_layout(channels) } else { mean_layout(channels) }
}

fn neighbourhood_layout(sites: usize) -> Layout<'static> {
    Layout::small::<i32>(&["site", "dy_dx"], &[sites, 2])
}

impl Model {
    /// Writes the random field model under `mrf/`.
    pub(crate) fn write_surface(&self, surface: &Surface) -> Result<()> {
        write(&self.store, surface)
    }

    /// How the fit went.
    ///
    /// # Errors
    /// Where it has not been run, or what it says is impossible, or not by its recipe.
    pub fn field_report(&self) -> Result<FieldReport> {
        let report: FieldReport = self.report(Stage::Fit)?;
        let tile = self.tile_report()?.size();
        report
            .check(&self.recipe(Stage::Fit)?, tile)
            .map_err(|what| self.damaged_report(Stage::Fit, &what))?;
        Ok(report)
    }

    /// The random field model.
    pub fn surface(&self) -> Result<Surface> {
        let report = self.field_report()?;
        for (name, layout) in arrays(&report) {
            self.open_array(Stage::Fit, &name, &layout)?;
        }
        read(&self.store, &report)
    }
}

/// Writes a surface's model under `mrf/`.
fn write(store: &Store, surface: &Surface) -> Result<()> {
    let field = &surface.field;
    store.write_group("mrf", Map::new())?;
    let channels = field.channels();
    store.write("mrf/mean", &mean_layout(channels), &field.mean)?;
    if let Some(transform) = &field.transform {
        store.write("mrf/transform", &transform_layout(channels), &rows(transform))?;
    }
    store.write("mrf/covariance", &square_layout(channels), &rows(&field.covariance))?;
    let gains: Vec<f64> = field.levels.iter().map(|level| level.gain).collect();
    store.write("mrf/gain", &gain_layout(gains.len()), &gains)?;
    if let Some(marginals) = &surface.marginals {
        let table: Vec<f32> = marginals.table().iter().flatten().copied().collect();
        store.write("mrf/marginals", &marginals_layout(), &table)?;
    }
    for (number, level) in field.levels.iter().enumerate() {
        let group = level_group(number);
        let sites = level.neighbourhood.len();
        store.write_group(&group, Map::new())?;
        store.write(
            &format!("{group}/gamma"),
            &gamma_layout(field.kind, channels, sites),
            &rows(&level.gamma),
        )?;
        store.write(&format!("{group}/sigma"), &sigma_layout(field.kind, channels), &rows(&level.sigma))?;
        let neighbours = level.neighbourhood.as_flattened();
        store.write(&format!("{group}/neighbourhood"), &neighbourhood_layout(sites), neighbours)?;
    }
    Ok(())
}

/// Reads a surface's model; `report` is that of stage `fit`.
fn read(store: &Store, report: &FieldReport) -> Result<Surface> {
    let (kind, coordinates) = (report.mrf, report.field);
    let channels = report.channels();
    let square = |name: &str, layout: &Layout<'_>| -> Result<DMatrix<f64>> {
        Ok(DMatrix::from_row_slice(channels, channels, &store.read_array::<f64>(name, layout)?))
    };
    let mean = store.read_array::<f64>("mrf/mean", &mean_layout(channels))?;
    let transform =
        (kind == CarKind::Car2d).then(|| square("mrf/transform", &transform_layout(channels))).transpose()?;
    let covariance = square("mrf/covariance", &square_layout(channels))?;
    let gains = store.read_array::<f64>("mrf/gain", &gain_layout(report.levels.len()))?;
    let levels = report
        .levels
        .iter()
        .zip(gains)
        .enumerate()
        .map(|(number, (level, gain))| read_level(store, number, gain, kind, channels, level))
        .collect::<Result<Vec<Level>>>()?;
    let autocovariance_error = report.autocovariance_error;
    let field = field::Model { kind, mean, transform, levels, covariance, autocovariance_error };
    field.check().map_err(|error| {
        error
            .context(store.path().display())
            .hint("the field is damaged: make the model anew, under another name")
    })?;
    if let Some(k) = report.levels.iter().zip(&field.levels).position(|(told, level)| told.gain != level.gain)
    {
        let (found, expected) = (report.levels[k].gain, field.levels[k].gain);
        return Err(Error::input(format!(
            "{}: report of fit: level {k}: gain: got {found}, mrf/gain has {expected}",
            store.path().display()
        ))
        .hint("make the model anew, under another name"));
    }
    let read_marginals = |matching| {
        let values = store.read_array::<f32>("mrf/marginals", &marginals_layout())?;
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
    kind: CarKind,
    channels: usize,
    report: &LevelReport,
) -> Result<Level> {
    let group = level_group(number);
    let sites =
        store.read_array::<i32>(&format!("{group}/neighbourhood"), &neighbourhood_layout(report.eta))?;
    let neighbourhood: Vec<[i32; 2]> = sites.as_chunks::<2>().0.to_vec();
    let near = |[dy, dx]: &[i32; 2]| dy.unsigned_abs().max(dx.unsigned_abs()) <= FARTHEST_SITE;
    if !neighbourhood.iter().all(near) {
        return Err(Error::input(format!(
            "{}: {group}/neighbourhood: expected no site farther than {FARTHEST_SITE}",
            store.path().display()
        )));
    }
    let gamma_layout = gamma_layout(kind, channels, report.eta);
    let columns = gamma_layout.shape[1] as usize;
    let gamma = store.read_array::<f64>(&format!("{group}/gamma"), &gamma_layout)?;
    let sigma = store.read_array::<f64>(&format!("{group}/sigma"), &sigma_layout(kind, channels))?;
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

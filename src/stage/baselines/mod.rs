//! A tile by other representations, at their bytes and ours: what each keeps of the measurement.
//!
//! | name | what it is | stands for |
//! | --- | --- | --- |
//! | clusters, texel | an index, and a measured BRDF for each cluster | BRDF clusters of Filip and Haindl (2007) |
//! | clusters, mean or median | the same with the middle of each cluster | vector quantisation |
//! | PCA | a mean and components of whole BRDFs, 8-bit factors | full matrix factorisation (Koudelka et al. 2003) |
//! | PCA per view | the same of each view by itself | reflectance fields per view (Sattler et al. 2003) |
//! | polynomials | six coefficients a texel, view and channel | polynomial texture maps (Malzbender et al. 2001) |
//! | packed | transformed and coded components | this program's `NAME.btfc` |
//!
//! Everything is made view by view, so that memory holds one view of the tile. Bytes count all that a decoder needs but
//! the directions, which all methods share.

mod figures;
mod methods;

use btfkit_formats::Samples;
use rayon::prelude::*;
use serde::Serialize;

use crate::color::curve::Curve;
use crate::error::Result;
use crate::method::cluster::choice::Representation;
use crate::picture::chart::{Chart, Point};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::stage::image::of_stage;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage};
pub use figures::Figures;
use figures::{Judge, Sums};
use methods::Method;

/// Ratios to the tile's samples that packed files are made at, beside the bytes of the other methods.
const RATIOS: [u64; 3] = [10_000, 2000, 580];

/// Bytes that are one size: a packed file is made for the smaller of them.
const ONE_SIZE: f64 = 1.25;

/// A representation and what it keeps.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The method.
    pub method: &'static str,
    /// Its setting.
    pub setting: String,
    /// All its bytes.
    pub bytes: u64,
    /// Whether it is this program's packed file.
    pub packed: bool,
    /// What it keeps.
    pub figures: Figures,
}

/// All representations of a tile.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Bytes of the tile's samples, which ratios are of.
    pub tile_bytes: u64,
    /// By method, then by bytes.
    pub rows: Vec<Row>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Compares the representations of a model's tile. The model has clusters and components.
///
/// # Errors
/// A model without one of them, too little memory, and those of reading.
pub fn run(model: &Model, measurement: &Measurement, context: &Context<'_>) -> Result<Report> {
    let description = measurement.description();
    let tile = model.tile()?;
    let (bounds, offsets) = (tile.bounds(), tile.offsets_in_bounds());
    let texels = tile.size.texels();
    let tile_bytes = description.bytes_of(texels);
    let (mut methods, notes) = others(model, measurement, context)?;
    let mut sizes: Vec<u64> = methods.iter().flat_map(Method::bytes).collect();
    sizes.extend(RATIOS.map(|ratio| tile_bytes / ratio));
    methods.extend(packed(model, sizes, context)?);

    let numbers: usize = methods.iter().map(|method| method.rows().len()).sum();
    // A view as it is read and as it lies on the curve, and a copy of it of each representation.
    let view_bytes = (bounds.size.texels() + texels) * description.texel_bytes()
        + 2 * texels * description.texel_samples() * size_of::<f32>() * (1 + methods.len())
        + numbers * texels * (description.texel_bytes() + 8 * description.lights.len());
    context.require("comparing representations", view_bytes as u64)?;
    let judge = Judge::new(description, tile.size)?;
    let curve = Curve::new(description.sample_type, description.transfer);
    let mut sums = vec![Sums::default(); numbers];
    let views = description.views.len();
    context.progress.begin("baselines", views as u64, Counted::Items("views"));
    for view in 0..views {
        context.check_stop()?;
        let window = measurement.read_reflectance(view, bounds)?;
        let texel = description.texel_samples();
        let measured = window.select(offsets.iter().map(|&at| at * texel..(at + 1) * texel));
        let measured = measured.unwrap_or_else(|| Samples::none(description.sample_type));
        let mut values = vec![0.0; measured.len()];
        curve.values(&measured, 0..measured.len(), &mut values);
        let of_view = judge.of_view(view, &measured)?;
        let found: Vec<Sums> = context.install(|| {
            let made = methods.par_iter().map(|method| method.of_view(view, &measured, &values, description));
            let made: Vec<Vec<Samples>> = made.collect();
            made.par_iter().flatten().map(|samples| of_view.sums(samples)).collect()
        });
        sums.iter_mut().zip(&found).for_each(|(sum, more)| sum.add(more));
        context.progress.advance(1);
    }
    context.progress.end();
    let rows = methods.iter().flat_map(Method::rows).zip(sums).map(|((setting, bytes, method), sums)| Row {
        method,
        setting,
        bytes,
        packed: method == methods::PACKED,
        figures: sums.figures(),
    });
    Ok(Report { tile_bytes, rows: rows.collect(), notes })
}

/// The other methods.
fn others(
    model: &Model,
    measurement: &Measurement,
    context: &Context<'_>,
) -> Result<(Vec<Method>, Vec<String>)> {
    let description = measurement.description();
    let clusters = of_stage(model, Stage::Cluster, Model::read_clusters)?;
    let bytes = clusters.representative_bytes() + clusters.index_bytes();
    let count = clusters.sources.len();
    let asked = model.recipe::<crate::store::model::clusters::ClusterRecipe>(Stage::Cluster).ok();
    let own = asked.map_or(Representation::Texel, |recipe| recipe.representatives);
    let mut methods = vec![Method::of_model(own, &clusters, bytes)];
    for rule in [Representation::Mean, Representation::Median] {
        if rule != own {
            methods.push(Method::of_groups(rule, &clusters.index, count, bytes));
        }
    }
    let components = of_stage(model, Stage::Components, |model| {
        context.require("components of several ranks", 6 * model.components_bytes()?)?;
        model.components()
    })?;
    let mut notes = vec![];
    let ranks = std::iter::successors(Some(1usize), |rank| Some(4 * rank));
    let most = components.count();
    methods.extend(ranks.take_while(|&rank| rank < most).map(|rank| Method::principal(&components, rank)));
    methods.push(Method::principal(&components, most));
    match Method::principal_per_view(description, components.size.texels()) {
        Some(method) => methods.push(method),
        None => notes.push(format!(
            "PCA per view is left out: {} values of a view are more than it is made for",
            description.texel_samples()
        )),
    }
    match Method::polynomials(description, components.size.texels()) {
        Some(method) => methods.push(method),
        None => notes.push("polynomials are left out: they need six lights or more".to_owned()),
    }
    Ok((methods, notes))
}

/// Packed files of these sizes, each once.
fn packed(model: &Model, mut sizes: Vec<u64>, context: &Context<'_>) -> Result<Vec<Method>> {
    sizes.sort_unstable();
    let mut wanted: Vec<u64> = vec![];
    for size in sizes {
        if wanted.last().is_none_or(|&last| size as f64 > ONE_SIZE * last as f64) {
            wanted.push(size);
        }
    }
    context.progress.begin("pack", wanted.len() as u64, Counted::Items("files"));
    let mut found: Vec<Method> = vec![];
    for size in wanted {
        context.check_stop()?;
        // A size that takes no file of this tile is left out.
        if let Some(method) = Method::packed(model, size, context)?
            && found.last().is_none_or(|last| last.bytes() != method.bytes())
        {
            found.push(method);
        }
        context.progress.advance(1);
    }
    context.progress.end();
    Ok(found)
}

impl Report {
    /// What is ahead of the packed files at no more bytes than they have, by the squared error: none, as it should be.
    pub fn ahead(&self) -> Vec<&Row> {
        let others = self.rows.iter().filter(|row| !row.packed);
        let best = |row: &Row| {
            let within = self.rows.iter().filter(|own| own.packed && own.bytes <= row.bytes);
            within.filter_map(|own| own.figures.psnr_db).fold(0.0, f64::max)
        };
        others.filter(|row| row.figures.psnr_db.unwrap_or(f64::INFINITY) > best(row)).collect()
    }

    /// Curves of the error over the bytes, one a method.
    pub fn chart(&self, title: &str) -> Chart {
        let point = |row: &Row| Point {
            x: (row.bytes as f64 / 1000.0 * 10.0).round() / 10.0,
            y: row.figures.lightness,
            label: format!("{} {}", row.method, row.setting),
        };
        let lines = self.rows.chunk_by(|a, b| a.method == b.method);
        Chart {
            title: format!("{title}: error and bytes"),
            right: "kB".to_owned(),
            up: "mean |dL*|".to_owned(),
            labels: "each line a method; further left and down is better".to_owned(),
            lines: lines.map(|rows| rows.iter().map(point).collect()).collect(),
        }
    }
}

//! The error that each number of clusters leaves against the compression that it gives: what to choose n_c by.

use std::path::PathBuf;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::method::cluster::centre::CentreRule;
use crate::method::cluster::lloyd::Limits;
use crate::method::cluster::search::Trials;
use crate::picture::chart::{Chart, Point};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::stage::cluster::budget::Budget;
use crate::stage::cluster::{Amount, MOST_CLUSTERS, Options as ClusterOptions, Plan as ClusterPlan};
use crate::store::model::index_bytes;
use crate::words::counted;

/// Texels of the sample to each of the most clusters, at least: of fewer, clusters are hardly more than single texels,
/// and the error of a sample tells nothing of the others.
const TEXELS_OF_A_CLUSTER: usize = 4;

/// Of what to make a curve.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement that the tile was cut from.
    pub measurement: PathBuf,
    /// The model with the tile; nothing is written into it.
    pub model: PathBuf,
    /// Up to how many clusters.
    pub most: usize,
    /// How centres follow from their texels.
    pub centre: CentreRule,
    /// When each clustering stops.
    pub limits: Limits,
    /// Seed of the first centres and of the sample.
    pub seed: u64,
}

/// What each number of clusters leaves.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// Name of the measurement.
    pub measurement: String,
    /// Texels of the tile.
    pub tile_texels: usize,
    /// Texels that were clustered, all of the tile or a sample; the errors are theirs.
    pub sample_texels: usize,
    /// Bytes of the whole measurement's raw samples.
    pub measurement_bytes: u64,
    /// By the number of clusters.
    pub points: Vec<CurvePoint>,
}

/// What one number of clusters leaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Clusters, n_c.
    pub clusters: usize,
    /// Weighted mean |dL*| of texels from their centres, (1).
    pub mean_lightness_error: f64,
    /// Bytes of the representatives and the tile's index.
    pub bytes: u64,
    /// How many times smaller that is than the raw measurement.
    pub ratio: f64,
}

/// A curve, ready to be made.
pub struct Plan {
    clustering: ClusterPlan,
    /// Numbers of clusters, ascending.
    numbers: Vec<usize>,
}

/// Checks options against the tile.
pub fn plan(options: &Options) -> Result<Plan> {
    if !(2..=MOST_CLUSTERS).contains(&options.most) {
        return Err(Error::usage(format!(
            "a curve up to {} was asked for, expected 2 to {MOST_CLUSTERS}",
            counted(options.most, "cluster")
        )));
    }
    // Planned for one cluster, so that the sample is no larger for there being many.
    let clustering = super::plan(&ClusterOptions {
        measurement: options.measurement.clone(),
        model: options.model.clone(),
        amount: Amount::Clusters(1),
        centre: options.centre,
        representatives: crate::method::cluster::choice::Representation::Texel,
        limits: options.limits,
        first: None,
        sample: None,
        restarts: 1,
        seed: options.seed,
        time: None,
    })?;
    let sample = clustering.sample_texels();
    let most = options.most.min((sample / TEXELS_OF_A_CLUSTER).max(2)).min(sample);
    // No more are drawn than the last number takes.
    let numbers = numbers(most);
    Ok(Plan { clustering, numbers })
}

impl Plan {
    /// Clusters the sample by 1, 2, 4 ... first ones of the same seeds.
    pub fn run(&self, context: &Context<'_>) -> Result<Curve> {
        let Self { clustering: plan, numbers } = self;
        let most = numbers.last().copied().unwrap_or(1);
        let budget = Budget::of(plan, most, context)?;
        let sample = plan.read_sample(context)?;
        let mut trials = Trials::new(&sample, plan.method(budget.sample_columns, None), plan.options.seed);
        context.progress.begin("draw centres", most as u64, Counted::Items("centres"));
        let drawn = context.install(|| trials.draw(most, context))?;
        context.progress.end();
        // Where there are fewer distinct BRDFs, the numbers beyond them are left out.
        let numbers: Vec<usize> = numbers.iter().copied().filter(|&number| number <= drawn).collect();
        context.progress.begin("curve", numbers.len() as u64, Counted::Items("clusterings"));
        for clusters in numbers {
            context.install(|| trials.run(clusters, context))?;
            context.progress.advance(1);
        }
        context.progress.end();

        let description = plan.measurement.description();
        let texels = plan.selection.texels();
        let measurement_bytes = description.bytes();
        let brdf_bytes = measurement_bytes / description.size.texels() as u64;
        let points = trials.found().into_iter().map(|trial| {
            let bytes = trial.clusters as u64 * brdf_bytes + index_bytes(texels, trial.clusters);
            CurvePoint {
                clusters: trial.clusters,
                mean_lightness_error: trial.mean_lightness_error,
                bytes,
                ratio: measurement_bytes as f64 / bytes as f64,
            }
        });
        let name = plan.measurement.path().file_stem().unwrap_or_default();
        Ok(Curve {
            measurement: name.to_string_lossy().into_owned(),
            tile_texels: texels,
            sample_texels: sample.len(),
            measurement_bytes,
            points: points.collect(),
        })
    }
}

/// The powers of two up to `most`.
fn numbers(most: usize) -> Vec<usize> {
    std::iter::successors(Some(1usize), |number| number.checked_mul(2))
        .take_while(|&number| number <= most)
        .collect()
}

impl Curve {
    /// The curve as a chart; of points without an error there is none on it.
    pub fn chart(&self) -> Chart {
        let points = self.points.iter().map(|point| Point {
            x: point.clusters as f64,
            y: point.mean_lightness_error,
            label: ratio_text(point.ratio),
        });
        Chart {
            title: format!("{}: error and compression", self.measurement),
            right: "clusters n_c".to_owned(),
            up: "mean |dL*| from centres".to_owned(),
            labels: "1:N  representatives and index are N times smaller than the raw measurement".to_owned(),
            lines: vec![points.collect()],
        }
    }
}

/// A ratio for people: 1:7.3 or 1:1203.
pub fn ratio_text(ratio: f64) -> String {
    let decimals = match ratio {
        _ if ratio < 0.1 => 3,
        _ if ratio < 10.0 => 1,
        _ => 0,
    };
    format!("1:{ratio:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_the_powers_of_two_within_the_most() {
        assert_eq!(numbers(1), [1]);
        assert_eq!(numbers(9), [1, 2, 4, 8]);
        assert_eq!(numbers(16), [1, 2, 4, 8, 16]);
    }

    #[test]
    fn a_chart_shows_each_number_with_its_ratio() {
        let point = |clusters: usize, ratio: f64| CurvePoint {
            clusters,
            mean_lightness_error: 9.0 / clusters as f64,
            bytes: 1,
            ratio,
        };
        let curve = Curve {
            measurement: "wood".to_owned(),
            tile_texels: 64,
            sample_texels: 64,
            measurement_bytes: 1000,
            points: vec![point(1, 1000.4), point(2, 10.04), point(4, 7.21)],
        };
        let chart = curve.chart();
        assert!(chart.title.starts_with("wood"));
        let labels: Vec<&str> = chart.lines[0].iter().map(|point| point.label.as_str()).collect();
        assert_eq!(labels, ["1:1000", "1:10", "1:7.2"]);
        assert_eq!(chart.lines[0][2].y, 2.25);
    }
}

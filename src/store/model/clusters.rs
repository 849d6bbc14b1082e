//! What clusters are in a model: their index over the tile, their centres, the measured BRDFs that stand for them, and
//! the distances between them.

use std::ops::Range;

use btfkit_formats::{SampleType, Samples};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Model, Stage};
use crate::color::{Decoder, Transfer};
use crate::error::{Error, Result};
use crate::method::cluster::centre::CentreRule;
use crate::method::cluster::choice::{Amount, First, Representation};
use crate::method::cluster::lloyd::{Limits, Pass};
use crate::method::cluster::search::Trial;
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::store::clustering::BatchPass;
use crate::zarr::{Layout, data_type_of, samples_named};

/// Most clusters: the index is u16.
const MOST_CLUSTERS: usize = 1 << 16;

/// The lightness of white: no two texels differ by more.
const LARGEST_LIGHTNESS: f64 = 100.0;

/// Clusters that a narrow index, of u8, can tell apart.
pub(crate) const NARROW: usize = 256;

/// Everything that clusters are in a model.
pub struct Clusters {
    /// Size of the tile.
    pub size: Size,
    /// Cluster of each texel of the tile.
    pub index: Vec<u16>,
    /// Views and lights.
    pub brdf: [usize; 2],
    /// Centres [cluster, view, light], L* codes.
    pub centres: Vec<u8>,
    /// Measured colour BRDFs.
    pub representatives: Representatives,
    /// Row and column in the measurement of the texel nearest to each centre: of the representative, unless that is a
    /// mean or a median.
    pub sources: Vec<[u32; 2]>,
    /// D of (26), row by row.
    pub distance: Vec<f32>,
}

impl Clusters {
    /// Bytes of the representatives' samples.
    pub fn representative_bytes(&self) -> u64 {
        let samples = &self.representatives.samples;
        (samples.len() * samples.sample_type().bytes()) as u64
    }

    /// Bytes of the tile's index.
    pub fn index_bytes(&self) -> u64 {
        index_bytes(self.index.len(), self.sources.len())
    }
}

/// Bytes of an index of so many texels into so many clusters.
pub fn index_bytes(texels: usize, clusters: usize) -> u64 {
    texels as u64 * if clusters <= NARROW { 1 } else { 2 }
}

/// Colour BRDFs, one a cluster: measured ones, or means or medians of them.
pub struct Representatives {
    /// Clusters, views, lights, channels.
    pub shape: [usize; 4],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Samples in the order of the shape.
    pub samples: Samples,
    /// Their transfer curve.
    pub transfer: Transfer,
}

impl Representatives {
    /// What turns them into linear RGB.
    ///
    /// # Errors
    /// Channels that are not understood.
    pub fn decoder(&self) -> Result<Decoder> {
        Decoder::new(self.transfer, self.samples.sample_type(), &self.channels)
    }
}

/// Version of the clustering, part of its recipes.
const CLUSTER_METHOD: u64 = 2;

/// What clusters depend on that were found in this model's tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClusterRecipe {
    /// Digest of the tile.
    pub tile: String,
    /// How many clusters.
    pub amount: Amount,
    /// How centres follow from their texels.
    pub centre: CentreRule,
    /// When to stop.
    pub limits: Limits,
    /// Texels that are clustered in memory, where given.
    pub sample: Option<usize>,
    /// Draws of first centres.
    pub restarts: u32,
    /// Seed of the first centres and of the sample.
    pub seed: u64,
    /// Where first centres come from, where given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<First>,
    /// What stands for the texels of a cluster.
    #[serde(default, skip_serializing_if = "Representation::is_texel")]
    pub representatives: Representation,
}

impl Recipe for ClusterRecipe {
    const STAGE: &'static str = Stage::Cluster.name();
    const METHOD: u64 = CLUSTER_METHOD;
}

/// What clusters depend on that were taken from another model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TakenRecipe {
    /// Digest of the tile.
    pub tile: String,
    /// Digest of the other model's clusters.
    pub clusters_of: String,
}

impl Recipe for TakenRecipe {
    const STAGE: &'static str = Stage::Cluster.name();
    const METHOD: u64 = CLUSTER_METHOD;
}

/// How a clustering went.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClusterReport {
    /// Clusters, fewer than asked for where there are fewer distinct BRDFs.
    pub clusters: usize,
    /// What each pass over all texels found; the last one's objective is the result's.
    pub passes: Vec<Pass>,
    /// Why there was no further pass.
    pub ended: Ended,
    /// Passes over mini-batches that grew, before these.
    #[serde(default)]
    pub batches: Vec<BatchPass>,
    /// Texels of the sample that the initial clustering was made on; 0 where all texels went into memory.
    pub sample_texels: usize,
    /// Passes over the sample.
    pub sample_passes: Vec<Pass>,
    /// What other numbers of clusters left, where one was searched: of the sample, then of all texels.
    pub trials: Vec<Trial>,
    /// Mean weighted |dL*| of texels from the representatives of their clusters.
    pub representative_lightness_error: f64,
    /// Mean weighted |dL*| of representatives from their centres.
    pub representative_from_centre: f64,
    /// The largest of these.
    pub representative_from_centre_most: f64,
    /// Clusters of a single texel.
    pub single_texel_clusters: usize,
    /// The model that the clusters were taken from, where they were: its name and the texels that it clustered.
    pub taken_from: Option<(String, usize)>,
    /// Bytes of the representatives' samples.
    pub representative_bytes: u64,
    /// Bytes of the tile's index.
    pub index_bytes: u64,
    /// Bytes of the tile's raw samples.
    pub tile_bytes: u64,
    /// Bytes of the whole measurement's raw samples.
    pub measurement_bytes: u64,
}

impl ClusterReport {
    /// Checks the parts against each other and, where clusters were found in this tile, against the recipe.
    fn check(&self, asked: Option<&ClusterRecipe>) -> std::result::Result<(), String> {
        let clusters = self.clusters;
        if !(1..=MOST_CLUSTERS).contains(&clusters) {
            return Err(format!("clusters: got {clusters}, expected 1 to {MOST_CLUSTERS}"));
        }
        if self.single_texel_clusters > clusters {
            return Err(format!("single_texel_clusters: got {} of {clusters}", self.single_texel_clusters));
        }
        let batches = self.batches.iter().map(|batch| batch.pass.mean_lightness_error);
        let errors = [
            self.representative_lightness_error,
            self.representative_from_centre,
            self.representative_from_centre_most,
        ];
        let passes = self.passes.iter().chain(&self.sample_passes).map(|pass| pass.mean_lightness_error);
        let trials = self.trials.iter().map(|trial| trial.mean_lightness_error);
        let mut all = errors.into_iter().chain(passes).chain(batches).chain(trials);
        if let Some(error) = all.find(|error| !(0.0..=LARGEST_LIGHTNESS).contains(error)) {
            return Err(format!("an error of {error}, expected 0 to {LARGEST_LIGHTNESS}"));
        }
        let Some(ClusterRecipe { amount, limits, sample, .. }) = asked else { return Ok(()) };
        if let Amount::Clusters(most) = amount
            && clusters > *most
        {
            return Err(format!("clusters: got {clusters}, the recipe says {most}"));
        }
        if !(limits.tolerance.is_finite() && limits.tolerance >= 0.0) {
            return Err(format!(
                "tolerance: the recipe says {}, expected a share from 0 on",
                limits.tolerance
            ));
        }
        if self.passes.is_empty() || self.passes.len() > limits.passes {
            return Err(format!("passes: got {}, the recipe says 1 to {}", self.passes.len(), limits.passes));
        }
        if let Amount::Error(number) | Amount::Ratio(number) = amount
            && !(number.is_finite() && *number > 0.0)
        {
            return Err(format!("amount: the recipe says {number}, expected a number above 0"));
        }
        match sample {
            Some(0) => Err("sample: the recipe says 0 texels".to_owned()),
            _ => Ok(()),
        }
    }
}

/// Why there was no further pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ended {
    /// Nothing moved, or the objective fell by less than the tolerance.
    #[serde(rename = "settled")]
    Converged,
    /// There were as many as allowed.
    Passes,
    /// The time was over.
    Time,
}

/// The arrays of clusters [cluster, view, light] of a tile.
pub(super) fn arrays(
    tile: Size,
    brdfs: [usize; 3],
    channels: &[String],
    samples: SampleType,
) -> Vec<(String, Layout<'static>)> {
    let clusters = brdfs[0];
    [
        ("index", index_layout(tile, clusters)),
        ("centres", centres_layout(brdfs)),
        ("representatives", representatives_layout(brdfs, channels, samples)),
        ("representative_texel", texel_layout(clusters)),
        ("distance", distance_layout(clusters)),
    ]
    .map(|(name, layout)| (name.to_owned(), layout))
    .into()
}

impl Model {
    /// Writes what clusters are.
    pub(crate) fn write_clusters(&self, clusters: &Clusters) -> Result<()> {
        let count = clusters.sources.len();
        let layout = index_layout(clusters.size, count);
        if count <= NARROW {
            let narrow: Vec<u8> = clusters.index.iter().map(|&cluster| cluster as u8).collect();
            self.store.write("index", &layout, &narrow)?;
        } else {
            self.store.write("index", &layout, &clusters.index)?;
        }
        let [views, lights] = clusters.brdf;
        let brdf = [count, views, lights];
        self.store.write("centres", &centres_layout(brdf), &clusters.centres)?;
        let Representatives { channels, samples, .. } = &clusters.representatives;
        let layout = representatives_layout(brdf, channels, samples.sample_type());
        match samples {
            Samples::U8(list) => self.store.write("representatives", &layout, list),
            Samples::U16(list) => self.store.write("representatives", &layout, list),
            Samples::F16(list) => self.store.write("representatives", &layout, list),
            Samples::F32(list) => self.store.write("representatives", &layout, list),
        }?;
        let sources: Vec<u32> = clusters.sources.iter().flatten().copied().collect();
        self.store.write("representative_texel", &texel_layout(count), &sources)?;
        self.store.write("distance", &distance_layout(count), &clusters.distance)
    }

    /// What clusters are.
    pub fn read_clusters(&self) -> Result<Clusters> {
        let [views, lights] = self.directions()?;
        Ok(Clusters {
            size: self.tile_report()?.size(),
            index: self.index()?,
            brdf: [views.len(), lights.len()],
            centres: self.centres()?,
            representatives: self.representatives()?,
            sources: self.representative_texels()?,
            distance: self.distance()?,
        })
    }

    /// How the clustering went.
    ///
    /// # Errors
    /// Where it has not been run, or what it says is impossible, or not of these arrays.
    pub fn cluster_report(&self) -> Result<ClusterReport> {
        let report: ClusterReport = self.report(Stage::Cluster)?;
        let asked = self.recipe::<ClusterRecipe>(Stage::Cluster).ok();
        let damaged = |what: String| self.damaged_report(Stage::Cluster, &what);
        report.check(asked.as_ref()).map_err(damaged)?;
        let tile = self.tile_report()?;
        let (channels, samples) = self.values()?;
        let pairs: usize = self.directions()?.map(|list| list.len()).iter().product();
        let brdf = (pairs * channels.len() * samples.bytes()) as u64;
        let [rows, columns] = tile.measurement_size;
        let expected = [
            ("representative_bytes", report.representative_bytes, report.clusters as u64 * brdf),
            ("index_bytes", report.index_bytes, index_bytes(tile.size().texels(), report.clusters)),
            ("tile_bytes", report.tile_bytes, tile.size().texels() as u64 * brdf),
            ("measurement_bytes", report.measurement_bytes, (rows * columns) as u64 * brdf),
        ];
        match expected.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(report),
            Some((name, found, expected)) => {
                Err(damaged(format!("{name}: got {found}, expected {expected}, as the arrays have")))
            }
        }
    }

    /// Number of clusters.
    pub fn clusters(&self) -> Result<usize> {
        let report: ClusterReport = self.report(Stage::Cluster)?;
        report.check(None).map_err(|what| self.damaged_report(Stage::Cluster, &what))?;
        Ok(report.clusters)
    }

    /// The cluster of each tile texel.
    pub fn index(&self) -> Result<Vec<u16>> {
        let clusters = self.clusters()?;
        let layout = index_layout(self.tile_report()?.size(), clusters);
        let index = if clusters > NARROW {
            self.read::<u16>(Stage::Cluster, "index", &layout)?
        } else {
            self.read::<u8>(Stage::Cluster, "index", &layout)?.into_iter().map(u16::from).collect()
        };
        match index.iter().find(|&&cluster| usize::from(cluster) >= clusters) {
            None => Ok(index),
            Some(cluster) => Err(self.damaged("index", &format!("cluster {cluster} of {clusters}"))),
        }
    }

    /// L* codes of the clusters' centres, [cluster, view, light].
    pub fn centres(&self) -> Result<Vec<u8>> {
        let [views, lights] = self.directions()?.map(|list| list.len());
        self.read::<u8>(Stage::Cluster, "centres", &centres_layout([self.clusters()?, views, lights]))
    }

    /// Names of the channels, and type of the samples, of the representatives.
    pub(super) fn values(&self) -> Result<(Vec<String>, SampleType)> {
        let report = self.tile_report()?;
        if let Some(values) = report.values() {
            return Ok(values);
        }
        // The oldest layout has them beside the array only.
        let document = self.store.array_document("representatives")?;
        let names = document.get("attributes").and_then(|attributes| attributes.get("channels"));
        let names = serde_json::from_value(names.cloned().unwrap_or_default());
        let name = document.get("data_type").and_then(Value::as_str).unwrap_or_default();
        let samples = samples_named(name);
        names
            .ok()
            .zip(samples)
            .ok_or_else(|| self.damaged("representatives", "no names of channels, or no samples"))
    }

    /// The measured colour BRDFs that stand for the clusters.
    pub fn representatives(&self) -> Result<Representatives> {
        self.representatives_of(0..self.clusters()?)
    }

    fn representatives_layout(&self) -> Result<Layout<'static>> {
        let [views, lights] = self.directions()?.map(|list| list.len());
        let (channels, samples) = self.values()?;
        Ok(representatives_layout([self.clusters()?, views, lights], &channels, samples))
    }

    /// Ranges of clusters whose representatives are decoded together: at most 16 MiB, unless one is larger.
    pub(crate) fn representative_chunks(&self) -> Result<Vec<Range<usize>>> {
        let clusters = self.clusters()?;
        let rows = self.representatives_layout()?.chunk[0] as usize;
        Ok((0..clusters).step_by(rows).map(|first| first..clusters.min(first + rows)).collect())
    }

    /// The measured colour BRDFs that stand for some of the clusters.
    pub(crate) fn representatives_of(&self, clusters: Range<usize>) -> Result<Representatives> {
        let layout = self.representatives_layout()?;
        let array = self.open_array(Stage::Cluster, "representatives", &layout)?;
        let [_, views, lights, channels] = layout.shape[..] else {
            return Err(Error::internal("representatives have four dimensions"));
        };
        let samples = self.store.read_samples(&array, clusters.start as u64..clusters.end as u64)?;
        let shape = [clusters.len(), views as usize, lights as usize, channels as usize];
        let transfer = self.tile_report()?.transfer;
        Ok(Representatives { shape, channels: self.values()?.0, samples, transfer })
    }

    /// Row and column in the measurement of each representative.
    pub(crate) fn representative_texels(&self) -> Result<Vec<[u32; 2]>> {
        let layout = texel_layout(self.clusters()?);
        let sources = self.read::<u32>(Stage::Cluster, "representative_texel", &layout)?;
        let sources: Vec<[u32; 2]> = sources.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        self.expect_measured("representative_texel", &sources, &self.tile_report()?)?;
        Ok(sources)
    }

    /// D of (26), row by row.
    ///
    /// # Errors
    /// Where it is no distance: finite, at least 0, 0 from itself, the same both ways.
    pub fn distance(&self) -> Result<Vec<f32>> {
        let clusters = self.clusters()?;
        let distance = self.read::<f32>(Stage::Cluster, "distance", &distance_layout(clusters))?;
        let wrong = (0..clusters).find_map(|row| {
            let wrong = |&column: &usize| {
                let (there, back) = (distance[row * clusters + column], distance[column * clusters + row]);
                !there.is_finite() || there < 0.0 || there != back || (row == column && there != 0.0)
            };
            (0..clusters).find(wrong).map(|column| (row, column, distance[row * clusters + column]))
        });
        match wrong {
            None => Ok(distance),
            Some((row, column, found)) => Err(self.damaged(
                "distance",
                &format!(
                    "from {row} to {column} got {found}, expected finite numbers >= 0, the same both ways, 0 on the diagonal"
                ),
            )),
        }
    }
}

fn index_layout(size: Size, clusters: usize) -> Layout<'static> {
    let shape = [size.height, size.width];
    if clusters <= NARROW {
        Layout::small::<u8>(&["y", "x"], &shape)
    } else {
        Layout::small::<u16>(&["y", "x"], &shape)
    }
}

fn centres_layout(shape: [usize; 3]) -> Layout<'static> {
    Layout::small::<u8>(&["cluster", "view", "light"], &shape)
}

fn representatives_layout(
    [clusters, views, lights]: [usize; 3],
    channels: &[String],
    samples: SampleType,
) -> Layout<'static> {
    let names = &["cluster", "view", "light", "channel"];
    let shape = [clusters, views, lights, channels.len()];
    Layout::small_of(data_type_of(samples), samples.bytes(), names, &shape).with("channels", channels)
}

fn texel_layout(clusters: usize) -> Layout<'static> {
    Layout::small::<u32>(&["cluster", "row_column"], &[clusters, 2])
}

fn distance_layout(clusters: usize) -> Layout<'static> {
    Layout::small::<f32>(&["cluster", "cluster_other"], &[clusters, clusters])
        .with("units", "L*, summed over directions with weight cos(theta_v)")
}

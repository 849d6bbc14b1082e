//! Tile to clusters: index, centres, representatives and their distances.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use btfkit_formats::Samples;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::kernel::absolute_difference::Kernel;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::run::{Context, units};
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Representatives, Stage};
use crate::texel::cluster::centre::CentreRule;
use crate::texel::cluster::lloyd::{self, Limits, Pass};
use crate::texel::cluster::points::{Arrangement, Points};
use crate::texel::cluster::{distance_matrix, seeding};
use crate::texel::tile::Tile;

/// Most clusters: the index is u16.
const MOST_CLUSTERS: usize = 1 << 16;

/// How to cluster.
#[derive(Clone, Debug)]
pub struct Options {
    /// The measurement that the tile was cut from.
    pub measurement: PathBuf,
    /// The model with the tile.
    pub model: PathBuf,
    /// Number of clusters, n_c.
    pub clusters: usize,
    /// How centres follow from their texels.
    pub centre: CentreRule,
    /// When to stop.
    pub limits: Limits,
    /// Seed of the first centres.
    pub seed: u64,
}

/// How a clustering went.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Clusters, fewer than asked for where the tile has fewer distinct BRDFs.
    pub clusters: usize,
    /// What each pass found; the last one's objective is the result's.
    pub passes: Vec<Pass>,
    /// Mean weighted |dL*| of texels from the representatives of their clusters.
    pub representative_lightness_error: f64,
    /// Mean weighted |dL*| of representatives from their centres.
    pub representative_from_centre: f64,
    /// Clusters of a single texel.
    pub single_texel_clusters: usize,
    /// Bytes of the representatives' samples.
    pub representative_bytes: u64,
    /// Bytes of the tile's index.
    pub index_bytes: u64,
    /// Bytes of the tile's raw samples.
    pub tile_bytes: u64,
    /// Bytes of the whole measurement's raw samples.
    pub measurement_bytes: u64,
}

/// A clustering, ready to run.
pub struct Plan {
    measurement: Measurement,
    model: Model,
    tile: Tile,
    options: Options,
    recipe: Value,
}

/// Opens the measurement that a model was begun from.
pub(crate) fn open_measurement_of(model: &Model, path: &Path) -> Result<Measurement> {
    let measurement = Measurement::open(path)?;
    let entry = model.stage(Stage::Tile)?.unwrap_or_default();
    let expected = entry.get("recipe").and_then(|recipe| recipe.get("measurement")).and_then(Value::as_str);
    if expected.is_some() && expected != Some(measurement.digest()) {
        return Err(Error::recipe(format!(
            "{} was cut from another measurement than {}",
            model.path().display(),
            path.display()
        )));
    }
    Ok(measurement)
}

/// Checks options against the tile.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let tile_digest = model.stage_digest(Stage::Tile)?;
    let measurement = open_measurement_of(&model, &options.measurement)?;
    let tile = model.tile()?;
    let most = tile.size.texels().min(MOST_CLUSTERS);
    if !(1..=most).contains(&options.clusters) {
        return Err(Error::usage(format!(
            "{} clusters were asked for, expected 1 to {most} for a tile of {} texels",
            options.clusters,
            tile.size.texels()
        )));
    }
    let recipe = json!({
        "stage": "cluster", "method": METHOD,
        "tile": tile_digest,
        "clusters": options.clusters,
        "centre": options.centre,
        "limits": options.limits,
        "seed": options.seed,
    });
    Ok(Plan { measurement, model, tile, options: options.clone(), recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "cluster",
            "model": self.options.model,
            "texels": self.tile.size.texels(),
            "memory_bytes_one_thread": self.memory_bytes(1),
            "recipe": self.recipe,
        })
    }

    fn arrangement(&self) -> Arrangement {
        let description = self.measurement.description();
        Arrangement::new(&description.views, description.lights.len())
    }

    /// Vectors of all texels, windows decoded by each thread, representatives, D, nearest texels, and the
    /// program itself.
    fn memory_bytes(&self, threads: usize) -> u64 {
        const PROGRAM_BYTES: usize = 16 << 20;
        let description = self.measurement.description();
        let texel_bytes = description.texel_bytes();
        let window = self.tile.bounds().size.texels() * texel_bytes;
        let representatives = self.options.clusters * description.views.len() * texel_bytes;
        let vectors = self.tile.size.texels() * self.arrangement().stride();
        let clusters = self.options.clusters;
        let matrix = clusters * clusters * size_of::<f32>();
        let nearest = self.tile.size.texels().div_ceil(lloyd::PART) * clusters * size_of::<lloyd::Near>();
        (vectors + threads * 3 * window + 2 * representatives + matrix + nearest + PROGRAM_BYTES) as u64
    }

    /// Clusters the tile, unless that is done.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Some(_lock) = self.model.begin(Stage::Cluster, &self.recipe)? else {
            return self.model.report(Stage::Cluster);
        };
        let needed = self.memory_bytes(context.threads);
        if needed > context.memory_bytes {
            return Err(Error::usage(format!(
                "clustering {} texels takes {} MiB of memory, {} MiB are allowed",
                self.tile.size.texels(),
                needed >> 20,
                context.memory_bytes >> 20
            ))
            .hint("this version clusters in memory: choose a smaller --tile or a larger --memory"));
        }
        let points = self.read_points(context)?;
        let kernel = Kernel::fastest();
        let Options { clusters, centre, limits, seed, .. } = self.options;
        context.progress.begin("seed clusters", clusters.saturating_sub(1) as u64, Counted::Items("centres"));
        let seeds = context.install(|| seeding::draw(&points, clusters, seed, kernel, context))?;
        context.progress.end();
        context.progress.begin("cluster", limits.passes as u64, Counted::Items("passes"));
        let clustering = context.install(|| lloyd::run(&points, &seeds, centre, limits, kernel, context))?;
        context.progress.end();
        self.write(&points, &clustering, kernel, context)
    }

    /// Reads the tile's L* codes, view by view.
    fn read_points(&self, context: &Context<'_>) -> Result<Points> {
        let arrangement = self.arrangement();
        let lights = self.measurement.description().lights.len();
        let (bounds, offsets) = (self.tile.bounds(), self.tile.offsets_in_bounds());
        let vectors = Mutex::new(vec![0; self.tile.size.texels() * arrangement.stride()]);
        let views: Vec<usize> = (0..self.measurement.description().views.len()).collect();
        context.progress.begin("read luminance", views.len() as u64, Counted::Items("views"));
        units::for_each(context, &views, context.threads, |&view| {
            let window = self.measurement.read_luminance(view, bounds)?;
            let codes: Vec<u8> =
                offsets.iter().flat_map(|&at| &window[at * lights..(at + 1) * lights]).copied().collect();
            arrangement.insert_view(
                &mut vectors.lock().unwrap_or_else(PoisonError::into_inner),
                view,
                &codes,
            );
            context.progress.advance(1);
            Ok(())
        })?;
        context.progress.end();
        Ok(Points { arrangement, vectors: vectors.into_inner().unwrap_or_else(PoisonError::into_inner) })
    }

    fn write(
        &self,
        points: &Points,
        clustering: &lloyd::Clustering,
        kernel: Kernel,
        context: &Context<'_>,
    ) -> Result<Report> {
        let description = self.measurement.description();
        let arrangement = &points.arrangement;
        let clusters = clustering.assignment.nearest.len();
        let texels: Vec<usize> =
            clustering.assignment.nearest.iter().map(|near| near.texel as usize).collect();
        let codes: Vec<u8> = texels.iter().flat_map(|&texel| points.vector(texel)).copied().collect();
        let matrix = context.install(|| distance_matrix(&arrangement.plain(&codes), arrangement));
        let representatives = self.read_representatives(&texels, context)?;
        let sources: Vec<[u32; 2]> = texels.iter().map(|&texel| self.tile.source[texel]).collect();

        let shape = [clusters, description.views.len(), description.lights.len()];
        self.model.write_index(self.tile.size, &clustering.assignment.index, clusters)?;
        self.model.write_centres(shape, &arrangement.plain(&clustering.centres))?;
        self.model.write_representatives(&representatives, &sources)?;
        self.model.write_distance(clusters, &matrix)?;

        let mut population = vec![0usize; clusters];
        let mut from_representatives = 0;
        for (texel, &cluster) in clustering.assignment.index.iter().enumerate() {
            population[usize::from(cluster)] += 1;
            from_representatives += distance(points, texel, texels[usize::from(cluster)], kernel);
        }
        let from_centres: u64 = clustering.assignment.nearest.iter().map(|near| near.distance).sum();
        let tile_texels = self.tile.size.texels();
        let report = Report {
            clusters,
            passes: clustering.passes.clone(),
            representative_lightness_error: arrangement.mean_lightness(from_representatives)
                / tile_texels as f64,
            representative_from_centre: arrangement.mean_lightness(from_centres) / clusters as f64,
            single_texel_clusters: population.iter().filter(|&&n| n == 1).count(),
            representative_bytes: (representatives.samples.len() * description.sample_type.bytes()) as u64,
            index_bytes: tile_texels as u64 * if clusters <= 256 { 1 } else { 2 },
            tile_bytes: description.bytes() / description.size.texels() as u64 * tile_texels as u64,
            measurement_bytes: description.bytes(),
        };
        self.model.finish(Stage::Cluster, &self.recipe, &report)?;
        Ok(report)
    }

    /// The colour BRDFs of tile texels, [cluster, view, light, channel].
    fn read_representatives(&self, texels: &[usize], context: &Context<'_>) -> Result<Representatives> {
        let description = self.measurement.description();
        let (views, texel) = (description.views.len(), description.texel_samples());
        let (bounds, offsets) = (self.tile.bounds(), self.tile.offsets_in_bounds());
        let numbers: Vec<usize> = (0..views).collect();
        context.progress.begin("read representatives", views as u64, Counted::Items("views"));
        let of = |window: &Samples, range: Range<usize>| {
            window.select(std::iter::once(range)).unwrap_or_else(|| Samples::none(description.sample_type))
        };
        let by_view: Vec<Vec<Samples>> = units::for_each(context, &numbers, context.threads, |&view| {
            let window = self.measurement.read_reflectance(view, bounds)?;
            context.progress.advance(1);
            Ok(texels.iter().map(|&t| offsets[t] * texel).map(|at| of(&window, at..at + texel)).collect())
        })?;
        context.progress.end();
        let mut samples = Samples::none(description.sample_type);
        for cluster in 0..texels.len() {
            for view in &by_view {
                samples.append(&view[cluster]);
            }
        }
        Ok(Representatives {
            shape: [texels.len(), views, description.lights.len(), description.n_channels()],
            channels: description.channels.clone(),
            samples,
            transfer: description.transfer,
        })
    }
}

/// The fixed-point distance of two texels.
fn distance(points: &Points, first: usize, second: usize, kernel: Kernel) -> u64 {
    let mut distance = [0];
    let arrangement = &points.arrangement;
    let (a, b) = (points.vector(first), points.vector(second));
    kernel.distances(a, b, arrangement.stride(), arrangement.groups(), &mut distance);
    distance[0]
}

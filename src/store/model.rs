//! The model store: what the analysis of a measurement leaves, everything an evaluator needs.
//!
//! Each stage (`tile`, `cluster`, `normals`, `fit`, `appearance`) writes its arrays and then, last, its entry in
//! the attributes: arrays without their entry are the remains of a run that was killed.

use std::ops::Range;
use std::path::Path;

use btfkit_formats::Samples;
use serde_json::{Map, Value, json};

use crate::coherent::Appearance;
use crate::color::{Decoder, Transfer};
use crate::error::{Error, Result};
use crate::mrf::Surface;
use crate::run::{Context, recipe};
use crate::shape::Size;
use crate::store::appearance::{self, AppearanceReport};
use crate::store::field;
use crate::store::measurement::{Description, read_directions, write_directions};
use crate::store::output::Existing;
use crate::store::{Layout, Lock, Named, Store};
use crate::texel::tile::Tile;
use crate::texel::triangulation::triangulate;
use btfkit_formats::Direction;

/// The attribute `kind` of a model store.
pub const KIND: &str = "model";

/// The stages of an analysis, in the order of the data flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Cut a tile.
    Tile,
    /// Cluster its BRDFs.
    Cluster,
    /// Estimate its normal map.
    Normals,
    /// Fit the random field.
    Fit,
    /// How the exemplar looks, for the coherent rule.
    Appearance,
}

impl Stage {
    /// All of them, in their order.
    pub const ALL: [Self; 5] = [Self::Tile, Self::Cluster, Self::Normals, Self::Fit, Self::Appearance];

    /// Its name, as a command and as an entry in the attributes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tile => "tile",
            Self::Cluster => "cluster",
            Self::Normals => "normals",
            Self::Fit => "fit",
            Self::Appearance => "appearance",
        }
    }

    /// The stages that build on it, directly or not, in the order of the data flow.
    fn builders(self) -> &'static [Self] {
        match self {
            Self::Tile => &[Self::Cluster, Self::Normals, Self::Fit, Self::Appearance],
            Self::Cluster => &[Self::Appearance],
            Self::Normals => &[Self::Fit],
            Self::Fit | Self::Appearance => &[],
        }
    }

    /// Its arrays; `report` is that of the stage.
    fn arrays(self, report: Option<&Value>) -> Vec<String> {
        let levels =
            report.and_then(|report| report.get("levels")).and_then(Value::as_array).map_or(0, Vec::len);
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        match self {
            Self::Tile => names(&[
                "tile_source",
                "view_direction",
                "light_direction",
                "view_triangles",
                "light_triangles",
            ]),
            Self::Cluster => {
                names(&["index", "centres", "representatives", "representative_texel", "distance"])
            }
            Self::Normals => names(&["normals"]),
            Self::Fit => field::arrays(levels),
            Self::Appearance => appearance::arrays(levels),
        }
    }
}

/// Name of the lock of a stage.
fn lock_name(stage: Stage) -> String {
    format!("-{}", stage.name())
}

/// A model store.
pub struct Model {
    store: Store,
}

impl Model {
    /// Opens a model, or begins one where there is none.
    pub fn create(path: &Path, context: &Context<'_>) -> Result<Self> {
        let store = Store::at(path);
        let mut attributes = Map::new();
        attributes.insert("stages".to_owned(), json!({}));
        store.begin(KIND, attributes, context)?;
        store.sweep()?;
        Ok(Self { store })
    }

    /// Opens a model for reading.
    pub fn open(path: &Path) -> Result<Self> {
        let store = Store::at(path);
        store.expect(KIND)?;
        Ok(Self { store })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// The attributes of a stage that is done: `recipe`, `digest` and `report`.
    pub fn stage(&self, stage: Stage) -> Result<Option<Map<String, Value>>> {
        let attributes = self.store.expect(KIND)?;
        let entry = attributes.get("stages").and_then(|stages| stages.get(stage.name()));
        Ok(entry.and_then(Value::as_object).cloned())
    }

    /// Digest of a stage that must be done.
    pub fn stage_digest(&self, stage: Stage) -> Result<String> {
        let entry = self.stage(stage)?.ok_or_else(|| {
            Error::missing(format!("{}: stage {} has not been run", self.path().display(), stage.name()))
                .hint(format!("run `btf {}` (or `btf model`) on it first", stage.name()))
        })?;
        Ok(entry.get("digest").and_then(Value::as_str).unwrap_or_default().to_owned())
    }

    /// Digest of some stages together.
    pub fn digest_of(&self, stages: &[Stage]) -> Result<String> {
        let digests: Map<String, Value> = stages
            .iter()
            .map(|&stage| Ok((stage.name().to_owned(), json!(self.stage_digest(stage)?))))
            .collect::<Result<_>>()?;
        Ok(recipe::digest(&Value::Object(digests)))
    }

    /// Begins a stage and holds it against other processes; none where it is done by this recipe and
    /// its arrays are all there. Where results may be replaced, what another recipe made is taken back first, and with
    /// it every stage that builds on it.
    ///
    /// # Errors
    /// Where it has been run by another recipe.
    pub fn begin(&self, stage: Stage, recipe: &Value, context: &Context<'_>) -> Result<Option<Lock>> {
        let lock = self.store.lock(&lock_name(stage), context)?;
        self.store.sweep()?;
        if context.existing == Existing::Replace {
            self.take_back(stage, recipe, context)?;
        }
        Ok(if self.is_done(stage, recipe)? { None } else { Some(lock) })
    }

    /// Takes back a stage that another recipe made, and those that build on it: their entries first, then their arrays.
    fn take_back(&self, stage: Stage, recipe: &Value, context: &Context<'_>) -> Result<()> {
        let Some(entry) = self.stage(stage)? else { return Ok(()) };
        if entry.get("digest").and_then(Value::as_str) == Some(recipe::digest(recipe).as_str()) {
            return Ok(());
        }
        // In the order of the data flow, as everybody takes them.
        let _later: Vec<Lock> = stage
            .builders()
            .iter()
            .map(|&stage| self.store.lock(&lock_name(stage), context))
            .collect::<Result<_>>()?;
        let mut arrays = Vec::new();
        {
            let _lock = self.store.lock("", context)?;
            let mut attributes = self.store.expect(KIND)?;
            let stages = attributes.get_mut("stages").and_then(Value::as_object_mut);
            let Some(stages) = stages else { return Ok(()) };
            for taken in stage.builders().iter().chain([&stage]) {
                if let Some(entry) = stages.remove(taken.name()) {
                    arrays.extend(taken.arrays(entry.get("report")));
                    if *taken != stage {
                        context.progress.notice(&format!(
                            "{}: stage {} built on what is made anew: run it again (btf {}, or btf model)",
                            self.path().display(),
                            taken.name(),
                            taken.name()
                        ));
                    }
                }
            }
            self.store.write_group("", attributes)?;
        }
        for array in arrays {
            self.store.remove(&array)?;
        }
        Ok(())
    }

    /// Whether a stage is done by this recipe, and its arrays are all there.
    ///
    /// # Errors
    /// Where it has been run by another recipe.
    pub fn is_done(&self, stage: Stage, recipe: &Value) -> Result<bool> {
        let Some(entry) = self.stage(stage)? else { return Ok(false) };
        let place = format!("{} ({})", self.path().display(), stage.name());
        recipe::expect_same(Path::new(&place), &entry, recipe)?;
        Ok(stage.arrays(entry.get("report")).iter().all(|array| self.store.is_whole(array)))
    }

    /// Declares a stage done; to be called after its arrays are written.
    pub fn finish(
        &self,
        stage: Stage,
        recipe: &Value,
        report: &impl serde::Serialize,
        context: &Context<'_>,
    ) -> Result<()> {
        // Another stage may be writing its own entry.
        let _lock = self.store.lock("", context)?;
        let mut attributes = self.store.expect(KIND)?;
        let report = serde_json::to_value(report).map_err(|error| Error::internal(error.to_string()))?;
        let entry = json!({"recipe": recipe, "digest": recipe::digest(recipe), "report": report});
        if let Some(stages) = attributes.get_mut("stages").and_then(Value::as_object_mut) {
            stages.insert(stage.name().to_owned(), entry);
        }
        self.store.write_group("", attributes)
    }

    /// The report of a stage that is done.
    pub fn report<T: serde::de::DeserializeOwned>(&self, stage: Stage) -> Result<T> {
        self.stage_digest(stage)?;
        let entry = self.stage(stage)?.unwrap_or_default();
        serde_json::from_value(entry.get("report").cloned().unwrap_or_default()).map_err(|error| {
            Error::input(format!("{}: report of {}: {error}", self.path().display(), stage.name()))
                .hint("if another version of the program made this model, make it anew")
        })
    }

    /// Writes the directions of the measurement and their triangulations.
    pub fn write_directions(&self, description: &Description) -> Result<()> {
        for (dimension, directions) in [("view", &description.views), ("light", &description.lights)] {
            write_directions(&self.store, &format!("{dimension}_direction"), dimension, directions)?;
            let triangles = triangulate(directions);
            let corners: Vec<u16> = triangles.iter().flatten().copied().collect();
            let layout = Layout::small::<u16>(&["triangle", "corner"], &[triangles.len(), 3]);
            self.store.write(&format!("{dimension}_triangles"), &layout, &corners)?;
        }
        Ok(())
    }

    /// View directions and light directions.
    pub fn directions(&self) -> Result<[Vec<Direction>; 2]> {
        Ok([
            read_directions(&self.store, "view_direction")?,
            read_directions(&self.store, "light_direction")?,
        ])
    }

    /// Triangles of the views and of the lights: numbers of three directions each.
    pub fn triangles(&self) -> Result<[Vec<[u16; 3]>; 2]> {
        let read = |name: &str| -> Result<Vec<[u16; 3]>> {
            let (_, corners) = self.store.read::<u16>(name, &[0, 3])?;
            Ok(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
        };
        Ok([read("view_triangles")?, read("light_triangles")?])
    }

    /// Writes which measured texel each tile texel is, [y, x, 2].
    pub fn write_tile(&self, tile: &Tile) -> Result<()> {
        let coordinates: Vec<u32> = tile.source.iter().flatten().copied().collect();
        let layout = Layout::small::<u32>(&["y", "x", "row_column"], &[tile.size.height, tile.size.width, 2]);
        self.store.write("tile_source", &layout, &coordinates)
    }

    /// The tile.
    pub fn tile(&self) -> Result<Tile> {
        let report: Map<String, Value> = self.report(Stage::Tile)?;
        let wraps = report.get("wraps").and_then(Value::as_bool).unwrap_or(false);
        let (shape, coordinates) = self.store.read::<u32>("tile_source", &[0, 0, 2])?;
        let source: Vec<[u32; 2]> = coordinates.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        let plane = report.get("measurement_size").and_then(Value::as_array);
        let side = |axis: usize| plane.and_then(|plane| plane.get(axis)?.as_u64()).unwrap_or(0);
        let within = |[row, column]: &[u32; 2]| u64::from(*row) < side(0) && u64::from(*column) < side(1);
        if source.is_empty() || !source.iter().all(within) {
            return Err(
                self.damaged("tile_source", "a source lies outside the measurement, or there is none")
            );
        }
        Ok(Tile { size: Size::new(shape[0], shape[1]), source, wraps })
    }

    /// Writes what clusters are.
    pub fn write_clusters(&self, clusters: &Clusters) -> Result<()> {
        let count = clusters.sources.len();
        write_index(&self.store, clusters.size, &clusters.index, count)?;
        let [views, lights] = clusters.brdf;
        let layout = Layout::small::<u8>(&["cluster", "view", "light"], &[count, views, lights]);
        self.store.write("centres", &layout, &clusters.centres)?;
        self.write_representatives(&clusters.representatives, &clusters.sources)?;
        self.write_distance(count, &clusters.distance)
    }

    /// What clusters are.
    pub fn read_clusters(&self) -> Result<Clusters> {
        let count = self.clusters()?;
        let [views, lights] = self.directions()?;
        let brdf = [views.len(), lights.len()];
        let (_, sources) = self.store.read::<u32>("representative_texel", &[count, 2])?;
        Ok(Clusters {
            size: self.tile()?.size,
            index: self.index()?,
            brdf,
            centres: self.centres()?,
            representatives: self.representatives()?,
            sources: sources.chunks_exact(2).map(|c| [c[0], c[1]]).collect(),
            distance: self.distance()?,
        })
    }

    /// The cluster of each tile texel.
    pub fn index(&self) -> Result<Vec<u16>> {
        let Size { height, width } = self.tile()?.size;
        let wide = *self.store.open_array("index")?.data_type() == u16::data_type();
        let index = if wide {
            self.store.read::<u16>("index", &[height, width])?.1
        } else {
            self.store.read::<u8>("index", &[height, width])?.1.into_iter().map(u16::from).collect()
        };
        let clusters = self.clusters()?;
        match index.iter().find(|&&cluster| usize::from(cluster) >= clusters) {
            None => Ok(index),
            Some(cluster) => Err(self.damaged("index", &format!("cluster {cluster} of {clusters}"))),
        }
    }

    /// Number of clusters.
    fn clusters(&self) -> Result<usize> {
        let report: Map<String, Value> = self.report(Stage::Cluster)?;
        Ok(report.get("clusters").and_then(Value::as_u64).unwrap_or(0) as usize)
    }

    fn damaged(&self, array: &str, what: &str) -> Error {
        Error::input(format!("{}: {array}: {what}", self.path().display()))
            .hint("delete this array's folder and run the command that made it again")
    }

    /// Writes representatives [cluster, view, light, channel] and where each was measured.
    fn write_representatives(&self, representatives: &Representatives, texels: &[[u32; 2]]) -> Result<()> {
        let names = ["cluster", "view", "light", "channel"];
        let shape = &representatives.shape;
        let channels = &representatives.channels;
        self.store.write_samples("representatives", &names, shape, channels, &representatives.samples)?;
        let layout = Layout::small::<u32>(&["cluster", "row_column"], &[texels.len(), 2]);
        self.store.write(
            "representative_texel",
            &layout,
            &texels.iter().flatten().copied().collect::<Vec<_>>(),
        )
    }

    /// The measured colour BRDFs that stand for the clusters.
    pub fn representatives(&self) -> Result<Representatives> {
        self.representatives_of(0..self.clusters()?)
    }

    /// Ranges of clusters whose representatives are decoded together: at most 16 MiB, unless one is larger.
    pub fn representative_chunks(&self) -> Result<Vec<Range<usize>>> {
        let clusters = self.clusters()?;
        let rows = self.store.chunk_rows("representatives")?;
        Ok((0..clusters).step_by(rows).map(|first| first..clusters.min(first + rows)).collect())
    }

    /// The measured colour BRDFs that stand for some of the clusters.
    pub fn representatives_of(&self, clusters: Range<usize>) -> Result<Representatives> {
        let [views, lights] = self.directions()?;
        let (found, channels, samples) =
            self.store.read_samples_of("representatives", clusters.start as u64..clusters.end as u64)?;
        let expected = [self.clusters()?, views.len(), lights.len(), channels.len()];
        if found != expected || samples.is_empty() {
            let found = format!("got shape {found:?}, expected {expected:?} to fit the model");
            return Err(self.damaged("representatives", &found));
        }
        let report: Map<String, Value> = self.report(Stage::Tile)?;
        let transfer = report.get("transfer").cloned().unwrap_or_default();
        let transfer: Transfer = serde_json::from_value(transfer)
            .map_err(|error| Error::input(format!("{}: transfer: {error}", self.path().display())))?;
        let shape = [clusters.len(), views.len(), lights.len(), channels.len()];
        Ok(Representatives { shape, channels, samples, transfer })
    }

    /// Writes D of (26), [cluster, cluster], L* units.
    fn write_distance(&self, clusters: usize, distance: &[f32]) -> Result<()> {
        let mut layout = Layout::small::<f32>(&["cluster", "cluster_other"], &[clusters, clusters]);
        layout
            .attributes
            .insert("units".to_owned(), json!("L*, summed over directions with weight cos(theta_v)"));
        self.store.write("distance", &layout, distance)
    }

    /// D of (26), row by row.
    pub fn distance(&self) -> Result<Vec<f32>> {
        let clusters = self.clusters()?;
        let (_, distance) = self.store.read::<f32>("distance", &[clusters, clusters])?;
        if !distance.iter().all(|d| d.is_finite() && *d >= 0.0) {
            return Err(self.damaged("distance", "expected finite numbers >= 0"));
        }
        Ok(distance)
    }

    /// Writes the normal map [y, x, 3], unit vectors.
    pub fn write_normals(&self, size: Size, normals: &[[f32; 3]]) -> Result<()> {
        write_normals(&self.store, size, normals)
    }

    /// The normal map.
    pub fn normals(&self) -> Result<Vec<[f32; 3]>> {
        let Size { height, width } = self.tile()?.size;
        let (_, values) = self.store.read::<f32>("normals", &[height, width, 3])?;
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values.chunks_exact(3).map(|n| [n[0], n[1], n[2]]).collect()),
            Some(at) => {
                Err(self.damaged("normals", &format!("texel {} has a component {}", at / 3, values[at])))
            }
        }
    }

    /// Writes the random field model under `mrf/`.
    pub fn write_surface(&self, surface: &Surface) -> Result<()> {
        field::write(&self.store, surface)
    }

    /// Writes how the exemplar looks.
    pub fn write_appearance(&self, appearance: &Appearance) -> Result<()> {
        appearance::write(&self.store, appearance)
    }

    /// How the exemplar looks.
    pub fn appearance(&self) -> Result<Appearance> {
        let report: AppearanceReport = self.report(Stage::Appearance)?;
        appearance::read(&self.store, &report, self.tile()?.size, self.clusters()?)
    }

    /// L* codes of the clusters' centres, [cluster, view, light].
    pub fn centres(&self) -> Result<Vec<u8>> {
        let [views, lights] = self.directions()?;
        Ok(self.store.read::<u8>("centres", &[self.clusters()?, views.len(), lights.len()])?.1)
    }

    /// The random field model.
    pub fn surface(&self) -> Result<Surface> {
        field::read(&self.store, &self.report(Stage::Fit)?)
    }
}

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
    /// Row and column in the measurement of each representative.
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
    texels as u64 * if clusters <= 256 { 1 } else { 2 }
}

/// Measured colour BRDFs, one a cluster.
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

/// Writes an index [y, x] as u8 or u16 by the number of clusters.
fn write_index(store: &Store, size: Size, index: &[u16], clusters: usize) -> Result<()> {
    let shape = [size.height, size.width];
    if clusters <= 256 {
        let narrow: Vec<u8> = index.iter().map(|&cluster| cluster as u8).collect();
        store.write("index", &Layout::small::<u8>(&["y", "x"], &shape), &narrow)
    } else {
        store.write("index", &Layout::small::<u16>(&["y", "x"], &shape), index)
    }
}

/// Writes unit vectors [y, x, 3] in the sample frame.
fn write_normals(store: &Store, size: Size, normals: &[[f32; 3]]) -> Result<()> {
    let mut layout = Layout::small::<f32>(&["y", "x", "xyz"], &[size.height, size.width, 3]);
    layout.attributes.insert("frame".to_owned(), json!("x right, y up, z out of the surface"));
    store.write("normals", &layout, &normals.iter().flatten().copied().collect::<Vec<_>>())
}

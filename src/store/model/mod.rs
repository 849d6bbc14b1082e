//! The model store: what the analysis of a measurement leaves, everything an evaluator needs.
//!
//! Each stage (`tile`, `cluster`, `normals`, `fit`, `appearance`) writes its arrays and then, last, its entry in
//! the attributes: arrays without their entry are the remains of a run that was killed.

pub mod appearance;
pub mod field;
pub mod tile;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use btfkit_formats::{Direction, SampleType, Samples};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::color::{Decoder, Transfer};
use crate::disk::lock::Lock;
use crate::error::{Error, Result};
use crate::method::coherent::Appearance;
use crate::method::field::Surface;
use crate::method::tile::Tile;
use crate::method::value::triangulation::triangulate;
use crate::run::{Context, Existing, recipe};
use crate::shape::Size;
use crate::store::directions;
use crate::store::measurement::Description;
use crate::zarr::checksums::DIGITS;
use crate::zarr::{Array, DAMAGED, Layout, Named, SAMPLE_TYPES, Store, data_type_of, metadata};
use appearance::AppearanceReport;
use field::FieldReport;
use tile::TileReport;

/// The attribute `kind` of a model store.
pub const KIND: &str = "model";

/// Most clusters: the index is u16.
const MOST_CLUSTERS: usize = 1 << 16;

/// How far from 1 the length of a unit normal in f32 may be.
pub(crate) const UNIT_TOLERANCE: f32 = 1e-4;

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

    /// All of them, in the order of the data flow.
    pub const ALL: [Self; 5] = [Self::Tile, Self::Cluster, Self::Normals, Self::Fit, Self::Appearance];

    /// The stages that build on it, directly or not, in the order of the data flow.
    fn builders(self) -> &'static [Self] {
        match self {
            Self::Tile => &[Self::Cluster, Self::Normals, Self::Fit, Self::Appearance],
            Self::Cluster => &[Self::Appearance],
            Self::Normals => &[Self::Fit],
            Self::Fit | Self::Appearance => &[],
        }
    }

    /// The stage that it works on the result of, and the member of its recipe that names that one's digest.
    pub fn input(self) -> Option<(Self, &'static str)> {
        match self {
            Self::Tile => None,
            Self::Cluster | Self::Normals => Some((Self::Tile, "tile")),
            Self::Fit => Some((Self::Normals, "normals")),
            Self::Appearance => Some((Self::Cluster, "cluster")),
        }
    }
}

/// What the attributes hold of a stage that is done.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    recipe: Value,
    digest: String,
    report: Value,
    /// Of its arrays, by name; not in the oldest layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checksums: Option<BTreeMap<String, String>>,
}

/// As much of the report of stage `cluster` as the arrays are read by.
#[derive(Deserialize)]
struct ClusterFacts {
    clusters: usize,
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
        let mut store = Store::at(path);
        let mut attributes = Map::new();
        attributes.insert("stages".to_owned(), json!({}));
        store.begin(KIND, attributes, context)?;
        store.sweep()?;
        Ok(Self { store })
    }

    /// Opens a model for reading.
    pub fn open(path: &Path) -> Result<Self> {
        let model = Self { store: Store::open(path, KIND)?.0 };
        model.entries()?;
        Ok(model)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.store.path()
    }

    /// Version of its layout.
    pub fn format(&self) -> u64 {
        self.store.format()
    }

    /// Version of the program that began it.
    pub fn version(&self) -> Result<String> {
        let attributes = self.store.expect(KIND)?;
        Ok(attributes.get("version").and_then(Value::as_str).unwrap_or_default().to_owned())
    }

    /// The stages that are done.
    fn entries(&self) -> Result<BTreeMap<String, Entry>> {
        let attributes = self.store.expect(KIND)?;
        let damaged = |what: String| {
            Error::input(format!("{}: attribute btfkit.stages: {what}", self.path().display()))
                .hint("make the model anew, under another name")
        };
        let stages = attributes.get("stages").cloned().unwrap_or_default();
        let entries: BTreeMap<String, Entry> =
            serde_json::from_value(stages.clone()).map_err(|error| damaged(error.to_string()))?;
        for (name, entry) in &entries {
            if !Stage::ALL.iter().any(|stage| stage.name() == name) {
                return Err(damaged(format!("no stage is called {}", json!(name))));
            }
            if entry.digest != recipe::digest(&entry.recipe) {
                return Err(damaged(format!("{name}: digest: it is not that of the recipe")));
            }
            if entry.checksums.is_none() && self.store.format() > metadata::OLDEST_FORMAT {
                return Err(damaged(format!("{name}: no checksums")));
            }
        }
        Ok(entries)
    }

    fn entry(&self, stage: Stage) -> Result<Option<Entry>> {
        Ok(self.entries()?.remove(stage.name()))
    }

    fn done(&self, stage: Stage) -> Result<Entry> {
        self.entry(stage)?.ok_or_else(|| {
            Error::missing(format!("{}: stage {} has not been run", self.path().display(), stage.name()))
                .hint(format!("run `btf {}` (or `btf model`) on it first", stage.name()))
        })
    }

    /// The attributes of a stage that is done: `recipe`, `digest` and `report`.
    pub fn stage(&self, stage: Stage) -> Result<Option<Map<String, Value>>> {
        let Some(entry) = self.entry(stage)? else { return Ok(None) };
        let members = [("recipe", entry.recipe), ("digest", json!(entry.digest)), ("report", entry.report)];
        Ok(Some(members.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()))
    }

    /// Digest of a stage that must be done.
    pub fn stage_digest(&self, stage: Stage) -> Result<String> {
        Ok(self.done(stage)?.digest)
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
        if !self.is_done(stage, recipe)? {
            return Ok(Some(lock));
        }
        // Another program may have changed an array's attributes since.
        if !self.is_consolidated().unwrap_or(true) {
            let _lock = self.store.lock("", context)?;
            self.write_root(self.store.expect(KIND)?)?;
        }
        Ok(None)
    }

    /// Takes back a stage that another recipe made, and those that build on it: their entries first, then their arrays.
    fn take_back(&self, stage: Stage, recipe: &Value, context: &Context<'_>) -> Result<()> {
        match self.entry(stage)? {
            Some(entry) if entry.digest != recipe::digest(recipe) => {}
            _ => return Ok(()),
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
                    let report = entry.get("report").cloned().unwrap_or_default();
                    let of_stage = self.arrays(*taken, &report).unwrap_or_default();
                    arrays.extend(of_stage.into_iter().map(|(name, _)| name));
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
            self.write_root(attributes)?;
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
        self.has_arrays(stage)
    }

    /// Whether the arrays of a stage that is done are all there.
    pub fn has_arrays(&self, stage: Stage) -> Result<bool> {
        let report = self.done(stage)?.report;
        // Arrays that do not even have their metadata are not there.
        let Ok(arrays) = self.arrays(stage, &report) else { return Ok(false) };
        Ok(arrays.iter().all(|(name, layout)| {
            self.store.open_array(name, layout).is_ok_and(|array| self.store.has_all(&array))
        }))
    }

    /// Declares a stage done; to be called after its arrays are written.
    pub fn finish(
        &self,
        stage: Stage,
        recipe: &Value,
        report: &impl Serialize,
        context: &Context<'_>,
    ) -> Result<()> {
        let failed = |error: serde_json::Error| Error::internal(error.to_string());
        let report = serde_json::to_value(report).map_err(failed)?;
        let checksum = |(name, layout): (String, Layout<'_>)| {
            let array = self.store.open_array(&name, &layout)?;
            Ok((name, self.store.checksums(&array)?))
        };
        let checksums = self.arrays(stage, &report)?.into_iter().map(checksum).collect::<Result<_>>()?;
        let digest = recipe::digest(recipe);
        let entry = Entry { recipe: recipe.clone(), digest, report, checksums: Some(checksums) };
        // Another stage may be writing its own entry.
        let _lock = self.store.lock("", context)?;
        let mut attributes = self.store.expect(KIND)?;
        if let Some(stages) = attributes.get_mut("stages").and_then(Value::as_object_mut) {
            stages.insert(stage.name().to_owned(), serde_json::to_value(entry).map_err(failed)?);
        }
        self.write_root(attributes)
    }

    /// Writes the root with the metadata of the arrays of all stages that are done, as far as they are there.
    fn write_root(&self, attributes: Map<String, Value>) -> Result<()> {
        let names = |(name, entry): (&String, &Value)| {
            let stage = Stage::ALL.into_iter().find(|stage| stage.name() == name)?;
            let report = entry.get("report")?;
            Some(self.arrays(stage, report).ok()?.into_iter().map(|(name, _)| name))
        };
        let stages = attributes.get("stages").and_then(Value::as_object);
        let arrays: Option<Vec<_>> = stages.into_iter().flatten().map(names).collect();
        let arrays: Option<Vec<String>> = arrays.map(|arrays| arrays.into_iter().flatten().collect());
        match arrays.filter(|arrays| self.store.consolidated(arrays).is_ok()) {
            Some(arrays) => self.store.write_finished(attributes, &arrays),
            None => self.store.write_group("", attributes),
        }
    }

    /// Whether the root holds the metadata of all arrays as they are.
    ///
    /// # Errors
    /// Those of reading.
    pub fn is_consolidated(&self) -> Result<bool> {
        let mut names = Vec::new();
        for stage in Stage::ALL {
            if let Some(entry) = self.entry(stage)? {
                names.extend(self.arrays(stage, &entry.report)?.into_iter().map(|(name, _)| name));
            }
        }
        self.store.is_consolidated(&names)
    }

    /// The arrays of a stage with this report.
    fn arrays(&self, stage: Stage, report: &Value) -> Result<Vec<(String, Layout<'static>)>> {
        Ok(match stage {
            Stage::Tile => {
                let report: TileReport = self.typed(stage, report)?;
                let mut arrays = vec![("tile_source".to_owned(), tile_layout(report.size()))];
                for (dimension, directions) in ["view", "light"].into_iter().zip(self.directions()?) {
                    let names = directions::layouts(dimension, directions.len(), self.store.format());
                    arrays.extend(names);
                    let count = triangulate(&directions).len();
                    arrays.push((format!("{dimension}_triangles"), triangle_layout(dimension, count)));
                }
                arrays
            }
            Stage::Cluster => {
                let ClusterFacts { clusters } = self.typed(stage, report)?;
                let tile = self.tile_report()?;
                let [views, lights] = self.directions()?.map(|list| list.len());
                let (channels, samples) = self.values()?;
                [
                    ("index", index_layout(tile.size(), clusters)),
                    ("centres", centres_layout([clusters, views, lights])),
                    (
                        "representatives",
                        representatives_layout([clusters, views, lights], &channels, samples),
                    ),
                    ("representative_texel", texel_layout(clusters)),
                    ("distance", distance_layout(clusters)),
                ]
                .map(|(name, layout)| (name.to_owned(), layout))
                .into()
            }
            Stage::Normals => vec![("normals".to_owned(), normals_layout(self.tile_report()?.size()))],
            Stage::Fit => field::arrays(&self.typed(stage, report)?),
            Stage::Appearance => {
                let report: AppearanceReport = self.typed(stage, report)?;
                appearance::arrays(&report, self.clusters()?)
            }
        })
    }

    /// Opens an array of a stage.
    fn open_array(&self, stage: Stage, name: &str, layout: &Layout<'_>) -> Result<Array> {
        let array = self.store.open_array(name, layout).map_err(|error| match error.kind() {
            crate::ErrorKind::Missing => {
                error.hint(format!("run `btf {}` (or `btf model`) on it again", stage.name()))
            }
            _ => error,
        })?;
        let kept = self.done(stage)?.checksums;
        let Some(kept) = kept else { return Ok(array) };
        let kept = kept.get(name).map(String::as_str).unwrap_or_default();
        let found = self.store.checksums(&array)?;
        if found == kept {
            return Ok(array);
        }
        let row = (0..array.grid()[0]).find(|&row| {
            let digits = row as usize * DIGITS..(row as usize + 1) * DIGITS;
            kept.get(digits.clone()) != found.get(digits)
        });
        let mut place = vec![0; array.shape().len()];
        place[0] = row.unwrap_or(0);
        let file = self.store.chunk_path(&array, &place);
        let what = "its checksum is not the one that was kept: another chunk in its place, or a damaged one";
        Err(Error::input(format!("{}: {what}", file.display())).hint(DAMAGED))
    }

    /// Reads an array of a stage.
    fn read<T: Named>(&self, stage: Stage, name: &str, layout: &Layout<'_>) -> Result<Vec<T>> {
        let array = self.open_array(stage, name, layout)?;
        self.store.read_box(&array, &vec![0; array.shape().len()], array.shape())
    }

    fn typed<T: serde::de::DeserializeOwned>(&self, stage: Stage, report: &Value) -> Result<T> {
        serde_json::from_value(report.clone()).map_err(|error| {
            Error::input(format!("{}: report of {}: {error}", self.path().display(), stage.name()))
                .hint("if another version of the program made this model, make it anew")
        })
    }

    /// The report of a stage that is done.
    pub fn report<T: serde::de::DeserializeOwned>(&self, stage: Stage) -> Result<T> {
        self.typed(stage, &self.done(stage)?.report)
    }

    /// How the tile was cut.
    pub fn tile_report(&self) -> Result<TileReport> {
        let entry = self.done(Stage::Tile)?;
        let report: TileReport = self.typed(Stage::Tile, &entry.report)?;
        report.check(&entry.recipe).map_err(|what| {
            Error::input(format!("{}: report of tile: {what}", self.path().display()))
                .hint("make the model anew, under another name")
        })?;
        Ok(report)
    }

    /// Names of the channels, and type of the samples, of the representatives.
    fn values(&self) -> Result<(Vec<String>, SampleType)> {
        let report = self.tile_report()?;
        if let Some(values) = report.values() {
            return Ok(values);
        }
        // The oldest layout has them beside the array only.
        let document = self.store.array_document("representatives")?;
        let names = document.get("attributes").and_then(|attributes| attributes.get("channels"));
        let names = serde_json::from_value(names.cloned().unwrap_or_default());
        let name = document.get("data_type").and_then(Value::as_str).unwrap_or_default();
        let samples = SAMPLE_TYPES.into_iter().find(|samples| samples.name() == name);
        names
            .ok()
            .zip(samples)
            .ok_or_else(|| self.damaged("representatives", "no names of channels, or no samples"))
    }

    /// Writes the directions of the measurement and their triangulations.
    pub fn write_directions(&self, description: &Description) -> Result<()> {
        for (dimension, directions) in [("view", &description.views), ("light", &description.lights)] {
            directions::write(&self.store, dimension, directions)?;
            let triangles = triangulate(directions);
            let corners: Vec<u16> = triangles.iter().flatten().copied().collect();
            let layout = triangle_layout(dimension, triangles.len());
            self.store.write(&format!("{dimension}_triangles"), &layout, &corners)?;
        }
        Ok(())
    }

    /// View directions and light directions.
    pub fn directions(&self) -> Result<[Vec<Direction>; 2]> {
        Ok([directions::read(&self.store, "view")?, directions::read(&self.store, "light")?])
    }

    /// Checks that the coordinates by which other programs select are the directions.
    ///
    /// # Errors
    /// Where they are not.
    pub fn check_coordinates(&self) -> Result<()> {
        for (dimension, directions) in ["view", "light"].into_iter().zip(self.directions()?) {
            directions::check_coordinates(&self.store, dimension, &directions)?;
        }
        Ok(())
    }

    /// Triangles of the views and of the lights: numbers of three directions each.
    ///
    /// # Errors
    /// Where they are not the spherical Delaunay triangles of the directions.
    pub fn triangles(&self) -> Result<[Vec<[u16; 3]>; 2]> {
        let [views, lights] = self.directions()?;
        let read = |dimension: &str, directions: &[Direction]| -> Result<Vec<[u16; 3]>> {
            let expected = triangulate(directions);
            let name = format!("{dimension}_triangles");
            let corners =
                self.read::<u16>(Stage::Tile, &name, &triangle_layout(dimension, expected.len()))?;
            if corners != *expected.as_flattened() {
                return Err(self.damaged(&name, &format!("not the triangles of the {dimension} directions")));
            }
            Ok(expected)
        };
        Ok([read("view", &views)?, read("light", &lights)?])
    }

    /// Writes which measured texel each tile texel is, [y, x, 2].
    pub fn write_tile(&self, tile: &Tile) -> Result<()> {
        let coordinates: Vec<u32> = tile.source.iter().flatten().copied().collect();
        self.store.write("tile_source", &tile_layout(tile.size), &coordinates)
    }

    /// The tile.
    pub fn tile(&self) -> Result<Tile> {
        let report = self.tile_report()?;
        let coordinates = self.read::<u32>(Stage::Tile, "tile_source", &tile_layout(report.size()))?;
        let source: Vec<[u32; 2]> = coordinates.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        self.expect_measured("tile_source", &source, &report)?;
        Ok(Tile { size: report.size(), source, wraps: report.wraps })
    }

    /// Checks that texels lie in the measurement.
    fn expect_measured(&self, array: &str, source: &[[u32; 2]], report: &TileReport) -> Result<()> {
        let [rows, columns] = report.measurement_size;
        let beyond = |[row, column]: &&[u32; 2]| *row as usize >= rows || *column as usize >= columns;
        match source.iter().find(beyond) {
            None => Ok(()),
            Some([row, column]) => Err(self.damaged(
                array,
                &format!("row {row}, column {column} lie outside the measurement of {columns}x{rows}"),
            )),
        }
    }

    /// Writes what clusters are.
    pub fn write_clusters(&self, clusters: &Clusters) -> Result<()> {
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

    /// Row and column in the measurement of each representative.
    pub fn representative_texels(&self) -> Result<Vec<[u32; 2]>> {
        let layout = texel_layout(self.clusters()?);
        let sources = self.read::<u32>(Stage::Cluster, "representative_texel", &layout)?;
        let sources: Vec<[u32; 2]> = sources.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        self.expect_measured("representative_texel", &sources, &self.tile_report()?)?;
        Ok(sources)
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

    /// Number of clusters.
    pub fn clusters(&self) -> Result<usize> {
        let ClusterFacts { clusters } = self.report(Stage::Cluster)?;
        if (1..=MOST_CLUSTERS).contains(&clusters) {
            return Ok(clusters);
        }
        Err(Error::input(format!(
            "{}: report of cluster: clusters: got {clusters}, expected 1 to {MOST_CLUSTERS}",
            self.path().display()
        )))
    }

    fn damaged(&self, array: &str, what: &str) -> Error {
        Error::input(format!("{}: {array}: {what}", self.path().display()))
            .hint("delete this array's folder and run the command that made it again")
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
    pub fn representative_chunks(&self) -> Result<Vec<Range<usize>>> {
        let clusters = self.clusters()?;
        let rows = self.representatives_layout()?.chunk[0] as usize;
        Ok((0..clusters).step_by(rows).map(|first| first..clusters.min(first + rows)).collect())
    }

    /// The measured colour BRDFs that stand for some of the clusters.
    pub fn representatives_of(&self, clusters: Range<usize>) -> Result<Representatives> {
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

    /// Writes the normal map [y, x, 3], unit vectors.
    pub fn write_normals(&self, size: Size, normals: &[[f32; 3]]) -> Result<()> {
        self.store.write("normals", &normals_layout(size), normals.as_flattened())
    }

    /// The normal map.
    pub fn normals(&self) -> Result<Vec<[f32; 3]>> {
        let layout = normals_layout(self.tile_report()?.size());
        let values = self.read::<f32>(Stage::Normals, "normals", &layout)?;
        let normals = values.as_chunks::<3>().0;
        match normals.iter().position(|normal| !is_unit(normal)) {
            None => Ok(normals.to_vec()),
            Some(at) => {
                Err(self.damaged("normals", &format!("texel {at} has {:?}, no unit vector", normals[at])))
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
        let tile = self.tile_report()?;
        for (name, layout) in appearance::arrays(&report, self.clusters()?) {
            self.open_array(Stage::Appearance, &name, &layout)?;
        }
        appearance::read(&self.store, &report, tile.size(), tile.wraps, self.clusters()?)
    }

    /// L* codes of the clusters' centres, [cluster, view, light].
    pub fn centres(&self) -> Result<Vec<u8>> {
        let [views, lights] = self.directions()?.map(|list| list.len());
        self.read::<u8>(Stage::Cluster, "centres", &centres_layout([self.clusters()?, views, lights]))
    }

    /// The random field model.
    pub fn surface(&self) -> Result<Surface> {
        let entry = self.done(Stage::Fit)?;
        let report: FieldReport = self.typed(Stage::Fit, &entry.report)?;
        report.check(&entry.recipe).map_err(|what| {
            Error::input(format!("{}: report of fit: {what}", self.path().display()))
                .hint("make the model anew, under another name")
        })?;
        for (name, layout) in field::arrays(&report) {
            self.open_array(Stage::Fit, &name, &layout)?;
        }
        field::read(&self.store, &report)
    }
}

/// Whether a vector is a unit vector, as far as f32 goes.
pub(crate) fn is_unit(normal: &[f32; 3]) -> bool {
    let length = normal.iter().map(|value| value * value).sum::<f32>().sqrt();
    (length - 1.0).abs() <= UNIT_TOLERANCE
}

/// Clusters that a narrow index, of u8, can tell apart.
pub(crate) const NARROW: usize = 256;

fn tile_layout(size: Size) -> Layout<'static> {
    Layout::small::<u32>(&["y", "x", "row_column"], &[size.height, size.width, 2])
}

fn triangle_layout(dimension: &str, count: usize) -> Layout<'static> {
    // A name for each list: other programs take one length for one name.
    let names: &[&str] =
        if dimension == "view" { &["view_triangle", "corner"] } else { &["light_triangle", "corner"] };
    Layout::small::<u16>(names, &[count, 3])
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

fn normals_layout(size: Size) -> Layout<'static> {
    Layout::small::<f32>(&["y", "x", "xyz"], &[size.height, size.width, 3])
        .with("frame", "x right, y up, z out of the surface")
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
    texels as u64 * if clusters <= NARROW { 1 } else { 2 }
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

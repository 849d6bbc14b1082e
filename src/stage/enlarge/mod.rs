//! Model to enlarged index: synthesise normals row by row, find each one's nearest normals of the
//! tile, choose by (25). Rows flow through; memory is some bands and a row of shards.

mod pipeline;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::mrf::{Extent, Surface, Synthesis};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::{self, METHOD};
use crate::shape::{Size, Window};
use crate::stage::cluster;
use crate::store::enlarge_state::EnlargeState;
use crate::store::enlarged::{Description, Enlarged, SHARD_SIDE};
use crate::store::model::{Model, Stage, index_bytes};
use crate::texel::nearest::NearestNormals;
use crate::texel::scan::Scan;
use pipeline::{Band, Chooser, Pipeline, Source};

/// Bytes of a band of normals and candidates, unless its rows are given. Small, so that the stations of the pipeline
/// are soon all at work, and a band is still in a cache when the next station takes it.
const BAND_BYTES: usize = 2 << 20;

/// Bands on their way at a time.
const BANDS: usize = 3;

/// How to enlarge.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
    /// The enlarged index to make; of several seeds, what their names begin with.
    pub output: PathBuf,
    /// Rows and columns.
    pub size: Size,
    /// Seeds of the noise, one output each.
    pub seeds: RangeInclusive<u64>,
    /// Number of nearest normals that are candidates, n_k.
    pub candidates: usize,
    /// Whether the output joins at its own borders.
    pub tileable: bool,
    /// Write the synthesised normals too.
    pub keep_normals: bool,
    /// Rows whose candidates are sought at a time; as many as fit 2 MiB where absent. Changes no byte.
    pub band_rows: Option<usize>,
}

/// An enlargement, ready to run.
pub struct Plan {
    model: Model,
    surface: Surface,
    options: Options,
    clusters: cluster::Report,
    /// Size of the tile.
    tile: Size,
    outputs: Vec<Output>,
    /// Bytes that the field takes.
    field_bytes: u64,
}

/// One output of a plan.
struct Output {
    seed: u64,
    path: PathBuf,
    recipe: Value,
}

/// How it went, and what it saves.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The enlarged index.
    pub output: PathBuf,
    /// Its seed.
    pub seed: u64,
    /// Bytes of the enlarged index and of the representatives that it refers to.
    pub stored_bytes: u64,
    /// Bytes of the enlarged BTF's raw samples.
    pub raw_bytes: u64,
    /// Rows of shards found done.
    pub shard_rows_found: usize,
    /// Rows of shards written by this run.
    pub shard_rows_written: usize,
}

/// Checks that the model is complete and can be enlarged to this size.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let digest = model.digest()?;
    let tile = model.tile()?.size;
    if !(1..=tile.texels()).contains(&options.candidates) {
        return Err(Error::usage(format!(
            "{} candidates were asked for, expected 1 to {} for this tile",
            options.candidates,
            tile.texels()
        )));
    }
    let recipe = |seed: u64| {
        json!({
            "stage": "enlarge", "method": METHOD,
            "model": digest,
            "size": [options.size.height, options.size.width],
            "seed": seed,
            "candidates": options.candidates,
            "tileable": options.tileable,
            "keep_normals": options.keep_normals,
        })
    };
    let several = options.seeds.start() != options.seeds.end();
    let output = |seed: u64| Output {
        seed,
        path: if several { numbered(&options.output, seed) } else { options.output.clone() },
        recipe: recipe(seed),
    };
    let outputs: Vec<Output> = options.seeds.clone().map(output).collect();
    if outputs.is_empty() {
        return Err(Error::usage("no seed: the first of a range must not be above the last"));
    }
    let surface = model.surface()?;
    let field_bytes =
        Synthesis::memory_bytes(&surface.field, options.size.height, options.size.width, options.extent())?;
    let clusters: cluster::Report = model.report(Stage::Cluster)?;
    Ok(Plan { model, surface, options: options.clone(), clusters, tile, outputs, field_bytes })
}

/// `plane.zarr` with a number: `plane-3.zarr`.
fn numbered(output: &Path, number: u64) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match name.strip_suffix(".zarr") {
        Some(stem) => output.with_file_name(format!("{stem}-{number}.zarr")),
        None => output.with_file_name(format!("{name}-{number}")),
    }
}

impl Options {
    fn extent(&self) -> Extent {
        if self.tileable { Extent::Wrapping } else { Extent::Endless }
    }
}

/// What all outputs of a plan share.
struct Shared {
    nearest: NearestNormals,
    scan: Scan,
    kernel: Kernel,
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        json!({
            "stage": "enlarge",
            "outputs": self.outputs.iter().map(|output| &output.path).collect::<Vec<_>>(),
            "units": self.options.size.height.div_ceil(SHARD_SIDE) * self.outputs.len(),
            "unit": "row of shards",
            "index_bytes": self.index_bytes(),
            "memory_bytes": self.memory_bytes(),
            "recipes": self.outputs.iter().map(|output| &output.recipe).collect::<Vec<_>>(),
        })
    }

    /// Bytes of one output.
    fn index_bytes(&self) -> u64 {
        index_bytes(self.options.size.texels(), self.clusters.clusters)
    }

    fn band_rows(&self) -> usize {
        let row_bytes = Band::row_bytes(self.options.size.width, self.options.candidates);
        self.options.band_rows.unwrap_or(BAND_BYTES / row_bytes).clamp(1, SHARD_SIDE)
    }

    /// Bands, a row of shards, the field, and what belongs to the tile.
    fn memory_bytes(&self) -> u64 {
        let Options { size, candidates, keep_normals, .. } = self.options;
        let bands = BANDS * self.band_rows() * Band::row_bytes(size.width, candidates);
        let texel_bytes = size_of::<u16>() + if keep_normals { size_of::<[f32; 3]>() } else { 0 };
        let shards = SHARD_SIDE.min(size.height) * size.width * texel_bytes;
        let tile = NearestNormals::most_bytes(self.tile.texels())
            + self.clusters.clusters * self.clusters.clusters * size_of::<f32>();
        (bands + shards + tile) as u64 + self.field_bytes
    }

    /// Makes the outputs one after the other, each from where it was left.
    pub fn run(&self, context: &Context<'_>) -> Result<Vec<Report>> {
        if self.memory_bytes() > context.memory_bytes {
            return Err(Error::usage(format!(
                "an enlargement {} texels wide takes {} MiB of memory, {} MiB are allowed",
                self.options.size.width,
                self.memory_bytes() >> 20,
                context.memory_bytes >> 20
            ))
            .hint(
                "choose a lower --band, a larger --memory or a smaller width, or leave out --keep-normals",
            ));
        }
        // All that can fail for the model's sake comes before an output is begun.
        let kernel = Kernel::fastest();
        let normals = self.model.normals()?;
        let shared = Shared {
            nearest: context.install(|| NearestNormals::new(&normals, self.options.candidates, kernel)),
            scan: Scan::new(self.model.index()?, &self.model.distance()?),
            kernel,
        };
        self.outputs.iter().map(|output| self.make(output, &shared, context)).collect()
    }

    /// Makes one output.
    fn make(&self, output: &Output, shared: &Shared, context: &Context<'_>) -> Result<Report> {
        let Options { size, candidates, keep_normals, tileable, .. } = self.options;
        let Size { height, width } = size;
        let digest = recipe::digest(&output.recipe);
        let mut field = Synthesis::new(
            &self.surface.field,
            output.seed,
            height,
            width,
            self.options.extent(),
            shared.kernel,
        )?;
        let description = Description { size, clusters: self.clusters.clusters, keep_normals };
        let store = Enlarged::create(&output.path, &description, &output.recipe, &self.options.model)?;
        let state = EnlargeState::read(&output.path, &digest)?;
        let found = match &state {
            Some(state) => state.shard_rows,
            None if store.is_whole() => store.shard_rows(),
            None => 0,
        };
        let report = Report {
            output: output.path.clone(),
            seed: output.seed,
            stored_bytes: self.index_bytes() + self.clusters.representative_bytes,
            raw_bytes: self.clusters.tile_bytes / self.tile.texels() as u64 * size.texels() as u64,
            shard_rows_found: found,
            shard_rows_written: store.shard_rows().saturating_sub(found),
        };
        if report.shard_rows_written == 0 {
            EnlargeState::remove(&output.path)?;
            return Ok(report);
        }
        if let Some(state) = &state {
            field.restore(&state.field).map_err(|error| error.context(output.path.display()))?;
        }
        let done = found * SHARD_SIDE;
        let stored_row = |y: usize| store.read(Window { y, x: 0, size: Size::new(1, width) });
        let shard_texels = SHARD_SIDE.min(height) * width;
        let source = Source { surface: &self.surface, field, height, width, band_rows: self.band_rows() };
        let chooser = Chooser {
            scan: &shared.scan,
            height,
            width,
            keep_normals,
            above: (done > 0).then(|| stored_row(done - 1)).transpose()?,
            first: (tileable && done > 0).then(|| stored_row(0)).transpose()?,
            wraps: tileable,
            row: done,
            index: Vec::with_capacity(shard_texels),
            normals: Vec::with_capacity(if keep_normals { 3 * shard_texels } else { 0 }),
        };
        let mut pipeline = Pipeline::new(source, &shared.nearest, chooser, candidates);
        context.progress.begin("enlarge", size.texels() as u64, Counted::Items("texels"));
        context.progress.advance((done * width) as u64);
        while let Some((rows, completed)) = context.install(|| pipeline.step())? {
            if let Some(row) = completed {
                context.install(|| store.write_shard_row(row.number, &row.index, &row.normals))?;
                let state = EnlargeState { shard_rows: row.number + 1, field: row.state };
                state.write(&output.path, &digest)?;
            }
            context.progress.advance((rows * width) as u64);
            context.check_stop()?;
        }
        EnlargeState::remove(&output.path)?;
        context.progress.end();
        Ok(report)
    }
}

//! Model to enlarged index: synthesise normals row by row, find each one's nearest normals of the
//! tile, choose by (25). Rows flow through; memory is a band and a row of shards.

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::mrf::{Extent, Synthesis};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::METHOD;
use crate::shape::{Size, Window};
use crate::stage::cluster;
use crate::store::enlarged::{Description, Enlarged, SHARD_SIDE};
use crate::store::model::{Model, Stage};
use crate::texel::nearest::{NearestNormals, Neighbour};
use crate::texel::scan::Scan;

/// Bytes of candidates and normals in a band, unless its rows are given.
const BAND_BYTES: usize = 64 << 20;

/// How to enlarge.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: PathBuf,
    /// The enlarged index to make.
    pub output: PathBuf,
    /// Rows and columns.
    pub size: Size,
    /// Seed of the noise.
    pub seed: u64,
    /// Number of nearest normals that are candidates, n_k.
    pub candidates: usize,
    /// Write the synthesised normals too.
    pub keep_normals: bool,
    /// Rows whose candidates are sought at a time; as many as fit 64 MiB where absent. Changes no byte.
    pub band_rows: Option<usize>,
}

/// An enlargement, ready to run.
pub struct Plan {
    model: Model,
    options: Options,
    description: Description,
    clusters: cluster::Report,
    /// Texels of the tile.
    texels: u64,
    recipe: Value,
}

/// How it went, and what it saves.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Bytes of the enlarged index and of the representatives that it refers to.
    pub stored_bytes: u64,
    /// Bytes of the enlarged BTF's raw samples.
    pub raw_bytes: u64,
    /// Rows of shards found done.
    pub shard_rows_found: usize,
    /// Rows of shards written by this run.
    pub shard_rows_written: usize,
}

/// Checks that the model is complete.
pub fn plan(options: &Options) -> Result<Plan> {
    let model = Model::open(&options.model)?;
    let digest = model.digest()?;
    let texels = model.tile()?.size.texels();
    if !(1..=texels).contains(&options.candidates) {
        return Err(Error::usage(format!(
            "{} candidates were asked for, expected 1 to {texels} for this tile",
            options.candidates
        )));
    }
    let clusters: cluster::Report = model.report(Stage::Cluster)?;
    let recipe = json!({
        "stage": "enlarge", "method": METHOD,
        "model": digest,
        "size": [options.size.height, options.size.width],
        "seed": options.seed,
        "candidates": options.candidates,
        "keep_normals": options.keep_normals,
    });
    let description =
        Description { size: options.size, clusters: clusters.clusters, keep_normals: options.keep_normals };
    Ok(Plan { model, options: options.clone(), description, clusters, texels: texels as u64, recipe })
}

impl Plan {
    /// What would be done.
    pub fn summary(&self) -> Value {
        let height = self.options.size.height;
        json!({
            "stage": "enlarge",
            "output": self.options.output,
            "units": height.div_ceil(SHARD_SIDE),
            "unit": "row of shards",
            "index_bytes": self.index_bytes(),
            "memory_bytes": self.memory_bytes(),
            "recipe": self.recipe,
        })
    }

    fn index_bytes(&self) -> u64 {
        self.options.size.texels() as u64 * if self.description.clusters > 256 { 2 } else { 1 }
    }

    fn band_row_bytes(&self) -> usize {
        self.options.size.width * (size_of::<Neighbour>() * self.options.candidates + size_of::<[f32; 3]>())
    }

    fn band_rows(&self) -> usize {
        self.options.band_rows.unwrap_or(BAND_BYTES / self.band_row_bytes()).clamp(1, SHARD_SIDE)
    }

    /// Band, row of shards, and about twenty rows of three levels' fields in f64.
    fn memory_bytes(&self) -> u64 {
        let width = self.options.size.width;
        let shards = SHARD_SIDE * width * if self.options.keep_normals { 14 } else { 2 };
        let field = 20 * 2 * width * 3 * size_of::<f64>();
        (self.band_rows() * self.band_row_bytes() + shards + field) as u64
    }

    /// Makes the rows of shards that are not there yet.
    ///
    /// After an interruption the field is run through again (its rows depend on those above), but
    /// candidates are only sought for rows of shards that are missing.
    pub fn run(&self, context: &Context<'_>) -> Result<Report> {
        let Size { height, width } = self.options.size;
        if self.memory_bytes() > context.memory_bytes {
            return Err(Error::usage(format!(
                "an enlargement {width} texels wide takes {} MiB of memory, {} MiB are allowed",
                self.memory_bytes() >> 20,
                context.memory_bytes >> 20
            ))
            .hint(
                "choose a lower --band, a larger --memory or a smaller width, or leave out --keep-normals",
            ));
        }
        // All that can fail for the model's sake comes before the output is begun.
        let normals = NearestNormals::new(&self.model.normals()?);
        let scan = Scan::new(self.model.index()?, self.model.distance()?);
        let mut field = Synthesis::new(
            &self.model.field()?,
            self.options.seed,
            height,
            width,
            Extent::Endless,
            Kernel::fastest(),
        )?;
        let output =
            Enlarged::create(&self.options.output, &self.description, &self.recipe, &self.options.model)?;
        let found = (0..output.shard_rows()).take_while(|&row| output.has_shard_row(row)).count();
        let report = Report {
            stored_bytes: self.index_bytes() + self.clusters.representative_bytes,
            raw_bytes: self.clusters.tile_bytes / self.texels * self.options.size.texels() as u64,
            shard_rows_found: found,
            shard_rows_written: output.shard_rows() - found,
        };
        if report.shard_rows_written == 0 {
            return Ok(report);
        }
        context.progress.begin("enlarge", (height * width) as u64, Counted::Items("texels"));
        let done = (found * SHARD_SIDE).min(height);
        for _ in 0..done {
            context.check_stop()?;
            field.skip_rows(1)?;
            context.progress.advance(width as u64);
        }
        let mut above: Option<Vec<u16>> = match done {
            0 => None,
            _ => Some(output.read(Window { y: done - 1, x: 0, size: Size::new(1, width) })?),
        };
        for shard_row in found..output.shard_rows() {
            let rows = SHARD_SIDE.min(height - shard_row * SHARD_SIDE);
            let mut index = Vec::with_capacity(rows * width);
            let mut kept = Vec::new();
            for first in (0..rows).step_by(self.band_rows()) {
                let band_rows = self.band_rows().min(rows - first);
                let band = synthesise(&mut field, band_rows, width, context)?;
                let candidates = context.install(|| self.candidates(&normals, &band));
                for candidates in candidates.chunks_exact(width * self.options.candidates) {
                    let mut sources = vec![0; width];
                    scan.choose_row(candidates, above.as_deref(), &mut sources);
                    let clusters: Vec<u16> = sources.iter().map(|&texel| scan.cluster(texel)).collect();
                    index.extend_from_slice(&clusters);
                    above = Some(clusters);
                }
                if self.options.keep_normals {
                    kept.extend(band.iter().flatten().copied());
                }
                context.progress.advance((band_rows * width) as u64);
            }
            output.write_shard_row(shard_row, &index, &kept)?;
        }
        context.progress.end();
        Ok(report)
    }

    fn candidates(&self, normals: &NearestNormals, band: &[[f32; 3]]) -> Vec<Neighbour> {
        let per_texel = self.options.candidates;
        let mut candidates = vec![Neighbour { distance: 0.0, texel: 0 }; band.len() * per_texel];
        candidates
            .par_chunks_exact_mut(per_texel)
            .zip(band)
            .with_min_len(256)
            .for_each(|(found, &normal)| normals.find(normal, found));
        candidates
    }
}

/// The next rows of the field as unit normals.
fn synthesise(
    field: &mut Synthesis,
    rows: usize,
    width: usize,
    context: &Context<'_>,
) -> Result<Vec<[f32; 3]>> {
    let mut band = Vec::with_capacity(rows * width);
    let mut row = vec![0.0; width * 3];
    for _ in 0..rows {
        context.check_stop()?;
        field.next_row(&mut row)?;
        band.extend((0..width).map(|x| unit([0, 1, 2].map(|axis| f64::from(row[axis * width + x])))));
    }
    Ok(band)
}

/// A synthesised vector brought back to unit length; one without direction points up.
fn unit(vector: [f64; 3]) -> [f32; 3] {
    let length = (vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]).sqrt();
    if length > 0.0 { vector.map(|value| (value / length) as f32) } else { [0.0, 0.0, 1.0] }
}

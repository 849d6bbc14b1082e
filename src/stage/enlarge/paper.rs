//! The paper's rule: synthesise normals row by row, find each one's nearest normals of the tile, choose by (25). Rows
//! flow through; memory is some bands and a row of shards.

use super::pipeline::{Band, Chooser, Pipeline, Source};
use super::{Output, Rule, Subject, Units};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::method::field::{Extent, Surface, Synthesis};
use crate::method::index::nearest::NearestNormals;
use crate::method::index::scan::Scan;
use crate::run::Context;
use crate::run::budget::OWN_BYTES;
use crate::run::progress::Counted;
use crate::run::recipe;
use crate::run::shard::Shard;
use crate::shape::{Size, Window};
use crate::store::enlarged::state::EnlargeState;
use crate::store::enlarged::{Description, EnlargeRecipe, Enlarged, Method, SHARD_SIDE, Texels};
use crate::words::counted;

/// Candidates unless their number is given.
const CANDIDATES: usize = 16;

/// Bytes of a band of normals and candidates, unless its rows are given. Small, so that the stations of the pipeline
/// are soon all at work, and a band is still in a cache when the next station takes it.
const BAND_BYTES: usize = 2 << 20;

/// Bands on their way at a time.
const BANDS: usize = 3;

/// Settings of the paper's rule.
#[derive(Clone, Debug)]
pub struct Options {
    /// Number of nearest normals that are candidates, n_k; where absent, [`CANDIDATES`], or all of a smaller tile.
    pub candidates: Option<usize>,
    /// Write the synthesised normals too.
    pub keep_normals: bool,
    /// Rows whose candidates are sought at a time; as many as fit 2 MiB where absent. Changes no byte.
    pub band_rows: Option<usize>,
}

/// The paper's rule on a model.
pub(super) struct Paper {
    options: Options,
    candidates: usize,
    surface: Surface,
    /// Bytes that the field takes.
    field_bytes: u64,
}

/// What all outputs share.
struct Shared {
    nearest: NearestNormals,
    scan: Scan,
    kernel: Kernel,
}

impl Options {
    /// Candidates of a tile of so many texels.
    fn candidates(&self, texels: usize) -> usize {
        self.candidates.unwrap_or(CANDIDATES.min(texels))
    }

    fn band_rows(&self, width: usize, candidates: usize) -> usize {
        self.band_rows.unwrap_or(BAND_BYTES / Band::row_bytes(width, candidates)).clamp(1, SHARD_SIDE)
    }
}

/// Memory that a run takes beside the field: the program, bands, a row of shards, and what belongs to a tile of so many
/// texels and clusters.
pub(super) fn bytes(options: &Options, size: Size, texels: usize, clusters: usize) -> u64 {
    let Size { height, width } = size;
    let candidates = options.candidates(texels);
    let bands = BANDS * options.band_rows(width, candidates) * Band::row_bytes(width, candidates);
    let texel_bytes = size_of::<u16>() + if options.keep_normals { size_of::<[f32; 3]>() } else { 0 };
    let shards = SHARD_SIDE.min(height) * width * texel_bytes;
    let tile = NearestNormals::most_bytes(texels) + clusters * clusters * size_of::<f32>();
    OWN_BYTES + (bands + shards + tile) as u64
}

impl Paper {
    pub(super) fn open(subject: &Subject, options: &Options) -> Result<Self> {
        let texels = subject.tile.texels();
        let candidates = options.candidates(texels);
        if !(1..=texels).contains(&candidates) {
            return Err(Error::usage(format!(
                "got --candidates {candidates}, expected 1 to {texels} for a tile of {}",
                counted(texels, "texel")
            )));
        }
        if subject.options.shard != Shard::WHOLE {
            return Err(Error::usage(
                "the paper's rule goes from the top down and cannot be made in parts by --shard",
            )
            .hint("leave out --shard, or choose --method coherent"));
        }
        let surface = subject.model.surface()?;
        let Size { height, width } = subject.options.size;
        let field_bytes = Synthesis::memory_bytes(&surface.field, height, width, extent(subject))?;
        Ok(Self { options: options.clone(), candidates, surface, field_bytes })
    }

    /// Makes one output.
    fn make_one(
        &self,
        subject: &Subject,
        output: &Output,
        shared: &Shared,
        context: &Context<'_>,
    ) -> Result<Units> {
        let (candidates, keep_normals) = (self.candidates, self.options.keep_normals);
        let super::Options { size, tileable, .. } = subject.options;
        let Size { height, width } = size;
        let digest = recipe::digest(&output.recipe);
        let mut field =
            Synthesis::new(&self.surface.field, output.seed, height, width, extent(subject), shared.kernel)?;
        let description = Description {
            size,
            clusters: subject.clusters.clusters,
            tile: subject.tile,
            keep_source: false,
            keep_normals,
        };
        let store =
            Enlarged::create(&output.path, &description, &output.recipe, &subject.options.model, context)?;
        let state = EnlargeState::read(&output.path, &digest)?;
        let shard_rows = store.shards().height;
        let found = match &state {
            Some(state) => state.shard_rows,
            None if store.is_whole() => shard_rows,
            None => 0,
        };
        let units = Units { found, written: shard_rows.saturating_sub(found) };
        if units.written == 0 {
            EnlargeState::remove(&output.path)?;
            return Ok(units);
        }
        if let Some(state) = &state {
            field.restore(&state.field).map_err(|error| error.context(output.path.display()))?;
        }
        let done = found * SHARD_SIDE;
        let stored_row = |y: usize| store.read(Window { y, x: 0, size: Size::new(1, width) });
        let shard_texels = SHARD_SIDE.min(height) * width;
        let band_rows = self.options.band_rows(width, candidates);
        let source = Source { surface: &self.surface, field, height, width, band_rows };
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
                let y = row.number * SHARD_SIDE;
                let window = Window { y, x: 0, size: Size::new(row.index.len() / width, width) };
                let texels = Texels { index: &row.index, source: &[], normals: &row.normals };
                context.install(|| store.write(window, texels))?;
                let state = EnlargeState { shard_rows: row.number + 1, field: row.state };
                state.write(&output.path, &digest)?;
            }
            context.progress.advance((rows * width) as u64);
            context.check_stop()?;
        }
        EnlargeState::remove(&output.path)?;
        context.progress.end();
        Ok(units)
    }
}

impl Rule for Paper {
    fn method(&self) -> Method {
        Method::Paper
    }

    fn units(&self, subject: &Subject) -> (&'static str, usize) {
        ("rows of shards", subject.options.size.height.div_ceil(SHARD_SIDE))
    }

    fn describe(&self, recipe: &mut EnlargeRecipe) {
        recipe.candidates = Some(self.candidates);
        recipe.keep_normals = self.options.keep_normals;
    }

    fn memory_bytes(&self, subject: &Subject, _threads: usize) -> u64 {
        let (tile, clusters) = (subject.tile.texels(), subject.clusters.clusters);
        bytes(&self.options, subject.options.size, tile, clusters) + self.field_bytes
    }

    fn advice(&self) -> &'static str {
        "choose a lower --band or a smaller width, or leave out --keep-normals"
    }

    fn make(&self, subject: &Subject, outputs: &[Output], context: &Context<'_>) -> Result<Vec<Units>> {
        // All that can fail for the model's sake comes before an output is begun.
        let kernel = Kernel::fastest();
        let normals = subject.model.normals()?;
        let shared = Shared {
            nearest: context.compute(|| NearestNormals::new(&normals, self.candidates, kernel)),
            scan: Scan::new(subject.model.index()?, &subject.model.distance()?),
            kernel,
        };
        outputs.iter().map(|output| self.make_one(subject, output, &shared, context)).collect()
    }
}

fn extent(subject: &Subject) -> Extent {
    if subject.options.tileable { Extent::Wrapping } else { Extent::Endless }
}

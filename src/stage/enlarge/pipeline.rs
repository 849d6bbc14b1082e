//! Rows on their way from the field to the index: while the field makes one band, the candidates of the band before
//! are sought on all threads, and the scan chooses in the band before that.

use rayon::prelude::*;

use crate::error::Result;
use crate::method::field::{Surface, Synthesis};
use crate::method::index::nearest::NearestNormals;
use crate::method::index::scan::{Neighbours, Scan};
use crate::store::enlarged::SHARD_SIDE;

/// Texels whose candidates are sought in one go.
const TEXELS_AT_ONCE: usize = 512;

/// Some rows; never of two rows of shards.
#[derive(Default)]
pub(super) struct Band {
    rows: usize,
    normals: Vec<[f32; 3]>,
    /// n_k texels of the tile for each texel.
    candidates: Vec<u32>,
    /// State of the field after the band, where a row of shards ends.
    state: Option<Vec<u8>>,
}

impl Band {
    /// Bytes a row of `width` texels takes.
    pub(super) fn row_bytes(width: usize, candidates: usize) -> usize {
        width * (size_of::<[f32; 3]>() + candidates * size_of::<u32>())
    }
}

/// Makes the bands of normals, from the top down.
pub(super) struct Source<'a> {
    pub(super) surface: &'a Surface,
    pub(super) field: Synthesis,
    pub(super) height: usize,
    pub(super) width: usize,
    /// Most rows of a band.
    pub(super) band_rows: usize,
}

impl Source<'_> {
    /// Fills `band` with the next rows; with none where all have been given.
    fn fill(&mut self, band: &mut Band) -> Result<()> {
        let first = self.field.position();
        let shard_end = (first / SHARD_SIDE + 1) * SHARD_SIDE;
        let end = (first + self.band_rows).min(shard_end).min(self.height);
        band.rows = end - first;
        band.normals.resize(band.rows * self.width, [0.0; 3]);
        self.surface.next_rows(&mut self.field, self.width, &mut band.normals)?;
        let ends_shards = band.rows > 0 && (end == shard_end || end == self.height);
        band.state = ends_shards.then(|| self.field.state());
        Ok(())
    }
}

/// Chooses the index, from the top down.
pub(super) struct Chooser<'a> {
    pub(super) scan: &'a Scan,
    pub(super) height: usize,
    pub(super) width: usize,
    pub(super) keep_normals: bool,
    /// Clusters of the row above, where there is one.
    pub(super) above: Option<Vec<u16>>,
    /// Clusters of the first row, which the last row of an index that wraps lies beside.
    pub(super) first: Option<Vec<u16>>,
    /// Whether the index wraps.
    pub(super) wraps: bool,
    /// The next row.
    pub(super) row: usize,
    /// What there is of the row of shards.
    pub(super) index: Vec<u16>,
    pub(super) normals: Vec<f32>,
}

/// A row of shards.
pub(super) struct ShardRow {
    pub(super) number: usize,
    pub(super) index: Vec<u16>,
    pub(super) normals: Vec<f32>,
    /// State of the field after it.
    pub(super) state: Vec<u8>,
}

impl Chooser<'_> {
    /// Chooses the rows of a band; gives the row of shards that they complete.
    fn take(&mut self, band: &mut Band, candidates: usize) -> Option<ShardRow> {
        let mut sources = vec![0; self.width];
        for candidates in band.candidates.chunks_exact(self.width * candidates) {
            let is_last = self.row + 1 == self.height;
            let neighbours = Neighbours {
                above: self.above.as_deref(),
                below: self.first.as_deref().filter(|_| is_last && self.row > 0),
                wraps: self.wraps,
            };
            self.scan.choose_row(candidates, neighbours, &mut sources);
            let mut clusters = self.above.take().unwrap_or_default();
            clusters.clear();
            clusters.extend(sources.iter().map(|&texel| self.scan.cluster(texel)));
            self.index.extend_from_slice(&clusters);
            if self.row == 0 && self.wraps {
                self.first = Some(clusters.clone());
            }
            self.above = Some(clusters);
            self.row += 1;
        }
        if self.keep_normals {
            self.normals.extend(band.normals.iter().flatten());
        }
        let capacity = (self.index.len(), self.normals.len());
        band.state.take().map(|state| ShardRow {
            number: (self.row - 1) / SHARD_SIDE,
            index: std::mem::replace(&mut self.index, Vec::with_capacity(capacity.0)),
            normals: std::mem::replace(&mut self.normals, Vec::with_capacity(capacity.1)),
            state,
        })
    }
}

/// The three stations that bands pass.
pub(super) struct Pipeline<'a> {
    pub(super) source: Source<'a>,
    pub(super) nearest: &'a NearestNormals,
    pub(super) chooser: Chooser<'a>,
    /// n_k.
    pub(super) candidates: usize,
    /// Made, not yet sought.
    made: Band,
    /// Sought, not yet chosen.
    sought: Band,
    spare: Band,
}

impl<'a> Pipeline<'a> {
    pub(super) fn new(
        source: Source<'a>,
        nearest: &'a NearestNormals,
        chooser: Chooser<'a>,
        candidates: usize,
    ) -> Self {
        let [made, sought, spare] = std::array::from_fn(|_| Band::default());
        Self { source, nearest, chooser, candidates, made, sought, spare }
    }

    /// Moves every band on by one station; gives the number of rows that were chosen, and a row of shards if they
    /// complete it. `None` once nothing is left. To be called on the pool.
    pub(super) fn step(&mut self) -> Result<Option<(usize, Option<ShardRow>)>> {
        let Self { source, nearest, chooser, candidates, made, sought, spare } = self;
        let (mut filled, mut completed) = (Ok(()), None);
        // The two that are serial begin at once, each on a thread; the search, which all threads share, fills the rest.
        rayon::scope(|scope| {
            scope.spawn(|_| filled = source.fill(spare));
            scope.spawn(|_| seek(nearest, made, *candidates));
            completed = chooser.take(sought, *candidates);
        });
        filled?;
        let chosen = sought.rows;
        if spare.rows + made.rows + chosen == 0 {
            return Ok(None);
        }
        // spare -> made -> sought -> spare
        std::mem::swap(sought, spare);
        std::mem::swap(sought, made);
        Ok(Some((chosen, completed)))
    }
}

/// Seeks the candidates of a band.
fn seek(nearest: &NearestNormals, band: &mut Band, candidates: usize) {
    band.candidates.resize(band.normals.len() * candidates, 0);
    band.candidates
        .par_chunks_mut(TEXELS_AT_ONCE * candidates)
        .zip(band.normals.par_chunks(TEXELS_AT_ONCE))
        .for_each(|(found, normals)| nearest.find_row(normals, found));
}

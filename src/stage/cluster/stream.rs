//! The vectors of a selection, block by block: read ahead while the block before is worked on, and kept where memory
//! allows.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::method::cluster::points::Arrangement;
use crate::method::cluster::selection::{Block, Selection};
use crate::run::{Context, read_ahead};
use crate::store::measurement::Measurement;

/// Slots that a thread fills at a time.
const TOGETHER: usize = 64;

/// Blocks of L* codes out of a measurement.
pub(super) struct Stream<'a> {
    measurement: &'a Measurement,
    arrangement: &'a Arrangement,
    selection: &'a Selection,
    /// The first blocks, once they have been read.
    kept: Vec<Option<Vec<u8>>>,
}

impl<'a> Stream<'a> {
    /// Keeps the first `kept` blocks in memory once they have been read.
    pub(super) fn new(
        measurement: &'a Measurement,
        arrangement: &'a Arrangement,
        selection: &'a Selection,
        kept: usize,
    ) -> Self {
        let kept = vec![None; kept.min(selection.blocks().len())];
        Self { measurement, arrangement, selection, kept }
    }

    /// Most bytes in flight: a block at work, the next one, and the views that it is put together from.
    pub(super) fn bytes_in_flight(selection: &Selection, arrangement: &Arrangement) -> usize {
        let texels = selection.blocks().iter().map(|block| block.slots.len()).max().unwrap_or(0);
        let windows = |block: &Block| block.windows.iter().map(|window| window.size.texels()).sum();
        let windows: usize = selection.blocks().iter().map(windows).max().unwrap_or(0);
        read_ahead::IN_FLIGHT * texels * arrangement.stride()
            + windows * arrangement.cosines().len() * arrangement.lights()
    }

    /// Calls `work` with each block of `blocks` and its vectors [slot, stride], in their order, on the pool.
    pub(super) fn for_each(
        &mut self,
        blocks: Range<usize>,
        context: &Context<'_>,
        mut work: impl FnMut(&Block, &[u8]) -> Result<()> + Send,
    ) -> Result<()> {
        let Self { measurement, arrangement, selection, ref mut kept } = *self;
        let absent: Vec<usize> =
            blocks.clone().filter(|&number| !kept.get(number).is_some_and(Option::is_some)).collect();
        let read = |number: usize| read(measurement, arrangement, selection, &selection.blocks()[number]);
        read_ahead::with(context, read_ahead::IN_FLIGHT, absent, read, |absent| {
            for number in blocks {
                context.check_stop()?;
                let block = &selection.blocks()[number];
                if let Some(Some(vectors)) = kept.get(number) {
                    context.install(|| work(block, vectors))?;
                } else {
                    let vectors = absent.next().unwrap_or_else(|| Err(crate::Error::stopped()))?;
                    context.install(|| work(block, &vectors))?;
                    if let Some(kept) = kept.get_mut(number) {
                        *kept = Some(vectors);
                    }
                }
                context.progress.advance(block.slots.len() as u64);
            }
            Ok(())
        })
    }
}

/// The vectors of a block [slot, stride].
fn read(
    measurement: &Measurement,
    arrangement: &Arrangement,
    selection: &Selection,
    block: &Block,
) -> Result<Vec<u8>> {
    let views: Vec<Vec<u8>> = (0..arrangement.cosines().len())
        .into_par_iter()
        .map(|view| measurement.read_luminance_of(view, &block.windows))
        .collect::<Result<_>>()?;
    let stride = arrangement.stride();
    let places = selection.places(block.slots.clone());
    let mut vectors = vec![0; places.len() * stride];
    vectors.par_chunks_mut(TOGETHER * stride).zip(places.par_chunks(TOGETHER)).for_each(
        |(vectors, places)| {
            for (vector, &place) in vectors.chunks_exact_mut(stride).zip(places) {
                arrangement.gather(vector, &views, place as usize);
            }
        },
    );
    Ok(vectors)
}

//! One pass over the chunks of a tile: blocks of texels with all their samples, in the order of the selection.

use btfkit_formats::Samples;
use rayon::prelude::*;

use crate::color::curve::{Curve, Unheld};
use crate::error::Result;
use crate::method::cluster::selection::{Block, Selection};
use crate::method::principal::Texels;
use crate::run::{Context, read_ahead};
use crate::store::measurement::Measurement;

/// What passes read.
pub(super) struct Pass<'a> {
    measurement: &'a Measurement,
    selection: &'a Selection,
    curve: Curve,
    in_flight: usize,
}

/// The samples of a block of texels.
pub(super) struct BlockTexels<'a> {
    /// Of each view, [place, light, channel].
    views: Vec<Samples>,
    /// Where each texel lies.
    places: &'a [u32],
    /// Texels that were read, those between included.
    places_read: usize,
    curve: &'a Curve,
}

impl Texels for BlockTexels<'_> {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn values(&self, texel: usize, view: usize, to: &mut [f32]) {
        let first = self.places[texel] as usize * to.len();
        self.curve.values(&self.views[view], first..first + to.len(), to);
    }
}

impl BlockTexels<'_> {
    /// Samples that the curve does not hold.
    pub(super) fn unheld(&self) -> Unheld {
        let of_view = |samples: &Samples| {
            let texel = samples.len() / self.places_read.max(1);
            let mut unheld = Unheld::default();
            for &place in self.places {
                let first = place as usize * texel;
                unheld += self.curve.unheld(samples, first..first + texel);
            }
            unheld
        };
        self.views.par_iter().map(of_view).reduce(Unheld::default, |mut sum, more| {
            sum += more;
            sum
        })
    }
}

impl<'a> Pass<'a> {
    /// The least and the largest sample that components hold.
    pub(super) fn range(&self) -> [f64; 2] {
        self.curve.range()
    }

    pub(super) fn new(measurement: &'a Measurement, selection: &'a Selection, in_flight: usize) -> Self {
        let description = measurement.description();
        let curve = Curve::new(description.sample_type, description.transfer);
        Self { measurement, selection, curve, in_flight }
    }

    /// Calls `work` with each block, one after the other, on the pool.
    pub(super) fn for_each(
        &self,
        context: &Context<'_>,
        mut work: impl FnMut(&BlockTexels<'_>) + Send,
    ) -> Result<()> {
        let read = |block: &Block| {
            let views = 0..self.measurement.description().views.len();
            let read = |view| {
                let mut samples = Samples::none(self.measurement.description().sample_type);
                for &window in &block.windows {
                    samples.append(&self.measurement.read_reflectance(view, window)?);
                }
                Ok(samples)
            };
            let views = views.into_par_iter().map(read).collect::<Result<_>>()?;
            let places = self.selection.places(block.slots.clone());
            let places_read = block.windows.iter().map(|window| window.size.texels()).sum();
            Ok(BlockTexels { views, places, places_read, curve: &self.curve })
        };
        let blocks = self.selection.blocks().iter();
        read_ahead::for_each(context, self.in_flight, blocks, read, |block| {
            context.install(|| work(&block));
            context.progress.advance(block.count() as u64);
            Ok(())
        })
    }
}

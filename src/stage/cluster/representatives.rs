//! What stands for the texels of a cluster: the measured texel nearest to its centre, or the mean or the median of all.

use btfkit_formats::Samples;

use super::Plan;
use super::finish::Clustered;
use crate::error::Result;
use crate::method::cluster::choice::Representation;
use crate::method::cluster::middle;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::store::model::Representatives;

/// What stands for clusters.
pub(super) struct Represented {
    /// Colour BRDFs [cluster, view, light, channel].
    pub(super) representatives: Representatives,
    /// Their L* codes, as vectors [cluster, stride].
    pub(super) vectors: Vec<u8>,
}

impl Plan {
    /// What stands for the texels of each cluster.
    ///
    /// # Errors
    /// Those of reading, and too little memory.
    pub(super) fn represent(&self, clustered: &Clustered, context: &Context<'_>) -> Result<Represented> {
        let rule = self.options.representatives;
        if rule == Representation::Texel {
            let sources = self.sources(clustered);
            return Ok(Represented {
                vectors: self.read_vectors(&sources, context)?,
                representatives: self.read_representatives(&sources, context)?,
            });
        }
        let representatives = self.middles(rule, clustered, context)?;
        let plain = self.measurement.description().codes()?.of(&representatives.samples);
        Ok(Represented { vectors: self.arrangement.arranged(&plain), representatives })
    }

    /// Means or medians of the texels of each cluster, view by view.
    fn middles(
        &self,
        rule: Representation,
        clustered: &Clustered,
        context: &Context<'_>,
    ) -> Result<Representatives> {
        let description = self.measurement.description();
        let (views, clusters) = (description.views.len(), clustered.nearest.len());
        // Where the texels of each cluster lie in what is read of a view, which is the same for all views.
        let mut runs = vec![Vec::new(); clusters];
        let mut before = 0;
        for block in self.selection.blocks() {
            let slots = || block.slots.clone();
            for (&place, &number) in
                self.selection.places(slots()).iter().zip(self.selection.numbers(slots()))
            {
                runs[usize::from(clustered.index[number as usize])].push(before + place);
            }
            before += block.windows.iter().map(|window| window.size.texels() as u32).sum::<u32>();
        }
        let bytes = u64::from(before) * description.texel_bytes() as u64;
        let in_flight = units::in_flight(context, "what stands for the clusters", bytes)?;
        context.progress.begin("read representatives", views as u64, Counted::Items("views"));
        let numbers: Vec<usize> = (0..views).collect();
        let by_view: Vec<Samples> = units::for_each(context, &numbers, in_flight, |&view| {
            let mut read = Samples::none(description.sample_type);
            for window in self.selection.blocks().iter().flat_map(|block| &block.windows) {
                read.append(&self.measurement.read_reflectance(view, *window)?);
            }
            context.progress.advance(1);
            Ok(middle::of_groups(rule, &read, description.texel_samples(), &runs))
        })?;
        context.progress.end();
        let texel = description.texel_samples();
        let mut samples = Samples::none(description.sample_type);
        for cluster in 0..clusters {
            for view in &by_view {
                let part = view.select(std::iter::once(cluster * texel..(cluster + 1) * texel));
                samples.append(&part.unwrap_or_else(|| Samples::none(description.sample_type)));
            }
        }
        Ok(Representatives {
            shape: [clusters, views, description.lights.len(), description.n_channels()],
            channels: description.channels.clone(),
            samples,
            transfer: description.transfer,
        })
    }
}

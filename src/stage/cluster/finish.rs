//! From clusters to the arrays of the model: the representatives are read, and how it went is told.

use std::collections::BTreeMap;

use btfkit_formats::Samples;

use crate::error::Result;
use crate::method::cluster::distance_matrix;
use crate::method::cluster::nearest::Near;
use crate::run::progress::Counted;
use crate::run::{Context, units};
use crate::shape::{Size, Window};
use crate::stage::cluster::representatives::Represented;
use crate::stage::cluster::{Ended, PASSES, Plan, Report};
use crate::store::clustering::{History, Passes};
use crate::store::model::{Clusters, Representatives, Stage};

/// A clustering that is over.
pub(super) struct Clustered {
    /// Centres [cluster, stride].
    pub(super) centres: Vec<u8>,
    /// Cluster of each texel of the tile.
    pub(super) index: Vec<u16>,
    /// The texel nearest to each centre.
    pub(super) nearest: Vec<Near>,
    /// How it came here.
    pub(super) history: History,
}

impl Plan {
    /// Rows and columns of the representatives in the measurement.
    pub(super) fn sources(&self, clustered: &Clustered) -> Vec<[u32; 2]> {
        clustered.nearest.iter().map(|near| self.tile.source[near.texel as usize]).collect()
    }

    /// Writes the arrays of the model, then how it went. `from_representatives` is the sum of the distances of all texels
    /// from the representatives of their clusters.
    pub(super) fn finish(
        &self,
        clustered: &Clustered,
        represented: Represented,
        from_representatives: u64,
        context: &Context<'_>,
    ) -> Result<Report> {
        let description = self.measurement.description();
        let Clustered { centres, index, nearest, history, .. } = clustered;
        let clusters = nearest.len();
        let sources = self.sources(clustered);
        let Represented { representatives, vectors } = represented;
        let codes = self.arrangement.plain(&vectors);
        let arrays = Clusters {
            size: self.tile.size,
            index: index.clone(),
            brdf: self.brdf(),
            centres: self.arrangement.plain(centres),
            sources,
            distance: context.compute(|| distance_matrix(&codes, &self.arrangement)),
            representatives,
        };
        self.model.write_clusters(&arrays)?;

        let mut population = vec![0usize; clusters];
        index.iter().for_each(|&cluster| population[usize::from(cluster)] += 1);
        let texels = self.selection.texels();
        let lightness = |distance: u64| self.arrangement.mean_lightness(distance);
        let (stride, kernel) = (self.arrangement.stride(), self.method(0, None).kernel);
        let pairs = vectors.chunks_exact(stride).zip(centres.chunks_exact(stride));
        let apart = pairs.map(|(a, b)| kernel.row_distances(a, [b], self.arrangement.groups())[0]);
        let from_centres: Vec<f64> = apart.map(lightness).collect();
        let report = Report {
            clusters,
            passes: history.passes.clone(),
            batches: history.batches.clone(),
            ended: Ended::of(&history.passes, self.options.limits),
            sample_texels: history.sample_texels,
            sample_passes: history.sample_passes.clone(),
            trials: history.trials.iter().chain(&history.attempts).copied().collect(),
            representative_lightness_error: lightness(from_representatives) / texels as f64,
            representative_from_centre: from_centres.iter().sum::<f64>() / clusters as f64,
            representative_from_centre_most: from_centres.iter().copied().fold(0.0, f64::max),
            single_texel_clusters: population.iter().filter(|&&n| n == 1).count(),
            taken_from: None,
            representative_bytes: arrays.representative_bytes(),
            index_bytes: arrays.index_bytes(),
            tile_bytes: description.bytes_of(texels),
            measurement_bytes: description.bytes(),
        };
        self.model.finish(Stage::Cluster, &self.recipe, &report, context)?;
        Passes::remove(&self.model.path().join(PASSES));
        Ok(report)
    }

    /// The vectors [texel, stride] of texels at these rows and columns of the measurement.
    pub(super) fn read_vectors(&self, sources: &[[u32; 2]], context: &Context<'_>) -> Result<Vec<u8>> {
        let stride = self.arrangement.stride();
        let mut vectors = vec![0; sources.len() * stride];
        for (window, wanted) in self.by_chunk(sources) {
            for view in 0..self.brdf()[0] {
                let codes = context.install(|| self.measurement.read_luminance(view, window))?;
                for &(number, place) in &wanted {
                    let lights = self.arrangement.lights();
                    let codes = &codes[place * lights..(place + 1) * lights];
                    let vector = &mut vectors[number * stride..(number + 1) * stride];
                    self.arrangement.insert_view(vector, view, codes);
                }
            }
        }
        Ok(vectors)
    }

    /// The colour BRDFs of texels at these rows and columns of the measurement, [cluster, view, light, channel].
    pub(super) fn read_representatives(
        &self,
        sources: &[[u32; 2]],
        context: &Context<'_>,
    ) -> Result<Representatives> {
        let description = self.measurement.description();
        let (views, texel) = (description.views.len(), description.texel_samples());
        let numbers: Vec<usize> = (0..views).collect();
        let windows = self.by_chunk(sources);
        context.progress.begin("read representatives", views as u64, Counted::Items("views"));
        let by_view: Vec<Vec<Samples>> = units::for_each(context, &numbers, context.threads, |&view| {
            let mut brdfs = vec![Samples::none(description.sample_type); sources.len()];
            for (window, wanted) in &windows {
                let read = context.install(|| self.measurement.read_reflectance(view, *window))?;
                for &(number, place) in wanted {
                    brdfs[number] = read
                        .select(std::iter::once(place * texel..(place + 1) * texel))
                        .unwrap_or_else(|| Samples::none(description.sample_type));
                }
            }
            context.progress.advance(1);
            Ok(brdfs)
        })?;
        context.progress.end();
        let mut samples = Samples::none(description.sample_type);
        for cluster in 0..sources.len() {
            for view in &by_view {
                samples.append(&view[cluster]);
            }
        }
        Ok(Representatives {
            shape: [sources.len(), views, description.lights.len(), description.n_channels()],
            channels: description.channels.clone(),
            samples,
            transfer: description.transfer,
        })
    }

    /// For each chunk that holds some of these texels: its window, and which they are at which places in it.
    fn by_chunk(&self, sources: &[[u32; 2]]) -> Vec<(Window, Vec<(usize, usize)>)> {
        let description = self.measurement.description();
        let side = description.chunk_side();
        let mut chunks: BTreeMap<[usize; 2], Vec<(usize, usize)>> = BTreeMap::new();
        for (number, source) in sources.iter().enumerate() {
            let [row, column] = source.map(|n| n as usize);
            let [y, x] = [row / side * side, column / side * side];
            let width = side.min(description.size.width - x);
            chunks.entry([y, x]).or_default().push((number, (row - y) * width + column - x));
        }
        chunks
            .into_iter()
            .map(|([y, x], wanted)| {
                let Size { height, width } = description.size;
                (Window { y, x, size: Size::new(side.min(height - y), side.min(width - x)) }, wanted)
            })
            .collect()
    }
}

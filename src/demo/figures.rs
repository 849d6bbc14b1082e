//! The figures of the page: errors, sizes, and how near the enlarged picture comes to the tile.

use std::path::Path;

use crate::demo::pictures::{Subject, Workshop};
use crate::error::{Error, Result};
use crate::method::tile::seam_visibility;
use crate::picture::Picture;
use crate::run::Context;
use crate::stage::normals::mean_and_spread;
use crate::stage::{cluster, compare, normals, tile};
use crate::store::model::field::FieldReport;

/// Side of the squares whose means show how patchy a picture is, texels.
pub(super) const BLOCK: usize = 16;

/// All figures of the page.
pub(super) struct Figures {
    pub(super) tile: tile::Report,
    pub(super) cluster: cluster::Report,
    pub(super) normals: normals::Report,
    pub(super) field: FieldReport,
    pub(super) compare: compare::Report,
    /// Seam visibility of the second tile.
    pub(super) second_tile_visibility: f64,
    /// Row and column of the region in its interior.
    pub(super) second_tile_origin: [usize; 2],
    /// Measured tile and tile by the model, under the light of the comparison.
    pub(super) greys: [Grey; 2],
    pub(super) enlarged: Likeness,
    pub(super) by_paper: Likeness,
    /// Root mean square angle of the synthesised normals from their mean, degrees.
    pub(super) synthesised_spread_deg: f64,
    pub(super) ledger: Ledger,
}

/// First and second moments of a picture's grey (the mean of R, G and B), display levels 0..255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grey {
    pub(super) mean: f64,
    /// Standard deviation.
    pub(super) spread: f64,
    /// Standard deviation of the means of squares of [`BLOCK`] texels a side.
    pub(super) block_spread: f64,
}

impl Grey {
    fn of(picture: &Picture) -> Self {
        let bytes = picture.bytes();
        let greys: Vec<f64> =
            bytes.chunks_exact(3).map(|p| p.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0).collect();
        let width = picture.size.width;
        let block = |top: usize, left: usize| {
            let rows = greys.chunks_exact(width).skip(top).take(BLOCK);
            rows.flat_map(|row| &row[left..left + BLOCK]).sum::<f64>() / (BLOCK * BLOCK) as f64
        };
        let starts = |n: usize| (0..n / BLOCK).map(|k| k * BLOCK);
        let blocks: Vec<f64> = starts(picture.size.height)
            .flat_map(|top| starts(width).map(move |left| (top, left)))
            .map(|(top, left)| block(top, left))
            .collect();
        let (mean, spread) = moments(&greys);
        Self { mean, spread, block_spread: moments(&blocks).1 }
    }
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// How near an enlargement comes to the tile.
pub(super) struct Likeness {
    /// Of the enlarged picture, under the light of the comparison.
    pub(super) grey: Grey,
    /// Sum over clusters of the lesser of their shares in the tile and in the enlarged index.
    pub(super) histogram_overlap: f64,
    /// Clusters of the model that the enlarged index does not use.
    pub(super) unused_clusters: usize,
}

impl Likeness {
    fn of(picture: &Picture, index: &[u16], in_tile: &[f64]) -> Self {
        let in_enlarged = shares(index, in_tile.len());
        Self {
            grey: Grey::of(picture),
            histogram_overlap: in_tile.iter().zip(&in_enlarged).map(|(a, b)| a.min(*b)).sum(),
            unused_clusters: in_enlarged.iter().filter(|&&share| share == 0.0).count(),
        }
    }
}

/// What is compared with what, in bytes.
pub(super) struct Ledger {
    pub(super) representatives: u64,
    pub(super) tile_index: u64,
    pub(super) enlarged_index: u64,
    pub(super) enlarged_texels: u64,
    /// Raw samples of one texel under all pairs of directions.
    pub(super) texel: u64,
    pub(super) tile: u64,
    pub(super) measurement: u64,
    pub(super) enlarged: u64,
    /// Bytes on disk of archive, measurement, model and enlarged index.
    pub(super) on_disk: [u64; 4],
}

impl Figures {
    /// Gathers the figures of the finished stages in `workshop`; `places` are archive, measurement,
    /// model and enlarged index.
    pub(super) fn gather(
        workshop: &Workshop,
        compare: compare::Report,
        places: [&Path; 4],
        context: &Context<'_>,
    ) -> Result<Self> {
        let model = &workshop.model;
        let cluster = model.cluster_report()?;
        let picture = |subject| workshop.picture(subject, context);
        let in_tile = shares(&workshop.tile_index, cluster.clusters);
        let enlarged = Likeness::of(&picture(Subject::ENLARGED)?, &workshop.enlarged_index, &in_tile);
        let by_paper = Likeness::of(&picture(Subject::ByPaper)?, &workshop.index_by_paper, &in_tile);
        let texel = workshop.texel_bytes();
        let enlarged_texels = workshop.enlarged_index.len() as u64;
        let ledger = Ledger {
            representatives: cluster.representative_bytes,
            tile_index: cluster.index_bytes,
            enlarged_index: enlarged_texels * if cluster.clusters <= 256 { 1 } else { 2 },
            enlarged_texels,
            texel,
            tile: cluster.tile_bytes,
            measurement: cluster.measurement_bytes,
            enlarged: enlarged_texels * texel,
            on_disk: [
                bytes_below(places[0])?,
                bytes_below(places[1])?,
                bytes_below(places[2])?,
                bytes_below(places[3])?,
            ],
        };
        Ok(Self {
            tile: model.tile_report()?,
            normals: model.normals_report()?,
            field: model.field_report()?,
            compare,
            second_tile_visibility: seam_visibility(&workshop.features, &workshop.second_tile.tile),
            second_tile_origin: workshop.second_tile.origin,
            greys: [Grey::of(&picture(Subject::Tile)?), Grey::of(&picture(Subject::Modelled)?)],
            enlarged,
            by_paper,
            synthesised_spread_deg: mean_and_spread(&workshop.synthesised_normals()?).1,
            ledger,
            cluster,
        })
    }
}

/// Share of the texels that each cluster has.
fn shares(index: &[u16], clusters: usize) -> Vec<f64> {
    let mut counts = vec![0u64; clusters];
    for &cluster in index {
        if let Some(count) = counts.get_mut(usize::from(cluster)) {
            *count += 1;
        }
    }
    counts.into_iter().map(|count| count as f64 / index.len().max(1) as f64).collect()
}

/// Bytes of a file, or of all files in a folder.
fn bytes_below(path: &Path) -> Result<u64> {
    let failed = |error| Error::io("read", path, error);
    let found = std::fs::metadata(path).map_err(failed)?;
    if !found.is_dir() {
        return Ok(found.len());
    }
    let mut total = 0;
    for entry in std::fs::read_dir(path).map_err(failed)? {
        total += bytes_below(&entry.map_err(failed)?.path())?;
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::shape::Size;

    #[test]
    fn greys_of_a_plane_with_a_bright_corner() {
        // A quarter at 200, the rest a fine pattern of 0 and 100.
        let pixel = |n: usize| {
            let (y, x) = (n / 128, n % 128);
            let level = if y < 32 && x < 64 { 200.0 } else { 100.0 * ((y + x) % 2) as f32 };
            [level / 255.0; 3]
        };
        let picture = Picture::display(Size::new(64, 128), (0..64 * 128).map(pixel).collect());
        let grey = Grey::of(&picture);
        assert!((grey.mean - 87.5).abs() < 1e-9, "{grey:?}");
        // A quarter of the squares has the mean 200, the others 50.
        let between = 150.0 * (0.25f64 * 0.75).sqrt();
        assert!((grey.block_spread - between).abs() < 1e-9, "{grey:?}");
        assert!((grey.spread - (between.powi(2) + 0.75 * 50.0f64.powi(2)).sqrt()).abs() < 1e-9, "{grey:?}");
    }

    #[test]
    fn shares_count_texels_of_clusters() {
        assert_eq!(shares(&[0, 2, 2, 2], 4), [0.25, 0.0, 0.75, 0.0]);
    }

    #[test]
    fn spread_of_two_normals_is_half_the_angle_between_them() {
        let normal = |degrees: f64| {
            let angle = degrees.to_radians();
            [angle.sin() as f32, 0.0, angle.cos() as f32]
        };
        assert!((mean_and_spread(&[normal(-20.0), normal(30.0)]).1 - 25.0).abs() < 1e-4);
    }

    #[test]
    fn bytes_of_a_folder_are_those_of_its_files() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("c")).unwrap();
        std::fs::write(folder.path().join("a"), [0; 7]).unwrap();
        std::fs::write(folder.path().join("c/b"), [0; 5]).unwrap();
        assert_eq!(bytes_below(folder.path()).unwrap(), 12);
    }
}

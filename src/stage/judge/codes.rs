//! Lightness under a pair of directions: as measured, and by the clusters.

use super::subject::Subject;
use super::whole::Material;
use crate::error::Result;
use crate::likeness::Lightness;
use crate::method::tile::Tile;
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::store::measurement::Measurement;

/// Rows of the measurement that are read together: a row of chunks.
const BAND_ROWS: usize = 16;

/// L* codes under a pair of directions: of the tile's texels as measured, and of the clusters.
pub(super) struct Codes {
    pub(super) tile: Vec<u8>,
    pub(super) clusters: Vec<u8>,
}

/// L* codes of the texels of a tile, as measured under a pair.
pub(super) fn tile_codes(
    measurement: &Measurement,
    tile: &Tile,
    [view, light]: [usize; 2],
    context: &Context<'_>,
) -> Result<Vec<u8>> {
    let bounds = tile.bounds();
    let mut plane = Vec::with_capacity(bounds.size.texels());
    for top in (0..bounds.size.height).step_by(BAND_ROWS) {
        context.check_stop()?;
        let rows = BAND_ROWS.min(bounds.size.height - top);
        let band = Window { y: bounds.y + top, x: bounds.x, size: Size::new(rows, bounds.size.width) };
        plane.extend(codes_of(measurement, [view, light], band)?);
    }
    Ok(tile.offsets_in_bounds().into_iter().map(|at| plane[at]).collect())
}

/// L* codes of a window under a pair.
pub(super) fn codes_of(
    measurement: &Measurement,
    [view, light]: [usize; 2],
    window: Window,
) -> Result<impl Iterator<Item = u8> + use<>> {
    let lights = measurement.description().lights.len();
    Ok(measurement.read_luminance(view, window)?.into_iter().skip(light).step_by(lights))
}

/// A window with the values measured where its texels come from, as far as that is known, and with the clusters' values.
pub(super) fn pictures_of(
    subject: &Subject,
    material: &Material<'_>,
    codes: &Codes,
    window: Window,
) -> Result<(Option<Lightness>, Lightness)> {
    let texels = subject.texels(window, material.clusters, material.tile)?;
    let of_cluster = |&cluster: &u16| codes.clusters[usize::from(cluster)];
    let of_texel = |texel: u32| codes.tile[texel as usize];
    let with_model = Lightness::of_codes(window.size, texels.index.iter().map(of_cluster));
    let source = texels.source;
    let alone = source.map(|source| Lightness::of_codes(window.size, source.into_iter().map(of_texel)));
    Ok((alone, with_model))
}

//! Memory that is enough for an enlargement before there is a model: no method holds the output, but some hold rows of it.

use super::{By, blocks, paper, patches, quilt};
use crate::method::baseline::Exemplar;
use crate::method::coherent::Plane;
use crate::shape::Size;

/// Memory of a column of the random field: that of a fitted model, and as much again (measured with five levels and three
/// channels).
const FIELD_COLUMN_BYTES: u64 = 1024;

/// Memory that is enough for an enlargement to a size, of a tile of at most this size with so many clusters.
pub(crate) fn enough_bytes(by: &By, size: Size, tile: Size, clusters: usize) -> u64 {
    let exemplar = Exemplar::bytes_of(tile, clusters);
    match by {
        By::Paper(options) => {
            paper::bytes(options, size, tile.texels(), clusters) + size.width as u64 * FIELD_COLUMN_BYTES
        }
        By::Coherent(_) => Plane::most_bytes(tile) + blocks::memory_bytes(size),
        By::Patches(options) => patches::bytes(exemplar, options.pieces, tile, size),
        By::Quilt(options) => quilt::bytes(exemplar, tile, size, options.keep_normals),
    }
}

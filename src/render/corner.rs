//! Corners of triangles, as files of meshes have them.

use super::mesh::TRIANGLE_BYTES;
use crate::error::Result;
use crate::run::budget::Room;
use crate::vector::Vector;
use crate::words::counted;

/// A corner of a triangle, as files have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Where it is.
    pub place: Vector,
    /// Texture coordinates, to the right and up.
    pub texture: [f64; 2],
    /// The normal of the smooth surface, if it is known.
    pub normal: Option<Vector>,
    /// Direction in which the first texture coordinate grows and 1, or -1 where the texture is mirrored, if known.
    pub tangent: Option<(Vector, f64)>,
}

/// Checks that there is room for a mesh of so many triangles, while they are read and with their tree.
///
/// # Errors
/// Where there is not.
pub(super) fn expect_triangles(room: &Room, triangles: usize) -> Result<()> {
    let bytes = (triangles as u64).saturating_mul(TRIANGLE_BYTES);
    room.require(&format!("a mesh of {}", counted(triangles, "triangle")), bytes)
}

//! Corners of triangles, as files of meshes have them.

use crate::error::{Error, Result};
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

/// Refuses more triangles than memory holds.
///
/// # Errors
/// Where there are more.
pub(super) fn expect_at_most(most: usize, triangles: usize) -> Result<()> {
    if triangles <= most {
        return Ok(());
    }
    let (got, most) = (counted(triangles, "triangle"), counted(most, "triangle"));
    Err(Error::usage(format!("got {got} or more; memory is allowed for {most}"))
        .hint("allow more with --memory, or simplify the mesh"))
}

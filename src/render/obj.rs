//! Triangles of a Wavefront OBJ file, by the crate `tobj`.

use super::corner::{Corner, expect_at_most};
use crate::error::{Error, Result};

/// All triangles of a file, groups and materials together; polygons are cut into triangles.
///
/// # Errors
/// A file that cannot be read, and faces without texture coordinates.
pub(super) fn corners(bytes: &[u8], most: usize) -> Result<Vec<[Corner; 3]>> {
    expect_texture_coordinates(bytes)?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let mut reader = bytes;
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| Ok(Default::default()))
        .map_err(|error| Error::input(format!("no OBJ that can be read: {error}")))?;
    let mut triangles = Vec::new();
    for model in models {
        let mesh = model.mesh;
        if mesh.indices.is_empty() {
            continue;
        }
        let three = |list: &[f32], at: usize| -> Option<[f64; 3]> {
            let values = list.get(3 * at..3 * at + 3)?;
            Some([0, 1, 2].map(|axis| f64::from(values[axis])))
        };
        let corner = |n: usize| -> Option<Corner> {
            let texture = *mesh.texcoord_indices.get(n)? as usize;
            let texture = mesh.texcoords.get(2 * texture..2 * texture + 2)?;
            let normal = mesh.normal_indices.get(n).and_then(|&at| three(&mesh.normals, at as usize));
            Some(Corner {
                place: three(&mesh.positions, *mesh.indices.get(n)? as usize)?,
                texture: [f64::from(texture[0]), f64::from(texture[1])],
                normal,
                tangent: None,
            })
        };
        expect_at_most(most, triangles.len() + mesh.indices.len() / 3)?;
        for first in (0..mesh.indices.len() / 3 * 3).step_by(3) {
            let triangle = [corner(first), corner(first + 1), corner(first + 2)];
            let [Some(a), Some(b), Some(c)] = triangle else {
                return Err(Error::input(format!(
                    "object {:?}: a face of corners that are not there",
                    model.name
                )));
            };
            triangles.push([a, b, c]);
        }
    }
    Ok(triangles)
}

/// Refuses faces with a corner that names no texture coordinates: the crate gives it those of another corner.
fn expect_texture_coordinates(bytes: &[u8]) -> Result<()> {
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        if words.next() != Some(b"f") {
            continue;
        }
        let names =
            |corner: &[u8]| corner.split(|&byte| byte == b'/').nth(1).is_some_and(|name| !name.is_empty());
        // What follows a # is a comment.
        if !words.take_while(|word| !word.starts_with(b"#")).all(names) {
            return Err(Error::input(format!(
                "line {}: a face whose corners have no texture coordinates (vt)",
                number + 1
            ))
            .hint("unwrap it in a modelling program, and export it with texture coordinates"));
        }
    }
    Ok(())
}

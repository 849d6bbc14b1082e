//! Triangles of a binary glTF file (GLB), by the crate `gltf`, which reads the description; accessors are read here,
//! each place of them checked.

use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::{Mode, Semantic};
use gltf::{Accessor, Node};

use super::mesh::{Corner, MOST_TRIANGLES};
use super::vector::{Vector, cross};
use crate::error::{Error, Result};

/// Nodes within nodes, deeper than which a file is refused: it may hold itself.
const DEEPEST: usize = 64;

/// A place or a direction as a row of four, times a matrix.
type Matrix = [[f64; 4]; 4];

struct Reader<'a> {
    blob: &'a [u8],
    triangles: Vec<[Corner; 3]>,
}

/// All triangles of the default scene, or of the first.
///
/// # Errors
/// A file that cannot be read, that keeps its buffers elsewhere or packed, and triangles without texture coordinates.
pub(super) fn corners(bytes: &[u8]) -> Result<Vec<[Corner; 3]>> {
    // Magic, version and length.
    if !bytes.starts_with(b"glTF")
        || bytes.len() < 20
        || bytes[8..12] < [20, 0, 0, 0][..] && bytes[9..12] == [0; 3]
    {
        return Err(
            Error::input("no binary glTF file").hint("export it as .glb, which holds all in one file")
        );
    }
    let file = gltf::Gltf::from_slice(bytes)
        .map_err(|error| Error::input(format!("no binary glTF that can be read: {error}")))?;
    let blob = file.blob.as_deref().unwrap_or_default();
    let mut reader = Reader { blob, triangles: Vec::new() };
    let scene = file.default_scene().or_else(|| file.scenes().next());
    let scene = scene.ok_or_else(|| Error::input("a glTF without a scene"))?;
    let identity =
        std::array::from_fn(|row| std::array::from_fn(|column| f64::from(u8::from(row == column))));
    for node in scene.nodes() {
        reader.node(&node, &identity, 0)?;
    }
    Ok(reader.triangles)
}

impl Reader<'_> {
    fn node(&mut self, node: &Node<'_>, above: &Matrix, depth: usize) -> Result<()> {
        if depth > DEEPEST {
            return Err(Error::input(format!(
                "node {}: more than {DEEPEST} nodes within each other",
                node.index()
            )));
        }
        let own = node.transform().matrix();
        let matrix: Matrix = std::array::from_fn(|column| {
            std::array::from_fn(|row| (0..4).map(|n| above[n][row] * f64::from(own[column][n])).sum())
        });
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                let place = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
                self.primitive(&primitive, &matrix).map_err(|error| error.context(place))?;
            }
        }
        for child in node.children() {
            self.node(&child, &matrix, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'_>, matrix: &Matrix) -> Result<()> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let read = |semantic| primitive.get(&semantic).map(|accessor| self.numbers(&accessor)).transpose();
        let places = read(Semantic::Positions)?.ok_or_else(|| Error::input("no positions"))?;
        let textures = read(Semantic::TexCoords(0))?.ok_or_else(|| {
            Error::input("no texture coordinates (TEXCOORD_0)")
                .hint("unwrap it in a modelling program, and export it with texture coordinates")
        })?;
        let (normals, tangents) = (read(Semantic::Normals)?, read(Semantic::Tangents)?);
        let order: Vec<usize> = match primitive.indices() {
            Some(accessor) => self.numbers(&accessor)?.iter().map(|value| value[0] as usize).collect(),
            None => (0..places.len()).collect(),
        };
        let triples: Vec<[usize; 3]> = match mode {
            Mode::Triangles => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            Mode::TriangleStrip => {
                let turned = |(n, c): (usize, &[usize])| {
                    if n % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] }
                };
                order.windows(3).enumerate().map(turned).collect()
            }
            _ => order.windows(2).skip(1).map(|c| [order[0], c[0], c[1]]).collect(),
        };
        if self.triangles.len() + triples.len() > MOST_TRIANGLES {
            return Err(Error::input(format!("got more than {MOST_TRIANGLES} triangles")));
        }
        let columns: [Vector; 3] = std::array::from_fn(|column| [0, 1, 2].map(|row| matrix[column][row]));
        // Normals are turned by the inverse of the transpose, whatever its scale; a mirrored object turns them over.
        let cofactors =
            [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])];
        let times = |columns: &[Vector; 3], v: [f64; 4]| -> Vector {
            std::array::from_fn(|row| (0..3).map(|n| columns[n][row] * v[n]).sum())
        };
        let turns_over = super::vector::dot(columns[0], cofactors[0]) < 0.0;
        let corner = |at: usize| -> Option<Corner> {
            let [s, t, ..] = *textures.get(at)?;
            let place = times(&columns, *places.get(at)?);
            let tangent = tangents.as_ref().and_then(|list| list.get(at));
            Some(Corner {
                place: std::array::from_fn(|row| place[row] + matrix[3][row]),
                // Of glTF the second coordinate grows downwards.
                texture: [s, 1.0 - t],
                normal: normals.as_ref().and_then(|list| list.get(at)).map(|&normal| {
                    let normal = times(&cofactors, normal);
                    if turns_over { normal.map(|value| -value) } else { normal }
                }),
                tangent: tangent.map(|&t| (times(&columns, t), if turns_over { -t[3] } else { t[3] })),
            })
        };
        for triple in triples {
            let [Some(a), Some(b), Some(c)] = triple.map(corner) else {
                return Err(Error::input(format!("a triangle of corners {triple:?}, which are not there")));
            };
            self.triangles.push([a, b, c]);
        }
        Ok(())
    }

    /// The elements of an accessor, up to four numbers each; whole numbers that stand for shares are from 0 to 1.
    fn numbers(&self, accessor: &Accessor<'_>) -> Result<Vec<[f64; 4]>> {
        let place = |what: &str| Error::input(format!("accessor {}: {what}", accessor.index()));
        if accessor.sparse().is_some() {
            return Err(place("sparse values, which are not read").hint("export without compression"));
        }
        let view = accessor.view().ok_or_else(|| {
            place("no buffer, as in compressed files").hint("export without compression (Draco, meshopt)")
        })?;
        if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
            return Err(
                place("a buffer outside of the file").hint("export it as .glb, which holds all in one file")
            );
        }
        let values = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            _ => return Err(place("a matrix, expected numbers or vectors")),
        };
        let bytes = accessor.data_type().size();
        let stride = view.stride().unwrap_or(bytes * values);
        let within =
            view.offset().checked_add(view.length()).and_then(|end| self.blob.get(view.offset()..end));
        let data = within.and_then(|data| data.get(accessor.offset()..));
        let count = accessor.count();
        let needed = count
            .checked_sub(1)
            .and_then(|n| n.checked_mul(stride))
            .and_then(|n| n.checked_add(bytes * values));
        let data = match (data, needed) {
            (Some(data), Some(needed)) if needed <= data.len() && stride >= bytes * values => data,
            _ => return Err(place("it does not lie within its buffer")),
        };
        let number = |at: usize| -> f64 {
            let byte = |n: usize| data[at + n];
            match accessor.data_type() {
                DataType::F32 => f64::from(f32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
                DataType::U32 => f64::from(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
                DataType::U16 => f64::from(u16::from_le_bytes([byte(0), byte(1)])),
                DataType::U8 => f64::from(byte(0)),
                DataType::I16 => f64::from(i16::from_le_bytes([byte(0), byte(1)])),
                DataType::I8 => f64::from(byte(0) as i8),
            }
        };
        let whole = match accessor.data_type() {
            DataType::U8 => 255.0,
            DataType::U16 => 65535.0,
            DataType::I8 => 127.0,
            DataType::I16 => 32767.0,
            _ => 1.0,
        };
        let scale = if accessor.normalized() { 1.0 / whole } else { 1.0 };
        let element = |n: usize| {
            let mut element = [0.0; 4];
            for (k, value) in element.iter_mut().take(values).enumerate() {
                *value = number(n * stride + k * bytes) * scale;
            }
            element
        };
        Ok((0..count).map(element).collect())
    }
}

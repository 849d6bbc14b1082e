//! Triangles of a binary glTF file (GLB), by the crate `gltf`, which reads the description. Its own walk through it takes
//! every number for that of something that is there, so the walk is here, each number and place checked.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

use super::corner::{Corner, expect_at_most};
use crate::error::{Error, Result};
use crate::vector::{Vector, cross};

/// Nodes within nodes, deeper than which a file is refused: it may hold itself.
const DEEPEST: usize = 64;

/// A place or a direction as a row of four, times a matrix.
type Matrix = [[f64; 4]; 4];

struct Reader<'a> {
    root: &'a json::Root,
    blob: &'a [u8],
    triangles: Vec<[Corner; 3]>,
    /// The most triangles that there may be.
    most: usize,
    /// Nodes that are still to be met: each hangs on one other at most.
    nodes_left: usize,
}

/// All triangles of the default scene, or of the first.
///
/// # Errors
/// A file that cannot be read, that keeps its buffers elsewhere or packed, and triangles without texture coordinates.
pub(super) fn corners(bytes: &[u8], most: usize) -> Result<Vec<[Corner; 3]>> {
    // Magic, version and length.
    if !bytes.starts_with(b"glTF")
        || bytes.len() < 20
        || bytes[8..12] < [20, 0, 0, 0][..] && bytes[9..12] == [0; 3]
    {
        return Err(
            Error::input("no binary glTF file").hint("export it as .glb, which holds all in one file")
        );
    }
    let unreadable =
        |error: &dyn std::fmt::Display| Error::input(format!("no binary glTF that can be read: {error}"));
    let file = gltf::Glb::from_slice(bytes).map_err(|error| unreadable(&error))?;
    let root: json::Root = serde_json::from_slice(&file.json).map_err(|error| unreadable(&error))?;
    let blob = file.bin.as_deref().unwrap_or_default();
    let nodes_left = root.nodes.len();
    let mut reader = Reader { root: &root, blob, triangles: Vec::new(), most, nodes_left };
    let scene = match root.scene {
        Some(number) => root.scenes.get(number.value()),
        None => root.scenes.first(),
    };
    let scene = scene.ok_or_else(|| Error::input("a glTF without a scene"))?;
    let identity =
        std::array::from_fn(|row| std::array::from_fn(|column| f64::from(u8::from(row == column))));
    for node in &scene.nodes {
        reader.node(node.value(), &identity, 0)?;
    }
    Ok(reader.triangles)
}

/// One of a list, by its number.
fn one_of<'a, T>(list: &'a [T], what: &str, number: usize) -> Result<&'a T> {
    list.get(number).ok_or_else(|| Error::input(format!("{what} {number} is not there, of {}", list.len())))
}

/// How a node lies within the one above it.
fn matrix_of(node: &Node) -> Matrix {
    if let Some(matrix) = node.matrix {
        return std::array::from_fn(|column| std::array::from_fn(|row| f64::from(matrix[4 * column + row])));
    }
    let translation = node.translation.unwrap_or_default();
    let scale = node.scale.unwrap_or([1.0; 3]);
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let turned = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
        [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
        [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    std::array::from_fn(|column| match column {
        3 => [translation[0].into(), translation[1].into(), translation[2].into(), 1.0],
        _ => {
            let [a, b, c] = turned[column].map(|value| value * f64::from(scale[column]));
            [a, b, c, 0.0]
        }
    })
}

impl Reader<'_> {
    fn node(&mut self, number: usize, above: &Matrix, depth: usize) -> Result<()> {
        if depth > DEEPEST {
            return Err(Error::input(format!("node {number}: more than {DEEPEST} nodes within each other")));
        }
        let left = self.nodes_left.checked_sub(1);
        self.nodes_left =
            left.ok_or_else(|| Error::input(format!("node {number} hangs on more than one other")))?;
        let root = self.root;
        let node = one_of(&root.nodes, "node", number)?;
        let own = matrix_of(node);
        let matrix: Matrix = std::array::from_fn(|column| {
            std::array::from_fn(|row| (0..4).map(|n| above[n][row] * own[column][n]).sum())
        });
        if let Some(mesh) = node.mesh {
            for (n, primitive) in one_of(&root.meshes, "mesh", mesh.value())?.primitives.iter().enumerate() {
                let place = format!("mesh {}, primitive {n}", mesh.value());
                self.primitive(primitive, &matrix).map_err(|error| error.context(place))?;
            }
        }
        for child in node.children.iter().flatten() {
            self.node(child.value(), &matrix, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, matrix: &Matrix) -> Result<()> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(Error::input("an unknown mode"));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let read = |semantic| {
            let accessor = primitive.attributes.get(&Checked::Valid(semantic));
            accessor.map(|accessor| self.numbers(accessor.value())).transpose()
        };
        let places = read(Semantic::Positions)?.ok_or_else(|| Error::input("no positions"))?;
        let textures = read(Semantic::TexCoords(0))?.ok_or_else(|| {
            Error::input("no texture coordinates (TEXCOORD_0)")
                .hint("unwrap it in a modelling program, and export it with texture coordinates")
        })?;
        let (normals, tangents) = (read(Semantic::Normals)?, read(Semantic::Tangents)?);
        let order: Vec<usize> = match primitive.indices {
            Some(accessor) => self.numbers(accessor.value())?.iter().map(|value| value[0] as usize).collect(),
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
        expect_at_most(self.most, self.triangles.len() + triples.len())?;
        let columns: [Vector; 3] = std::array::from_fn(|column| [0, 1, 2].map(|row| matrix[column][row]));
        // Normals are turned by the inverse of the transpose, whatever its scale; a mirrored object turns them over.
        let cofactors =
            [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])];
        let times = |columns: &[Vector; 3], v: [f64; 4]| -> Vector {
            std::array::from_fn(|row| (0..3).map(|n| columns[n][row] * v[n]).sum())
        };
        let turns_over = crate::vector::dot(columns[0], cofactors[0]) < 0.0;
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
    fn numbers(&self, number: usize) -> Result<Vec<[f64; 4]>> {
        let accessor = one_of(&self.root.accessors, "accessor", number)?;
        let place = |what: &str| Error::input(format!("accessor {number}: {what}"));
        if accessor.sparse.is_some() {
            return Err(place("sparse values, which are not read").hint("export without compression"));
        }
        let view = accessor.buffer_view.ok_or_else(|| {
            place("no buffer, as in compressed files").hint("export without compression (Draco, meshopt)")
        })?;
        let view = one_of(&self.root.buffer_views, "buffer view", view.value())?;
        // The first buffer is the file's own, unless it has a name.
        let buffer = one_of(&self.root.buffers, "buffer", view.buffer.value())?;
        if view.buffer.value() != 0 || buffer.uri.is_some() {
            return Err(
                place("a buffer outside of the file").hint("export it as .glb, which holds all in one file")
            );
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err(place("an unknown type of numbers"));
        };
        let component = component.0;
        let values = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec2) => 2,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => return Err(place("a matrix, expected numbers or vectors")),
        };
        let bytes = component.size();
        let stride = view.byte_stride.map_or(0, |stride| stride.0);
        let stride = if stride == 0 { bytes * values } else { stride };
        let offset = |value: Option<json::validation::USize64>| {
            usize::try_from(value.map_or(0, |value| value.0)).unwrap_or(usize::MAX)
        };
        let (start, length) = (offset(view.byte_offset), offset(Some(view.byte_length)));
        let within = start.checked_add(length).and_then(|end| self.blob.get(start..end));
        let data = within.and_then(|data| data.get(offset(accessor.byte_offset)..));
        let count = offset(Some(accessor.count));
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
            match component {
                ComponentType::F32 => f64::from(f32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
                ComponentType::U32 => f64::from(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
                ComponentType::U16 => f64::from(u16::from_le_bytes([byte(0), byte(1)])),
                ComponentType::U8 => f64::from(byte(0)),
                ComponentType::I16 => f64::from(i16::from_le_bytes([byte(0), byte(1)])),
                ComponentType::I8 => f64::from(byte(0) as i8),
            }
        };
        let whole = match component {
            ComponentType::U8 => 255.0,
            ComponentType::U16 => 65535.0,
            ComponentType::I8 => 127.0,
            ComponentType::I16 => 32767.0,
            _ => 1.0,
        };
        let scale = if accessor.normalized { 1.0 / whole } else { 1.0 };
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

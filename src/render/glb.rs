//! Triangles of a binary glTF file (GLB), by the crate `gltf`, which reads the description. Its own walk through it takes
//! every number for that of something that is there, so the walk is here, each number and place checked.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

use super::corner::{Corner, expect_triangles};
use crate::error::{Error, Result};
use crate::run::budget::Room;
use crate::vector::{Vector, cross};
use crate::words::counted;

/// Nodes within nodes, deeper than which a file is refused: it may hold itself.
const DEEPEST: usize = 64;

/// A place or a direction as a row of four, times a matrix.
type Matrix = [[f64; 4]; 4];

/// What is asked of a mesh file.
struct Reader<'a> {
    root: &'a json::Root,
    blob: &'a [u8],
}

/// The elements of an accessor, each decoded when it is asked for.
struct Numbers<'a> {
    data: &'a [u8],
    count: usize,
    stride: usize,
    component: ComponentType,
    /// Numbers of an element.
    values: usize,
    scale: f64,
}

/// All triangles of the default scene, or of the first.
///
/// # Errors
/// A file that cannot be read, that keeps its buffers elsewhere or packed, triangles without texture coordinates, and
/// more than there is room for.
pub(super) fn corners(bytes: &[u8], room: &mut Room) -> Result<Vec<[Corner; 3]>> {
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
    room.take("the description of a mesh", description_bytes(&file.json))?;
    let root: json::Root = serde_json::from_slice(&file.json).map_err(|error| unreadable(&error))?;
    let reader = Reader { root: &root, blob: file.bin.as_deref().unwrap_or_default() };
    let (mut count, mut visited) = (0usize, 0usize);
    reader.walk(&mut |primitive, _| {
        count = count.saturating_add(reader.triangles(primitive)?);
        // Those without a triangle are counted as one, so that no file keeps the program busy for ever.
        visited += 1;
        expect_triangles(room, count.max(visited))
    })?;
    let mut triangles = Vec::with_capacity(count);
    reader.walk(&mut |primitive, matrix| reader.primitive(primitive, matrix, &mut triangles))?;
    Ok(triangles)
}

/// The most memory that a description takes once it is read: that of its text, of so many objects as it has braces and
/// so many numbers as it has commas, in lists that grow by doubling.
fn description_bytes(text: &[u8]) -> u64 {
    const OBJECTS: [usize; 6] = [
        size_of::<Node>(),
        size_of::<Primitive>(),
        size_of::<json::Mesh>(),
        size_of::<json::Material>(),
        size_of::<json::Accessor>(),
        size_of::<json::Animation>(),
    ];
    let object = OBJECTS.into_iter().fold(0, usize::max);
    let count = |byte: u8| text.iter().filter(|&&found| found == byte).count();
    (text.len() + 3 * (object * count(b'{') + 8 * count(b','))) as u64
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

impl<'a> Reader<'a> {
    /// Visits the primitives of all meshes of the scene, with the place of each.
    fn walk(&self, visit: &mut dyn FnMut(&Primitive, &Matrix) -> Result<()>) -> Result<()> {
        let root = self.root;
        let scene = match root.scene {
            Some(number) => root.scenes.get(number.value()),
            None => root.scenes.first(),
        };
        let scene = scene.ok_or_else(|| Error::input("a glTF without a scene"))?;
        let identity =
            std::array::from_fn(|row| std::array::from_fn(|column| f64::from(u8::from(row == column))));
        // Each hangs on one other at most.
        let mut left = root.nodes.len();
        scene.nodes.iter().try_for_each(|node| self.node(node.value(), (&identity, 0), &mut left, visit))
    }

    fn node(
        &self,
        number: usize,
        (above, depth): (&Matrix, usize),
        left: &mut usize,
        visit: &mut dyn FnMut(&Primitive, &Matrix) -> Result<()>,
    ) -> Result<()> {
        if depth > DEEPEST {
            return Err(Error::input(format!("node {number}: more than {DEEPEST} nodes within each other")));
        }
        *left = left
            .checked_sub(1)
            .ok_or_else(|| Error::input(format!("node {number} hangs on more than one other")))?;
        let node = one_of(&self.root.nodes, "node", number)?;
        let own = matrix_of(node);
        let matrix: Matrix = std::array::from_fn(|column| {
            std::array::from_fn(|row| (0..4).map(|n| above[n][row] * own[column][n]).sum())
        });
        if let Some(mesh) = node.mesh {
            let mesh = mesh.value();
            for (n, primitive) in one_of(&self.root.meshes, "mesh", mesh)?.primitives.iter().enumerate() {
                visit(primitive, &matrix)
                    .map_err(|error| error.context(format!("mesh {mesh}, primitive {n}")))?;
            }
        }
        let mut children = node.children.iter().flatten();
        children.try_for_each(|child| self.node(child.value(), (&matrix, depth + 1), left, visit))
    }

    /// How many triangles a primitive has.
    fn triangles(&self, primitive: &Primitive) -> Result<usize> {
        let corners = match primitive.indices {
            Some(accessor) => Some(accessor),
            None => primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied(),
        };
        let corners = match corners {
            Some(accessor) => one_of(&self.root.accessors, "accessor", accessor.value())?.count.0,
            None => 0,
        };
        let corners = usize::try_from(corners).unwrap_or(usize::MAX);
        match primitive.mode {
            Checked::Valid(Mode::Triangles) => Ok(corners / 3),
            Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => Ok(corners.saturating_sub(2)),
            Checked::Valid(_) => Ok(0),
            Checked::Invalid => Err(Error::input("an unknown mode")),
        }
    }

    fn primitive(
        &self,
        primitive: &Primitive,
        matrix: &Matrix,
        triangles: &mut Vec<[Corner; 3]>,
    ) -> Result<()> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            _ => return Ok(()),
        };
        let read = |semantic, types| {
            let accessor = primitive.attributes.get(&Checked::Valid(semantic));
            accessor.map(|accessor| self.attribute(accessor.value(), types)).transpose()
        };
        let places = read(Semantic::Positions, Type::Vec3)?.ok_or_else(|| Error::input("no positions"))?;
        let textures = read(Semantic::TexCoords(0), Type::Vec2)?.ok_or_else(|| {
            Error::input("no texture coordinates (TEXCOORD_0)")
                .hint("unwrap it in a modelling program, and export it with texture coordinates")
        })?;
        let (normals, tangents) =
            (read(Semantic::Normals, Type::Vec3)?, read(Semantic::Tangents, Type::Vec4)?);
        let indices = primitive.indices.map(|accessor| self.indices(accessor.value())).transpose()?;
        let vertex = |at: usize| match &indices {
            Some(indices) => indices.get(at).map_or(usize::MAX, |[number, ..]| number as usize),
            None => at,
        };
        let columns: [Vector; 3] = std::array::from_fn(|column| [0, 1, 2].map(|row| matrix[column][row]));
        // Normals are turned by the inverse of the transpose, whatever its scale; a mirrored object turns them over.
        let cofactors =
            [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])];
        let times = |columns: &[Vector; 3], v: [f64; 4]| -> Vector {
            std::array::from_fn(|row| (0..3).map(|n| columns[n][row] * v[n]).sum())
        };
        let turns_over = crate::vector::dot(columns[0], cofactors[0]) < 0.0;
        let corner = |at: usize| -> Option<Corner> {
            let [s, t, ..] = textures.get(at)?;
            let place = times(&columns, places.get(at)?);
            let tangent = tangents.as_ref().and_then(|list| list.get(at));
            Some(Corner {
                place: std::array::from_fn(|row| place[row] + matrix[3][row]),
                // Of glTF the second coordinate grows downwards.
                texture: [s, 1.0 - t],
                normal: normals.as_ref().and_then(|list| list.get(at)).map(|normal| {
                    let normal = times(&cofactors, normal);
                    if turns_over { normal.map(|value| -value) } else { normal }
                }),
                tangent: tangent.map(|t| (times(&columns, t), if turns_over { -t[3] } else { t[3] })),
            })
        };
        for n in 0..self.triangles(primitive)? {
            let triple = match mode {
                Mode::Triangles => [3 * n, 3 * n + 1, 3 * n + 2],
                Mode::TriangleStrip if n % 2 == 0 => [n, n + 1, n + 2],
                Mode::TriangleStrip => [n + 1, n, n + 2],
                _ => [0, n + 1, n + 2],
            };
            let triple = triple.map(vertex);
            let [Some(a), Some(b), Some(c)] = triple.map(corner) else {
                return Err(Error::input(format!("a triangle of corners {triple:?}, which are not there")));
            };
            triangles.push([a, b, c]);
        }
        Ok(())
    }

    /// The values of an attribute; whole numbers that stand for shares are from 0 to 1.
    fn attribute(&self, number: usize, expected: Type) -> Result<Numbers<'a>> {
        let accessor = one_of(&self.root.accessors, "accessor", number)?;
        let numbers = self.numbers(number)?;
        // Whole numbers of 32 bits stand for indices alone (glTF 2.0, 3.6.2.2).
        if accessor.type_ != Checked::Valid(expected) || numbers.component == ComponentType::U32 {
            let (values, kind) = (numbers.values, numbers.component);
            let found = format!("accessor {number}: got {} of {kind:?}", counted(values, "value"));
            return Err(Error::input(format!("{found} for a vertex, expected {expected:?} of F32 or less")));
        }
        Ok(numbers)
    }

    /// Numbers of vertices.
    fn indices(&self, number: usize) -> Result<Numbers<'a>> {
        let accessor = one_of(&self.root.accessors, "accessor", number)?;
        let numbers = self.numbers(number)?;
        let is_whole =
            matches!(numbers.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if !is_whole || numbers.values != 1 || accessor.normalized {
            let (values, kind) = (numbers.values, numbers.component);
            let normalized = if accessor.normalized { ", normalized," } else { "" };
            let found =
                format!("accessor {number}: got {} of {kind:?}{normalized}", counted(values, "value"));
            return Err(Error::input(format!("{found} for an index, expected one of U8, U16 or U32")));
        }
        Ok(numbers)
    }

    /// The elements of an accessor, up to four numbers each.
    fn numbers(&self, number: usize) -> Result<Numbers<'a>> {
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
        let whole = match component {
            ComponentType::U8 => 255.0,
            ComponentType::U16 => 65535.0,
            ComponentType::I8 => 127.0,
            ComponentType::I16 => 32767.0,
            _ => 1.0,
        };
        let scale = if accessor.normalized { 1.0 / whole } else { 1.0 };
        Ok(Numbers { data, count, stride, component, values, scale })
    }
}

impl Numbers<'_> {
    /// An element, if there are so many.
    fn get(&self, at: usize) -> Option<[f64; 4]> {
        if at >= self.count {
            return None;
        }
        let mut element = [0.0; 4];
        let size = self.component.size();
        for (n, value) in element.iter_mut().take(self.values).enumerate() {
            let start = at * self.stride + n * size;
            let number = match (self.component, self.data.get(start..start + size)?) {
                (ComponentType::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
                (ComponentType::U32, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
                (ComponentType::U16, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
                (ComponentType::I16, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
                (ComponentType::U8, &[a]) => f64::from(a),
                (ComponentType::I8, &[a]) => f64::from(a as i8),
                _ => return None,
            };
            *value = number * self.scale;
        }
        Some(element)
    }
}

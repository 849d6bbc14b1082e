//! Objects of triangles, with texture coordinates, and the tree that finds where a ray meets them.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use nalgebra::{Point3, Vector3};

use super::camera::Ray;
use super::corner::Corner;
use super::hit::{Frame, Hit, NEAR};
use super::{glb, obj};
use crate::error::{Error, Result};
use crate::run::budget::Room;
use crate::vector::{Vector, along, cross, dot, length, minus, unit};

/// A triangle as it is asked for.
struct Triangle {
    corners: [Vector; 3],
    textures: [[f64; 2]; 3],
    normals: [Vector; 3],
    tangents: [Vector; 3],
    mirrored: bool,
    node: usize,
}

/// Memory of a triangle at most: as it is asked for, beside its corners as they were read, or beside two nodes of the
/// tree and a place in the lists that the tree's builder sorts.
pub(super) const TRIANGLE_BYTES: u64 = {
    let (corners, nodes) = (size_of::<[Corner; 3]>(), 2 * size_of::<BvhNode<f64, 3>>() + 32);
    (size_of::<Triangle>() + if corners > nodes { corners } else { nodes }) as u64
};

/// Triangles in a tree, scaled and moved so that they just fit the sphere of radius 1 around the origin.
pub struct Mesh {
    triangles: Vec<Triangle>,
    tree: Bvh<f64, 3>,
}

impl Bounded<f64, 3> for Triangle {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.corners.iter().fold(Aabb::empty(), |bounds, &corner| bounds.grow(&Point3::from(corner)))
    }
}

impl BHShape<f64, 3> for Triangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Mesh {
    /// Reads a file, Wavefront OBJ or binary glTF (GLB), by the ending of its name. What stays in memory is taken of the
    /// room; what a file claims beyond it is refused before it is decoded.
    ///
    /// # Errors
    /// Another ending, a file that is damaged, triangles without texture coordinates, and too many of them.
    pub fn read(name: &str, bytes: &[u8], room: &mut Room) -> Result<Self> {
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let mut spare = *room;
        spare.take("the file of a mesh", bytes.len() as u64).map_err(|error| error.context(name))?;
        let corners = match ending.as_str() {
            "obj" => obj::corners(bytes, &mut spare),
            "glb" => glb::corners(bytes, &mut spare),
            _ => Err(Error::usage("expected a mesh whose name ends in .obj or .glb")),
        };
        let mesh = corners.and_then(Self::new).map_err(|error| error.context(name))?;
        room.take("a mesh", mesh.bytes())?;
        Ok(mesh)
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> u64 {
        (self.triangles.capacity() * (size_of::<Triangle>() + 2 * size_of::<BvhNode<f64, 3>>())) as u64
    }

    /// Of three corners each. Triangles without an extent are left out.
    ///
    /// # Errors
    /// No triangle, and numbers that are not finite.
    pub fn new(corners: Vec<[Corner; 3]>) -> Result<Self> {
        let mut corners = corners;
        fit(&mut corners)?;
        let mut triangles: Vec<Triangle> = Vec::with_capacity(corners.len());
        triangles.extend(corners.iter().filter_map(triangle));
        drop(corners);
        if triangles.is_empty() {
            return Err(Error::input("a mesh without triangles that have an extent"));
        }
        let tree = Bvh::build(&mut triangles);
        Ok(Self { triangles, tree })
    }

    /// How many triangles.
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Length of the object for 1 of its texture coordinates, on an average of its area.
    fn length_of_texture(&self) -> f64 {
        let area = |[a, b, c]: [Vector; 3]| length(cross(minus(b, a), minus(c, a)));
        let flat =
            |[a, b, c]: [[f64; 2]; 3]| ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs();
        let world: f64 = self.triangles.iter().map(|triangle| area(triangle.corners)).sum();
        let texture: f64 = self.triangles.iter().map(|triangle| flat(triangle.textures)).sum();
        if texture > 0.0 { (world / texture).sqrt() } else { 1.0 }
    }

    /// The middle of its texture coordinates.
    pub(crate) fn texture_middle(&self) -> [f64; 2] {
        let all = || self.triangles.iter().flat_map(|triangle| triangle.textures);
        std::array::from_fn(|axis| {
            let low = all().map(|place| place[axis]).fold(f64::INFINITY, f64::min);
            f64::midpoint(low, all().map(|place| place[axis]).fold(f64::NEG_INFINITY, f64::max))
        })
    }

    /// Makes places in its texture lengths of the object.
    #[must_use]
    pub(crate) fn with_texture_in_lengths(mut self) -> Self {
        let scale = self.length_of_texture();
        for texture in self.triangles.iter_mut().flat_map(|triangle| &mut triangle.textures) {
            *texture = texture.map(|value| value * scale);
        }
        self
    }

    /// Looks at the triangles whose boxes a ray passes, until `look` has seen enough.
    fn pass<'a>(&'a self, ray: &Ray, mut look: impl FnMut(&'a Triangle) -> bool) {
        let query = bvh::ray::Ray {
            origin: Point3::from(ray.origin),
            direction: Vector3::from(ray.direction),
            // Of 0 the crate would make what is no number where a ray lies within the side of a box.
            inv_direction: Vector3::from(
                ray.direction.map(|value| 1.0 / if value == 0.0 { f64::MIN_POSITIVE } else { value }),
            ),
        };
        // A stack of its own, since that of the crate's iterator ends at a depth of 32.
        let mut stack = Vec::with_capacity(64);
        stack.push(0);
        while let Some(node) = stack.pop() {
            match self.tree.nodes.get(node) {
                Some(BvhNode::Leaf { shape_index, .. })
                    if self.triangles.get(*shape_index).is_some_and(&mut look) =>
                {
                    return;
                }
                Some(BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. }) => {
                    if query.intersects_aabb(child_l_aabb) {
                        stack.push(*child_l_index);
                    }
                    if query.intersects_aabb(child_r_aabb) {
                        stack.push(*child_r_index);
                    }
                }
                Some(BvhNode::Leaf { .. }) | None => {}
            }
        }
    }

    /// Where a ray meets it first.
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<(f64, [f64; 2], &Triangle)> = None;
        self.pass(ray, |triangle| {
            if let Some((distance, weights)) = meet(ray, &triangle.corners)
                && nearest.is_none_or(|(nearest, ..)| distance < nearest)
            {
                nearest = Some((distance, weights, triangle));
            }
            false
        });
        let (distance, [second, third], triangle) = nearest?;
        let first = 1.0 - second - third;
        let mixed = |[a, b, c]: [Vector; 3]| -> Vector {
            std::array::from_fn(|axis| first * a[axis] + second * b[axis] + third * c[axis])
        };
        let [a, b, c] = triangle.corners;
        let normal = unit(cross(minus(b, a), minus(c, a)))?;
        let out = unit(mixed(triangle.normals)).unwrap_or(normal);
        // Normals of corners say which side is out; those of the triangle follow.
        let normal = if dot(normal, out) < 0.0 { normal.map(|value| -value) } else { normal };
        // A tangent along the normal says nothing: any other direction will do.
        let rights = [mixed(triangle.tangents), [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let frame = rights.into_iter().find_map(|right| Frame::new(out, right, triangle.mirrored))?;
        let [a, b, c] = triangle.textures;
        let place = std::array::from_fn(|axis| first * a[axis] + second * b[axis] + third * c[axis]);
        Some(Hit { distance, point: along(ray.origin, distance, ray.direction), normal, frame, place })
    }

    /// Whether a triangle lies on a ray nearer than this.
    pub(super) fn blocks(&self, ray: &Ray, distance: f64) -> bool {
        let mut found = false;
        self.pass(ray, |triangle| {
            found = meet(ray, &triangle.corners).is_some_and(|(met, _)| met < distance);
            found
        });
        found
    }
}

/// Scales and moves corners into the sphere of radius 1.
fn fit(corners: &mut [[Corner; 3]]) -> Result<()> {
    let places = || corners.iter().flatten().map(|corner| corner.place);
    let finite = |values: &[f64]| values.iter().all(|value| value.abs() < 1e30);
    let is_finite = |corner: &Corner| finite(&corner.place) && finite(&corner.texture);
    if !corners.iter().flatten().all(is_finite) {
        return Err(Error::input("a corner whose place or texture coordinates are no usual numbers"));
    }
    let bound = |pick: fn(f64, f64) -> f64, from: f64| -> Vector {
        places().fold([from; 3], |bound, place| std::array::from_fn(|axis| pick(bound[axis], place[axis])))
    };
    let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
    let middle: Vector = std::array::from_fn(|axis| f64::midpoint(low[axis], high[axis]));
    let radius = places().map(|place| length(minus(place, middle))).fold(0.0, f64::max);
    if radius.is_nan() || radius <= 0.0 {
        return Err(Error::input("a mesh without triangles that have an extent"));
    }
    for corner in corners.iter_mut().flatten() {
        corner.place = minus(corner.place, middle).map(|value| value / radius);
    }
    Ok(())
}

/// A triangle with normals and tangents: those of its corners, else of itself by its texture coordinates.
fn triangle(corners: &[Corner; 3]) -> Option<Triangle> {
    let places = corners.map(|corner| corner.place);
    let textures = corners.map(|corner| corner.texture);
    let [a, b, c] = places;
    let (along_b, along_c) = (minus(b, a), minus(c, a));
    let flat = unit(cross(along_b, along_c))?;
    let [ta, tb, tc] = textures;
    let (ub, vb, uc, vc) = (tb[0] - ta[0], tb[1] - ta[1], tc[0] - ta[0], tc[1] - ta[1]);
    let turn = ub * vc - uc * vb;
    // Where columns grow: the derivative of the place by the first coordinate.
    let grows = along(along_b.map(|value| value * vc), -vb, along_c).map(|value| value * turn.signum());
    let grows = unit(grows).or_else(|| unit(along_b))?;
    let normals = corners.map(|corner| corner.normal.and_then(unit).unwrap_or(flat));
    let tangents =
        corners.map(|corner| corner.tangent.and_then(|(tangent, _)| unit(tangent)).unwrap_or(grows));
    // Seen from outside, a texture that is not mirrored turns as the triangle does.
    let outward = normals.iter().map(|&normal| dot(normal, flat)).sum::<f64>() >= 0.0;
    let by_texture = (turn < 0.0) == outward;
    let mirrored = corners[0].tangent.map_or(by_texture, |(_, handedness)| handedness < 0.0);
    Some(Triangle { corners: places, textures, normals, tangents, mirrored, node: 0 })
}

/// Where a ray meets a triangle: the distance, and weights of the second and third corner (Moeller and Trumbore 1997).
#[inline]
fn meet(ray: &Ray, &[a, b, c]: &[Vector; 3]) -> Option<(f64, [f64; 2])> {
    let (second, third) = (minus(b, a), minus(c, a));
    let normal = cross(ray.direction, third);
    let scale = dot(second, normal);
    if scale == 0.0 {
        return None;
    }
    let from = minus(ray.origin, a);
    let u = dot(from, normal) / scale;
    let side = cross(from, second);
    let v = dot(ray.direction, side) / scale;
    let distance = dot(third, side) / scale;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > NEAR).then_some((distance, [u, v]))
}

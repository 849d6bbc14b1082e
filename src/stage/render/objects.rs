//! Objects with their textures laid on, and the camera that each is seen by unless one is chosen.

use std::path::Path;

use super::{DENSITY, Options, SAMPLES, Shape};
use crate::disk::mapped::MappedFile;
use crate::error::{Error, Result};
use crate::render::camera::View;
use crate::render::interior;
use crate::render::mesh::Mesh;
use crate::render::surface::Surface;
use crate::run::Context;
use crate::run::budget::Room;
use crate::shape::Size;

/// Field of view unless one is chosen, degrees.
const FOV_DEG: f64 = 30.0;

/// The same of the interior, which is wider than it is high.
const INTERIOR_FOV_DEG: f64 = 22.0;

/// The middle of the interior as its default camera sees it.
const INTERIOR_MIDDLE: [f64; 3] = [0.045, 0.0, 0.0];

/// How far the default camera is: the sphere of radius 1 fills nine tenths of the picture.
const DISTANCE: f64 = 4.3;

/// How the texture lies on an object.
pub(super) struct Laid {
    /// Texels along a length of 1.
    pub(super) density: f64,
    /// Place in the texture of what is at 0, 0 on the surface.
    pub(super) origin: [f64; 2],
    /// Rays per pixel.
    pub(super) samples: u32,
}

/// The object that the options ask for.
pub(super) fn surface(options: &Options, room: &mut Room, context: &Context<'_>) -> Result<Surface> {
    Ok(match &options.shape {
        Shape::Flat => Surface::Endless,
        Shape::Plane => Surface::Plane,
        Shape::Sphere => Surface::Sphere,
        Shape::Cylinder => Surface::Cylinder,
        Shape::Interior => Surface::Mesh(context.compute(|| interior::mesh(room))?.with_texture_in_lengths()),
        Shape::Mesh(path) => {
            let file = bytes_of(path)?;
            let bytes = file.as_ref();
            let name = path.display().to_string();
            Surface::Mesh(context.compute(|| Mesh::read(&name, bytes, room))?.with_texture_in_lengths())
        }
    })
}

/// How a texture of this extent lies on an object: one that does not repeat lies around its middle.
pub(super) fn laid(options: &Options, surface: &Surface, bounds: Option<(Size, bool)>) -> Laid {
    let density = DENSITY / options.scale;
    let middle = bounds.map(|(size, _)| [size.width as f64 / 2.0, size.height as f64 / 2.0]);
    let origin = match (surface, bounds) {
        (Surface::Endless, _) => {
            [options.size.width, options.size.height].map(|side| side as f64 / 2.0 / options.scale)
        }
        (Surface::Plane, _) => [density; 2],
        (_, Some((_, true)) | None) => [0.0; 2],
        (Surface::Mesh(mesh), _) => {
            let [u, v] = mesh.texture_middle();
            middle.map_or([0.0; 2], |[column, row]| [column - u * density, row + v * density])
        }
        _ => middle.unwrap_or_default(),
    };
    let usual = if options.shape == Shape::Flat && options.scale == 1.0 { 1 } else { SAMPLES };
    Laid { density, origin, samples: options.samples.unwrap_or(usual) }
}

/// How the camera stands.
pub(super) fn view(options: &Options, surface: &Surface) -> View {
    let chosen = options.camera;
    let flat = matches!(surface, Surface::Endless);
    let eye = match &options.shape {
        Shape::Flat | Shape::Plane | Shape::Sphere => [0.0, 0.0, DISTANCE],
        Shape::Cylinder => [0.0, 1.5, 4.03],
        Shape::Interior => [0.5, 1.5, 4.0],
        Shape::Mesh(_) => [0.8, 1.35, 4.0],
    };
    // Flat, a pixel is 1 / 256 of a length, however large the picture.
    let side = options.size.height.min(options.size.width) as f64 / DENSITY;
    let fov_deg = match options.shape {
        Shape::Flat => 2.0 * libm::atan(side / 2.0 / DISTANCE).to_degrees(),
        Shape::Interior => INTERIOR_FOV_DEG,
        _ => FOV_DEG,
    };
    View {
        eye: chosen.eye.unwrap_or(eye),
        target: chosen.target.unwrap_or(if options.shape == Shape::Interior {
            INTERIOR_MIDDLE
        } else {
            [0.0; 3]
        }),
        up: chosen.up.unwrap_or([0.0, 1.0, 0.0]),
        fov_deg: chosen.fov_deg.unwrap_or(fov_deg),
        orthographic: chosen.orthographic || flat,
    }
}

/// A file, mapped for reading.
pub(super) fn bytes_of(path: &Path) -> Result<MappedFile> {
    MappedFile::open(path).map_err(|error| Error::io("read", path, error))
}

//! Pictures of scenes: rays of view, the light at what they meet, and the material there.

use rayon::prelude::*;

use super::camera::{Camera, Ray};
use super::environment::Environment;
use super::hit::Hit;
use super::light::Light;
use super::surface::Surface;
use super::texture::{Reader, Texture};
use crate::error::{Error, Result};
use crate::method::value::evaluator::{Evaluator, tinted};
use crate::method::value::table::{Mixture, Tinted, Values};
use crate::picture::Picture;
use crate::run::Context;
use crate::shape::Size;
use crate::vector::{along, dot, turned};

/// Pixels of a row that a thread computes before it looks for a stop.
const TOGETHER: usize = 32;

/// From so many lights on, weights are gathered for every measured light: more lights then cost no more look-ups.
const MANY: usize = 9;

/// The least cosine of a view: where smooth normals turn away from the eye, what is seen is grazing.
const GRAZING: f64 = 1e-3;

/// How far a ray to a light begins above the surface.
const LIFT: f64 = 1e-6;

/// What is seen where there is no object.
pub enum Background {
    /// A linear grey.
    Grey(f64),
    /// What lights the scene.
    Environment(Environment),
}

/// All of a picture but its size.
pub struct Scene {
    /// The object.
    pub surface: Surface,
    /// What lights it.
    pub lights: Vec<Light>,
    /// What is behind it.
    pub background: Background,
    /// Whether parts of the object hide light from each other.
    pub shadows: bool,
    /// Texels along a length of 1.
    pub density: f64,
    /// Place in the texture, column and row, of what is at 0, 0 on the surface.
    pub origin: [f64; 2],
    /// The object is turned by this about the vertical axis, radians.
    pub turn_rad: f64,
}

/// A picture, and whether it shows something beyond the border of its texture.
pub struct Rendered {
    /// Linear values.
    pub picture: Picture,
    /// Whether something beyond the border of a texture that does not repeat is seen.
    pub beyond: bool,
}

/// Makes a picture of `samples` rays per pixel, the same bytes whatever the threads.
///
/// # Errors
/// Those of reading the texture, and a stop.
pub fn render<V: Values>(
    scene: &Scene,
    camera: &Camera,
    material: (&Evaluator<V>, &Texture),
    size: Size,
    samples: u32,
    context: &Context<'_>,
) -> Result<Rendered>
where
    Evaluator<V>: Sync,
{
    let mut pixels = vec![[0.0f32; 3]; size.texels()];
    let part = |row: usize, (number, pixels): (usize, &mut [[f32; 3]])| -> Result<bool> {
        context.check_stop()?;
        let mut painter =
            Painter { scene, material: material.0, texels: material.1.reader(), tints: Vec::new() };
        for (column, pixel) in pixels.iter_mut().enumerate() {
            *pixel = painter.pixel(camera, [(number * TOGETHER + column) as f64, row as f64], samples)?;
        }
        Ok(painter.texels.beyond)
    };
    let either = |a: bool, b: bool| Ok(a || b);
    let row = |(row, pixels): (usize, &mut [[f32; 3]])| {
        let parts = pixels.par_chunks_mut(TOGETHER).enumerate();
        let beyond = parts.map(|pixels| part(row, pixels)).try_reduce(|| false, either);
        context.progress.advance(1);
        beyond
    };
    let rows = pixels.par_chunks_mut(size.width).enumerate();
    let beyond = context.install(|| rows.map(row).try_reduce(|| false, either))?;
    Ok(Rendered { picture: Picture::linear(size, pixels), beyond })
}

/// What one thread works with.
struct Painter<'a, V> {
    scene: &'a Scene,
    material: &'a Evaluator<V>,
    texels: Reader<'a>,
    tints: Vec<Tinted>,
}

impl<V: Values> Painter<'_, V> {
    /// The mean of the samples of a pixel, which lie where those of every other do: spread evenly by the additive
    /// recurrence of Roberts (2018), the first in the middle.
    fn pixel(&mut self, camera: &Camera, [x, y]: [f64; 2], samples: u32) -> Result<[f32; 3]> {
        const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        let mut sum = [0.0f64; 3];
        for sample in 0..samples.max(1) {
            let offset = STEP.map(|step| (0.5 + step * f64::from(sample)).fract());
            let color = self.seen(&camera.ray([x + offset[0], y + offset[1]]))?;
            sum = std::array::from_fn(|c| sum[c] + f64::from(color[c]));
        }
        Ok(sum.map(|value| (value / f64::from(samples.max(1))) as f32))
    }

    /// What a ray sees.
    fn seen(&mut self, ray: &Ray) -> Result<[f32; 3]> {
        let turned = |v| turned(v, -self.scene.turn_rad);
        let own = Ray { origin: turned(ray.origin), direction: turned(ray.direction) };
        match self.scene.surface.hit(&own) {
            Some(hit) => self.reflected(&own, &hit),
            None => Ok(match &self.scene.background {
                Background::Grey(value) => [*value as f32; 3],
                Background::Environment(environment) => environment.seen(ray.direction),
            }),
        }
    }

    /// The light that a place reflects to the eye.
    fn reflected(&mut self, ray: &Ray, hit: &Hit) -> Result<[f32; 3]> {
        let scene = self.scene;
        let mut view = hit.frame.local(ray.direction.map(|value| -value));
        view[2] = view[2].max(GRAZING);
        let length = dot(view, view).sqrt();
        let view = self.material.view(view.map(|value| (value / length) as f32));
        self.tints.clear();
        let many = scene.lights.len() >= MANY;
        if many {
            let all = 0..self.material.lights() as u16;
            self.tints.extend(all.map(|number| Tinted { number, weights: [0.0; 4] }));
        }
        for light in &scene.lights {
            let world = turned(hit.point, scene.turn_rad);
            let Some((direction, distance, factor)) = light.seen_from(world) else { continue };
            let direction = turned(direction, -scene.turn_rad);
            let local = hit.frame.local(direction);
            if local[2] <= 0.0 || dot(hit.normal, direction) <= 0.0 {
                continue;
            }
            if scene.shadows {
                let from = Ray { origin: along(hit.point, LIFT, hit.normal), direction };
                if scene.surface.blocks(&from, distance) {
                    continue;
                }
            }
            let located = self.material.light(local.map(|value| value as f32));
            let tints = tinted(&located, light.color.map(|value| (value * factor) as f32));
            if many {
                for tint in tints {
                    let sum = &mut self.tints[usize::from(tint.number)].weights;
                    *sum = std::array::from_fn(|c| sum[c] + tint.weights[c]);
                }
            } else {
                self.tints.extend(tints);
            }
        }
        if many {
            self.tints.retain(|tint| tint.weights != [0.0; 4]);
        }
        if self.tints.is_empty() {
            return Ok([0.0; 3]);
        }
        let place =
            [scene.origin[0] + hit.place[0] * scene.density, scene.origin[1] - hit.place[1] * scene.density];
        if place.iter().any(|value| value.abs() > f64::from(1 << 30)) {
            return Err(Error::usage(
                "the texture is so fine on this object that its places have no numbers",
            )
            .hint("choose a larger --scale"));
        }
        let mixture = Mixture { views: &view.shares, lights: &self.tints };
        self.material.at(&mut self.texels, place, &mixture)
    }
}

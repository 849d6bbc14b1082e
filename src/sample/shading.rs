//! Light on the surface: a Lambertian base under a dielectric coat
//! (GGX, Walter et al. 2007; Schlick 1994), for wood with the lobe of its fibres
//! (after Marschner et al. 2005). All terms are reciprocal.

use rayon::prelude::*;

use super::encode::Encoder;
use super::surface::{Surface, Texel, normal};
use super::visibility::{Corners, Heading, Relief};

/// Reflectance of the coat at normal incidence, index of refraction 1.5.
const F0: f32 = 0.04;
/// Stray light of the laboratory, as a part of the beam on the mean plane.
const STRAY: f32 = 0.045;
/// Standard deviation of the sensor noise, levels of 255.
const NOISE: f32 = 0.6;
/// Width of the fibre lobe, in units of the sum of two cosines.
const FIBRE_WIDTH: f32 = 0.28;
/// What the base loses to the fibre lobe in all directions, of the lobe's peak.
const FIBRE_LOSS: f32 = 0.4;

/// Where in its square a pixel is sampled: (column, row) from the centre.
const SAMPLES: [[f32; 2]; 2] = [[-0.25, -0.25], [0.25, 0.25]];

/// A surface and what every light of a list reaches of it.
#[derive(Clone, Debug)]
pub struct Scene {
    surface: Surface,
    lights: Vec<Light>,
    /// Part of the sky that each padded texel sees.
    openness: Vec<f32>,
    encoder: Encoder,
}

#[derive(Clone, Debug)]
struct Light {
    direction: [f32; 3],
    /// Part of the light that reaches each padded texel, 255 = all.
    lit: Vec<u8>,
}

/// What each pixel of one view of a scene sees.
#[derive(Clone, Debug)]
pub struct ViewPoints<'a> {
    scene: &'a Scene,
    number: u32,
    direction: [f32; 3],
    /// The samples of each pixel, pixel by pixel.
    points: Vec<[Point; SAMPLES.len()]>,
}

/// A point of the surface as one view sees it, with all that no light changes.
#[derive(Clone, Copy, Debug)]
struct Point {
    corners: Corners,
    normal: [f32; 3],
    coat_normal: [f32; 3],
    /// Albedo times the transmittance of the coat towards the view.
    base: [f32; 3],
    /// Light from around, linear RGB per unit of irradiance on the mean plane.
    fill: [f32; 3],
    /// Cosine between the coat's normal and the view.
    coat_cosine: f32,
    /// Square of the GGX alpha.
    alpha2: f32,
    coat: f32,
    /// Unit tangent of the fibres.
    fibre: [f32; 3],
    fibre_weight: f32,
}

impl Scene {
    /// Traces the shadows of every light (theta, phi in radians). Beyond 75 degrees the margin is
    /// too small and borders see its edge continued. One byte per light and texel stays in memory.
    pub fn new(surface: Surface, lights: &[[f64; 2]]) -> Self {
        let relief = Relief::new(&surface);
        let places = surface.rows * surface.columns;
        let openness = (0..places).into_par_iter().map(|n| relief.openness(n)).collect();
        let lights = lights
            .par_iter()
            .map(|&angles| {
                let heading = Heading::new(angles);
                let lit = (0..places).map(|n| (255.0 * relief.lit(n, heading) + 0.5) as u8).collect();
                Light { direction: unit(angles), lit }
            })
            .collect();
        let encoder = Encoder::new(surface.seed(), NOISE);
        Self { surface, lights, openness, encoder }
    }

    /// The surface with its truth.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// What each pixel sees from `view` (theta, phi in radians; as for [`Self::new`] up to 75
    /// degrees), the view's `number` in the measurement, which tells its sensor noise from others'.
    pub fn view(&self, number: u32, view: [f64; 2]) -> ViewPoints<'_> {
        let surface = &self.surface;
        let (relief, heading, direction) = (Relief::new(surface), Heading::new(view), unit(view));
        let points = (0..surface.width() * surface.height())
            .into_par_iter()
            .map(|n| {
                let (row, column) =
                    (n / surface.width() + surface.margin, n % surface.width() + surface.margin);
                SAMPLES.map(|[dx, dy]| {
                    let [column, row] = relief.hit(column as f32 + dx, row as f32 + dy, heading);
                    self.point(relief.corners(column, row), direction)
                })
            })
            .collect();
        ViewPoints { scene: self, number, direction, points }
    }

    fn point(&self, corners: Corners, view: [f32; 3]) -> Point {
        let texel = self.texel(corners);
        let (normal, coat_normal) = (normal(texel.slope), normal(texel.coat_slope));
        let open = self.gather(corners, |n| self.openness[n]);
        let passed = 1.0 - fresnel(dot(normal, view));
        let [dive, turn] = texel.fibre_slope;
        let length = (1.0 + dive * dive + turn * turn).sqrt();
        Point {
            corners,
            normal,
            coat_normal,
            base: texel.albedo.map(|a| a * passed),
            // Hollows are lit by their own walls, which are as lit and as coloured as the rest.
            fill: texel.albedo.map(|a| a * passed * (STRAY * open + (1.0 - open) * a)),
            coat_cosine: dot(coat_normal, view).max(0.03),
            alpha2: texel.alpha * texel.alpha,
            coat: texel.coat,
            fibre: [1.0 / length, turn / length, dive / length],
            fibre_weight: texel.fibre,
        }
    }

    /// Bilinear value of a map over the padded texels.
    fn gather(&self, corners: Corners, map: impl Fn(usize) -> f32) -> f32 {
        let Corners { first, weights: [a, b, c, d] } = corners;
        let below = first + self.surface.columns;
        a * map(first) + b * map(first + 1) + c * map(below) + d * map(below + 1)
    }

    fn texel(&self, corners: Corners) -> Texel {
        let of = |part: fn(&Texel) -> f32| self.gather(corners, |n| part(&self.surface.texels[n]));
        Texel {
            slope: [of(|t| t.slope[0]), of(|t| t.slope[1])],
            coat_slope: [of(|t| t.coat_slope[0]), of(|t| t.coat_slope[1])],
            albedo: [of(|t| t.albedo[0]), of(|t| t.albedo[1]), of(|t| t.albedo[2])],
            alpha: of(|t| t.alpha),
            coat: of(|t| t.coat),
            fibre: of(|t| t.fibre),
            fibre_slope: [of(|t| t.fibre_slope[0]), of(|t| t.fibre_slope[1])],
        }
    }
}

impl ViewPoints<'_> {
    /// The image under light number `light` of the scene's list: RGB bytes [y, x, channel], the
    /// sRGB curve of exposure x pi L / E, E across the beam: the cosine of the light's angle is in
    /// it. With sensor noise of its own. `None` if there is no such light.
    pub fn image(&self, light: usize) -> Option<Vec<u8>> {
        let scene = self.scene;
        let number = self.number.wrapping_mul(scene.lights.len() as u32).wrapping_add(light as u32);
        let light = scene.lights.get(light)?;
        let pair = Pair::new(light.direction, self.direction);
        let exposure = scene.surface.kind().exposure() / SAMPLES.len() as f32;
        let mut bytes = Vec::with_capacity(3 * self.points.len());
        for (row, points) in self.points.chunks(scene.surface.width()).enumerate() {
            for (column, samples) in points.iter().enumerate() {
                // Clipped after averaging, as a sensor clips what its optics have averaged.
                let mut value = [0.0; 3];
                for point in samples {
                    let lit = scene.gather(point.corners, |n| f32::from(light.lit[n])) / 255.0;
                    let radiance = pair.radiance(point, lit);
                    value = std::array::from_fn(|channel| value[channel] + exposure * radiance[channel]);
                }
                bytes.extend(scene.encoder.bytes(value, row as u32, column as u32, number));
            }
        }
        Some(bytes)
    }
}

/// A light and a view: what is the same for all pixels of an image.
struct Pair {
    light: [f32; 3],
    /// Sum of the two directions, and the unit vector along it.
    sum: [f32; 3],
    half: [f32; 3],
    fresnel: f32,
}

impl Pair {
    fn new(light: [f32; 3], view: [f32; 3]) -> Self {
        let sum: [f32; 3] = std::array::from_fn(|axis| light[axis] + view[axis]);
        let length = dot(sum, sum).sqrt().max(1e-6);
        let half = sum.map(|s| s / length);
        Self { light, sum, half, fresnel: fresnel(dot(half, light)) }
    }

    /// pi L / E of a point, linear RGB; E across the beam, of which the part `lit` arrives.
    fn radiance(&self, point: &Point, lit: f32) -> [f32; 3] {
        let cosine = dot(point.normal, self.light).max(0.0);
        let along = dot(point.fibre, self.sum) / FIBRE_WIDTH;
        let lobe = 1.0 / (1.0 + along * along);
        let base =
            lit * cosine * (1.0 - fresnel(cosine)) * (1.0 + point.fibre_weight * (lobe * lobe - FIBRE_LOSS));
        let coat = lit * self.coat(point);
        std::array::from_fn(|channel| point.base[channel] * base + point.fill[channel] * self.light[2] + coat)
    }

    /// pi times the coat's GGX reflection with the light's cosine; masking after Heitz 2014
    /// (height-correlated Smith).
    fn coat(&self, point: &Point) -> f32 {
        let (cosine, a2) = (dot(point.coat_normal, self.light), point.alpha2);
        if cosine <= 0.0 {
            return 0.0;
        }
        let half = dot(point.coat_normal, self.half);
        let spread = half * half * (a2 - 1.0) + 1.0;
        let smith = |a: f32, b: f32| a * (b * b * (1.0 - a2) + a2).sqrt();
        let masking = 0.5 / (smith(cosine, point.coat_cosine) + smith(point.coat_cosine, cosine));
        point.coat * self.fresnel * a2 / (spread * spread) * masking * cosine
    }
}

/// Schlick's reflectance of the coat.
fn fresnel(cosine: f32) -> f32 {
    let x = 1.0 - cosine.clamp(0.0, 1.0);
    F0 + (1.0 - F0) * (x * x) * (x * x) * x
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Unit vector of theta and phi.
fn unit([theta, phi]: [f64; 2]) -> [f32; 3] {
    let sine = libm::sin(theta);
    [sine * libm::cos(phi), sine * libm::sin(phi), libm::cos(theta)].map(|c| c as f32)
}

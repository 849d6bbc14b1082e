//! Pictures of a material on an object, one or a sequence of them.

pub mod material;
mod objects;
mod sheets;

use std::path::{Path, PathBuf};

use btfkit_formats::Direction;

use crate::disk::output::Made;
use crate::error::{Error, Result};
use crate::picture::{Encoding, Picture, stream};
use crate::render::camera::Camera;
use crate::render::light::{Light, Place};
use crate::render::surface::Surface;
use crate::render::{Background, Environment, Scene};
use crate::run::Context;
use crate::run::budget::Room;
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::shape::Size;
use crate::stage::image::PlaneOptions;
use crate::stage::values::By;
use crate::store::{kind_of, model};
use crate::vector::{Vector, length};
use crate::words::counted;

pub use sheets::compare;

/// Texels along a length of 1, the radius of an object, at scale 1.
pub(crate) const DENSITY: f64 = 256.0;

/// Rays per pixel, unless their number is given.
const SAMPLES: u32 = 16;

/// Memory of a pixel while its picture is made and written.
const PIXEL_BYTES: u64 = 32;

/// What a material is shown on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Seen from the front, without perspective: one pixel per texel at scale 1.
    Flat,
    /// A square of side 2.
    Plane,
    /// A sphere of radius 1.
    Sphere,
    /// An upright cylinder with lids.
    Cylinder,
    /// A seat and a dashboard.
    Interior,
    /// A mesh, from a file.
    Mesh(PathBuf),
}

/// How the camera stands; what is absent follows from the shape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraOptions {
    /// Where it is.
    pub eye: Option<Vector>,
    /// What it looks at.
    pub target: Option<Vector>,
    /// What is upright.
    pub up: Option<Vector>,
    /// Angle that the shorter side covers, degrees.
    pub fov_deg: Option<f64>,
    /// Whether rays are parallel.
    pub orthographic: bool,
}

/// Light from all around.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentOptions {
    /// A latitude-longitude picture, OpenEXR or Radiance.
    pub path: PathBuf,
    /// Turned about the vertical axis by this, degrees.
    pub turn_deg: f64,
    /// It is approximated by so many directional lights.
    pub lights: usize,
    /// Whether it is seen behind the object.
    pub seen: bool,
}

/// What moves from picture to picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// The object turns once about the vertical axis.
    Turntable,
    /// Lights that are far away go once round the axis to the default camera.
    LightSweep,
}

/// What to show, on what, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// A model (its tile, repeated if its borders join), an enlarged index, or a packed model.
    pub source: PathBuf,
    /// The model of an enlarged index, where it is not found by itself.
    pub model: Option<PathBuf>,
    /// Of a model: the endless plane that the coherent rule makes of it.
    pub plane: Option<PlaneOptions>,
    /// Whose values: those of the clusters where absent, or of the components of a model that has no clusters.
    pub values: Option<By>,
    /// The object.
    pub shape: Shape,
    /// Size of the picture.
    pub size: Size,
    /// Rays per pixel; as the shape needs where absent.
    pub samples: Option<u32>,
    /// Lights far away.
    pub lights: Vec<Direction>,
    /// Lights at points.
    pub points: Vec<Vector>,
    /// Light from all around.
    pub environment: Option<EnvironmentOptions>,
    /// Linear grey behind the object.
    pub background: f64,
    /// The camera.
    pub camera: CameraOptions,
    /// Size of the texture on the object; at 1, its radius has 256 texels.
    pub scale: f64,
    /// Factor on all light.
    pub exposure: f64,
    /// Whether parts of the object hide light from each other.
    pub shadows: bool,
    /// So many pictures of a motion; one picture where absent.
    pub frames: Option<(u32, Motion)>,
    /// The part of the pictures that this run makes.
    pub shard: Shard,
}

impl Options {
    /// A sphere under one light, of 512 pixels a side.
    pub fn new(source: impl Into<PathBuf>) -> Self {
        Self {
            source: source.into(),
            model: None,
            plane: None,
            values: None,
            shape: Shape::Sphere,
            size: Size::new(512, 512),
            samples: None,
            lights: vec![Direction::from_degrees(45.0, 120.0)],
            points: Vec::new(),
            environment: None,
            background: 0.18,
            camera: CameraOptions::default(),
            scale: 1.0,
            exposure: 1.0,
            shadows: true,
            frames: None,
            shard: Shard::WHOLE,
        }
    }
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Report {
    /// The pictures, in order, and whether each was there already.
    pub pictures: Vec<(PathBuf, Made)>,
    /// Rows and columns of each.
    pub size: Size,
    /// What a user should know, a sentence each.
    pub notes: Vec<String>,
}

/// Makes the pictures.
///
/// # Errors
/// Those of opening the stores, the mesh and the environment, of the camera, of memory, and of writing.
pub fn run(options: &Options, output: &Path, encoding: Encoding, context: &Context<'_>) -> Result<Report> {
    let Options { size, .. } = *options;
    encoding.check_size(size)?;
    let picture = size.texels() as u64 * PIXEL_BYTES + encoding.memory_bytes(size);
    let mut room = Room::new(context.memory());
    room.take(&format!("a picture of {size}"), picture)?;
    let surface = objects::surface(options, &mut room, context)?;
    let (lights, environment) = lights(options, &surface, &mut room)?;
    // Last, since what is left of the memory keeps pieces of an endless texture.
    let material = material::open(options, &mut room, context)?;
    let laid = objects::laid(options, &surface, material.bounds);
    let camera = Camera::new(objects::view(options, &surface), size)?;
    let background = match (environment, &options.environment) {
        (Some(environment), Some(chosen)) if chosen.seen => Background::Environment(environment),
        _ => Background::Grey(options.background),
    };
    let shadows = options.shadows;
    let objects::Laid { density, origin, samples } = laid;
    let mut scene =
        Scene { surface, lights: lights.clone(), background, shadows, density, origin, turn_rad: 0.0 };
    let count = options.frames.map_or(1, |(count, _)| count);
    let numbers: Vec<u32> = (0..count).filter(|&number| options.shard.has(number as usize)).collect();
    let mut report = Report { pictures: Vec::new(), size, notes: material.notes.clone() };
    let mut beyond = false;
    context.progress.begin("render", (numbers.len() * size.height) as u64, Counted::Items("rows"));
    for number in numbers {
        let path = match options.frames {
            Some((count, _)) => numbered(output, number, count),
            None => output.to_owned(),
        };
        let turn_rad = f64::from(number) / f64::from(count) * std::f64::consts::TAU;
        match options.frames {
            Some((_, Motion::Turntable)) => scene.turn_rad = turn_rad,
            Some((_, Motion::LightSweep)) => {
                scene.lights = lights.iter().map(|light| swept(light, turn_rad)).collect();
            }
            None => {}
        }
        let rendered = crate::render::render(
            &scene,
            &camera,
            (&material.evaluator, &material.texture),
            size,
            samples,
            context,
        )?;
        beyond |= rendered.beyond;
        report
            .pictures
            .push((path.clone(), write(&rendered.picture, options.exposure, &path, encoding, context)?));
    }
    context.progress.end();
    if beyond {
        report.notes.push(beyond_note(options, material.bounds));
    }
    Ok(report)
}

/// What is told where an object shows more than a texture has.
fn beyond_note(options: &Options, bounds: Option<(Size, bool)>) -> String {
    let (size, _) = bounds.unwrap_or((Size::new(0, 0), false));
    let more = match kind_of(&options.source) {
        Ok(model::KIND) => "choose a larger --scale, or --plane for a surface that never ends",
        Ok(_) => "choose a larger --scale, or make a larger enlargement",
        Err(_) => "choose a larger --scale",
    };
    format!(
        "the object is larger than the texture, which has {size} texels and does not repeat: its border goes on; {more}"
    )
}

/// Writes a picture, its linear values times an exposure.
pub(super) fn write(
    picture: &Picture,
    exposure: f64,
    path: &Path,
    encoding: Encoding,
    context: &Context<'_>,
) -> Result<Made> {
    let mut rows = picture.pixels.chunks_exact(picture.size.width);
    stream::prepare(path, encoding, picture.size, picture.meaning, context.existing, |row| {
        let pixels = rows.next().unwrap_or_default();
        row.copy_from_slice(pixels);
        row.as_flattened_mut().iter_mut().for_each(|value| *value *= exposure as f32);
        Ok(())
    })?
    .publish()
}

/// All lights, and the environment that some of them stand for.
fn lights(
    options: &Options,
    surface: &Surface,
    room: &mut Room,
) -> Result<(Vec<Light>, Option<Environment>)> {
    let mut lights: Vec<Light> = options.lights.iter().map(|&direction| Light::far(direction)).collect();
    for &point in &options.points {
        let told = |what: &str| {
            let [x, y, z] = point;
            Error::usage(format!("a light at the point {x},{y},{z}, {what}"))
                .hint("choose a point outside of the object, whose radius is 1: --point-light 1,1,2")
        };
        if length(point) == 0.0 {
            return Err(told("the origin, where its brightness is measured"));
        }
        if surface.holds(point) {
            return Err(told("which lies within the object or on it: it would light nothing"));
        }
        lights.push(Light::at(point));
    }
    let Some(chosen) = &options.environment else { return Ok((lights, None)) };
    let bytes = objects::bytes_of(&chosen.path)?;
    let environment = Environment::read(bytes.as_ref(), chosen.turn_deg, room)
        .map_err(|error| error.context(chosen.path.display()))?;
    let around = environment.lights(chosen.lights);
    if around.is_empty() {
        return Err(Error::input(format!(
            "{}: all of it is black: it lights nothing",
            chosen.path.display()
        )));
    }
    lights.extend(around);
    Ok((lights, Some(environment)))
}

/// A light that is far away, turned about the axis to the default camera.
fn swept(light: &Light, radians: f64) -> Light {
    let Place::Far([x, y, z]) = light.place else { return *light };
    let (sin, cos) = (libm::sin(radians), libm::cos(radians));
    Light { place: Place::Far([cos * x - sin * y, sin * x + cos * y, z]), ..*light }
}

/// `turn.png` with the number of a picture, from 1: `turn-007.png`, as many digits as the last one has.
fn numbered(output: &Path, number: u32, count: u32) -> PathBuf {
    let digits = count.to_string().len();
    // Names are bytes: two that are not UTF-8 must not become the same.
    let mut name = output.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{:0digits$}.", number + 1));
    name.push(output.extension().unwrap_or_default());
    output.with_file_name(name)
}

/// What is told of a run.
impl Report {
    /// One line: the picture, or how many and which.
    pub fn summary(&self) -> String {
        match &self.pictures[..] {
            [(path, _)] => format!("{}: {}", path.display(), self.size),
            [(first, _), .., (last, _)] => {
                let count = counted(self.pictures.len(), "picture");
                format!("{} to {}: {count} of {}", first.display(), last.display(), self.size)
            }
            [] => "no picture is this part's".to_owned(),
        }
    }
}

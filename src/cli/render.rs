use std::path::PathBuf;

use btfkit::disk::output::Made;
use btfkit::error::Result;
use btfkit::picture::{Encoding, Ending};
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::shape::Size;
use btfkit::stage::render::{self, CameraOptions, EnvironmentOptions, Motion, Options, Shape};
use btfkit::stage::values::By;
use btfkit_formats::Direction;
use clap::{Args, ValueEnum};

use super::given::Given;
use super::scene::PlaneArgs;
use super::{Console, found, number};

/// Longest side of a picture, pixels.
const MOST_SIDE: usize = 65_535;

/// Show a material on an object: a sphere, a car interior or your own mesh, under lights or an environment
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf render wood.model.zarr --out sphere.png
  btf render wood-4k.zarr --shape interior --light 40,60 --size 1200x900 --out seat.png
  btf render wood.model.zarr --plane --mesh chair.glb --environment studio.exr --out chair.exr
  btf render wood.model.zarr --shape cylinder --frames 48 --turntable --out turn.png      turn-01.png to turn-48.png
  btf render wood.model.zarr --shape plane --frames 36 --light-sweep --shard 0/4 --out sweep.jpg
  btf render wood.model.zarr --shape interior --compare --out methods.png
  btf render wood.btfc --out packed.png
Coordinates: x to the right, y up, z towards the default camera. The object lies around the origin and has a radius of 1.
One light shows a perfect white diffuser that faces it as white, as in `btf image`. Light that one surface reflects onto
another is not computed.")]
pub(super) struct Render {
    /// A model or a packed model, whose tile is shown, or an enlargement
    source: PathBuf,
    /// The picture: .png, .jpg, .webp or .tif for displays, .exr for linear values. With --frames its name is followed
    /// by a number
    #[arg(long, short)]
    out: PathBuf,
    /// Size of the picture in pixels, WIDTHxHEIGHT, each from 1 to 65535
    #[arg(long, default_value = "512x512", allow_hyphen_values = true, value_parser = size)]
    size: Size,
    /// What the material is shown on
    #[arg(long, value_enum, default_value = "sphere")]
    shape: ShapeName,
    /// Show it on a mesh instead: .obj or .glb, with texture coordinates. It is moved and scaled to a radius of 1
    #[arg(long, value_name = "FILE", conflicts_with = "shape")]
    mesh: Option<PathBuf>,
    /// Size of the texture on the object, from 0.01 to 100; at 1, the radius of the object is 256 texels long
    #[arg(long, default_value_t = 1.0, value_parser = number::scale, allow_hyphen_values = true)]
    scale: f64,
    /// A light far away, theta,phi in degrees: theta from the axis towards the default camera, phi counter-clockwise
    /// from the right. May be repeated [default: 45,120, unless there are other lights]
    #[arg(long, allow_hyphen_values = true, value_name = "THETA,PHI")]
    light: Vec<Direction>,
    /// A light at a point. Its brightness falls with the square of the distance; at the origin it is that of --light. May
    /// be repeated
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,Z", value_parser = number::place)]
    point_light: Vec<[f64; 3]>,
    /// Light from all around: a latitude-longitude picture, .exr or .hdr, whose middle lies behind the object
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Turn the environment about the vertical axis by so many degrees
    #[arg(long, requires = "environment", default_value_t = 0.0, value_parser = number::turn)]
    #[arg(allow_hyphen_values = true)]
    environment_turn: f64,
    /// Approximate the environment by N directional lights; more make softer shadows
    #[arg(long, requires = "environment", default_value = "64", value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=4096))]
    environment_lights: u32,
    /// Show the environment behind the object, instead of grey
    #[arg(long, requires = "environment", conflicts_with = "background")]
    show_environment: bool,
    /// Grey behind the object, linear
    #[arg(long, default_value_t = 0.18, value_parser = number::grey, allow_hyphen_values = true)]
    background: f64,
    /// Cast no shadows: parts of the object do not hide light from each other
    #[arg(long)]
    no_shadows: bool,
    /// Place of the camera [default: by the shape]
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,Z", value_parser = number::place)]
    eye: Option<[f64; 3]>,
    /// What the camera looks at [default: 0,0,0, or the middle of the interior]
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,Z", value_parser = number::place)]
    target: Option<[f64; 3]>,
    /// Which way is up in the picture [default: 0,1,0]
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,Z", value_parser = number::place)]
    up: Option<[f64; 3]>,
    /// Field of view: the angle that the shorter side of the picture covers, degrees [default: 30]
    #[arg(long, value_parser = number::field_of_view, value_name = "DEGREES")]
    fov: Option<f64>,
    /// Parallel rays: no perspective
    #[arg(long)]
    orthographic: bool,
    /// Rays per pixel, from 1 to 4096: more make smoother edges and finer textures [default: 16; 1 for --shape flat]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    samples: Option<u32>,
    /// Brightness: a factor on the linear values, above 0
    #[arg(long, default_value_t = 1.0, value_parser = number::exposure)]
    exposure: f64,
    /// Quality of a JPEG, 1 to 100 [default: 90]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: Option<u8>,
    /// Make N pictures of a motion: --turntable or --light-sweep
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: Option<u32>,
    /// The object turns once about the vertical axis
    #[arg(long, requires = "frames")]
    turntable: bool,
    /// Lights move once around the axis that points to the default camera
    #[arg(long, requires = "frames", conflicts_with = "turntable")]
    light_sweep: bool,
    /// Make only part K of N of the pictures, K from 0, so that N jobs share them; `env` takes both from the variables
    /// of Slurm or MPI
    #[arg(long, value_name = "K/N|env", requires = "frames", default_value = "0/1")]
    shard: Shard,
    /// Cover the object with the endless surface of a model, instead of its tile
    #[arg(long)]
    plane: bool,
    #[command(flatten)]
    variation: PlaneArgs,
    /// Which values texels have [default: model]
    #[arg(long, value_enum)]
    values: Option<ValuesName>,
    /// Show five ways to cover the object with the material of a model, side by side with labels: the tile repeated, two
    /// tiles that join each other, the paper's rule with a 2D and a 3D random field, and the coherent rule
    #[arg(long, conflicts_with_all = ["frames", "plane", "model", "show_environment", "values"])]
    compare: bool,
    /// The model of an enlargement [default: where it was when the enlargement was made; else of that name beside it
    /// or in the current folder]
    #[arg(long, conflicts_with = "plane")]
    model: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ValuesName {
    /// Those of the model's clusters; of its components if it has no clusters
    Model,
    /// Those of the model's components (btf components)
    Components,
}

fn size(text: &str) -> std::result::Result<Size, String> {
    Size::up_to(text, MOST_SIDE)
}

#[derive(Clone, Copy, ValueEnum)]
enum ShapeName {
    /// Seen from the front, without perspective: one pixel per texel at scale 1
    Flat,
    /// A square
    Plane,
    /// A sphere
    Sphere,
    /// An upright cylinder with lids
    Cylinder,
    /// A seat and a dashboard of a car
    Interior,
}

impl Render {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<()> {
        let ending = Ending::of(&self.out, &Ending::ALL)?;
        if ending != Ending::Jpeg {
            given.refuse_these(&["quality"], "in this format: it is that of a JPEG")?;
        }
        let flat = matches!(self.shape, ShapeName::Flat) && self.mesh.is_none();
        if flat {
            given.refuse_these(
                &[
                    "eye",
                    "target",
                    "up",
                    "fov",
                    "orthographic",
                    "background",
                    "show_environment",
                    "no_shadows",
                ],
                "of --shape flat, which fills the picture and is seen from afar along its normal",
            )?;
        }
        if self.mesh.is_none() && !matches!(self.shape, ShapeName::Interior) {
            given.refuse_these(&["no_shadows"], "of this shape, which hides no light from itself")?;
        }
        let motion = match (self.frames, self.turntable, self.light_sweep) {
            (Some(count), true, _) => Some((count, Motion::Turntable)),
            (Some(count), _, true) => Some((count, Motion::LightSweep)),
            (Some(_), ..) => {
                return Err(btfkit::Error::usage("--frames says how many pictures, but not of what motion")
                    .hint("add --turntable or --light-sweep"));
            }
            (None, ..) => None,
        };
        let own_light = self.light.is_empty() && self.point_light.is_empty() && self.environment.is_none();
        let mut options = Options::new(&self.source);
        if !own_light {
            options.lights.clone_from(&self.light);
        }
        if self.light_sweep && options.lights.is_empty() {
            return Err(btfkit::Error::usage(
                "--light-sweep moves lights that are far away, and there is none",
            )
            .hint("add --light THETA,PHI"));
        }
        let options = Options {
            model: self.model.clone(),
            plane: self.plane.then(|| self.variation.options()),
            values: matches!(self.values, Some(ValuesName::Components)).then_some(By::Components),
            shape: match (&self.mesh, self.shape) {
                (Some(path), _) => Shape::Mesh(path.clone()),
                (None, ShapeName::Flat) => Shape::Flat,
                (None, ShapeName::Plane) => Shape::Plane,
                (None, ShapeName::Sphere) => Shape::Sphere,
                (None, ShapeName::Cylinder) => Shape::Cylinder,
                (None, ShapeName::Interior) => Shape::Interior,
            },
            size: self.size,
            samples: self.samples,
            points: self.point_light.clone(),
            environment: self.environment.as_ref().map(|path| EnvironmentOptions {
                path: path.clone(),
                turn_deg: self.environment_turn,
                lights: self.environment_lights as usize,
                seen: self.show_environment,
            }),
            background: self.background,
            camera: CameraOptions {
                eye: self.eye,
                target: self.target,
                up: self.up,
                fov_deg: self.fov,
                orthographic: self.orthographic,
            },
            scale: self.scale,
            exposure: self.exposure,
            shadows: !self.no_shadows,
            frames: motion,
            shard: self.shard,
            ..options
        };
        let encoding = Encoding::of(&self.out, &Ending::ALL)?.with(None, self.quality)?;
        let report = if self.compare {
            Ending::of(&self.out, &Ending::DISPLAY)?;
            render::compare(&options, &self.out, encoding, context)?
        } else {
            render::run(&options, &self.out, encoding, context)?
        };
        let made = report.pictures.iter().map(|&(_, made)| made).find(|made| *made == Made::Written);
        let made = made.or_else(|| report.pictures.first().map(|&(_, made)| made));
        console.line(format!("{}{}", report.summary(), made.map_or("", found)));
        console.notes(&report.notes);
        Ok(())
    }
}

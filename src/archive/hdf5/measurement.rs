//! Our own layout: the arrays and attributes of a measurement store.

use std::ops::Range;

use btfkit_formats::{Contents, Direction, Limits};
use hdf5::H5Type;
use serde_json::Value;

use super::attribute::Attributes;
use super::dataset::{File, Table, side};
use crate::error::Result;
use crate::store::measurement::KIND;
use crate::words::counted;

/// The samples, [view, y, x, light, channel].
pub(super) const REFLECTANCE: &str = "reflectance";
/// L* codes, [view, y, x, light].
pub(super) const LUMINANCE: &str = "luminance";
/// Directions, [n, 2], theta and phi in radians.
pub(super) const DIRECTIONS: [&str; 2] = ["view_direction", "light_direction"];

/// Version of this layout, the attribute `format`; not that of stores.
pub(super) const FORMAT: u64 = 1;

/// The attribute `radiometry`, where the cosine of the light's angle is in the samples, and where it is not.
pub(super) const RADIOMETRY: [(bool, &str); 2] = [
    (true, "apparent reflectance, cosine of the light angle included"),
    (false, "apparent reflectance, cosine of the light angle divided out"),
];

/// The attribute `transfer`, where samples are linear, and where they are display values.
pub(super) const TRANSFER: [(bool, &str); 2] = [(true, "linear"), (false, "srgb")];

/// Attributes that are told by [`Contents`] itself and so are no remarks.
pub(super) const TOLD: [&str; 4] = ["kind", "format", "radiometry", "transfer"];

/// Texel by texel.
pub(super) struct Texels {
    reflectance: Table,
}

impl Texels {
    pub(super) fn open(file: &File, limits: &Limits) -> Result<(Self, Contents)> {
        let root = Attributes::of(file.root(), file.path().display().to_string());
        let wrong = |name: &str, found: &Value, expected: String| {
            file.error(format!("attribute {name}: got {found}, expected {expected}"))
        };
        for (name, expected) in [("kind", Value::from(KIND)), ("format", Value::from(FORMAT))] {
            let found = root.required(name)?;
            if found != expected {
                return Err(wrong(name, &found, expected.to_string()));
            }
        }
        let either =
            |name: &str, known: [(bool, &str); 2]| -> Result<bool> {
                let found = root.text(name)?;
                known.iter().find(|(_, text)| *text == found).map(|&(is, _)| is).ok_or_else(|| {
                    wrong(name, &found.into(), format!("{:?} or {:?}", known[0].1, known[1].1))
                })
            };
        let reflectance = file.table(REFLECTANCE, limits)?;
        let [views, height, width, lights, channels] = reflectance.extents([
            ("view", limits.max_directions),
            ("y", limits.max_pixels_per_image),
            ("x", limits.max_pixels_per_image),
            ("light", limits.max_directions),
            ("channel", limits.max_channels),
        ])?;
        let names =
            Attributes::of(reflectance.location(), format!("{}: {REFLECTANCE}", file.path().display()))
                .texts("channels")?;
        if names.len() != channels {
            return Err(
                reflectance.error(format!("got {} and the names {names:?}", counted(channels, "channel")))
            );
        }
        let mut remarks = Vec::new();
        for name in root.names()?.into_iter().filter(|name| !TOLD.contains(&name.as_str())) {
            if let Some(value) = root.value(&name)? {
                remarks.push((name, value.as_str().map_or_else(|| value.to_string(), str::to_owned)));
            }
        }
        let sample_type = reflectance.sample_type()?;
        let contents = Contents {
            format: format!("HDF5, btfkit measurement, {}", sample_type.name()),
            width: side(width, &reflectance)?,
            height: side(height, &reflectance)?,
            channels: names,
            sample_type,
            views: read_directions(file, DIRECTIONS[0], views, limits)?,
            lights: read_directions(file, DIRECTIONS[1], lights, limits)?,
            linear: either("transfer", TRANSFER)?,
            cosine_included: either("radiometry", RADIOMETRY)?,
            assumptions: reflectance.fewer_bits().into_iter().map(Into::into).collect(),
            remarks,
        };
        Ok((Self { reflectance }, contents))
    }

    /// A window of a view under some lights, [y, x, light, channel].
    pub(super) fn read<T: H5Type>(
        &self,
        view: usize,
        [y, x]: [Range<usize>; 2],
        lights: Range<usize>,
    ) -> Result<Vec<T>> {
        let channels = self.reflectance.shape().last().copied().unwrap_or(0);
        self.reflectance.read(&[view..view + 1, y, x, lights, 0..channels])
    }
}

/// Directions as they are written: theta from 0 to pi/2, phi.
fn read_directions(file: &File, name: &'static str, count: usize, limits: &Limits) -> Result<Vec<Direction>> {
    let table = file.table(name, limits)?;
    if table.shape() != [count, 2] {
        return Err(table.error(format!("got the shape {:?}, expected [{count}, 2]", table.shape())));
    }
    let angles = table.read_floats()?;
    let directions = angles.chunks_exact(2).map(|a| Direction { theta_rad: a[0], phi_rad: a[1] });
    directions
        .map(|direction| {
            // A little more than pi/2.
            let fine = (0.0..=1.571).contains(&direction.theta_rad) && direction.phi_rad.is_finite();
            fine.then_some(direction).ok_or_else(|| {
                table.error(format!(
                    "got theta {}, phi {}, expected radians with theta from 0 to pi/2",
                    direction.theta_rad, direction.phi_rad
                ))
            })
        })
        .collect()
}

//! What components are in a model: a mean BRDF, the BRDFs that add to it, and how much of each a texel has.
//!
//! | array | shape | type | |
//! | --- | --- | --- | --- |
//! | `mean` | [view, light, channel] | f32 | |
//! | `basis` | [view, light, channel, component] | i16 | unit BRDFs, the strongest first |
//! | `basis_scale` | [component] | f32 | what a step of `basis` means |
//! | `coefficients` | [y, x, component] | i16 | |
//! | `coefficient_scale` | [component] | f32 | what a step of `coefficients` means |
//!
//! Values lie on the sRGB curve, on which 255 is white; see [`crate::color::curve`].

use std::collections::BTreeMap;

use btfkit_packed::{LARGEST, LARGEST_OF_BASIS};
use serde::{Deserialize, Serialize};

use super::{Model, Stage};
use crate::error::Result;
use crate::method::value::components::Components;
use crate::run::recipe::Recipe;
use crate::shape::Size;
use crate::words::counted;
use crate::zarr::Layout;

/// What components depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ComponentsRecipe {
    /// Digest of the tile.
    pub tile: String,
    /// How many were asked for.
    pub components: usize,
    /// Seed of the range finder.
    pub seed: u64,
    /// Digest of the packed model that they were unpacked from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packed: Option<String>,
}

impl Recipe for ComponentsRecipe {
    const STAGE: &'static str = Stage::Components.name();
}

/// What components there are.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ComponentsReport {
    /// How many.
    pub components: usize,
    /// Root of the squared sum that each adds to all values; none of those that were unpacked.
    pub strengths: Vec<f64>,
    /// Squared error of all values, on the curve; none of those that were unpacked.
    pub squared_error: Option<f64>,
    /// Samples of the tile that are no finite numbers: they count as black, also in the error.
    #[serde(default, skip_serializing_if = "is_none")]
    pub not_finite: u64,
    /// Peak signal-to-noise ratio on the curve, dB, as far as it is known.
    pub psnr_db: Option<f64>,
    /// Bytes of the arrays.
    pub bytes: u64,
    /// Bytes of the tile's samples in the measurement.
    pub tile_bytes: u64,
    /// What a packed file said of itself that no array holds, such as its licence, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub texts: BTreeMap<String, String>,
}

fn is_none(count: &u64) -> bool {
    *count == 0
}

impl ComponentsReport {
    /// What a user should know of them, if there is anything.
    pub fn note(&self) -> Option<String> {
        let samples = counted(self.not_finite, "sample");
        let is_told = self.not_finite > 0;
        is_told
            .then(|| format!("{samples} of the tile: no finite numbers, counted as black, also in the PSNR"))
    }
}

/// Extents of the arrays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    brdf: [usize; 3],
    size: Size,
    components: usize,
}

impl Shape {
    fn brdf(&self) -> usize {
        self.brdf.iter().product()
    }

    fn bytes(&self) -> u64 {
        raw_bytes(self.components, self.brdf(), self.size.texels())
    }

    fn mean(&self) -> Layout<'static> {
        Layout::small::<f32>(&["view", "light", "channel"], &self.brdf).with("units", UNITS)
    }

    fn basis(&self) -> Layout<'static> {
        let [views, lights, channels] = self.brdf;
        let shape = [views, lights, channels, self.components];
        Layout::small::<i16>(&["view", "light", "channel", "component"], &shape)
    }

    fn coefficients(&self) -> Layout<'static> {
        let Size { height, width } = self.size;
        Layout::small::<i16>(&["y", "x", "component"], &[height, width, self.components])
    }

    fn scale(&self) -> Layout<'static> {
        Layout::small::<f32>(&["component"], &[self.components])
    }
}

/// Bytes of components as a model keeps them: a mean of f32, the rest of i16 with two scales each.
pub(crate) fn raw_bytes(components: usize, brdf: usize, texels: usize) -> u64 {
    (4 * brdf + components * (2 * (brdf + texels) + 8)) as u64
}

const UNITS: &str = "sRGB curve, 255 = reflectance 1";

/// The arrays of components.
pub(super) fn arrays(shape: &Shape) -> Vec<(String, Layout<'static>)> {
    vec![
        ("mean".to_owned(), shape.mean()),
        ("basis".to_owned(), shape.basis()),
        ("basis_scale".to_owned(), shape.scale()),
        ("coefficients".to_owned(), shape.coefficients()),
        ("coefficient_scale".to_owned(), shape.scale()),
    ]
}

/// Components as they are stored: each list a component.
pub(crate) struct Found {
    /// Mean BRDF [view, light, channel].
    pub mean: Vec<f32>,
    /// BRDFs [component][view, light, channel].
    pub bases: Vec<Vec<f64>>,
    /// Weights [component][y, x].
    pub coefficients: Vec<Vec<f64>>,
}

/// Lists as steps of a scale each, [place, list].
fn in_steps(lists: &[Vec<f64>], length: usize) -> (Vec<i16>, Vec<f32>) {
    let most = f64::from(i16::MAX);
    let mut steps = vec![0; length * lists.len()];
    let mut scales = Vec::with_capacity(lists.len());
    for (number, list) in lists.iter().enumerate() {
        let largest = list.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let scale = (largest / most) as f32;
        let of = |value: f64| {
            if scale > 0.0 { (value / f64::from(scale)).round().clamp(-most, most) } else { 0.0 }
        };
        steps
            .iter_mut()
            .skip(number)
            .step_by(lists.len())
            .zip(list)
            .for_each(|(to, &value)| *to = of(value) as i16);
        scales.push(scale);
    }
    (steps, scales)
}

impl Model {
    /// The shape that a report of components means.
    pub(super) fn components_shape(&self, report: &ComponentsReport) -> Result<Shape> {
        let [views, lights] = self.directions()?.map(|list| list.len());
        let (channels, _) = self.values()?;
        let shape = Shape {
            brdf: [views, lights, channels.len()],
            size: self.tile_report()?.size(),
            components: report.components,
        };
        let most = shape.brdf().min(shape.size.texels());
        if (1..=most).contains(&shape.components) {
            return Ok(shape);
        }
        let what = format!("got {} components, expected 1 to {most}", shape.components);
        Err(self.damaged_report(Stage::Components, &what))
    }

    fn shape_of_components(&self) -> Result<Shape> {
        self.components_shape(&self.report(Stage::Components)?)
    }

    /// Bytes that so many components take in a model of this tile.
    ///
    /// # Errors
    /// Those of reading what the tile is.
    pub(crate) fn bytes_of_components(&self, components: usize) -> Result<u64> {
        let report = ComponentsReport {
            components,
            strengths: vec![],
            squared_error: None,
            not_finite: 0,
            psnr_db: None,
            bytes: 0,
            tile_bytes: 0,
            texts: BTreeMap::new(),
        };
        Ok(self.components_shape(&report)?.bytes())
    }

    /// Memory that reading the components takes.
    ///
    /// # Errors
    /// Where there are none.
    pub fn components_bytes(&self) -> Result<u64> {
        Ok(4 * self.shape_of_components()?.bytes())
    }

    /// Writes components.
    pub(crate) fn write_components(&self, found: &Found) -> Result<()> {
        let (channels, _) = self.values()?;
        let [views, lights] = self.directions()?.map(|list| list.len());
        let shape = Shape {
            brdf: [views, lights, channels.len()],
            size: self.tile_report()?.size(),
            components: found.bases.len(),
        };
        self.store.write("mean", &shape.mean(), &found.mean)?;
        let (steps, scales) = in_steps(&found.bases, shape.brdf());
        self.store.write("basis", &shape.basis(), &steps)?;
        self.store.write("basis_scale", &shape.scale(), &scales)?;
        let (steps, scales) = in_steps(&found.coefficients, shape.size.texels());
        self.store.write("coefficients", &shape.coefficients(), &steps)?;
        self.store.write("coefficient_scale", &shape.scale(), &scales)
    }

    /// The components.
    ///
    /// # Errors
    /// Where they have not been found, or hold what is no number, or one of no use.
    pub fn components(&self) -> Result<Components> {
        let shape = self.shape_of_components()?;
        // Those of packed models: sums of products have to stay finite.
        let numbers = |name: &str, layout: &Layout<'_>, most: f64| -> Result<Vec<f32>> {
            let list = self.read::<f32>(Stage::Components, name, layout)?;
            match list.iter().find(|value| value.is_nan() || f64::from(value.abs()) > most) {
                None => Ok(list),
                Some(value) => {
                    let what = format!("got {value:e}, expected finite numbers of at most {most:e}");
                    Err(self.damaged(name, &what))
                }
            }
        };
        let scaled = |name: &str, layout: &Layout<'_>, scale: &str, most: f64| -> Result<Vec<f32>> {
            let scales = numbers(scale, &shape.scale(), most / -f64::from(i16::MIN))?;
            let steps = self.read::<i16>(Stage::Components, name, layout)?;
            Ok(steps
                .iter()
                .zip(scales.iter().cycle())
                .map(|(&step, scale)| f32::from(step) * scale)
                .collect())
        };
        Ok(Components {
            size: shape.size,
            brdf: [shape.brdf[0], shape.brdf[1]],
            channels: self.values()?.0,
            mean: numbers("mean", &shape.mean(), LARGEST)?,
            basis: scaled("basis", &shape.basis(), "basis_scale", LARGEST_OF_BASIS)?,
            coefficients: scaled("coefficients", &shape.coefficients(), "coefficient_scale", LARGEST)?,
        })
    }
}

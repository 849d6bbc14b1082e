//! A model to bytes, with a step.

use crate::error::Result;
use crate::header::{Header, expect_numbers};
use crate::model::Model;
use crate::palette::Palette;
use crate::quantise::{MOST_PLANES, quantised, strength, strength_code, value};
use crate::range_coder::Encoder;
use crate::section::Section;
use crate::spectrum::Transforms;
use crate::stream::{Stream, Truth};

/// A component begins where it lowers the squared error by at least so many squared steps a bit.
const WORTH: f64 = 0.18;

/// The step of a basis in units of that of coefficients: errors of few numbers that many texels share weigh the same
/// as others, but a coarser basis leaves more bytes to them.
const BASIS_STEP: f64 = 1.4;

/// The largest value on the curve that the peak signal-to-noise ratio is of.
const PEAK: f64 = 255.0;

/// A packed model.
#[derive(Clone, Debug)]
pub struct Packed {
    /// The file.
    pub bytes: Vec<u8>,
    /// The finest step.
    pub step: f32,
    /// Its components.
    pub components: usize,
    /// Peak signal-to-noise ratio, dB: to what the model was made of if it is known what the model leaves out, else to
    /// the model.
    pub decibels: f64,
}

/// A component's spectra, both as long as it is strong.
struct Part {
    strength: u16,
    basis: Vec<f64>,
    image: Vec<f64>,
    /// Its part of the squared error where it is left out.
    energy: f64,
}

/// A model in its spectra.
pub(crate) struct Prepared<'a> {
    model: &'a Model,
    transforms: Transforms,
    mean: Vec<f64>,
    parts: Vec<Part>,
    /// Squared error of the whole model, if it is known.
    residual: Option<f64>,
}

impl<'a> Prepared<'a> {
    /// Transforms a model, whose squared error over all texels and directions is `residual`, if it is known; by a palette
    /// or by cosines.
    ///
    /// # Errors
    /// A model whose parts do not fit together.
    pub(crate) fn new(model: &'a Model, residual: Option<f64>, palette: Option<Palette>) -> Result<Self> {
        model.check()?;
        // What a file says of sizes and directions.
        let header = Header::of(model, 1.0, 1, 1)?.to_bytes()?;
        let header = Header::read(&mut crate::bytes::Reader::new(&header), &header)?;
        let transforms =
            Transforms::new(model.size, &header.views, &header.lights, model.channels.len(), palette);
        let scaled = |list: &[f64], scale: f64| list.iter().map(|value| value * scale).collect::<Vec<f64>>();
        let mean = scaled(&transforms.of_brdf(&model.mean), (model.texels() as f64).sqrt());
        let parts = model.components.iter().map(|component| {
            let energy = energy(&component.coefficients) * energy(&component.basis);
            let code = strength_code(energy.sqrt() / BASIS_STEP);
            let basis = scaled(&transforms.of_brdf(&component.basis), strength(code));
            Part { strength: code, basis, image: transforms.of_image(&component.coefficients), energy }
        });
        let parts = parts.collect();
        Ok(Self { model, transforms, mean, parts, residual })
    }

    /// The largest number of all.
    pub(crate) fn largest(&self) -> f64 {
        let parts = self.parts.iter().flat_map(|part| [&part.basis, &part.image]);
        parts.chain([&self.mean]).flatten().fold(0.0, |most, value| value.abs().max(most))
    }

    /// Whether a file has all components.
    pub(crate) fn is_complete(&self, packed: &Packed) -> bool {
        packed.components == self.parts.len()
    }

    /// Peak signal-to-noise ratio that no step goes beyond: a palette leaves out what centres do not say.
    pub(crate) fn most_decibels(&self) -> f64 {
        let left = self.parts.iter().map(|part| {
            let strength = strength(part.strength);
            (part.energy - energy(&part.image) * energy(&part.basis) / (strength * strength)).max(0.0)
        });
        self.decibels(self.residual.unwrap_or(0.0) + left.sum::<f64>())
    }

    /// Peak signal-to-noise ratio of a squared error.
    fn decibels(&self, error: f64) -> f64 {
        let count = (self.model.texels() * self.model.brdf()) as f64;
        10.0 * libm::log10(PEAK * PEAK * count / error.max(f64::MIN_POSITIVE))
    }

    /// The bytes with a finest step, in at most so many sections.
    ///
    /// # Errors
    /// Sizes that the format has no room for.
    pub(crate) fn encode(&self, step: f32, sections: u32) -> Result<Packed> {
        let finest = f64::from(step);
        let mean = quantised(&self.mean, finest);
        let parts: Vec<[Vec<i32>; 2]> = self
            .parts
            .iter()
            .map(|part| [&part.basis, &part.image].map(|list| quantised(list, finest)))
            .collect();
        let most = parts.iter().flatten().chain([&mean]).flatten().map(|number| number.unsigned_abs()).max();
        let planes = (u32::BITS - most.unwrap_or(0).leading_zeros()).clamp(1, MOST_PLANES);
        let sections = sections.min(planes);
        let mut header = Header::of(self.model, step, planes, sections)?;
        header.has_palette = self.transforms.palette().is_some();
        let mut bytes = header.to_bytes()?;
        if let Some(palette) = self.transforms.palette() {
            palette.write(&mut bytes, self.model.size[1]);
        }
        let mut stream = Stream::new(&self.transforms, self.model.channels.len(), planes);
        let (mut components, mut decibels) = (0, 0.0);
        for low in (0..sections).rev() {
            let coarse = finest * f64::from(1u32 << low);
            let mut encoder = Encoder::new();
            stream.code_mean(&mut encoder, low, &mean);
            let mut error = self.residual.unwrap_or(0.0) + distance(&self.mean, &mean, low, finest);
            let before = components;
            let mut refused = false;
            for (number, (part, numbers)) in self.parts.iter().zip(&parts).enumerate() {
                let left = if refused { part.energy } else { part.error(numbers, low, finest) };
                if number >= before && !refused {
                    let (mark, place, bits) = (stream.mark(), encoder.mark(), encoder.bits());
                    let [basis, image] = numbers;
                    stream.code_component(&mut encoder, number, low, Truth { basis, image });
                    let bits = encoder.bits() - bits + f64::from(u16::BITS);
                    refused = part.energy - left < WORTH * coarse * coarse * bits;
                    if refused {
                        stream.return_to(mark);
                        encoder.return_to(place);
                    } else {
                        components = number + 1;
                    }
                } else if number < before {
                    let [basis, image] = numbers;
                    stream.code_component(&mut encoder, number, low, Truth { basis, image });
                }
                error += if number < components { left } else { part.energy };
            }
            decibels = self.decibels(error);
            let strengths = self.parts[before..components].iter().map(|part| part.strength).collect();
            // 0 stands for what is not known.
            let known = (decibels * 100.0).round().clamp(1.0, f64::from(u16::MAX)) as u16;
            let centibels = if self.residual.is_some() { known } else { 0 };
            let payload = encoder.finish();
            Section { components, centibels, strengths, payload: &payload }.write(&mut bytes);
        }
        expect_numbers(self.model.brdf(), self.model.texels(), components, bytes.len())?;
        Ok(Packed { bytes, step, components, decibels })
    }
}

impl Part {
    /// Its squared error where it is coded to a plane.
    fn error(&self, numbers: &[Vec<i32>; 2], low: u32, step: f64) -> f64 {
        let [basis, image] = numbers;
        let strength = strength(self.strength);
        // |c b' - d e'|^2 = |c|^2 |b|^2 - 2 (c d) (b e) + |d|^2 |e|^2 of columns c, d and rows b, e.
        let [(basis_own, basis_both), (image_own, image_both)] = [(&self.basis, basis), (&self.image, image)]
            .map(|(list, numbers)| products(list, numbers, low, step));
        (self.energy + (basis_own * image_own) / (strength * strength)
            - 2.0 * (basis_both * image_both) / (strength * strength))
            .max(0.0)
    }
}

fn energy(list: &[f64]) -> f64 {
    list.iter().map(|value| value * value).sum()
}

fn coarse(number: i32, low: u32, step: f64) -> f64 {
    value(number.unsigned_abs() >> low, number < 0, step * f64::from(1u32 << low))
}

/// Squared length of the coded numbers, and their inner product with the values.
fn products(values: &[f64], numbers: &[i32], low: u32, step: f64) -> (f64, f64) {
    values.iter().zip(numbers).fold((0.0, 0.0), |(own, both), (given, &number)| {
        let coded = coarse(number, low, step);
        (own + coded * coded, both + coded * given)
    })
}

/// Squared distance of the coded numbers from the values.
fn distance(values: &[f64], numbers: &[i32], low: u32, step: f64) -> f64 {
    let difference = |(given, &number): (&f64, &i32)| given - coarse(number, low, step);
    values.iter().zip(numbers).map(difference).map(|value| value * value).sum()
}

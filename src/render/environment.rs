//! Light from all around, from a picture of it, as a number of lights that are far away.
//!
//! The picture is cut in two of equal light again and again (Debevec, "A median cut algorithm for light probe sampling",
//! 2005); each part becomes a light in its middle. The same picture gives the same lights.

use btfkit_formats::{Limits, Samples, picture};

use super::light::{Light, Place};
use crate::color::{Decoder, LUMINANCE_WEIGHTS, Transfer};
use crate::error::{Error, Result};
use crate::run::budget::Room;
use crate::shape::Size;
use crate::vector::{Vector, along, length, unit};

/// A latitude-longitude picture of what surrounds a scene: its middle lies behind the object, its left edge behind the
/// default camera, its top row above.
pub struct Environment {
    size: Size,
    /// Linear values.
    pixels: Vec<[f32; 3]>,
    turn_rad: f64,
}

/// Memory of a pixel: its colour, and the sum of light up to it.
const PIXEL_BYTES: u64 = 12 + 8;

/// Rows and columns of a part: from, and up to.
#[derive(Clone, Copy)]
struct Part {
    rows: [usize; 2],
    columns: [usize; 2],
}

impl Environment {
    /// Reads a picture: OpenEXR or Radiance. `turn_deg` turns it about the vertical axis. What stays in memory is taken of
    /// the room.
    ///
    /// # Errors
    /// Bytes that are no such picture, values that are not finite or are negative, and a picture that there is no room
    /// for.
    pub fn read(bytes: &[u8], turn_deg: f64, room: &mut Room) -> Result<Self> {
        let header =
            picture::header(bytes, &Limits::default()).map_err(|error| Error::input(error.to_string()))?;
        let count = u64::from(header.width).saturating_mul(u64::from(header.height));
        // Its file, its samples as they are read and as they are sorted, and its pixels with the sums of their light.
        let sample = (header.channels.len() * header.sample_type.bytes()) as u64;
        let needed = count.saturating_mul(2 * sample + PIXEL_BYTES).saturating_add(bytes.len() as u64);
        room.require(&format!("an environment of {} x {}", header.width, header.height), needed)?;
        let picture =
            picture::decode(bytes, &Limits::default()).map_err(|error| Error::input(error.to_string()))?;
        if !matches!(picture.samples, Samples::F16(_) | Samples::F32(_)) {
            return Err(Error::input("a picture of display values, expected linear ones")
                .hint("an environment is an OpenEXR (.exr) or a Radiance picture (.hdr)"));
        }
        let is_finite = |at: &usize| picture.samples.value(*at).is_some_and(f64::is_finite);
        if let Some(at) = (0..picture.samples.len()).find(|at| !is_finite(at)) {
            let pixel = at / picture.channels.len().max(1);
            let (row, column) = (pixel / picture.width as usize, pixel % picture.width as usize);
            return Err(Error::input(format!("row {row}, column {column}: got a value that is not finite")));
        }
        let decoder = Decoder::new(Transfer::Linear, picture.samples.sample_type(), &picture.channels)?;
        let step = decoder.channels().max(1);
        let color = |at: usize| decoder.rgb(&picture.samples, at).map(|value| value as f32);
        let pixels: Vec<[f32; 3]> = (0..picture.samples.len()).step_by(step).map(color).collect();
        let size = Size::new(picture.height as usize, picture.width as usize);
        if pixels.is_empty() || pixels.len() != size.texels() {
            return Err(Error::input(format!("a picture of {size} with {} pixels", pixels.len())));
        }
        if let Some(at) = pixels.iter().position(|pixel| pixel.iter().any(|v| !v.is_finite() || *v < 0.0)) {
            let (row, column) = (at / size.width, at % size.width);
            return Err(Error::input(format!(
                "row {row}, column {column}: got {:?}, expected finite values of at least 0",
                pixels[at]
            )));
        }
        drop(picture);
        room.take("an environment", PIXEL_BYTES * size.texels() as u64)?;
        Ok(Self { size, pixels, turn_rad: turn_deg.to_radians() })
    }

    /// The direction of a place of the picture.
    fn direction(&self, row: f64, column: f64) -> Vector {
        let elevation = (0.5 - row / self.size.height as f64) * std::f64::consts::PI;
        let around = (column / self.size.width as f64 - 0.5) * std::f64::consts::TAU + self.turn_rad;
        let level = libm::cos(elevation);
        [level * libm::sin(around), libm::sin(elevation), -level * libm::cos(around)]
    }

    /// What is seen of it in a direction, linear.
    pub(super) fn seen(&self, [x, y, z]: Vector) -> [f32; 3] {
        let around = (libm::atan2(x, -z) - self.turn_rad) / std::f64::consts::TAU + 0.5;
        let down = 0.5 - libm::asin(y.clamp(-1.0, 1.0)) / std::f64::consts::PI;
        let place = |share: f64, side: usize| ((share * side as f64) as usize).min(side - 1);
        let row = place(down, self.size.height);
        self.pixels[row * self.size.width + place(around.rem_euclid(1.0), self.size.width)]
    }

    /// Solid angle of a pixel of a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let edge = |row: usize| libm::cos(row as f64 / self.size.height as f64 * std::f64::consts::PI);
        (edge(row) - edge(row + 1)) * std::f64::consts::TAU / self.size.width as f64
    }

    /// So many lights, or fewer where there are fewer pixels that shine.
    pub fn lights(&self, count: usize) -> Vec<Light> {
        let Size { height, width } = self.size;
        // Light of everything above and to the left of a pixel.
        let mut sums = vec![0.0f64; (height + 1) * (width + 1)];
        for row in 0..height {
            let (angle, mut sum) = (self.solid_angle(row), 0.0);
            for column in 0..width {
                let pixel = self.pixels[row * width + column];
                sum += angle * (0..3).map(|c| LUMINANCE_WEIGHTS[c] * f64::from(pixel[c])).sum::<f64>();
                sums[(row + 1) * (width + 1) + column + 1] = sums[row * (width + 1) + column + 1] + sum;
            }
        }
        let at = |row: usize, column: usize| sums[row * (width + 1) + column];
        let energy = |part: Part| {
            let ([top, bottom], [left, right]) = (part.rows, part.columns);
            at(bottom, right) - at(top, right) - at(bottom, left) + at(top, left)
        };
        let mut parts = vec![Part { rows: [0, height], columns: [0, width] }];
        while parts.len() < count {
            let can = |part: &Part| part.rows[1] - part.rows[0] > 1 || part.columns[1] - part.columns[0] > 1;
            let brightest = (0..parts.len())
                .filter(|&n| can(&parts[n]) && energy(parts[n]) > 0.0)
                .max_by(|&a, &b| energy(parts[a]).total_cmp(&energy(parts[b])).then(b.cmp(&a)));
            let Some(brightest) = brightest else { break };
            let (first, second) = self.cut(parts[brightest], energy);
            parts[brightest] = first;
            parts.push(second);
        }
        parts.into_iter().filter_map(|part| self.light_of(part)).collect()
    }

    /// Two parts of about equal light, across the longer extent.
    fn cut(&self, part: Part, energy: impl Fn(Part) -> f64) -> (Part, Part) {
        let [rows, columns] = [part.rows[1] - part.rows[0], part.columns[1] - part.columns[0]];
        let middle = (part.rows[0] + part.rows[1]) as f64 / 2.0 / self.size.height as f64;
        let across = columns as f64 * libm::sin(middle * std::f64::consts::PI) * 2.0 / self.size.width as f64;
        let by_rows = columns < 2 || (rows > 1 && rows as f64 / self.size.height as f64 > across);
        let halves = |at: usize| match by_rows {
            true => (Part { rows: [part.rows[0], at], ..part }, Part { rows: [at, part.rows[1]], ..part }),
            false => (
                Part { columns: [part.columns[0], at], ..part },
                Part { columns: [at, part.columns[1]], ..part },
            ),
        };
        let [mut low, mut high] = if by_rows { part.rows } else { part.columns };
        (low, high) = (low + 1, high - 1);
        let half = energy(part) / 2.0;
        while low < high {
            let at = (low + high) / 2;
            if energy(halves(at).0) < half {
                low = at + 1;
            } else {
                high = at;
            }
        }
        halves(low)
    }

    /// All light of a part from the middle of it, or from where it is brightest if its directions cancel each other. A
    /// light of 1 all around makes a perfect diffuser 1.
    fn light_of(&self, part: Part) -> Option<Light> {
        /// Of a sum of directions, the share of the light that must be left for it to be a direction and no rounding.
        const LEFT: f64 = 1e-6;
        let (mut middle, mut color, mut sum) = ([0.0; 3], [0.0f64; 3], 0.0);
        let mut brightest = (0.0, [0.0; 3]);
        for row in part.rows[0]..part.rows[1] {
            let angle = self.solid_angle(row);
            for column in part.columns[0]..part.columns[1] {
                let pixel = self.pixels[row * self.size.width + column].map(f64::from);
                let light = angle * (0..3).map(|c| LUMINANCE_WEIGHTS[c] * pixel[c]).sum::<f64>();
                let direction = self.direction(row as f64 + 0.5, column as f64 + 0.5);
                middle = along(middle, light, direction);
                color = along(color, angle / std::f64::consts::PI, pixel);
                sum += light;
                if light > brightest.0 {
                    brightest = (light, direction);
                }
            }
        }
        let is_sure = length(middle) > LEFT * sum;
        let direction = unit(if is_sure { middle } else { brightest.1 })?;
        Some(Light { place: Place::Far(direction), color })
    }
}

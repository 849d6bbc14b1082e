//! The functions of a database, and their values under one pair of directions.
//!
//! A pixel is a factor times a 4D function. A 4D function is a list of 3D functions over the view's phi, a 3D function
//! a list of 2D functions over the view's theta, each with a factor; a 2D function is luminance and colour over two
//! angles of the light, alpha and beta. There are hundreds of 4D functions and tens of thousands of pixels, so that the
//! functions are evaluated once for an image.

use super::header::Header;
use super::table::{FloatTable, IntTable, require_end};
use crate::reader::Reader;
use crate::ubo2003::Angles;
use crate::{Error, Result};

/// 8-bit YCbCr of studio range (ITU-R BT.601) to RGB, with the roundings of the encoder's authors.
const RGB_OF_Y: f64 = 298.082 / 256.0;
const RED: (f64, f64, f64) = (0.0, 408.583 / 256.0, -222.921);
const GREEN: (f64, f64, f64) = (-100.291 / 256.0, -208.120 / 256.0, 135.576);
const BLUE: (f64, f64, f64) = (516.412 / 256.0, 0.0, -276.836);

/// All tables, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Functions {
    pub(super) slices_6d: IntTable,
    pub(super) scale_6d: FloatTable,
    pub(super) luminance_1d: FloatTable,
    /// Cb, Cr.
    pub(super) colors: FloatTable,
    pub(super) color_rows: IntTable,
    pub(super) slices_2d: IntTable,
    pub(super) scale_2d: FloatTable,
    pub(super) colors_2d: IntTable,
    /// Row of `slices_2d`, row of `colors_2d`.
    pub(super) indices_2d: IntTable,
    pub(super) slices_3d: IntTable,
    pub(super) scale_3d: FloatTable,
    pub(super) slices_4d: IntTable,
    pub(super) scale_4d: FloatTable,
    beta_nodes_deg: Vec<f64>,
    even_in_sine: bool,
}

/// A place between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Between {
    lower: usize,
    upper: usize,
    /// Of the upper node; 0 to 1.
    weight: f64,
}

impl Between {
    /// `position` in units of nodes from node 0.
    fn on_line(position: f64, nodes: usize) -> Between {
        let lower = (position.max(0.0) as usize).min(nodes.saturating_sub(2));
        Between { lower, upper: lower.saturating_add(1), weight: position - lower as f64 }
    }

    /// The same where the last node is followed by the first.
    fn on_circle(position: f64, nodes: usize) -> Between {
        let lower = (position.max(0.0) as usize).checked_rem(nodes).unwrap_or(0);
        let upper = lower.saturating_add(1).checked_rem(nodes).unwrap_or(0);
        Between { lower, upper, weight: position.fract() }
    }

    /// The nodes that count, with their weights.
    fn nodes(self) -> impl Iterator<Item = (usize, f64)> {
        [(self.lower, 1.0 - self.weight), (self.upper, self.weight)].into_iter().filter(|&(_, w)| w != 0.0)
    }
}

/// A view: which 2D functions make up each 4D function, with which factors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct View {
    phi_deg: f64,
    /// As many for each 4D function, in the order of these.
    terms: Vec<Term>,
    terms_per_function: usize,
}

/// A 2D function, as rows of the tables of luminance and of colour, and the factor on its RGB.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Term {
    luminance: usize,
    color: usize,
    factor: f64,
}

/// A light seen in the frame of a view.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Light {
    alpha: Between,
    beta: Between,
    /// Weights of the luminance at the nodes of beta before the interval, at its start and at its end.
    hermite: [f64; 3],
}

impl Functions {
    /// Reads the tables, which end the file. Zero bytes are not resolved yet.
    pub(super) fn read(reader: &mut Reader<'_>, header: &Header) -> Result<Functions> {
        let h = header;
        let (width, height) = (side(h.width), side(h.height));
        let functions = Functions {
            slices_6d: IntTable::read(reader, height, width, 1, h.functions_4d)?,
            scale_6d: FloatTable::read(reader, height, width)?,
            luminance_1d: FloatTable::read(reader, h.luminances_1d, h.beta_nodes)?,
            colors: FloatTable::read(reader, h.colors, 2)?,
            color_rows: IntTable::read(reader, h.color_rows, h.beta_nodes, 0, h.colors)?,
            slices_2d: IntTable::read(reader, h.luminances_2d, h.alpha_nodes, 0, h.luminances_1d)?,
            scale_2d: FloatTable::read(reader, h.luminances_2d, h.alpha_nodes)?,
            colors_2d: IntTable::read(reader, h.colors_2d, h.alpha_nodes, 0, h.color_rows)?,
            indices_2d: IntTable::read(reader, h.functions_2d, 2, 0, h.luminances_2d.max(h.colors_2d))?,
            slices_3d: IntTable::read(reader, h.functions_3d, h.theta_nodes, 0, h.functions_2d)?,
            scale_3d: FloatTable::read(reader, h.functions_3d, h.theta_nodes)?,
            slices_4d: IntTable::read(reader, h.functions_4d, h.phi_nodes, 0, h.functions_3d)?,
            scale_4d: FloatTable::read(reader, h.functions_4d, h.phi_nodes)?,
            beta_nodes_deg: beta_nodes_deg(h),
            even_in_sine: h.even_in_sine,
        };
        require_end(reader)?;
        let in_range = |row: &[u32]| match row {
            &[luminance, color] => side(luminance) < h.luminances_2d && side(color) < h.colors_2d,
            _ => false,
        };
        if !functions.indices_2d.rows().all(in_range) {
            let expected = format!("pairs less than {}, {}", h.luminances_2d, h.colors_2d);
            return Err(Error::malformed("a 2D function of a table row that is not there", expected));
        }
        Ok(functions)
    }

    /// The view's part of the work, which all lights share.
    pub(super) fn view(&self, view: Angles) -> View {
        let phi_deg = (360.0 - view.phi_deg()).rem_euclid(360.0);
        let phi_nodes = self.scale_4d.columns;
        let phi = Between::on_circle(phi_deg / 360.0 * phi_nodes as f64, phi_nodes);
        let theta_nodes = self.scale_3d.columns;
        let last = theta_nodes.saturating_sub(1) as f64;
        let theta = Between::on_line(view.theta_deg() / 90.0 * last, theta_nodes);

        let pairs: Vec<_> =
            phi.nodes().flat_map(|phi| theta.nodes().map(move |theta| (phi, theta))).collect();
        let mut terms = Vec::new();
        for function in 0..self.scale_4d.rows {
            for &((phi, phi_weight), (theta, theta_weight)) in &pairs {
                let slice_3d = self.slices_4d.get(function, phi);
                let slice_2d = self.slices_3d.get(slice_3d, theta);
                let scale = f64::from(self.scale_4d.get(function, phi))
                    * f64::from(self.scale_3d.get(slice_3d, theta));
                terms.push(Term {
                    luminance: self.indices_2d.get(slice_2d, 0),
                    color: self.indices_2d.get(slice_2d, 1),
                    factor: phi_weight * theta_weight * scale,
                });
            }
        }
        View { phi_deg, terms, terms_per_function: pairs.len() }
    }

    /// The light's angles in the frame that turns with the view.
    fn light(&self, view: &View, light: Angles) -> Light {
        let phi = ((360.0 - light.phi_deg()) - (90.0 + view.phi_deg)).rem_euclid(360.0).to_radians();
        let sine = light.theta_deg().to_radians().sin();
        let (x, y) = (sine * phi.cos(), sine * phi.sin());
        let beta_deg = x.asin().to_degrees();
        let cosine = x.asin().cos();
        let alpha_deg = if cosine < 0.001 { 0.0 } else { (y / cosine).clamp(-1.0, 1.0).asin().to_degrees() };

        let last = self.scale_2d.columns.saturating_sub(1) as f64;
        let alpha = Between::on_line((alpha_deg + 90.0) / 180.0 * last, self.scale_2d.columns);

        let nodes = self.beta_nodes_deg.len();
        let even = if self.even_in_sine { x } else { beta_deg / 90.0 };
        let mut beta = Between::on_line((even + 1.0) / 2.0 * nodes.saturating_sub(1) as f64, nodes);
        let node = |place: usize| self.beta_nodes_deg.get(place).copied().unwrap_or(0.0);
        beta.weight = (beta_deg - node(beta.lower)) / (node(beta.upper) - node(beta.lower));
        Light { alpha, beta, hermite: hermite(beta, nodes) }
    }

    /// RGB of every 4D function, 1.0 being display white.
    pub(super) fn evaluate(&self, view: &View, light: Angles) -> Vec<[f32; 3]> {
        let light = self.light(view, light);
        let functions = view.terms.chunks_exact(view.terms_per_function).map(|terms| {
            let mut rgb = [0.0f64; 3];
            for term in terms {
                let y = self.luminance(term.luminance, &light);
                let (cb, cr) = self.color(term.color, &light);
                for (sum, (of_cb, of_cr, offset)) in rgb.iter_mut().zip([RED, GREEN, BLUE]) {
                    *sum += term.factor * (RGB_OF_Y * y + of_cb * cb + of_cr * cr + offset).max(0.0);
                }
            }
            rgb.map(|value| (value / 255.0) as f32)
        });
        functions.collect()
    }

    /// One image `[y, x, RGB]` from the values of its 4D functions.
    pub(super) fn fill(&self, functions: &[[f32; 3]], image: &mut [f32]) {
        let (pixels, _) = image.as_chunks_mut::<3>();
        let places = self.slices_6d.values().iter().zip(&self.scale_6d.values);
        for (pixel, (&function, &scale)) in pixels.iter_mut().zip(places) {
            let rgb = usize::try_from(function).ok().and_then(|place| functions.get(place));
            *pixel = rgb.map_or([0.0; 3], |rgb| rgb.map(|value| value * scale));
        }
    }

    fn luminance(&self, row: usize, light: &Light) -> f64 {
        let along_alpha = light.alpha.nodes().map(|(alpha, weight)| {
            let density = self.slices_2d.get(row, alpha);
            let nodes = [light.beta.lower.saturating_sub(1), light.beta.lower, light.beta.upper];
            let values = nodes.map(|node| f64::from(self.luminance_1d.get(density, node)));
            let value: f64 = values.iter().zip(light.hermite).map(|(value, weight)| value * weight).sum();
            weight * value * f64::from(self.scale_2d.get(row, alpha))
        });
        along_alpha.sum()
    }

    fn color(&self, row: usize, light: &Light) -> (f64, f64) {
        let (mut cb, mut cr) = (0.0, 0.0);
        for (alpha, alpha_weight) in light.alpha.nodes() {
            let along_beta = self.colors_2d.get(row, alpha);
            for (beta, beta_weight) in light.beta.nodes() {
                let color = self.color_rows.get(along_beta, beta);
                cb += alpha_weight * beta_weight * f64::from(self.colors.get(color, 0));
                cr += alpha_weight * beta_weight * f64::from(self.colors.get(color, 1));
            }
        }
        (cb, cr)
    }
}

/// Weights of the cubic Hermite interpolation that the encoder's authors publish: slopes are central differences
/// inside, but at the right node half of the interval's own difference, and whole one-sided differences at both ends.
fn hermite(beta: Between, nodes: usize) -> [f64; 3] {
    let u = beta.weight;
    let (u2, u3) = (u * u, u * u * u);
    let (start, end) = (2.0 * u3 - 3.0 * u2 + 1.0, 3.0 * u2 - 2.0 * u3);
    let (slope_start, slope_end) = (u3 - 2.0 * u2 + u, u3 - u2);
    let right = if beta.upper < nodes.saturating_sub(1) { 0.5 * slope_end } else { slope_end };
    if beta.lower == 0 {
        [0.0, start - slope_start - right, end + slope_start + right]
    } else {
        [-0.5 * slope_start, start - right, end + 0.5 * slope_start + right]
    }
}

fn side(side: u32) -> usize {
    usize::try_from(side).unwrap_or(usize::MAX)
}

fn beta_nodes_deg(header: &Header) -> Vec<f64> {
    let last = header.beta_nodes.saturating_sub(1) as f64;
    let even = (0..header.beta_nodes).map(|node| -1.0 + 2.0 * node as f64 / last);
    even.map(|x| if header.even_in_sine { x.clamp(-1.0, 1.0).asin().to_degrees() } else { 90.0 * x })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_weights_by_hand() {
        let between = |lower, weight| Between { lower, upper: lower + 1, weight };
        assert_eq!(hermite(between(2, 0.0), 5), [0.0, 1.0, 0.0]);
        assert_eq!(hermite(between(1, 1.0), 5), [0.0, 0.0, 1.0]);
        // In the middle the curve is half of either node, and an eighth of the slope at the left less that at the
        // right.
        assert_eq!(hermite(between(1, 0.5), 5), [-0.0625, 0.5625, 0.5]);
        assert_eq!(hermite(between(0, 0.5), 5), [0.0, 0.4375, 0.5625]);
        assert_eq!(hermite(between(3, 0.5), 5), [-0.0625, 0.625, 0.4375]);
    }
}

//! BRDFs and images as spectra: smooth parts first, most of the rest nearly 0.

use crate::channels::rotation;
use crate::dct::Dct;
use crate::model::Direction;
use crate::palette::Palette;
use crate::polynomials::Polynomials;
use crate::turn::transposed;

/// The transforms of a model.
pub(crate) struct Transforms {
    views: Polynomials,
    lights: Polynomials,
    rotation: Vec<Vec<f64>>,
    images: Images,
}

/// How images become few numbers.
enum Images {
    Cosines(Dct, [usize; 2]),
    Palette(Palette),
}

impl Transforms {
    pub(crate) fn new(
        size: [usize; 2],
        views: &[Direction],
        lights: &[Direction],
        channels: usize,
        palette: Option<Palette>,
    ) -> Self {
        Self {
            views: Polynomials::new(views),
            lights: Polynomials::new(lights),
            rotation: rotation(channels),
            images: match palette {
                Some(palette) => Images::Palette(palette),
                None => Images::Cosines(Dct::new(size), size),
            },
        }
    }

    /// Degrees of the polynomials of views and lights.
    pub(crate) fn degrees(&self) -> [&[usize]; 2] {
        [self.views.degrees(), self.lights.degrees()]
    }

    /// Frequencies of the rows and columns of an image's spectrum; centres of a palette have none.
    pub(crate) fn frequencies(&self) -> [Vec<usize>; 2] {
        match &self.images {
            Images::Cosines(_, size) => size.map(|side| (0..side).collect()),
            Images::Palette(palette) => [vec![0], vec![0; palette.centres()]],
        }
    }

    /// The palette, where images are by one.
    pub(crate) fn palette(&self) -> Option<&Palette> {
        match &self.images {
            Images::Cosines(..) => None,
            Images::Palette(palette) => Some(palette),
        }
    }

    /// A BRDF [view, light, channel] as [channel, polynomial of views, polynomial of lights].
    pub(crate) fn of_brdf(&self, brdf: &[f64]) -> Vec<f64> {
        let [views, lights, channels] = self.shape();
        let mut spectrum = Vec::with_capacity(brdf.len());
        for weights in &self.rotation {
            let rotated: Vec<f64> = brdf
                .chunks_exact(channels)
                .map(|texel| texel.iter().zip(weights).map(|(value, weight)| value * weight).sum())
                .collect();
            // [view, light] to [light, polynomial of views] to [polynomial of views, polynomial of lights].
            let turned = transposed_product(self.views.rows(), &rotated, views, lights);
            spectrum.extend(transposed_product(self.lights.rows(), &turned, lights, views));
        }
        spectrum
    }

    /// Back from a spectrum to a BRDF.
    pub(crate) fn to_brdf(&self, spectrum: &[f64]) -> Vec<f64> {
        let [views, lights, channels] = self.shape();
        let mut brdf = vec![0.0; spectrum.len()];
        for (weights, plane) in self.rotation.iter().zip(spectrum.chunks_exact(views * lights)) {
            if plane.iter().all(|&value| value == 0.0) {
                continue;
            }
            // Few rows of a spectrum are not 0: they alone are mixed.
            let over_lights = transposed(&mixed(plane, self.lights.rows(), lights), views, lights);
            let over_both = transposed(&mixed(&over_lights, self.views.rows(), views), lights, views);
            for (texel, value) in brdf.chunks_exact_mut(channels).zip(over_both) {
                texel.iter_mut().zip(weights).for_each(|(to, weight)| *to += weight * value);
            }
        }
        brdf
    }

    /// An image [y, x] as its cosine spectrum, or as numbers of the centres of a palette.
    pub(crate) fn of_image(&self, image: &[f64]) -> Vec<f64> {
        match &self.images {
            Images::Cosines(dct, _) => {
                let mut spectrum = image.to_vec();
                dct.forward(&mut spectrum);
                spectrum
            }
            Images::Palette(palette) => palette.of_image(image),
        }
    }

    /// Back to an image.
    pub(crate) fn to_image(&self, mut spectrum: Vec<f64>) -> Vec<f64> {
        match &self.images {
            Images::Cosines(dct, _) => {
                dct.inverse(&mut spectrum);
                spectrum
            }
            Images::Palette(palette) => palette.to_image(&spectrum),
        }
    }

    fn shape(&self) -> [usize; 3] {
        [self.views.rows().len(), self.lights.rows().len(), self.rotation.len()]
    }
}

/// [column, polynomial] of a matrix [direction, column].
fn transposed_product(polynomials: &[Vec<f64>], matrix: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let mut product = vec![0.0; rows * columns];
    for (polynomial, weights) in polynomials.iter().enumerate() {
        let mut sums = vec![0.0; columns];
        for (row, weight) in matrix.chunks_exact(columns).zip(weights) {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
        for (to, sum) in product.chunks_exact_mut(rows).zip(sums) {
            to[polynomial] = sum;
        }
    }
    product
}

/// Each row of weights [polynomial] as the sum of the polynomials' rows [direction].
fn mixed(weights: &[f64], polynomials: &[Vec<f64>], count: usize) -> Vec<f64> {
    let mut mixed = vec![0.0; weights.len()];
    for (to, weights) in mixed.chunks_exact_mut(count).zip(weights.chunks_exact(count)) {
        for (&weight, polynomial) in weights.iter().zip(polynomials) {
            if weight != 0.0 {
                to.iter_mut().zip(polynomial).for_each(|(to, value)| *to += weight * value);
            }
        }
    }
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_brdf_comes_back_from_its_spectrum() {
        let direction = |n: usize| Direction { theta_deg: 9.0 * n as f64, phi_deg: 100.0 * n as f64 };
        let views: Vec<Direction> = (0..5).map(direction).collect();
        let lights: Vec<Direction> = (0..8).map(direction).collect();
        for channels in [1, 3, 4] {
            let transforms = Transforms::new([3, 4], &views, &lights, channels, None);
            let brdf: Vec<f64> = (0..5 * 8 * channels).map(|n| (n * 37 % 23) as f64).collect();
            let spectrum = transforms.of_brdf(&brdf);
            let energy = |list: &[f64]| list.iter().map(|v| v * v).sum::<f64>();
            assert!((energy(&spectrum) / energy(&brdf) - 1.0).abs() < 1e-11);
            let back = transforms.to_brdf(&spectrum);
            assert!(back.iter().zip(&brdf).all(|(a, b)| (a - b).abs() < 1e-9));
            // A constant is the first number alone.
            let constant = transforms.of_brdf(&vec![2.0; brdf.len()]);
            assert!((constant[0] / 2.0 - (brdf.len() as f64).sqrt()).abs() < 1e-9);
            assert!(constant[1..].iter().all(|v| v.abs() < 1e-9));
        }
    }
}

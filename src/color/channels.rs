//! What the channels of a measurement are, and how samples become linear RGB and luminance.
//!
//! R, G, B and one grey channel are taken as they are; X, Y, Z and wavelengths go through the CIE 1931 2 degree
//! observer, wavelengths as reflectances under D65.

use btfkit_formats::picture::wavelength_nm;
use btfkit_formats::{SampleType, Samples};

use super::{LUMINANCE_WEIGHTS, Transfer};
use crate::error::{Error, Result};

/// Linear sRGB (rows) of XYZ, D65.
const RGB_OF_XYZ: [[f64; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266_0, 1.876_010_8, 0.041_556_0],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

/// First wavelength and step of [`D65`], nanometres.
const D65_FROM_NM: f64 = 380.0;
const D65_STEP_NM: f64 = 10.0;

/// Relative spectral power of CIE standard illuminant D65.
const D65: [f64; 36] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80,
    104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70, 80.03,
    80.21, 82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89,
];

/// How much each channel of a sample adds to linear R, G, B and to the luminance.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// R, G and B of each channel.
    pub rgb: Vec<[f64; 3]>,
    /// Luminance of each channel.
    pub luminance: Vec<f64>,
}

/// The weights of channels by their names.
///
/// # Errors
/// Names that are neither a grey channel, R G B, X Y Z nor wavelengths in nanometres.
pub fn weights(channels: &[String]) -> Result<Weights> {
    let place = |name: &str| channels.iter().position(|channel| channel.eq_ignore_ascii_case(name));
    let zeros = || Weights { rgb: vec![[0.0; 3]; channels.len()], luminance: vec![0.0; channels.len()] };
    let mut found = zeros();
    if channels.len() == 1 {
        return Ok(Weights { rgb: vec![[1.0; 3]], luminance: vec![1.0] });
    }
    if let (Some(r), Some(g), Some(b)) = (place("R"), place("G"), place("B")) {
        for (component, channel) in [r, g, b].into_iter().enumerate() {
            found.rgb[channel][component] = 1.0;
            found.luminance[channel] = LUMINANCE_WEIGHTS[component];
        }
        return Ok(found);
    }
    if let (Some(x), Some(y), Some(z)) = (place("X"), place("Y"), place("Z")) {
        for (component, channel) in [x, y, z].into_iter().enumerate() {
            found.rgb[channel] = std::array::from_fn(|rgb| RGB_OF_XYZ[rgb][component]);
        }
        found.luminance[y] = 1.0;
        return Ok(found);
    }
    let wavelengths: Option<Vec<f64>> = channels.iter().map(|name| wavelength_nm(name)).collect();
    match wavelengths {
        Some(wavelengths) => Ok(of_spectrum(&wavelengths)),
        None => Err(Error::input(format!(
            "got channels {}, expected one grey channel, R G B, X Y Z, or wavelengths in nanometres",
            channels.join(", ")
        ))),
    }
}

/// Weights of reflectances at wavelengths: linear between them, constant beyond, under D65.
fn of_spectrum(wavelengths: &[f64]) -> Weights {
    let mut order: Vec<usize> = (0..wavelengths.len()).collect();
    order.sort_by(|&a, &b| wavelengths[a].total_cmp(&wavelengths[b]));
    let mut xyz = vec![[0.0; 3]; wavelengths.len()];
    for nm in 380..=730 {
        let nm = f64::from(nm);
        let observed = observer(nm).map(|o| o * d65(nm));
        let above = order.partition_point(|&channel| wavelengths[channel] <= nm);
        let (low, high) = (order[above.saturating_sub(1)], order[above.min(order.len() - 1)]);
        let span = wavelengths[high] - wavelengths[low];
        let t = if span > 0.0 { ((nm - wavelengths[low]) / span).clamp(0.0, 1.0) } else { 0.0 };
        for (component, observed) in observed.into_iter().enumerate() {
            xyz[low][component] += (1.0 - t) * observed;
            xyz[high][component] += t * observed;
        }
    }
    let sum = |component: usize| xyz.iter().map(|channel| channel[component]).sum::<f64>();
    let white = sum(1);
    let rgb_of = |xyz: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|rgb| (0..3).map(|c| RGB_OF_XYZ[rgb][c] * xyz[c] / white).sum::<f64>())
    };
    let mut rgb: Vec<[f64; 3]> = xyz.iter().map(rgb_of).collect();
    // A reflectance of 1 everywhere is white: the observer's fit is off by a per cent.
    let total: [f64; 3] = std::array::from_fn(|component| rgb.iter().map(|channel| channel[component]).sum());
    rgb.iter_mut().for_each(|channel| *channel = std::array::from_fn(|c| channel[c] / total[c]));
    Weights { rgb, luminance: xyz.iter().map(|channel| channel[1] / white).collect() }
}

/// CIE 1931 colour matching functions, by the multi-lobe fit of Wyman, Sloan and Shirley (JCGT 2013).
fn observer(nm: f64) -> [f64; 3] {
    let lobe = |centre: f64, below: f64, above: f64| {
        let t = (nm - centre) * if nm < centre { below } else { above };
        libm::exp(-0.5 * t * t)
    };
    [
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
            - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    ]
}

fn d65(nm: f64) -> f64 {
    let at = ((nm - D65_FROM_NM) / D65_STEP_NM).clamp(0.0, (D65.len() - 1) as f64);
    let low = at as usize;
    let high = (low + 1).min(D65.len() - 1);
    D65[low] + (D65[high] - D65[low]) * (at - low as f64)
}

/// Turns stored samples into linear RGB and luminance.
pub struct Decoder {
    transfer: Transfer,
    /// Linear value of every integer sample; empty for floats.
    table: Vec<f64>,
    weights: Weights,
    /// Channels are R, G, B in this order, or one grey one: no mixing.
    plain: bool,
}

impl Decoder {
    /// For samples of a type with these channels.
    ///
    /// # Errors
    /// Those of [`weights`].
    pub fn new(transfer: Transfer, sample_type: SampleType, channels: &[String]) -> Result<Self> {
        let weights = weights(channels)?;
        let largest = match sample_type {
            SampleType::U8 => 255,
            SampleType::U16 => 65535,
            SampleType::F16 | SampleType::F32 => 0,
        };
        let table = if largest > 0 {
            (0..=largest).map(|sample| transfer.decode(f64::from(sample) / f64::from(largest))).collect()
        } else {
            Vec::new()
        };
        let plain =
            weights.rgb.len() == 1 || weights.rgb == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Ok(Self { transfer, table, weights, plain })
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.weights.rgb.len()
    }

    /// Linear value of sample number `at`; what is no number counts as 0.
    #[inline]
    pub fn linear(&self, samples: &Samples, at: usize) -> f64 {
        let value = match samples {
            Samples::U8(list) => return self.table[usize::from(list[at])],
            Samples::U16(list) => return self.table[usize::from(list[at])],
            Samples::F16(list) => list[at].to_f64(),
            Samples::F32(list) => f64::from(list[at]),
        };
        let linear = self.transfer.decode(value);
        if linear.is_finite() { linear } else { 0.0 }
    }

    /// Linear RGB of the sample whose first channel is number `at`; a grey one counts for all three.
    #[inline]
    pub fn rgb(&self, samples: &Samples, at: usize) -> [f64; 3] {
        let channels = self.channels();
        if self.plain {
            return std::array::from_fn(|c| self.linear(samples, at + c.min(channels - 1)));
        }
        let mut rgb = [0.0; 3];
        for (channel, weights) in self.weights.rgb.iter().enumerate() {
            let linear = self.linear(samples, at + channel);
            rgb.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * linear);
        }
        rgb
    }

    /// Luminance of the sample whose first channel is number `at`.
    #[inline]
    pub fn luminance(&self, samples: &Samples, at: usize) -> f64 {
        let weights = self.weights.luminance.iter().enumerate();
        weights.map(|(channel, weight)| weight * self.linear(samples, at + channel)).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn white_is_white_whatever_the_channels() {
        let spectrum: Vec<String> = (0..32).map(|n| format!("{}nm", 400 + 10 * n)).collect();
        for channels in [names(&["Y"]), names(&["B", "G", "R"]), spectrum, names(&["450", "550.5", "650"])] {
            let weights = weights(&channels).unwrap();
            let sum: [f64; 3] = std::array::from_fn(|c| weights.rgb.iter().map(|w| w[c]).sum());
            assert!(sum.iter().all(|s| (s - 1.0).abs() < 1e-12), "{channels:?}: {sum:?}");
            assert!((weights.luminance.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert!(weights(&names(&["A", "B"])).is_err());
    }

    #[test]
    fn spectra_have_the_colours_of_their_wavelengths() {
        let channels: Vec<String> = (0..32).map(|n| format!("{}", 400 + 10 * n)).collect();
        let decoder = Decoder::new(Transfer::Linear, SampleType::F32, &channels).unwrap();
        let band = |from: usize, to: usize| {
            let samples = (0..32).map(|n| f32::from(u8::from((from..to).contains(&(400 + 10 * n)))));
            decoder.rgb(&Samples::F32(samples.collect()), 0)
        };
        let [r, g, b] = band(600, 720);
        assert!(r > 0.5 && r > 4.0 * g.abs() && r > 4.0 * b.abs(), "{r} {g} {b}");
        let [r, g, b] = band(400, 480);
        assert!(b > 0.5 && b > 4.0 * g.abs() && b > 2.0 * r.abs(), "{r} {g} {b}");
        let [r, g, b] = band(510, 570);
        assert!(g > 0.5 && g > r && g > 3.0 * b.abs(), "{r} {g} {b}");
    }

    #[test]
    fn types_agree_on_the_same_values_and_no_number_is_black() {
        let channels = names(&["R", "G", "B"]);
        let of = |samples: Samples| {
            let decoder = Decoder::new(Transfer::Srgb, samples.sample_type(), &channels).unwrap();
            (decoder.rgb(&samples, 0), decoder.luminance(&samples, 0))
        };
        let (eight, y) = of(Samples::U8(vec![51, 102, 204]));
        for samples in [
            Samples::U16(vec![51 * 257, 102 * 257, 204 * 257]),
            Samples::F32([0.2, 0.4, 0.8].to_vec()),
            Samples::F16([0.2, 0.4, 0.8].map(btfkit_formats::f16::from_f64).to_vec()),
        ] {
            let (rgb, luminance) = of(samples);
            assert!(rgb.iter().zip(eight).all(|(a, b)| (a - b).abs() < 1e-3), "{rgb:?} {eight:?}");
            assert!((luminance - y).abs() < 1e-3);
        }
        assert_eq!(of(Samples::F32(vec![f32::NAN, f32::INFINITY, 0.5])).0[..2], [0.0, 0.0]);
    }
}

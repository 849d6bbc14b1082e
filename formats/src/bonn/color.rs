//! From the stored channels to reflectance, and back where this crate writes.

use crate::words::counted;
use crate::{Error, ErrorKind, Result};

/// What is added before a logarithm is taken and subtracted after it is undone.
const EPSILON: f32 = 1e-5;

/// Weights of V in R; of U and V in G; of U in B.
const R_V: f32 = 1.13983;
const G_U: f32 = -0.39465;
const G_V: f32 = -0.5806;
const B_U: f32 = 2.03211;

/// White of CIE Lab as ICC profiles mean it, D50.
const WHITE: [f32; 3] = [0.9642, 1.0, 0.8249];

/// XYZ for D50 to linear sRGB (Bradford adaptation).
const XYZ_TO_RGB: [[f32; 3]; 3] = [
    [3.133_856, -1.616_866_7, -0.490_614_6],
    [-0.978_768_4, 1.916_141_5, 0.033_454],
    [0.071_945_3, -0.228_991_4, 1.405_242_7],
];

/// How the channels of a DFMF file relate to reflectance. Numbers are the file's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorModel {
    /// 0: the channels are what they are called.
    Rgb,
    /// 1: Y, U, V.
    Yuv,
    /// 2: CIE L*, a*, b* for D50; undone to linear sRGB.
    Lab,
    /// 3: principal components.
    Pca {
        /// Added after the product.
        mean: [f32; 3],
        /// Row i is what component i adds to the channels.
        matrix: [[f32; 3]; 3],
    },
    /// 4: Y, Co, Cg.
    YCoCg,
    /// 5: a sum, and the share of every channel but the first.
    Spectral,
    /// 6: a mean, and the relative deviation of every channel but the first.
    SpectralLinear,
    /// 9: log Y, U, V.
    LogYUv,
    /// 10: log Y, log U, log V.
    LogYLogULogV,
    /// 11: log Y, U / Y, V / Y.
    LogYRatios,
    /// 12: the logarithm of every channel.
    LogRgb,
}

impl ColorModel {
    /// From the file's number; mean and matrix are those of the file and matter to model 3 only.
    pub(super) fn from_code(code: i32, mean: [f32; 3], matrix: [[f32; 3]; 3]) -> Result<Self> {
        Ok(match code {
            0 => ColorModel::Rgb,
            1 => ColorModel::Yuv,
            2 => ColorModel::Lab,
            3 => ColorModel::Pca { mean, matrix },
            4 => ColorModel::YCoCg,
            5 => ColorModel::Spectral,
            6 => ColorModel::SpectralLinear,
            9 => ColorModel::LogYUv,
            10 => ColorModel::LogYLogULogV,
            11 => ColorModel::LogYRatios,
            12 => ColorModel::LogRgb,
            other => {
                let found = format!("colour model {other}");
                return Err(Error::new(ErrorKind::Unsupported, found, "0 to 6 or 9 to 12"));
            }
        })
    }

    /// The file's number and the channels in words.
    pub(super) fn describe(&self) -> (i32, &'static str) {
        match self {
            ColorModel::Rgb => (0, "RGB"),
            ColorModel::Yuv => (1, "YUV"),
            ColorModel::Lab => (2, "Lab"),
            ColorModel::Pca { .. } => (3, "principal components"),
            ColorModel::YCoCg => (4, "YCoCg"),
            ColorModel::Spectral => (5, "spectral"),
            ColorModel::SpectralLinear => (6, "spectral, linear"),
            ColorModel::LogYUv => (9, "log Y, U, V"),
            ColorModel::LogYLogULogV => (10, "log Y, log U, log V"),
            ColorModel::LogYRatios => (11, "log Y, U / Y, V / Y"),
            ColorModel::LogRgb => (12, "log RGB"),
        }
    }

    pub(super) fn is_lab(&self) -> bool {
        *self == ColorModel::Lab
    }

    /// Whether the model makes sense for so many channels.
    pub(super) fn check_channels(&self, channels: usize) -> Result<()> {
        let any = matches!(
            self,
            ColorModel::Rgb | ColorModel::Spectral | ColorModel::SpectralLinear | ColorModel::LogRgb
        );
        if any || channels == 3 {
            return Ok(());
        }
        let (code, name) = self.describe();
        let found = format!("{} in colour model {code} ({name})", counted(channels, "channel"));
        Err(Error::malformed(found, "three channels"))
    }

    /// Turns stored into reflectance values, in place; `pixels` is `[pixel, channel]`.
    pub(super) fn undo(&self, pixels: &mut [f32], channels: usize) {
        match self {
            ColorModel::Rgb => {}
            ColorModel::Yuv => each_triple(pixels, rgb_from_yuv),
            ColorModel::Lab => each_triple(pixels, rgb_from_lab),
            ColorModel::Pca { mean, matrix } => each_triple(pixels, |[a, b, c]| {
                let [from_a, from_b, from_c] = *matrix;
                add3(add3(scaled3(a, from_a), scaled3(b, from_b)), add3(scaled3(c, from_c), *mean))
            }),
            ColorModel::YCoCg => {
                each_triple(pixels, |[y, co, cg]| [y + co - cg, y + cg, y - co - cg]);
            }
            ColorModel::Spectral => each_spectrum(pixels, channels, |sum, others| {
                let share: f32 = others.iter().sum();
                others.iter_mut().for_each(|value| *value *= sum);
                (1.0 - share) * sum
            }),
            ColorModel::SpectralLinear => each_spectrum(pixels, channels, |mean, others| {
                let number = channels as f32;
                let sum = number * mean;
                let deviations: f32 = others.iter().sum();
                others.iter_mut().for_each(|value| *value = sum * (1.0 + *value));
                sum - deviations / number
            }),
            ColorModel::LogYUv => each_triple(pixels, |[y, u, v]| rgb_from_yuv([unlog(y), u, v])),
            ColorModel::LogYLogULogV => {
                each_triple(pixels, |[y, u, v]| rgb_from_yuv([unlog(y), unlog_signed(u), unlog_signed(v)]));
            }
            ColorModel::LogYRatios => each_triple(pixels, |[y, u, v]| {
                let scale = libm::expf(y);
                rgb_from_yuv([scale - EPSILON, u * scale, v * scale])
            }),
            ColorModel::LogRgb => expand_range(pixels),
        }
    }

    /// Turns reflectance into the values to be stored, in place; `pixels` is `[pixel, channel]`. A negative
    /// luminance becomes 0 in model 11.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`] for models other than [`ColorModel::Rgb`] and [`ColorModel::LogYRatios`]: those
    /// are what other programs read.
    pub fn apply(&self, pixels: &mut [f32]) -> Result<()> {
        match self {
            ColorModel::Rgb => Ok(()),
            ColorModel::LogYRatios => {
                each_triple(pixels, |rgb| {
                    let [y, u, v] = yuv_from_rgb(rgb);
                    let scale = y.max(0.0) + EPSILON;
                    [libm::logf(scale), u / scale, v / scale]
                });
                Ok(())
            }
            other => {
                let (code, name) = other.describe();
                let found = format!("colour model {code} ({name})");
                Err(Error::new(ErrorKind::Argument, found, "0 (RGB) or 11 (log Y, U / Y, V / Y)"))
            }
        }
    }
}

/// Undoes the reduction of the dynamic range by a logarithm, in place.
pub(super) fn expand_range(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = unlog(*value));
}

fn unlog(value: f32) -> f32 {
    libm::expf(value) - EPSILON
}

fn unlog_signed(value: f32) -> f32 {
    if value == 0.0 {
        return 0.0;
    }
    (libm::expf(value.abs()) * EPSILON).copysign(value)
}

fn each_triple(pixels: &mut [f32], change: impl Fn([f32; 3]) -> [f32; 3]) {
    let (triples, _) = pixels.as_chunks_mut::<3>();
    triples.iter_mut().for_each(|triple| *triple = change(*triple));
}

/// `change` gets the first channel and the others, changes these, and gives the new first.
fn each_spectrum(pixels: &mut [f32], channels: usize, change: impl Fn(f32, &mut [f32]) -> f32) {
    for spectrum in pixels.chunks_exact_mut(channels) {
        if let Some((first, others)) = spectrum.split_first_mut() {
            *first = change(*first, others);
        }
    }
}

fn add3([a, b, c]: [f32; 3], [d, e, f]: [f32; 3]) -> [f32; 3] {
    [a + d, b + e, c + f]
}

fn scaled3(factor: f32, vector: [f32; 3]) -> [f32; 3] {
    vector.map(|value| factor * value)
}

fn rgb_from_yuv([y, u, v]: [f32; 3]) -> [f32; 3] {
    [y + R_V * v, y + G_U * u + G_V * v, y + B_U * u]
}

/// The inverse of [`rgb_from_yuv`].
fn yuv_from_rgb([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (from_b, from_r) = (G_U / B_U, G_V / R_V);
    let y = (g - from_b * b - from_r * r) / (1.0 - from_b - from_r);
    [y, (b - y) / B_U, (r - y) / R_V]
}

fn rgb_from_lab([l, a, b]: [f32; 3]) -> [f32; 3] {
    let y = (l + 16.0) / 116.0;
    let [white_x, white_y, white_z] = WHITE;
    let xyz = [white_x * uncurve(y + a / 500.0), white_y * uncurve(y), white_z * uncurve(y - b / 200.0)];
    XYZ_TO_RGB.map(|row| row.iter().zip(xyz).map(|(weight, value)| weight * value).sum())
}

/// Inverse of the cube root of CIE Lab with its linear foot.
fn uncurve(value: f32) -> f32 {
    if value > 6.0 / 29.0 { value * value * value } else { (value - 4.0 / 29.0) * (108.0 / 841.0) }
}

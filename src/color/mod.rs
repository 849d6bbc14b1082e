//! Transfer curves, luminance, CIE L* codes and colour differences.
//!
//! Linear RGB has the sRGB primaries and white D65; 1.0 is a perfect diffuser lit frontally.

mod channels;
mod codes;
pub(crate) mod curve;
mod display;
pub mod samples;

pub use channels::{Decoder, Weights, weights};
pub use codes::{LightnessCodes, Remarkable};
pub use display::srgb_encode_all;

use serde::{Deserialize, Serialize};

/// Weights of linear R, G, B in the luminance Y (IEC 61966-2-1).
pub const LUMINANCE_WEIGHTS: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// How stored samples relate to linear reflectance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transfer {
    /// The sRGB curve; the largest integer, or 1.0, is reflectance 1.
    Srgb,
    /// Proportional; the largest integer, or 1.0, is reflectance 1.
    Linear,
}

impl Transfer {
    /// Linear reflectance of a sample on the scale where 1.0 is reflectance 1.
    pub fn decode(self, value: f64) -> f64 {
        match self {
            Self::Srgb => srgb_decode(value),
            Self::Linear => value,
        }
    }

    /// The sample of a linear reflectance, not clipped.
    pub fn encode(self, linear: f64) -> f64 {
        match self {
            Self::Srgb if linear <= 0.003_130_8 => linear * 12.92,
            Self::Srgb => 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055,
            Self::Linear => linear,
        }
    }
}

/// Inverse of the sRGB curve: 0..1 to linear 0..1; continued above 1, straight below 0.
pub fn srgb_decode(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// The sRGB curve: linear 0..1 to 0..1; values outside are clipped.
pub fn srgb_encode(linear: f64) -> f64 {
    Transfer::Srgb.encode(linear.clamp(0.0, 1.0))
}

/// The 8-bit display value of a linear value.
pub fn srgb_encode_u8(linear: f64) -> u8 {
    (srgb_encode(linear) * 255.0).round() as u8
}

/// CIE 1976 L* of a luminance relative to white; 0..100 for 0..1, not clipped above.
pub fn lightness(y: f64) -> f64 {
    116.0 * lab_curve(y) - 16.0
}

/// The u8 code of a luminance, `round(2.55 L*)`, clipped at L* = 100.
pub fn lightness_code(y: f64) -> u8 {
    (2.55 * lightness(y).clamp(0.0, 100.0)).round() as u8
}

fn lab_curve(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// CIE 1976 L*a*b* (D65) of linear RGB.
pub(crate) fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = rgb;
    let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175_0 * b;
    let z = (0.019_333_9 * r + 0.119_192_0 * g + 0.950_304_1 * b) / 1.088_83;
    let [fx, fy, fz] = [x, y, z].map(lab_curve);
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// CIEDE2000 colour difference of two L*a*b* colours (Sharma, Wu and Dalal 2005).
pub fn ciede2000(first: [f64; 3], second: [f64; 3]) -> f64 {
    let [l1, a1, b1] = first;
    let [l2, a2, b2] = second;
    let chroma_mean = (a1.hypot(b1) + a2.hypot(b2)) / 2.0;
    let saturation = |c: f64| (c.powi(7) / (c.powi(7) + 25f64.powi(7))).sqrt();
    let g = 0.5 * (1.0 - saturation(chroma_mean));
    let (a1, a2) = ((1.0 + g) * a1, (1.0 + g) * a2);
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    let hue =
        |a: f64, b: f64| if a == 0.0 && b == 0.0 { 0.0 } else { b.atan2(a).to_degrees().rem_euclid(360.0) };
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));
    let grey = c1 * c2 == 0.0;
    let hue_step = match h2 - h1 {
        _ if grey => 0.0,
        step if step > 180.0 => step - 360.0,
        step if step < -180.0 => step + 360.0,
        step => step,
    };
    let hue_mean = match h1 + h2 {
        sum if grey => sum,
        sum if (h1 - h2).abs() <= 180.0 => sum / 2.0,
        sum if sum < 360.0 => (sum + 360.0) / 2.0,
        sum => (sum - 360.0) / 2.0,
    };
    let (l_mean, c_mean) = ((l1 + l2) / 2.0, (c1 + c2) / 2.0);
    let cosine = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cosine(hue_mean - 30.0)
        + 0.24 * cosine(2.0 * hue_mean)
        + 0.32 * cosine(3.0 * hue_mean + 6.0)
        - 0.20 * cosine(4.0 * hue_mean - 63.0);
    let from_middle = (l_mean - 50.0).powi(2);
    let s_l = 1.0 + 0.015 * from_middle / (20.0 + from_middle).sqrt();
    let s_c = 1.0 + 0.045 * c_mean;
    let s_h = 1.0 + 0.015 * c_mean * t;
    let turn = 30.0 * (-((hue_mean - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * saturation(c_mean) * (2.0 * turn).to_radians().sin();
    let dl = (l2 - l1) / s_l;
    let dc = (c2 - c1) / s_c;
    let dh = 2.0 * (c1 * c2).sqrt() * (hue_step / 2.0).to_radians().sin() / s_h;
    (dl * dl + dc * dc + dh * dh + rotation * dc * dh).max(0.0).sqrt()
}

/// Luminance of an L* value.
pub(crate) fn inverse_lightness(l: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    let f = (l + 16.0) / 116.0;
    if f > DELTA { f * f * f } else { 3.0 * DELTA * DELTA * (f - 4.0 / 29.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_srgb_curve_gives_every_sample_back() {
        assert!((0..=255u8).all(|s| srgb_encode_u8(Transfer::Srgb.decode(f64::from(s) / 255.0)) == s));
    }

    #[test]
    fn lightness_has_its_defining_values() {
        assert_eq!(lightness(1.0), 100.0);
        assert!(lightness(0.0).abs() < 1e-12);
        assert!((lightness(0.184_186_5) - 50.0).abs() < 1e-4);
    }

    #[test]
    fn ciede2000_agrees_with_the_published_pairs() {
        for (first, second, difference) in [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
            ([22.7233, 20.0904, -46.694], [23.0331, 14.973, -42.5619], 2.0373),
            ([2.0776, 0.0795, -1.135], [0.9033, -0.0636, -0.5514], 0.9082),
        ] {
            assert!((ciede2000(first, second) - difference).abs() < 5e-5, "{}", ciede2000(first, second));
        }
    }
}

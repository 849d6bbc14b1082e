//! Directions to a light or a viewer.

use std::f64::consts::TAU;

/// A direction away from the surface, in the sample frame: x along increasing column, y up in the picture,
/// z out of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Polar angle from the surface normal, radians; 0 to pi/2 above the surface.
    pub theta_rad: f64,
    /// Azimuth in the surface plane, counter-clockwise from +x (right) towards +y (up), radians.
    pub phi_rad: f64,
}

impl Direction {
    /// From angles in degrees.
    pub fn from_degrees(theta: f64, phi: f64) -> Self {
        Direction { theta_rad: theta.to_radians(), phi_rad: phi.to_radians() }
    }

    /// Angles (theta, phi) in degrees, for people.
    pub fn degrees(self) -> (f64, f64) {
        (self.theta_rad.to_degrees(), self.phi_rad.to_degrees())
    }

    /// From a vector of any length but zero; phi in 0..2 pi.
    pub fn from_vector([x, y, z]: [f64; 3]) -> Option<Self> {
        let length = (x * x + y * y + z * z).sqrt();
        if !length.is_normal() {
            return None;
        }
        let theta_rad = libm::atan2(libm::hypot(x, y), z);
        Some(Direction { theta_rad, phi_rad: libm::atan2(y, x).rem_euclid(TAU) })
    }

    /// The unit vector.
    pub fn vector(self) -> [f64; 3] {
        let (sin_theta, cos_theta) = libm::sincos(self.theta_rad);
        let (sin_phi, cos_phi) = libm::sincos(self.phi_rad);
        [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
    }
}

/// An angle or another number for people: six significant digits, and none beyond the sixth decimal, where a conversion
/// leaves its noise.
///
/// ```
/// assert_eq!(btfkit_formats::six_digits(14.999999999999998).to_string(), "15");
/// ```
pub fn six_digits(value: f64) -> f64 {
    let decimals = (value * 1e6).round() / 1e6;
    // Zero is not negative.
    format!("{decimals:.5e}").parse().unwrap_or(decimals) + 0.0
}

/// An azimuth in degrees for people, as [`six_digits`]: what rounds to a whole turn is 0.
///
/// ```
/// assert_eq!(btfkit_formats::azimuth_digits(359.9999999), 0.0);
/// ```
pub fn azimuth_digits(phi_deg: f64) -> f64 {
    let phi = six_digits(phi_deg);
    if phi.abs() == 360.0 { 0.0 } else { phi }
}

impl std::fmt::Display for Direction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (theta, phi) = self.degrees();
        write!(f, "theta {} phi {}", six_digits(theta), azimuth_digits(phi))
    }
}

impl std::str::FromStr for Direction {
    type Err = String;

    /// `theta,phi` in degrees, phi within a turn either way.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "expected theta,phi in degrees such as 15,0 (theta 0 to 90, phi -360 to 360), got {text:?}"
            )
        };
        let (theta, phi) = text.split_once(',').ok_or_else(expected)?;
        let angle = |part: &str| part.trim().parse::<f64>().ok().filter(|a| a.is_finite());
        let (theta, phi) = (angle(theta).ok_or_else(expected)?, angle(phi).ok_or_else(expected)?);
        if !(0.0..=90.0).contains(&theta) || !(-360.0..=360.0).contains(&phi) {
            return Err(expected());
        }
        Ok(Direction::from_degrees(theta, phi.rem_euclid(360.0)))
    }
}

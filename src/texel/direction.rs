//! Directions of view and light.

use std::f64::consts::TAU;

/// A direction away from the surface: theta from the normal, phi counter-clockwise from +x, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Angle from the surface normal, 0 to pi/2.
    pub theta_rad: f64,
    /// Azimuth in the surface plane, counter-clockwise from +x (right) towards +y (up).
    pub phi_rad: f64,
}

impl Direction {
    /// From angles in degrees.
    pub fn from_degrees(theta: f64, phi: f64) -> Self {
        Self { theta_rad: theta.to_radians(), phi_rad: phi.to_radians() }
    }

    /// Angles (theta, phi) in degrees, for people.
    pub fn degrees(self) -> (f64, f64) {
        (self.theta_rad.to_degrees(), self.phi_rad.to_degrees())
    }

    /// The unit vector (x right, y up, z out of the surface).
    pub fn vector(self) -> [f64; 3] {
        let (sin_theta, cos_theta) = libm::sincos(self.theta_rad);
        let (sin_phi, cos_phi) = libm::sincos(self.phi_rad);
        [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
    }

    /// The direction of a vector above the plane.
    pub fn of_vector([x, y, z]: [f64; 3]) -> Self {
        Self { theta_rad: libm::atan2(x.hypot(y), z), phi_rad: libm::atan2(y, x).rem_euclid(TAU) }
    }
}

impl std::fmt::Display for Direction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (theta, phi) = self.degrees();
        write!(f, "theta {theta:.4} phi {phi:.4}")
    }
}

impl std::str::FromStr for Direction {
    type Err = String;

    /// `theta,phi` in degrees.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected theta,phi in degrees such as 15,0 (theta 0 to 90), got {text:?}");
        let (theta, phi) = text.split_once(',').ok_or_else(expected)?;
        let angle = |part: &str| part.trim().parse::<f64>().ok().filter(|a| a.is_finite());
        let (theta, phi) = (angle(theta).ok_or_else(expected)?, angle(phi).ok_or_else(expected)?);
        if !(0.0..=90.0).contains(&theta) {
            return Err(expected());
        }
        Ok(Self::from_degrees(theta, phi.rem_euclid(360.0)))
    }
}

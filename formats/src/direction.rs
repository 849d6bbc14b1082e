//! Directions to a light or a viewer.

/// A direction in the sample frame: x along increasing column, y up in the picture, z out of the surface.
/// Points away from the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Polar angle from the surface normal, radians.
    pub theta_rad: f64,
    /// Azimuth, counter-clockwise from +x as seen in the picture, radians.
    pub phi_rad: f64,
}

impl Direction {
    /// From angles in degrees.
    pub fn from_degrees(theta: f64, phi: f64) -> Self {
        Direction { theta_rad: theta.to_radians(), phi_rad: phi.to_radians() }
    }

    /// From a vector of any length but zero; phi in 0..2 pi.
    pub fn from_vector([x, y, z]: [f64; 3]) -> Option<Self> {
        let length = (x * x + y * y + z * z).sqrt();
        if !length.is_normal() {
            return None;
        }
        let theta_rad = (x.hypot(y)).atan2(z);
        Some(Direction { theta_rad, phi_rad: y.atan2(x).rem_euclid(std::f64::consts::TAU) })
    }

    /// The unit vector.
    pub fn vector(self) -> [f64; 3] {
        let (sin, cos) = self.theta_rad.sin_cos();
        [sin * self.phi_rad.cos(), sin * self.phi_rad.sin(), cos]
    }
}

//! A direction as file names, tables and light lists give it.

use std::cmp::Ordering;

use crate::Direction;

/// A direction in degrees, in canonical form: theta in 0..=90, phi in [0, 360), and phi 0 where theta is 0.
/// So two equal values are one direction.
///
/// Degrees, since that is what names are written in: whole ones stay exact. Ordered by theta, then phi, which
/// is the order of the published sets.
#[derive(Debug, Clone, Copy)]
pub struct Angles {
    theta_deg: f64,
    phi_deg: f64,
}

impl Angles {
    /// Straight along the surface normal.
    pub const FRONTAL: Angles = Angles { theta_deg: 0.0, phi_deg: 0.0 };

    /// Brings a direction into canonical form. `None` unless theta is in 0..=90 and phi within ten turns: a larger
    /// number is no azimuth.
    ///
    /// ```
    /// use btfkit_formats::Angles;
    ///
    /// let angles = Angles::new(15.0, -60.0).unwrap();
    /// assert_eq!((angles.theta_deg(), angles.phi_deg()), (15.0, 300.0));
    /// assert_eq!(Angles::new(0.0, 60.0), Some(Angles::FRONTAL));
    /// assert_eq!(Angles::new(91.0, 0.0), None);
    /// ```
    pub fn new(theta_deg: f64, phi_deg: f64) -> Option<Angles> {
        const TEN_TURNS: f64 = 3600.0;
        if !(0.0..=90.0).contains(&theta_deg) || !(-TEN_TURNS..=TEN_TURNS).contains(&phi_deg) {
            return None;
        }
        if theta_deg == 0.0 {
            return Some(Angles::FRONTAL);
        }
        let phi_deg = phi_deg.rem_euclid(360.0);
        // A tiny negative angle rounds up to 360 itself.
        let phi_deg = if phi_deg == 0.0 || phi_deg >= 360.0 { 0.0 } else { phi_deg };
        Some(Angles { theta_deg, phi_deg })
    }

    /// The direction of a vector of any length.
    ///
    /// # Errors
    /// The reason, for a message that goes on with what was found: components that are not finite, a length
    /// of less than a millionth (its direction would be noise), or a direction into the surface.
    pub(crate) fn from_vector(vector: [f64; 3]) -> Result<Angles, &'static str> {
        const FINITE: &str = "three finite numbers of moderate size";
        let [x, y, z] = vector;
        if !vector.iter().all(|component| component.is_finite()) {
            return Err(FINITE);
        }
        if x.hypot(y).hypot(z) < 1e-6 {
            return Err("a vector that is long enough to have a direction");
        }
        if z < 0.0 {
            return Err("a direction that points away from the surface, z >= 0");
        }
        Direction::from_vector(vector).and_then(Angles::from_direction).ok_or(FINITE)
    }

    /// The same direction in degrees, `None` if it points into the surface or is not finite.
    pub fn from_direction(direction: Direction) -> Option<Angles> {
        Angles::new(direction.theta_rad.to_degrees(), direction.phi_rad.to_degrees())
    }

    /// The same direction in radians.
    pub fn direction(self) -> Direction {
        Direction::from_degrees(self.theta_deg, self.phi_deg)
    }

    /// Polar angle from the surface normal, degrees, 0..=90.
    pub fn theta_deg(self) -> f64 {
        self.theta_deg
    }

    /// Azimuth, degrees, [0, 360).
    pub fn phi_deg(self) -> f64 {
        self.phi_deg
    }
}

impl PartialEq for Angles {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Angles {}

impl PartialOrd for Angles {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Angles {
    fn cmp(&self, other: &Self) -> Ordering {
        self.theta_deg.total_cmp(&other.theta_deg).then(self.phi_deg.total_cmp(&other.phi_deg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn canonical_form() {
        let phi = |p: f64| Angles::new(45.0, p).unwrap().phi_deg();
        assert_eq!((phi(360.0), phi(720.5), phi(-30.0)), (0.0, 0.5, 330.0));
        assert_eq!(phi(-1e-300).to_bits(), 0.0f64.to_bits());
        assert_eq!(phi(-0.0).to_bits(), 0.0f64.to_bits());
        assert_eq!(Angles::new(-0.0, 77.0), Angles::new(0.0, 0.0));
        for (theta, phi) in [
            (-1.0, 0.0),
            (90.5, 0.0),
            (f64::NAN, 0.0),
            (10.0, f64::NAN),
            (10.0, f64::INFINITY),
            (10.0, 3601.0),
        ] {
            assert_eq!(Angles::new(theta, phi), None, "{theta} {phi}");
        }
    }

    #[test]
    fn vectors_of_any_length() {
        let angles = |vector| Angles::from_vector(vector).map(|a| (a.theta_deg(), a.phi_deg()));
        assert_eq!(angles([0.0, 0.0, 7.0]), Ok((0.0, 0.0)));
        assert_eq!(angles([0.0, -3.0, 0.0]), Ok((90.0, 270.0)));
        let (theta, phi) = angles([-1e3, 1e3, 1e3 * 2f64.sqrt()]).unwrap();
        assert!((theta - 45.0).abs() < 1e-12 && (phi - 135.0).abs() < 1e-12, "{theta} {phi}");
        for vector in [[0.0; 3], [1e-7, 0.0, 1e-7], [0.0, 1.0, -1e-9], [f64::NAN, 0.0, 1.0], [1e200; 3]] {
            assert!(Angles::from_vector(vector).is_err(), "{vector:?}");
        }
    }

    #[test]
    fn radians_and_back() {
        let angles = Angles::new(37.5, 292.5).unwrap();
        let again = Angles::from_direction(angles.direction()).unwrap();
        assert!((again.theta_deg() - 37.5).abs() < 1e-12 && (again.phi_deg() - 292.5).abs() < 1e-12);
        assert_eq!(Angles::from_direction(Direction { theta_rad: 1.6, phi_rad: 0.0 }), None);
    }
}

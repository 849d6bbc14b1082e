//! A direction as file names give it, and the list of the published sets.

use std::cmp::Ordering;

/// A direction in degrees, in canonical form: theta in 0..=90, phi in [0, 360), and phi 0 where theta is 0.
/// So two equal values are one direction.
///
/// Ordered by theta, then phi, which is the order of the published sets.
#[derive(Debug, Clone, Copy)]
pub struct Angles {
    theta_deg: f64,
    phi_deg: f64,
}

impl Angles {
    /// Brings a direction into canonical form. `None` unless theta is in 0..=90 and phi is finite.
    ///
    /// ```
    /// use btfkit_formats::ubo2003::Angles;
    ///
    /// let angles = Angles::new(15.0, -60.0).unwrap();
    /// assert_eq!((angles.theta_deg(), angles.phi_deg()), (15.0, 300.0));
    /// assert_eq!(Angles::new(0.0, 60.0), Angles::new(0.0, 0.0));
    /// assert_eq!(Angles::new(91.0, 0.0), None);
    /// ```
    pub fn new(theta_deg: f64, phi_deg: f64) -> Option<Angles> {
        if !(0.0..=90.0).contains(&theta_deg) || !phi_deg.is_finite() {
            return None;
        }
        if theta_deg == 0.0 {
            return Some(Angles { theta_deg: 0.0, phi_deg: 0.0 });
        }
        let phi_deg = phi_deg.rem_euclid(360.0);
        // A tiny negative angle rounds up to 360 itself.
        let phi_deg = if phi_deg == 0.0 || phi_deg >= 360.0 { 0.0 } else { phi_deg };
        Some(Angles { theta_deg, phi_deg })
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

/// Rings of the published sets: theta and the step of phi, degrees.
const RINGS: [(u32, u32); 6] = [(0, 360), (15, 60), (30, 30), (45, 20), (60, 18), (75, 15)];

/// The 81 directions of the published sets, lights and views alike, in their order: sorted by theta, then phi.
pub fn directions_81() -> Vec<Angles> {
    let ring = |(theta, step): (u32, u32)| {
        (0..360).step_by(usize::try_from(step).unwrap_or(usize::MAX)).map(move |phi| (theta, phi))
    };
    RINGS.into_iter().flat_map(ring).filter_map(|(t, p)| Angles::new(f64::from(t), f64::from(p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_of_81_agrees_with_the_published_table() {
        let list = directions_81();
        assert_eq!(list.len(), 81);
        let at = |i: usize| (list[i].theta_deg(), list[i].phi_deg());
        assert_eq!(at(0), (0.0, 0.0));
        assert_eq!((at(1), at(6)), ((15.0, 0.0), (15.0, 300.0)));
        assert_eq!((at(7), at(8), at(18)), ((30.0, 0.0), (30.0, 30.0), (30.0, 330.0)));
        assert_eq!((at(19), at(36)), ((45.0, 0.0), (45.0, 340.0)));
        assert_eq!((at(37), at(56)), ((60.0, 0.0), (60.0, 342.0)));
        assert_eq!((at(57), at(80)), ((75.0, 0.0), (75.0, 345.0)));
        assert!(list.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn canonical_form() {
        let phi = |p: f64| Angles::new(45.0, p).unwrap().phi_deg();
        assert_eq!((phi(360.0), phi(720.5), phi(-30.0)), (0.0, 0.5, 330.0));
        assert_eq!(phi(-1e-300).to_bits(), 0.0f64.to_bits());
        assert_eq!(phi(-0.0).to_bits(), 0.0f64.to_bits());
        assert_eq!(Angles::new(-0.0, 77.0), Angles::new(0.0, 0.0));
        for (theta, phi) in
            [(-1.0, 0.0), (90.5, 0.0), (f64::NAN, 0.0), (10.0, f64::NAN), (10.0, f64::INFINITY)]
        {
            assert_eq!(Angles::new(theta, phi), None, "{theta} {phi}");
        }
    }
}

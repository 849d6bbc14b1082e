//! Angles that are read from names, but can hardly be meant.

use crate::{Angles, six_digits};

/// What is odd about the directions that a name gives, in words that follow "the name ... with".
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Doubt {
    /// No direction has these angles, so the name is none of an image; but it looks like one.
    Impossible(String),
    /// The azimuth is more than a whole turn: it is read as what is left of it.
    WholeTurns(String),
}

impl Doubt {
    /// Of angles in degrees.
    pub(crate) fn of_angles(theta_deg: f64, phi_deg: f64) -> Option<Doubt> {
        const WHOLE_TURN: f64 = 360.0;
        if Angles::new(theta_deg, phi_deg).is_none() {
            let found = format!("theta {} phi {}", six_digits(theta_deg), six_digits(phi_deg));
            return Some(Doubt::Impossible(found));
        }
        (phi_deg.abs() > WHOLE_TURN).then(|| Doubt::WholeTurns(format!("phi {}", six_digits(phi_deg))))
    }

    /// The worse of two.
    pub(crate) fn or_worse(self, other: Option<Doubt>) -> Doubt {
        match (self, other) {
            (Doubt::WholeTurns(_), Some(worse @ Doubt::Impossible(_))) => worse,
            (first, _) => first,
        }
    }
}

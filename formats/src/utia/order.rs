//! Orders of images that are known by name.

use super::Pair;
use crate::ubo2003::{Angles, directions_81};

/// Which pair of directions each image of a container belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Order {
    /// As the container says.
    #[default]
    Stated,
    /// "UBO81x81": the 81 directions of UBO2003; image = 81 view + light. (The numbers in UBO2003's own names run the other way.)
    Ubo81,
    /// "Uniform": 60 views of theta 15, 30, .. 75 degrees, 61 lights of theta 0, 15, .. 75, phi every 30; image = 61 view + light.
    Uniform,
}

impl Order {
    /// The order that a file means by its name.
    pub(crate) fn from_name(name: &str) -> Option<Order> {
        match name {
            "UBO81x81" => Some(Order::Ubo81),
            "Uniform" => Some(Order::Uniform),
            _ => None,
        }
    }

    /// The pairs of all images, in their order; nothing for [`Order::Stated`].
    pub(crate) fn pairs(self) -> Vec<Pair> {
        let (views, lights) = match self {
            Order::Stated => (Vec::new(), Vec::new()),
            Order::Ubo81 => (directions_81(), directions_81()),
            Order::Uniform => {
                let lights = [Angles::new(0.0, 0.0)].into_iter().flatten().chain(uniform_rings()).collect();
                (uniform_rings().collect(), lights)
            }
        };
        let of_view = |&view: &Angles| lights.iter().map(move |&light| Pair { view, light });
        views.iter().flat_map(of_view).collect()
    }
}

fn uniform_rings() -> impl Iterator<Item = Angles> {
    let ring =
        |theta: u32| (0..360).step_by(30).filter_map(move |phi: u32| Angles::new(theta.into(), phi.into()));
    (15..=75).step_by(15).flat_map(ring)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles(theta: f64, phi: f64) -> Angles {
        Angles::new(theta, phi).unwrap()
    }

    #[test]
    fn known_orders_have_their_pairs_in_place() {
        let pairs = Order::Ubo81.pairs();
        assert_eq!(pairs.len(), 6561);
        assert_eq!(pairs[81 * 8 + 1], Pair { view: angles(30.0, 30.0), light: angles(15.0, 0.0) });

        let pairs = Order::Uniform.pairs();
        assert_eq!(pairs.len(), 60 * 61);
        // 61 (12 (45 / 15 - 1) + 90 / 30) + 1 + 12 (30 / 15 - 1) + 60 / 30
        assert_eq!(pairs[61 * 27 + 15], Pair { view: angles(45.0, 90.0), light: angles(30.0, 60.0) });
        assert_eq!(pairs[61], Pair { view: angles(15.0, 30.0), light: angles(0.0, 0.0) });
    }
}

//! The lists of directions of the published sets.

use crate::Angles;

/// Rings of UBO2003 and ATRIUM: theta and the step of phi, degrees.
const RINGS_81: [(u32, u32); 6] = [(0, 360), (15, 60), (30, 30), (45, 20), (60, 18), (75, 15)];

/// Rings of the Bonn dome: theta, number of directions, phi of the first, degrees.
const RINGS_151: [(f64, u32, f64); 10] = [
    (0.0, 1, 0.0),
    (11.0, 6, 15.0),
    (23.5, 12, 0.0),
    (30.0, 12, 15.0),
    (37.5, 12, 0.0),
    (45.0, 18, 0.0),
    (52.5, 18, 7.5),
    (60.0, 24, 0.0),
    (67.5, 24, 7.5),
    (75.0, 24, 0.0),
];

/// The 81 directions of UBO2003 and ATRIUM, lights and views alike, in their order: sorted by theta, then phi.
pub fn directions_81() -> Vec<Angles> {
    let ring = |(theta, step): (u32, u32)| {
        (0..360).step_by(usize::try_from(step).unwrap_or(usize::MAX)).map(move |phi| (theta, phi))
    };
    RINGS_81.into_iter().flat_map(ring).filter_map(|(t, p)| Angles::new(f64::from(t), f64::from(p))).collect()
}

/// The 151 directions of the Bonn dome (UBO2014), lights and views alike, in their order: sorted by theta, then
/// phi.
pub fn directions_151() -> Vec<Angles> {
    let ring = |(theta, count, first): (f64, u32, f64)| {
        let phi = move |k| 360.0 * f64::from(k) / f64::from(count) + first;
        (0..count).filter_map(move |k| Angles::new(theta, phi(k)))
    };
    RINGS_151.into_iter().flat_map(ring).collect()
}

/// A published list by its name, `ubo81` or `bonn151`, for arrays that come without directions.
pub fn published(name: &str) -> Option<Vec<Angles>> {
    match name {
        "ubo81" => Some(directions_81()),
        "bonn151" => Some(directions_151()),
        _ => None,
    }
}

/// Name of the published list of this many directions.
pub(crate) fn published_name(count: usize) -> Option<&'static str> {
    match count {
        81 => Some("ubo81"),
        151 => Some("bonn151"),
        _ => None,
    }
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
    fn rings_of_151_start_where_published() {
        let list = directions_151();
        assert_eq!(list.len(), 151);
        assert!(list.windows(2).all(|pair| pair[0] < pair[1]));
        let firsts = [0, 1, 7, 19, 31, 43, 61, 79, 103, 127];
        for (first, (theta, _, phi)) in firsts.into_iter().zip(RINGS_151) {
            assert_eq!((list[first].theta_deg(), list[first].phi_deg()), (theta, phi));
        }
    }

    #[test]
    fn published_names_and_counts_belong_together() {
        for count in [81, 151] {
            assert_eq!(published(published_name(count).unwrap()).unwrap().len(), count);
        }
        assert_eq!((published("ubo82"), published_name(82)), (None, None));
    }
}

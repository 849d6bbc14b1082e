//! From a pair of directions for every image to a grid of views and lights.

use std::collections::HashMap;

use crate::ubo2003::Angles;
use crate::words::counted;
use crate::{Direction, Error, ErrorKind, Limits, Result, six_digits};

/// Angles that differ by less than about half of this are one direction, degrees: above the rounding of a
/// conversion, below any measurement.
const STEP_DEG: f64 = 1e-6;

/// Missing pairs that an error names.
const NAMED: usize = 5;

/// The directions of one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    pub(crate) view: Angles,
    pub(crate) light: Angles,
}

/// Every view under every light.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    /// In the order of their first image.
    pub(crate) views: Vec<Direction>,
    pub(crate) lights: Vec<Direction>,
    /// Place in the list of pairs, for `[view, light]`.
    places: Vec<usize>,
}

/// Directions of one kind, each once.
#[derive(Default)]
struct Unique {
    numbers: HashMap<(i64, i64), usize>,
    list: Vec<Angles>,
}

impl Unique {
    fn number(&mut self, angles: Angles) -> usize {
        let next = self.list.len();
        let number = *self.numbers.entry(key(angles)).or_insert(next);
        if number == next {
            self.list.push(angles);
        }
        number
    }

    fn directions(&self) -> Vec<Direction> {
        self.list.iter().map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg())).collect()
    }

    fn name(&self, number: usize) -> String {
        self.list.get(number).map_or_else(String::new, |a| {
            format!("({}, {})", six_digits(a.theta_deg()), six_digits(a.phi_deg()))
        })
    }
}

fn key(angles: Angles) -> (i64, i64) {
    let steps = |degrees: f64| (degrees / STEP_DEG).round() as i64;
    match steps(angles.theta_deg()) {
        0 => (0, 0),
        theta => (theta, steps(angles.phi_deg()).checked_rem(steps(360.0)).unwrap_or(0)),
    }
}

impl Grid {
    /// # Errors
    /// A pair twice, or pairs that are missing, by their angles in degrees; too many directions.
    pub(crate) fn from_pairs(pairs: &[Pair], limits: &Limits) -> Result<Grid> {
        let (mut views, mut lights) = (Unique::default(), Unique::default());
        let mut found: HashMap<(usize, usize), usize> = HashMap::new();
        for (place, pair) in pairs.iter().enumerate() {
            let numbers = (views.number(pair.view), lights.number(pair.light));
            if let Some(first) = found.insert(numbers, place) {
                let found = format!(
                    "images {first} and {place} both of view {}, light {}",
                    views.name(numbers.0),
                    lights.name(numbers.1)
                );
                return Err(Error::malformed(found, "one image for each pair of directions"));
            }
        }
        let most = views.list.len().max(lights.list.len());
        if u64::try_from(most).is_ok_and(|most| most > limits.max_directions) {
            let expected = format!("at most {} (max_directions)", limits.max_directions);
            return Err(Error::new(ErrorKind::Limit, counted(most, "direction"), expected));
        }
        let every =
            || (0..views.list.len()).flat_map(|view| (0..lights.list.len()).map(move |light| (view, light)));
        let missing: Vec<String> = every()
            .filter(|pair| !found.contains_key(pair))
            .take(NAMED)
            .map(|(view, light)| format!("view {}, light {}", views.name(view), lights.name(light)))
            .collect();
        if !missing.is_empty() {
            let expected = views.list.len().saturating_mul(lights.list.len());
            return Err(Error::malformed(
                format!(
                    "{} of {} and {}, none of {}",
                    counted(pairs.len(), "image"),
                    counted(views.list.len(), "view"),
                    counted(lights.list.len(), "light"),
                    missing.join("; ")
                ),
                format!("one for each of {} of directions", counted(expected, "pair")),
            ));
        }
        let places = every().filter_map(|pair| found.get(&pair).copied()).collect();
        Ok(Grid { views: views.directions(), lights: lights.directions(), places })
    }

    /// Place in the list of pairs of one view under one light.
    pub(crate) fn place(&self, view: usize, light: usize) -> Option<usize> {
        if light >= self.lights.len() {
            return None;
        }
        self.places.get(view.checked_mul(self.lights.len())?.checked_add(light)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(view: (f64, f64), light: (f64, f64)) -> Pair {
        Pair { view: Angles::new(view.0, view.1).unwrap(), light: Angles::new(light.0, light.1).unwrap() }
    }

    #[test]
    fn grid_in_order_of_appearance() {
        let pairs = [
            pair((30.0, 0.0), (15.0, 359.999_999_99)),
            pair((1e-9, 77.0), (60.0, 5.0)),
            pair((0.0, 0.0), (15.0, 0.0)),
            pair((30.0, 1e-8), (60.0, 5.0)),
        ];
        let grid = Grid::from_pairs(&pairs, &Limits::default()).unwrap();
        assert_eq!((grid.views.len(), grid.lights.len()), (2, 2));
        let places = |view| [grid.place(view, 0), grid.place(view, 1), grid.place(view, 2)];
        assert_eq!(places(0), [Some(0), Some(3), None]);
        assert_eq!(places(1), [Some(2), Some(1), None]);
        assert_eq!(places(2), [None; 3]);
    }

    #[test]
    fn holes_and_doubles_are_named() {
        let (a, b) = ((0.0, 0.0), (15.0, 60.0));
        let error = Grid::from_pairs(&[pair(a, a), pair(b, b)], &Limits::default()).unwrap_err().to_string();
        assert!(error.contains("view (0, 0), light (15, 60); view (15, 60), light (0, 0)"), "{error}");
        let error = Grid::from_pairs(&[pair(a, b), pair(b, b), pair(a, b)], &Limits::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("images 0 and 2 both of view (0, 0), light (15, 60)"), "{error}");

        // As many views and lights as images would be a grid of their square.
        let many: Vec<Pair> =
            (0..60_000).map(|i| pair((45.0, f64::from(i) / 1e3), (45.0, f64::from(i) / 1e3))).collect();
        assert!(Grid::from_pairs(&many, &Limits::default()).is_err());
        let limits = Limits { max_directions: 1, ..Limits::default() };
        assert_eq!(
            Grid::from_pairs(&[pair(a, a), pair(b, a)], &limits).unwrap_err().kind(),
            ErrorKind::Limit
        );
    }
}

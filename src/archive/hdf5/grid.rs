//! From a list of images with directions of their own to every view under every light.

use std::cmp::Ordering;
use std::collections::HashMap;

use crate::words::counted;
use btfkit_formats::{Direction, Limits};

/// Directions whose x and y differ by no more than this are one.
const TOLERANCE: f64 = 1e-4;

/// A complete grid: one image of every view under every light.
#[derive(Debug)]
pub(super) struct Grid {
    /// Views in the order in which they are first met.
    pub(super) views: Vec<Direction>,
    /// Lights likewise.
    pub(super) lights: Vec<Direction>,
    /// Number of the image [view, light].
    images: Vec<usize>,
}

impl Grid {
    /// From x and y of a unit vector to the viewer and one to the light for each image.
    ///
    /// # Errors
    /// What is no direction, and how many pairs are missing or there more than once.
    pub(super) fn of(views: &[[f64; 2]], lights: &[[f64; 2]], limits: &Limits) -> Result<Self, String> {
        let (views, view_of) = distinct("view", views, limits)?;
        let (lights, light_of) = distinct("light", lights, limits)?;
        let count = view_of.len();
        let mut image_of = HashMap::with_capacity(count);
        for (image, pair) in view_of.into_iter().zip(light_of).enumerate() {
            image_of.entry(pair).or_insert(image);
        }
        let pairs = views.len() * lights.len();
        let (missing, repeated) = (pairs - image_of.len(), count - image_of.len());
        if missing + repeated > 0 {
            return Err(format!(
                "got {} of {} and {}: of {} {missing} missing, and {} of a pair that another has; \
                 expected one image of every pair",
                counted(count, "image"),
                counted(views.len(), "view"),
                counted(lights.len(), "light"),
                counted(pairs, "pair"),
                counted(repeated, "image")
            ));
        }
        let every = (0..views.len()).flat_map(|view| (0..lights.len()).map(move |light| (view, light)));
        let images = every.filter_map(|pair| image_of.get(&pair).copied()).collect();
        Ok(Self { views, lights, images })
    }

    /// Number of an image in the list.
    pub(super) fn image(&self, view: usize, light: usize) -> usize {
        self.images[view * self.lights.len() + light]
    }
}

/// The distinct directions of a list, and for each of its entries which one it is.
fn distinct(what: &str, list: &[[f64; 2]], limits: &Limits) -> Result<(Vec<Direction>, Vec<usize>), String> {
    let mut found: Vec<[f64; 2]> = Vec::new();
    // Squares as wide as the tolerance: what is near lies in the same one or one beside it.
    let mut squares: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    let mut numbers = Vec::with_capacity(list.len());
    let mut directions = Vec::new();
    for (image, &xy) in list.iter().enumerate() {
        let direction = of_unit_vector(xy).ok_or_else(|| {
            format!("image {image}: got {xy:?}, expected x and y of a unit vector to the {what}")
        })?;
        let square = xy.map(|c| (c / TOLERANCE).floor() as i64);
        let near = |&&known: &&usize| (0..2).all(|k| (found[known][k] - xy[k]).abs() <= TOLERANCE);
        let beside = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [square[0] + dx, square[1] + dy]));
        let known = beside.filter_map(|square| squares.get(&square)).flatten().find(near).copied();
        numbers.push(known.unwrap_or(found.len()));
        if known.is_none() {
            squares.entry(square).or_default().push(found.len());
            found.push(xy);
            directions.push(direction);
        }
        if found.len() as u64 > limits.max_directions {
            return Err(format!("got more than {} different {what}s", limits.max_directions));
        }
    }
    Ok((directions, numbers))
}

fn of_unit_vector([x, y]: [f64; 2]) -> Option<Direction> {
    // NaN is none either.
    if x.hypot(y).partial_cmp(&(1.0 + TOLERANCE)).is_none_or(Ordering::is_gt) {
        return None;
    }
    Direction::from_vector([x, y, (1.0 - x * x - y * y).max(0.0).sqrt()])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn xy(theta: f64, phi: f64) -> [f64; 2] {
        let [x, y, _] = Direction::from_degrees(theta, phi).vector();
        [x, y]
    }

    const VIEWS: [(f64, f64); 3] = [(0.0, 0.0), (60.0, 90.0), (75.0, 200.0)];
    const LIGHTS: [(f64, f64); 2] = [(15.0, 300.0), (0.0, 0.0)];

    /// All pairs, lights slowest, each a little off.
    fn pairs() -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let every = LIGHTS.iter().flat_map(|&light| VIEWS.iter().map(move |&view| (view, light)));
        let off = |n: usize, [x, y]: [f64; 2]| [x + 4e-5 * (n % 2) as f64, y - 4e-5 * (n % 3) as f64 / 2.0];
        every.enumerate().map(|(n, (v, l))| (off(n, xy(v.0, v.1)), off(n, xy(l.0, l.1)))).unzip()
    }

    #[test]
    fn a_list_in_any_order_is_sorted_into_a_grid() {
        let (views, lights) = pairs();
        let grid = Grid::of(&views, &lights, &Limits::default()).unwrap();
        assert_eq!((grid.views.len(), grid.lights.len()), (3, 2));
        for (found, expected) in grid.views.iter().zip(VIEWS).chain(grid.lights.iter().zip(LIGHTS)) {
            let expected = Direction::from_degrees(expected.0, expected.1);
            let cos: f64 = found.vector().iter().zip(expected.vector()).map(|(a, b)| a * b).sum();
            assert!(cos > 0.999_999, "{found:?}, {expected:?}");
        }
        assert_eq!((grid.image(0, 0), grid.image(2, 0), grid.image(1, 1)), (0, 2, 4));
        let backwards = |list: &[[f64; 2]]| list.iter().rev().copied().collect::<Vec<_>>();
        let grid = Grid::of(&backwards(&views), &backwards(&lights), &Limits::default()).unwrap();
        assert_eq!((grid.image(0, 0), grid.image(2, 1)), (0, 5));
    }

    #[test]
    fn holes_and_repetitions_are_counted() {
        let (mut views, mut lights) = pairs();
        (views[1], lights[1]) = (views[0], lights[0]);
        let error = Grid::of(&views, &lights, &Limits::default()).unwrap_err();
        assert!(error.contains("of 6 pairs 1 missing, and 1 image of a pair that another has"), "{error}");
        views.truncate(5);
        lights.truncate(5);
        let error = Grid::of(&views, &lights, &Limits::default()).unwrap_err();
        assert!(error.contains("of 6 pairs 2 missing"), "{error}");
    }

    #[test]
    fn what_is_no_direction_and_too_many_of_them_are_refused() {
        for wrong in [[0.8, 0.8], [f64::NAN, 0.0], [f64::INFINITY, 0.0]] {
            let error = Grid::of(&[wrong], &[[0.0, 0.0]], &Limits::default()).unwrap_err();
            assert!(error.contains("image 0") && error.contains("view"), "{error}");
        }
        let mut limits = Limits::default();
        limits.max_directions = 2;
        let (views, lights) = pairs();
        assert!(Grid::of(&views, &lights, &limits).unwrap_err().contains("more than 2 different views"));
    }
}

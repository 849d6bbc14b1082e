//! Under which lights, and from where, an enlargement is judged.

use btfkit_formats::Direction;

use super::Options;
use crate::error::{Error, Result};
use crate::store::measurement::Measurement;

/// Pairs by default.
pub(super) const COUNT: usize = 5;

/// Lower lights and views, degrees from the normal, show little but shadow and foreshortening.
const LOWEST_DEG: f64 = 61.0;

/// The pairs to judge under.
pub(super) fn chosen(options: &Options, measurement: &Measurement) -> Result<Vec<[usize; 2]>> {
    let description = measurement.description();
    let (views, lights) = (description.views.len(), description.lights.len());
    match options.pairs.iter().find(|&&[view, light]| view >= views || light >= lights) {
        Some([view, light]) => Err(Error::usage(format!(
            "got the pair {view},{light}, expected a view from 0 to {} and a light from 0 to {}",
            views.saturating_sub(1),
            lights.saturating_sub(1)
        ))
        .hint(format!("btf info {} --directions lists them", measurement.path().display()))),
        None if options.pairs.is_empty() => Ok(spread(&description.views, &description.lights, COUNT)),
        None => Ok(options.pairs.clone()),
    }
}

/// Pairs (view, light) spread over the directions: the most frontal view under its lowest light first, then each time the
/// pair that is farthest from those chosen.
pub(super) fn spread(views: &[Direction], lights: &[Direction], count: usize) -> Vec<[usize; 2]> {
    let lowest = LOWEST_DEG.to_radians();
    let usable = |directions: &[Direction]| {
        let high: Vec<usize> = (0..directions.len()).filter(|&n| directions[n].theta_rad <= lowest).collect();
        if high.is_empty() { (0..directions.len()).collect() } else { high }
    };
    let (usable_views, usable_lights) = (usable(views), usable(lights));
    let by_theta = |directions: &[Direction], a: usize, b: usize| {
        directions[a].theta_rad.total_cmp(&directions[b].theta_rad)
    };
    let frontal = usable_views.iter().copied().min_by(|&a, &b| by_theta(views, a, b));
    let low = usable_lights.iter().copied().max_by(|&a, &b| by_theta(lights, a, b).then(b.cmp(&a)));
    let (Some(frontal), Some(low)) = (frontal, low) else { return Vec::new() };
    let vector = |[view, light]: [usize; 2]| [views[view].vector(), lights[light].vector()];
    let square = |a: [usize; 2], b: [usize; 2]| -> f64 {
        let (a, b) = (vector(a), vector(b));
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let pairs: Vec<[usize; 2]> =
        usable_views.iter().flat_map(|&view| usable_lights.iter().map(move |&light| [view, light])).collect();
    let mut chosen = vec![[frontal, low]];
    let mut nearest: Vec<f64> = pairs.iter().map(|&pair| square(pair, [frontal, low])).collect();
    while chosen.len() < count {
        let farthest = (0..pairs.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]).then(b.cmp(&a)));
        let Some(next) = farthest.filter(|&n| nearest[n] > 0.0) else { break };
        chosen.push(pairs[next]);
        for (nearest, &pair) in nearest.iter_mut().zip(&pairs) {
            *nearest = nearest.min(square(pair, pairs[next]));
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_begin_with_a_low_light_and_are_all_different() {
        let ring = |theta: f64| (0..4).map(move |n| Direction::from_degrees(theta, 90.0 * f64::from(n)));
        let directions: Vec<Direction> = [Direction::from_degrees(0.0, 0.0)]
            .into_iter()
            .chain([30.0, 60.0, 75.0].into_iter().flat_map(ring))
            .collect();
        let pairs = spread(&directions, &directions, COUNT);
        assert_eq!((pairs.len(), pairs[0]), (COUNT, [0, 5]));
        assert!(pairs.iter().flatten().all(|&n| n < 9), "{pairs:?}");
        assert!((1..COUNT).all(|n| !pairs[..n].contains(&pairs[n])));
        assert_eq!(spread(&directions[..1], &directions[..2], COUNT), [[0, 1], [0, 0]]);
    }
}

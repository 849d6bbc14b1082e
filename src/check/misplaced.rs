//! Images under wrong names: exchanged, or from another direction.
//!
//! What an image shows beyond what all images show (its relief under its own light) changes smoothly with the
//! directions, so the images of neighbouring lights and views predict its pattern. An image that looks like neither,
//! and like the neighbourhood of another place, belongs there.

use std::collections::HashSet;

use rayon::prelude::*;
use serde_json::json;

use super::angular::{Alike, Neighbourhood, angle};
use super::finding::{Check, Finding, ImageSelection, Severity, apart, confidence, names, round};
use super::statistics::{Statistics, median};

/// Name of the check.
pub const NAME: &str = "misplaced-images";

/// Lights farther apart than this predict each other's patterns too badly, degrees.
const SPACING_DEG: f64 = 38.0;

/// Fewer directions have no neighbours to speak of.
const LEAST_DIRECTIONS: usize = 12;

/// Root mean square contrast of patterns below which there is nothing to see.
const LEAST_CONTRAST: f64 = 0.03;

/// An image is suspected if it correlates with its neighbours' prediction less than this ...
const MISFIT: f64 = 0.7;

/// ... and less than images of like geometry do by this many times their deviation (never taken for less than the
/// floor).
const TIMES: f64 = 5.0;
const FLOOR: f64 = 0.04;

/// Most suspects that are followed up.
const SUSPECTS: usize = 256;

/// Two suspects are exchanged if each correlates this well with the prediction at the other's place ...
const FIT: f64 = 0.8;

/// ... and by this much better than at its own.
const BETTER: f64 = 0.5;

/// A single image that belongs elsewhere must fit there nearly perfectly, and far better.
const FIT_ALONE: f64 = 0.93;
const BETTER_ALONE: f64 = 1.2;

/// Patterns of all images, [view, light, cell].
struct Patterns {
    values: Vec<Vec<f32>>,
    lights: usize,
}

impl Patterns {
    /// Thumbnails over their mean, minus what is common to all.
    fn new(statistics: &Statistics) -> Self {
        let mut values: Vec<Vec<f32>> = statistics
            .images
            .iter()
            .map(|image| {
                let mean = image.thumbnail.iter().sum::<f32>() / image.thumbnail.len().max(1) as f32;
                image.thumbnail.iter().map(|value| if mean > 1e-6 { value / mean } else { 1.0 }).collect()
            })
            .collect();
        let cells = values.first().map_or(0, Vec::len);
        let mut common = vec![0.0f32; cells];
        values
            .iter()
            .for_each(|pattern| common.iter_mut().zip(pattern).for_each(|(sum, value)| *sum += value));
        common.iter_mut().for_each(|sum| *sum /= values.len().max(1) as f32);
        for pattern in &mut values {
            pattern.iter_mut().zip(&common).for_each(|(value, common)| *value -= common);
        }
        Self { values, lights: statistics.lights.len() }
    }

    fn contrast(&self) -> f64 {
        median(self.values.iter().map(|pattern| {
            (pattern.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / pattern.len().max(1) as f64).sqrt()
        }))
    }

    /// What the neighbouring lights (or views) of a place promise.
    fn promised(&self, near: &Neighbourhood, at: usize, among_lights: bool) -> Vec<f32> {
        let (view, light) = (at / self.lights, at % self.lights);
        let other = |number: usize| {
            if among_lights { view * self.lights + number } else { number * self.lights + light }
        };
        let number = if among_lights { light } else { view };
        let mut sum = vec![0.0f32; self.values[at].len()];
        for (neighbour, weight) in near.weighted(number) {
            let pattern = &self.values[other(neighbour)];
            sum.iter_mut().zip(pattern).for_each(|(sum, value)| *sum += weight as f32 * value);
        }
        sum
    }
}

fn correlation(a: &[f32], b: &[f32]) -> f64 {
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(1e-12)
}

/// How well an image fits where it is, and what was promised there.
struct Fit {
    own: f64,
    promised: Vec<f32>,
}

/// Looks for them; images in `explained` have other faults.
pub fn check(statistics: &Statistics, explained: &HashSet<ImageSelection>) -> Check {
    let (near_lights, near_views) =
        (Neighbourhood::new(&statistics.lights), Neighbourhood::new(&statistics.views));
    for (what, near, count) in
        [("light", &near_lights, statistics.lights.len()), ("view", &near_views, statistics.views.len())]
    {
        let spacing = near.spacing_rad.to_degrees();
        if count < LEAST_DIRECTIONS || spacing > SPACING_DEG {
            return Check::not_checked(
                NAME,
                format!(
                    "{}: this check needs at least {LEAST_DIRECTIONS}, no farther apart than {SPACING_DEG} degrees",
                    apart(count, what, spacing)
                ),
            );
        }
    }
    let patterns = Patterns::new(statistics);
    let contrast = patterns.contrast();
    if contrast < LEAST_CONTRAST {
        return Check::not_checked(
            NAME,
            format!("images differ by {contrast:.3} in pattern only, expected {LEAST_CONTRAST}"),
        );
    }
    let fits: Vec<Fit> = (0..patterns.values.len())
        .into_par_iter()
        .map(|at| fit(&patterns, &near_lights, &near_views, at))
        .collect();
    let own: Vec<f64> = fits.iter().map(|fit| fit.own).collect();
    let contrasts = Alike::new(&statistics.views, &statistics.lights).contrast(&own);
    let place = |at: usize| ImageSelection::image(at / patterns.lights, at % patterns.lights);
    let mut suspects: Vec<usize> = (0..own.len())
        .filter(|&at| {
            let (less, spread) = contrasts[at];
            own[at] < MISFIT && -less > TIMES * spread.max(FLOOR) && !explained.contains(&place(at))
        })
        .collect();
    suspects.sort_by(|&a, &b| own[a].total_cmp(&own[b]));
    suspects.truncate(SUSPECTS);
    let Verdict { exchanged, moved, nearest } = judge(statistics, &patterns, &fits, &suspects);
    let mut findings = Vec::new();
    if !exchanged.is_empty() {
        let places: Vec<ImageSelection> =
            exchanged.iter().flat_map(|&(a, b, _)| [place(a), place(b)]).collect();
        let pairs: Vec<_> = exchanged
            .iter()
            .map(|&(a, b, there)| json!({"images": [place(a), place(b)], "fit_own": [round(own[a], 3), round(own[b], 3)], "fit_exchanged": round(there, 3)}))
            .collect();
        let best = exchanged.iter().map(|&(a, b, there)| there - own[a].max(own[b])).fold(0.0, f64::max);
        findings.push(Finding {
            code: "images-exchanged",
            severity: Severity::Fault,
            confidence: confidence(best / BETTER),
            message: format!(
                "images fit each other's place better than their own: {}",
                names(&places, statistics)
            ),
            evidence: json!({"pairs": pairs}),
            repair: None,
            directions: places,
        });
    }
    if !moved.is_empty() {
        let places: Vec<ImageSelection> = moved.iter().map(|&(at, ..)| place(at)).collect();
        let list: Vec<_> = moved
            .iter()
            .map(|&(at, to, there)| json!({"image": place(at), "fits_at": place(to), "fit_own": round(own[at], 3), "fit_there": round(there, 3)}))
            .collect();
        let best = moved.iter().map(|&(at, _, there)| there - own[at]).fold(0.0, f64::max);
        findings.push(Finding {
            code: "misplaced-image",
            severity: Severity::Suspicion,
            confidence: confidence(best / BETTER_ALONE),
            message: format!(
                "images fit another place far better than their own: {}",
                names(&places, statistics)
            ),
            evidence: json!({"images": list}),
            repair: None,
            directions: places,
        });
    }
    let detail = format!("{} of {} images fit their neighbours badly", suspects.len(), own.len());
    Check::done(NAME, detail, nearest, findings)
}

fn fit(patterns: &Patterns, near_lights: &Neighbourhood, near_views: &Neighbourhood, at: usize) -> Fit {
    let by_lights = patterns.promised(near_lights, at, true);
    let by_views = patterns.promised(near_views, at, false);
    let pattern = &patterns.values[at];
    let own = correlation(pattern, &by_lights).max(correlation(pattern, &by_views));
    Fit { own, promised: by_lights.iter().zip(&by_views).map(|(a, b)| (a + b) / 2.0).collect() }
}

/// What became of the suspects.
struct Verdict {
    /// Pairs that fit each other's place, and how well the worse one does.
    exchanged: Vec<(usize, usize, f64)>,
    /// Others, the place where they fit, and how well.
    moved: Vec<(usize, usize, f64)>,
    /// The nearest to either as a share of the alarm.
    nearest: f64,
}

fn judge(statistics: &Statistics, patterns: &Patterns, fits: &[Fit], suspects: &[usize]) -> Verdict {
    let mut verdict = Verdict { exchanged: Vec::new(), moved: Vec::new(), nearest: 0.0 };
    let at_place = |image: usize, place: usize| correlation(&patterns.values[image], &fits[place].promised);
    let mut pairs = Vec::new();
    for (number, &a) in suspects.iter().enumerate() {
        for &b in &suspects[..number] {
            let there = at_place(a, b).min(at_place(b, a));
            let better = there - fits[a].own.max(fits[b].own);
            verdict.nearest = verdict.nearest.max((there / FIT).min(better / BETTER));
            if there > FIT && better > BETTER {
                pairs.push((a, b, there));
            }
        }
    }
    pairs.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut explained = HashSet::new();
    for (a, b, there) in pairs {
        if !explained.contains(&a) && !explained.contains(&b) {
            explained.extend([a, b]);
            verdict.exchanged.push((a, b, there));
        }
    }
    for &at in suspects.iter().filter(|at| !explained.contains(at)) {
        let best = (0..fits.len())
            .filter(|&to| far(statistics, patterns.lights, at, to))
            .map(|to| (to, at_place(at, to)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((to, there)) = best {
            let better = there - fits[at].own;
            verdict.nearest = verdict.nearest.max((there / FIT_ALONE).min(better / BETTER_ALONE));
            if there > FIT_ALONE && better > BETTER_ALONE {
                verdict.moved.push((at, to, there));
            }
        }
    }
    verdict
}

/// Whether two images are of clearly different directions.
fn far(statistics: &Statistics, lights: usize, a: usize, b: usize) -> bool {
    const FAR_DEG: f64 = 25.0;
    let (view_a, view_b) = (statistics.views[a / lights], statistics.views[b / lights]);
    let (light_a, light_b) = (statistics.lights[a % lights], statistics.lights[b % lights]);
    angle(view_a, view_b).max(angle(light_a, light_b)) > FAR_DEG.to_radians()
}

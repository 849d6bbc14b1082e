//! Exposure that jumps: of one light, one view, or one image.
//!
//! The mean of an image, its light's cosine divided out, is smooth in both directions, so neighbours predict it. A lamp
//! or an exposure time that differed stands out under all views, one wrong image alone. A highlight stands out too, but
//! with all images of its geometry, and with its partner under exchanged light and view (reciprocity).

use std::collections::HashSet;

use serde_json::json;

use super::angular::{Alike, Neighbourhood, angle};
use super::finding::{Check, Finding, ImageSelection, Severity, apart, confidence, listed, names, round};
use super::statistics::{Statistics, deviation, median};

/// Name of the check.
pub const NAME: &str = "exposure";

/// Directions farther apart than this, degrees, say too little of each other.
const SPACING_DEG: f64 = 38.0;

/// Fewer directions have no neighbours to speak of.
const LEAST_DIRECTIONS: usize = 12;

/// Jump of a whole light or view that counts, natural logarithm: about 28 per cent ...
const JUMP: f64 = 0.25;

/// ... and this many times the deviation over all lights or views.
const TIMES: f64 = 5.0;

/// Share of a light's or view's images that must jump the same way by at least half.
const AGREE: f64 = 0.75;

/// Jump of one image that counts, 35 per cent ...
const IMAGE_JUMP: f64 = 0.3;

/// ... and this many times the deviation among images of like geometry, never taken for less than the floor.
const IMAGE_TIMES: f64 = 6.0;
const FLOOR: f64 = 0.02;

/// An image counts as the partner of another up to this angle, degrees.
const RECIPROCAL_DEG: f64 = 1.5;

/// Logarithms of mean brightness, [view, light], the light's cosine divided out.
struct Levels {
    values: Vec<f64>,
    views: usize,
    lights: usize,
}

impl Levels {
    fn new(statistics: &Statistics) -> Self {
        let lights = statistics.lights.len();
        let mut values: Vec<f64> = (0..statistics.images.len())
            .map(|at| {
                let cosine = statistics.lights[at % lights].theta_rad.cos().max(0.05);
                (statistics.images[at].mean.max(1e-9) / cosine).ln()
            })
            .collect();
        // Black images say nothing: the median of their view stands in for them.
        for (view, row) in values.chunks_mut(lights).enumerate() {
            let black = |light: &usize| statistics.is_black(view, *light);
            let middle = median((0..lights).filter(|light| !black(light)).map(|light| row[light]));
            (0..lights).filter(black).for_each(|light| row[light] = middle);
        }
        Self { values, views: statistics.views.len(), lights }
    }

    /// What each image has more than its neighbours among the lights, or the views, promise.
    fn residuals(&self, near: &Neighbourhood, among_lights: bool) -> Vec<f64> {
        (0..self.values.len())
            .map(|at| {
                let (view, light) = (at / self.lights, at % self.lights);
                let promised = if among_lights {
                    near.predict(light, |other| self.values[view * self.lights + other])
                } else {
                    near.predict(view, |other| self.values[other * self.lights + light])
                };
                self.values[at] - promised
            })
            .collect()
    }
}

/// Whether directions predict each other.
fn dense(near: &Neighbourhood, directions: usize) -> bool {
    directions >= LEAST_DIRECTIONS && near.spacing_rad.to_degrees() <= SPACING_DEG
}

/// By how much each image is brighter than its neighbouring lights promise and than its neighbouring views do, as far
/// as images of like geometry are not as well: the smaller of both, natural logarithm, 0 where they contradict each
/// other. With sparse views the lights alone tell; nothing where those are sparse too.
pub(super) fn jumps(statistics: &Statistics) -> Option<Vec<f64>> {
    let (near_lights, near_views) =
        (Neighbourhood::new(&statistics.lights), Neighbourhood::new(&statistics.views));
    if !dense(&near_lights, statistics.lights.len()) {
        return None;
    }
    let levels = Levels::new(statistics);
    let by_light = levels.residuals(&near_lights, true);
    if !dense(&near_views, statistics.views.len()) {
        return Some(by_light);
    }
    let by_view = levels.residuals(&near_views, false);
    let alike = Alike::new(&statistics.views, &statistics.lights);
    let [by_light, by_view] = [by_light, by_view].map(|residuals| alike.contrast(&residuals));
    Some(by_light.iter().zip(&by_view).map(|(a, b)| smaller(a.0, b.0)).collect())
}

/// The smaller of two numbers of one sign, else 0.
fn smaller(a: f64, b: f64) -> f64 {
    match a * b > 0.0 {
        false => 0.0,
        true if a.abs() < b.abs() => a,
        true => b,
    }
}

/// Looks for jumps; images in `explained` have other faults and are left out.
pub fn check(statistics: &Statistics, explained: &HashSet<ImageSelection>) -> Check {
    let (near_lights, near_views) =
        (Neighbourhood::new(&statistics.lights), Neighbourhood::new(&statistics.views));
    if !dense(&near_lights, statistics.lights.len()) {
        return Check::not_checked(
            NAME,
            format!(
                "{}: this check needs at least {LEAST_DIRECTIONS}, no farther apart than {SPACING_DEG} degrees",
                apart(statistics.lights.len(), "light", near_lights.spacing_rad.to_degrees())
            ),
        );
    }
    let levels = Levels::new(statistics);
    let by_light = levels.residuals(&near_lights, true);
    let (light_jumps, worst_light) = whole(&levels, &by_light, true);
    let mut findings = Vec::new();
    findings.extend(whole_finding(statistics, "light-exposure", &light_jumps, ImageSelection::light));
    let mut alarm = worst_light;
    let mut detail = format!("lights at most {:.0} % of the alarm", 100.0 * worst_light);
    if dense(&near_views, statistics.views.len()) {
        let by_view = levels.residuals(&near_views, false);
        let (view_jumps, worst_view) = whole(&levels, &by_view, false);
        findings.extend(whole_finding(statistics, "view-exposure", &view_jumps, ImageSelection::view));
        let jumped = |at: usize| {
            light_jumps.iter().any(|jump| jump.0 == at % levels.lights)
                || view_jumps.iter().any(|jump| jump.0 == at / levels.lights)
        };
        let residuals = [centred(&levels, by_light, true), centred(&levels, by_view, false)];
        let (images, worst_image) = images(statistics, &levels, &residuals, |at| {
            let place = ImageSelection::image(at / levels.lights, at % levels.lights);
            jumped(at) || explained.contains(&place)
        });
        findings.extend(image_finding(statistics, &images));
        alarm = alarm.max(worst_view).max(worst_image);
        detail += &format!(", views {:.0} %, images {:.0} %", 100.0 * worst_view, 100.0 * worst_image);
    } else {
        detail += "; views are too sparse to check them and single images";
    }
    Check::done(NAME, detail, alarm, findings)
}

/// Residuals of one light (or view) under all views (or lights).
fn line(levels: &Levels, residuals: &[f64], number: usize, of_light: bool) -> Vec<f64> {
    let place =
        |other: usize| if of_light { other * levels.lights + number } else { number * levels.lights + other };
    (0..if of_light { levels.views } else { levels.lights }).map(|other| residuals[place(other)]).collect()
}

/// Lights (or views) that jump and by how much, and the worst as a share of the alarm.
fn whole(levels: &Levels, residuals: &[f64], of_light: bool) -> (Vec<(usize, f64)>, f64) {
    let count = if of_light { levels.lights } else { levels.views };
    let lines: Vec<Vec<f64>> = (0..count).map(|number| line(levels, residuals, number, of_light)).collect();
    let jumps: Vec<f64> = lines.iter().map(|line| median(line.iter().copied())).collect();
    let threshold = JUMP.max(TIMES * deviation(&jumps));
    let agree = |number: usize| {
        let jump = jumps[number];
        let same = lines[number].iter().filter(|&&residual| residual / jump > 0.5).count();
        same as f64 >= AGREE * lines[number].len() as f64
    };
    let found =
        (0..count).filter(|&n| jumps[n].abs() > threshold && agree(n)).map(|n| (n, jumps[n])).collect();
    (found, jumps.iter().fold(0.0, |worst: f64, jump| worst.max(jump.abs())) / threshold)
}

/// Residuals with what their light (or view) has in common taken away.
fn centred(levels: &Levels, mut residuals: Vec<f64>, of_light: bool) -> Vec<f64> {
    let count = if of_light { levels.lights } else { levels.views };
    let common: Vec<f64> = (0..count).map(|n| median(line(levels, &residuals, n, of_light))).collect();
    for (at, residual) in residuals.iter_mut().enumerate() {
        *residual -= common[if of_light { at % levels.lights } else { at / levels.lights }];
    }
    residuals
}

/// Single images that jump against their neighbours in both directions, and the worst as a share of the alarm.
fn images(
    statistics: &Statistics,
    levels: &Levels,
    residuals: &[Vec<f64>; 2],
    skip: impl Fn(usize) -> bool,
) -> (Vec<(ImageSelection, f64)>, f64) {
    let alike = Alike::new(&statistics.views, &statistics.lights);
    let [by_light, by_view] = residuals.each_ref().map(|residuals| alike.contrast(residuals));
    let partners = partners(statistics);
    let mut worst: f64 = 0.0;
    let mut found = Vec::new();
    for (at, (&(a, spread_a), &(b, spread_b))) in by_light.iter().zip(&by_view).enumerate() {
        let jump = smaller(a, b);
        if skip(at) || jump == 0.0 {
            continue;
        }
        let times = (a.abs() / spread_a.max(FLOOR)).min(b.abs() / spread_b.max(FLOOR));
        let mut share = (jump.abs() / IMAGE_JUMP).min(times / IMAGE_TIMES);
        let (view, light) = (at / levels.lights, at % levels.lights);
        if let (Some(other_view), Some(other_light)) = (partners.view_of[light], partners.light_of[view]) {
            let more = levels.values[at] - levels.values[other_view * levels.lights + other_light];
            // Its partner is as bright: a highlight, not an exposure.
            share = share.min(2.0 * more / jump);
        }
        worst = worst.max(share);
        if share > 1.0 {
            found.push((ImageSelection::image(view, light), jump));
        }
    }
    found.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    (found, worst)
}

/// The light with the direction of each view, the view with that of each light.
struct Partners {
    light_of: Vec<Option<usize>>,
    view_of: Vec<Option<usize>>,
}

fn partners(statistics: &Statistics) -> Partners {
    let (views, lights) = (&statistics.views, &statistics.lights);
    let within = |a, b| angle(a, b) < RECIPROCAL_DEG.to_radians();
    Partners {
        light_of: views.iter().map(|&view| lights.iter().position(|&light| within(view, light))).collect(),
        view_of: lights.iter().map(|&light| views.iter().position(|&view| within(view, light))).collect(),
    }
}

fn whole_finding(
    statistics: &Statistics,
    code: &'static str,
    jumps: &[(usize, f64)],
    place: fn(usize) -> ImageSelection,
) -> Option<Finding> {
    let places: Vec<(ImageSelection, f64)> =
        jumps.iter().map(|&(number, jump)| (place(number), jump.exp())).collect();
    let largest = jumps.iter().map(|(_, jump)| jump.abs()).fold(0.0, f64::max);
    finding(statistics, code, &places, largest / JUMP)
}

fn image_finding(statistics: &Statistics, jumps: &[(ImageSelection, f64)]) -> Option<Finding> {
    let places: Vec<(ImageSelection, f64)> = jumps.iter().map(|&(place, jump)| (place, jump.exp())).collect();
    let largest = jumps.iter().map(|(_, jump)| jump.abs()).fold(0.0, f64::max);
    finding(statistics, "image-exposure", &places, largest / IMAGE_JUMP)
}

fn finding(
    statistics: &Statistics,
    code: &'static str,
    factors: &[(ImageSelection, f64)],
    times: f64,
) -> Option<Finding> {
    let (_, first) = factors.first()?;
    let places: Vec<ImageSelection> = factors.iter().map(|(place, _)| *place).collect();
    Some(Finding {
        code,
        severity: Severity::Fault,
        confidence: confidence(times),
        message: format!(
            "exposure jumps ({} of {} times what neighbours promise): {}",
            if places.len() == 1 { "one" } else { "the first" },
            round(*first, 2),
            names(&places, statistics)
        ),
        evidence: json!({"factor": listed(factors)}),
        repair: None,
        directions: places,
    })
}

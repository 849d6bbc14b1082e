//! Is the light what it is said to be? Helmholtz reciprocity tells.
//!
//! The apparent BRDF of a whole plane, shadows, masking and interreflections and all, is reciprocal:
//! f(v, i) = f(i, v). Samples hold f cos(theta_i), so the means of an image and of the one with light and view
//! exchanged obey
//!
//! ```text
//! ln R(v, i) / R(i, v) = k ln cos(theta_i) / cos(theta_v),   k = 1
//! ```
//!
//! whatever the material. A transfer curve undone once too often makes k larger than 1, one not undone makes it smaller, a cosine
//! divided out makes it 0, light and view exchanged make it -1. Means read by other curves say which it is.
//!
//! Elevations that are taken for polar angles make the exponent anything, often about -1 or 0. They are told from the
//! other faults by how well the pairs agree: where the angles are read as they are meant, each pair has the exponent 1.

use serde_json::json;

use super::angular::interpolation;
use super::finding::{Check, Finding, Severity, confidence, round};
use super::statistics::{DECLARED, READINGS, Statistics, deviation, median};
use crate::archive::directions::of_elevation;
use crate::color::Transfer;
use crate::store::measurement::Side;
use btfkit_formats::Direction;

/// Name of the check.
pub const NAME: &str = "radiometry";

/// A light this near to a view has its direction; else its neighbours are interpolated.
const SAME_DEG: f64 = 1.5;

/// Lights farther from a view's direction than this do not tell what one there would show.
const REACH_DEG: f64 = 20.0;

/// Pairs must differ in the logarithm of their cosines by this much, 5 degrees against 45 do by 0.35.
const LEAST_DIFFERENCE: f64 = 0.1;

/// Fewer pairs than this say nothing.
const LEAST_PAIRS: usize = 15;

/// How far the exponent of a good measurement may be from 1.
const TOLERANCE: f64 = 0.2;

/// Another reading is taken for the right one if its exponent is at least this many times nearer to 1.
const NEARER: f64 = 1.5;

/// Exponents up to this far from 0 mean that the cosine is not in the samples.
const NO_COSINE: f64 = 0.25;

/// Exponents below mean that light and view are exchanged.
const EXCHANGED: f64 = -0.4;

/// Images with a larger share of samples at the largest value do not count: clipping flattens them.
const CLIPPED: f64 = 0.02;

/// Angles are elevations if the pairs then differ from what they should be by so many times less than under the best
/// other reading; where the exponent is right as it is, by so many times.
const CLEARER: f64 = 1.3;
const MUCH_CLEARER: f64 = 2.5;

/// Exponents of one view's fall-off that no material has unless its lights' angles are elevations: bounds of that
/// of the cosine of the angle given, and of its sine.
const RISING: f64 = -0.3;
const AS_ELEVATION: (f64, f64) = (0.6, 1.6);

/// Lights of one view must differ in the logarithm of their cosines and sines by this much.
const LEAST_SPREAD: f64 = 0.2;

/// An exponent k and what it rests on.
struct Exponents {
    by_reading: [f64; READINGS],
    pairs: usize,
    /// Deviation of the pairs from the declared reading's line.
    scatter: f64,
    /// Exponent of each pair by all readings, and how far its cosines differ.
    of_pairs: Vec<(f64, [f64; READINGS])>,
}

impl Exponents {
    /// How far the pairs are from an exponent by a reading of the curve: median, natural logarithm of brightness.
    fn misfit(&self, reading: usize, expected: f64) -> f64 {
        median(self.of_pairs.iter().map(|(weight, k)| (k[reading] - expected).abs() * weight))
    }
}

/// Looks at curve, cosine, and which of two directions is the light.
pub fn check(statistics: &Statistics) -> Check {
    let (views, lights) = (&statistics.views, &statistics.lights);
    let Some(exponents) = exponents(statistics, views, lights) else {
        if let Some(finding) = fall_off(statistics) {
            return Check::done(NAME, "brightness of one view under all lights", 1.0, vec![finding]);
        }
        return Check::not_checked(
            NAME,
            format!(
                "fewer than {LEAST_PAIRS} pairs of images with light and view exchanged; \
                 the fall-off of one direction alone depends on the material"
            ),
        );
    };
    let k = exponents.by_reading[DECLARED];
    let alarm = (k - 1.0).abs() / TOLERANCE;
    let detail = format!(
        "exponent of the light's cosine {k:.2} (expected 1 +- {TOLERANCE}) by {} reciprocal pairs",
        exponents.pairs
    );
    let findings = match elevations(statistics, &exponents, alarm > 1.0) {
        Some(found) => vec![found],
        None if alarm > 1.0 => vec![finding(statistics, &exponents)],
        None => Vec::new(),
    };
    Check::done(NAME, detail, alarm, findings)
}

/// The code, the words and the repair of elevations that were taken for polar angles.
fn of_side(side: Side) -> (&'static str, &'static str, &'static str) {
    match side {
        Side::Both => ("elevations", "lights and views", "--polar elevation"),
        Side::Lights => ("light-elevations", "lights", "--polar elevation-lights"),
        Side::Views => ("view-elevations", "views", "--polar elevation-views"),
    }
}

/// Whether the angles of lights, views or both are elevations, if the pairs say so.
fn elevations(statistics: &Statistics, as_given: &Exponents, wrong: bool) -> Option<Finding> {
    let (views, lights) = (&statistics.views, &statistics.lights);
    let read = |list: &[Direction]| list.iter().copied().map(of_elevation).collect::<Vec<_>>();
    let (low_views, low_lights) = (read(views), read(lights));
    let others = [
        (Side::Both, exponents(statistics, &low_views, &low_lights)),
        (Side::Lights, exponents(statistics, views, &low_lights)),
        (Side::Views, exponents(statistics, &low_views, lights)),
    ];
    // What else may be wrong: the curve, the cosine, or which is the light.
    let given = (0..READINGS)
        .map(|reading| (reading, 1.0))
        .chain([(DECLARED, 0.0), (DECLARED, -1.0)])
        .map(|(reading, expected)| as_given.misfit(reading, expected))
        .fold(f64::INFINITY, f64::min);
    let fitting = others.into_iter().filter_map(|(side, found)| {
        let found = found?;
        let k = found.by_reading[DECLARED];
        ((k - 1.0).abs() <= TOLERANCE).then(|| (found.misfit(DECLARED, 1.0), side, found))
    });
    let (misfit, side, found) = fitting.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let needed = if wrong { CLEARER } else { MUCH_CLEARER };
    let clearer = given / misfit.max(1e-6);
    if clearer < needed {
        return None;
    }
    let (code, whose, repair) = of_side(side);
    Some(Finding {
        code,
        severity: Severity::Fault,
        confidence: confidence(2.0 * clearer / needed),
        message: format!(
            "images of exchanged light and view differ as they should if the angles of the {whose} are elevations, \
             90 degrees from above, and not polar angles, 0 degrees from above"
        ),
        evidence: json!({
            "exponent": round(as_given.by_reading[DECLARED], 3),
            "exponent_of_elevations": round(found.by_reading[DECLARED], 3),
            "misfit": round(given, 4),
            "misfit_of_elevations": round(misfit, 4),
            "reciprocal_pairs": found.pairs,
        }),
        repair: Some(repair.to_owned()),
        directions: Vec::new(),
    })
}

/// Whether the frontal view grows brighter the lower its lights are said to be, in the proportion of the sine: a
/// suspicion, as one view alone has only its material to speak for it.
fn fall_off(statistics: &Statistics) -> Option<Finding> {
    let levels: Vec<(Direction, f64)> = (0..statistics.lights.len())
        .filter(|&light| !statistics.is_black(statistics.frontal, light))
        .filter(|&light| statistics.clipped_share(statistics.frontal, light) <= CLIPPED)
        .map(|light| (statistics.lights[light], statistics.image(statistics.frontal, light).means[DECLARED]))
        .filter(|(direction, mean)| *mean > 0.0 && (0.02..1.55).contains(&direction.theta_rad))
        .map(|(direction, mean)| (direction, mean.ln()))
        .collect();
    let slope = |of: fn(f64) -> f64| {
        let count = levels.len() as f64;
        let mean = levels.iter().map(|(d, _)| of(d.theta_rad).ln()).sum::<f64>() / count;
        let level = levels.iter().map(|(_, level)| level).sum::<f64>() / count;
        let x = |d: &Direction| of(d.theta_rad).ln() - mean;
        let square = levels.iter().map(|(d, _)| x(d).powi(2)).sum::<f64>();
        let along = levels.iter().map(|(d, value)| x(d) * (value - level)).sum::<f64>();
        ((square / count).sqrt() >= LEAST_SPREAD).then_some(along / square)
    };
    let is_frontal = statistics.views[statistics.frontal].theta_rad <= REACH_DEG.to_radians();
    if levels.len() < LEAST_PAIRS || !is_frontal {
        return None;
    }
    let (of_cosine, of_sine) = (slope(f64::cos)?, slope(f64::sin)?);
    if of_cosine > RISING || !(AS_ELEVATION.0..=AS_ELEVATION.1).contains(&of_sine) {
        return None;
    }
    let (code, _, repair) = of_side(Side::Lights);
    Some(Finding {
        code,
        severity: Severity::Suspicion,
        confidence: confidence(of_cosine / RISING),
        message: "the view grows brighter the farther its lights are said to be from the normal: their angles may be \
                  elevations, 90 degrees from above, and not polar angles, 0 degrees from above"
            .to_owned(),
        evidence: json!({
            "exponent_of_cosine": round(of_cosine, 3),
            "exponent_of_sine": round(of_sine, 3),
            "lights": levels.len(),
        }),
        repair: Some(repair.to_owned()),
        directions: Vec::new(),
    })
}

/// The exponents, if enough images have a reciprocal partner and directions are these.
fn exponents(statistics: &Statistics, views: &[Direction], lights: &[Direction]) -> Option<Exponents> {
    let levels = Levels::new(statistics, lights);
    // What lights in the views' own directions would show, from the lights there are.
    let as_light: Vec<Option<Vec<(usize, f64)>>> = views
        .iter()
        .map(|&view| interpolation(lights, view, SAME_DEG.to_radians(), REACH_DEG.to_radians()))
        .collect();
    let mut pairs = Vec::new();
    for a in 0..views.len() {
        for b in 0..a {
            let (Some(light_a), Some(light_b)) = (&as_light[a], &as_light[b]) else { continue };
            let x = (cosine(views[b]) / cosine(views[a])).ln();
            if x.abs() < LEAST_DIFFERENCE {
                continue;
            }
            if let (Some(first), Some(second)) = (levels.at(a, light_b), levels.at(b, light_a)) {
                let k: [f64; READINGS] =
                    std::array::from_fn(|reading| 1.0 + (first[reading] - second[reading]) / x);
                pairs.push((x.abs(), k));
            }
        }
    }
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let by_reading = std::array::from_fn(|reading| {
        weighted_median(pairs.iter().map(|(weight, k)| (k[reading], *weight)).collect())
    });
    let residuals: Vec<f64> =
        pairs.iter().map(|(weight, k)| (k[DECLARED] - by_reading[DECLARED]) * weight).collect();
    Some(Exponents { by_reading, pairs: pairs.len(), scatter: deviation(&residuals), of_pairs: pairs })
}

fn cosine(direction: Direction) -> f64 {
    direction.theta_rad.cos().max(1e-3)
}

/// Logarithms of the means of all images by all readings, the light's cosine divided out: smooth in angle.
struct Levels {
    /// Nothing for images that are black or clipped.
    values: Vec<Option<[f64; READINGS]>>,
    lights: usize,
}

impl Levels {
    fn new(statistics: &Statistics, directions: &[Direction]) -> Self {
        let lights = directions.len();
        let level = |at: usize| {
            let (view, light) = (at / lights, at % lights);
            let means = statistics.images[at].means;
            let usable = !statistics.is_black(view, light)
                && statistics.clipped_share(view, light) <= CLIPPED
                && means.iter().all(|mean| *mean > 0.0);
            usable.then(|| means.map(|mean| (mean / cosine(directions[light])).ln()))
        };
        Self { values: (0..statistics.images.len()).map(level).collect(), lights }
    }

    /// Under a view, for weighted lights.
    fn at(&self, view: usize, light: &[(usize, f64)]) -> Option<[f64; READINGS]> {
        let mut sum = [0.0; READINGS];
        for &(light, weight) in light {
            let values = self.values[view * self.lights + light]?;
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
        Some(sum)
    }
}

/// The value with half of the weight at either side: exposures that jump move it little.
fn weighted_median(mut values: Vec<(f64, f64)>) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    for (value, weight) in values {
        sum += weight;
        if sum >= half {
            return value;
        }
    }
    0.0
}

fn finding(statistics: &Statistics, exponents: &Exponents) -> Finding {
    let [fewer, k, more] = exponents.by_reading;
    let off = (k - 1.0).abs();
    let nearer = |other: f64| off >= NEARER * (other - 1.0).abs() && (other - 1.0).abs() < 1.5 * TOLERANCE;
    let sure = confidence(off / TOLERANCE);
    let (code, severity, message, repair) = if k < EXCHANGED {
        (
            "light-view-swapped",
            Severity::Fault,
            "images darken with the angle of what is called the view, as they should with the light's: light and view \
             are exchanged"
                .to_owned(),
            Some("--swap"),
        )
    } else if k.abs() <= NO_COSINE {
        (
            "cosine-excluded",
            Severity::Fault,
            "images with light and view exchanged are equally bright: the cosine of the light angle has been divided \
             out of the samples"
                .to_owned(),
            Some("--cosine excluded"),
        )
    } else if k > 1.0 && nearer(fewer) {
        match statistics.transfer {
            Transfer::Srgb => (
                "decoded-needlessly",
                Severity::Fault,
                "samples fall off as light does if they are taken as linear, too fast if the sRGB curve is undone: \
                 they are linear already"
                    .to_owned(),
                Some("--transfer linear"),
            ),
            Transfer::Linear => (
                "decoded-twice",
                Severity::Fault,
                "linear samples fall off too fast, as if the sRGB curve had been undone twice".to_owned(),
                None,
            ),
        }
    } else if k < 1.0 && nearer(more) {
        match statistics.transfer {
            Transfer::Linear => (
                "not-decoded",
                Severity::Fault,
                "samples said to be linear fall off as light does only once the sRGB curve is undone"
                    .to_owned(),
                Some("--transfer srgb"),
            ),
            Transfer::Srgb => (
                "encoded-twice",
                Severity::Fault,
                "samples fall off as light does only if the sRGB curve is undone twice: it was applied twice"
                    .to_owned(),
                None,
            ),
        }
    } else {
        (
            "radiometry-unclear",
            Severity::Suspicion,
            "brightness does not follow the cosine of the light angle under any known transfer curve"
                .to_owned(),
            None,
        )
    };
    Finding {
        code,
        severity,
        confidence: sure,
        message,
        evidence: json!({
            "exponent": round(k, 3),
            "expected": [1.0 - TOLERANCE, 1.0 + TOLERANCE],
            "exponent_one_decoding_fewer": round(fewer, 3),
            "exponent_one_decoding_more": round(more, 3),
            "reciprocal_pairs": exponents.pairs,
            "scatter": round(exponents.scatter, 3),
        }),
        repair: repair.map(str::to_owned),
        directions: Vec::new(),
    }
}

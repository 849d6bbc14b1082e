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

use serde_json::json;

use super::angular::interpolation;
use super::finding::{Check, Finding, Severity, confidence, round};
use super::statistics::{DECLARED, READINGS, Statistics, deviation};
use crate::color::Transfer;
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

/// An exponent k and what it rests on.
struct Exponents {
    by_reading: [f64; READINGS],
    pairs: usize,
    /// Deviation of the pairs from the declared reading's line.
    scatter: f64,
}

/// Looks at curve, cosine, and which of two directions is the light.
pub fn check(statistics: &Statistics) -> Check {
    let Some(exponents) = exponents(statistics) else {
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
    let findings = if alarm <= 1.0 { Vec::new() } else { vec![finding(statistics, &exponents)] };
    Check::done(NAME, detail, alarm, findings)
}

/// The exponents, if enough images have a reciprocal partner.
fn exponents(statistics: &Statistics) -> Option<Exponents> {
    let (views, lights) = (&statistics.views, &statistics.lights);
    let levels = Levels::new(statistics);
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
    Some(Exponents { by_reading, pairs: pairs.len(), scatter: deviation(&residuals) })
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
    fn new(statistics: &Statistics) -> Self {
        let lights = statistics.lights.len();
        let level = |at: usize| {
            let (view, light) = (at / lights, at % lights);
            let means = statistics.images[at].means;
            let usable = !statistics.is_black(view, light)
                && statistics.clipped_share(view, light) <= CLIPPED
                && means.iter().all(|mean| *mean > 0.0);
            usable.then(|| means.map(|mean| (mean / cosine(statistics.lights[light])).ln()))
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

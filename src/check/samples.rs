//! Samples that cannot be: not finite, negative, none at all, or more than the sensor holds.

use serde_json::json;

use super::finding::{Check, Finding, ImageSelection, Severity, confidence, listed, names, round};
use super::statistics::Statistics;
use crate::words::counted;

/// Name of the check of impossible numbers.
pub(crate) const NUMBERS: &str = "numbers";
/// Name of the check for images on which nothing is.
pub(crate) const BLACK: &str = "black-images";
/// Name of the check for images that are of one brightness.
pub(crate) const CONTRAST: &str = "contrast";
/// Name of the check for clipping.
pub(crate) const SATURATION: &str = "saturation";

/// Negative samples below this, in reflectance, are not the noise of a dark frame taken off.
const NOISE: f32 = -0.02;

/// Share of negative samples that is a fault even if they are small.
const MANY_NEGATIVE: f64 = 0.02;

/// Share of all samples at the largest value that is suspicious, and that is a fault.
const CLIPPED: (f64, f64) = (0.01, 0.04);

/// Share of the images that must be clipped so: a few highlights may fill theirs.
const CLIPPED_IMAGES: f64 = 0.1;

/// Fewer equal largest samples of floats are no sign of clipping.
const LEAST_CLIPPED: u64 = 16;

fn places(statistics: &Statistics) -> impl Iterator<Item = (usize, usize)> {
    let lights = statistics.lights.len();
    (0..statistics.views.len()).flat_map(move |view| (0..lights).map(move |light| (view, light)))
}

/// Images for which `value` is above 0, the largest values first.
fn ranked(statistics: &Statistics, value: impl Fn(usize, usize) -> f64) -> Vec<(ImageSelection, f64)> {
    let mut found: Vec<(ImageSelection, f64)> = places(statistics)
        .map(|(view, light)| (ImageSelection::image(view, light), value(view, light)))
        .filter(|(_, value)| *value > 0.0)
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found
}

fn only(ranked: &[(ImageSelection, f64)]) -> Vec<ImageSelection> {
    ranked.iter().map(|(place, _)| *place).collect()
}

/// Looks for NaN, infinities and negative values.
pub fn numbers(statistics: &Statistics) -> Check {
    let mut findings = Vec::new();
    let bad = ranked(statistics, |view, light| statistics.image(view, light).not_finite as f64);
    if !bad.is_empty() {
        let count: u64 = statistics.images.iter().map(|image| image.not_finite).sum();
        findings.push(Finding {
            code: "not-finite",
            severity: Severity::Fault,
            confidence: 1.0,
            message: format!(
                "{} NaN or infinite, in {}",
                counted(count, "sample"),
                names(&only(&bad), statistics)
            ),
            evidence: json!({"samples": count, "images": listed(&bad)}),
            repair: None,
            directions: only(&bad),
        });
    }
    let negative = ranked(statistics, |view, light| statistics.image(view, light).negative as f64);
    let count: u64 = statistics.images.iter().map(|image| image.negative).sum();
    let share = count as f64 / (statistics.samples * statistics.images.len() as u64).max(1) as f64;
    let least = statistics.images.iter().map(|image| image.least).fold(0.0, f32::min);
    let times = f64::from(least / NOISE).max(share / MANY_NEGATIVE);
    if !negative.is_empty() {
        findings.push(Finding {
            code: "negative",
            severity: if times > 1.0 { Severity::Fault } else { Severity::Note },
            confidence: if times > 1.0 { confidence(times) } else { 1.0 },
            message: format!(
                "{} ({:.3} %) below zero, down to {least}, in {}",
                counted(count, "sample"),
                100.0 * share,
                names(&only(&negative), statistics)
            ),
            evidence: json!({"samples": count, "share": round(share, 6), "least": least, "images": listed(&negative)}),
            repair: None,
            directions: only(&negative),
        });
    }
    let detail = if count > 0 {
        format!("{} below zero, the least {least}", counted(count, "sample"))
    } else {
        String::new()
    };
    Check::done(NUMBERS, detail, times, findings)
}

/// Looks for images on which nothing was photographed.
pub fn black(statistics: &Statistics) -> Check {
    let found: Vec<ImageSelection> = places(statistics)
        .filter(|&(view, light)| statistics.is_black(view, light))
        .map(|(view, light)| ImageSelection::image(view, light))
        .collect();
    let darkest = statistics.darkest();
    let alarm = super::statistics::BLACK / darkest.max(1e-9);
    let detail = format!("the darkest image has {:.1} % of the light of its like", 100.0 * darkest);
    if found.is_empty() {
        return Check::done(BLACK, detail, alarm, Vec::new());
    }
    let values: Vec<(ImageSelection, f64)> = found
        .iter()
        .map(|&place| (place, statistics.image(place.view.unwrap_or(0), place.light.unwrap_or(0)).mean))
        .collect();
    let whole_view = (0..statistics.views.len())
        .find(|&view| (0..statistics.lights.len()).all(|light| statistics.is_black(view, light)));
    let finding = Finding {
        code: "black-image",
        severity: Severity::Fault,
        confidence: confidence(alarm),
        message: format!("{} black: {}", counted(found.len(), "image"), names(&found, statistics)),
        evidence: json!({"mean": listed(&values)}),
        repair: whole_view.map(|view| format!("--drop-view {view}")),
        directions: found,
    };
    Check::done(BLACK, detail, alarm, vec![finding])
}

/// Looks for images on which nothing is to be seen, though they need not be black. Of a measurement that is `saturated`
/// images that are clipped are told already.
pub fn contrast(statistics: &Statistics, saturated: bool) -> Check {
    let plain: Vec<ImageSelection> = places(statistics)
        .filter(|&(view, light)| statistics.is_plain(view, light))
        .map(|(view, light)| ImageSelection::image(view, light))
        .collect();
    let all = statistics.images.len();
    let nothing = plain.len() == all;
    // Single ones that are black, or among many that are clipped, are told as such.
    let is_told = |place: &ImageSelection| {
        let (view, light) = (place.view.unwrap_or(0), place.light.unwrap_or(0));
        statistics.is_black(view, light) || (saturated && statistics.clipped_share(view, light) > CLIPPED.0)
    };
    let plain: Vec<ImageSelection> = plain.into_iter().filter(|place| nothing || !is_told(place)).collect();
    let share = plain.len() as f64 / all.max(1) as f64;
    let detail = format!("{} of {} of one brightness throughout", plain.len(), counted(all, "image"));
    if plain.is_empty() {
        return Check::done(CONTRAST, detail, 0.0, Vec::new());
    }
    let message = if nothing {
        "no image shows anything: each is of one brightness throughout".to_owned()
    } else {
        format!(
            "{} of one brightness throughout: {}",
            counted(plain.len(), "image"),
            names(&plain, statistics)
        )
    };
    let values: Vec<(ImageSelection, f64)> = plain
        .iter()
        .map(|&place| (place, statistics.image(place.view.unwrap_or(0), place.light.unwrap_or(0)).mean))
        .collect();
    let finding = Finding {
        code: if nothing { "no-contrast" } else { "plain-image" },
        severity: if nothing { Severity::Fault } else { Severity::Suspicion },
        confidence: 1.0,
        message,
        evidence: json!({"share": round(share, 5), "mean": listed(&values)}),
        repair: None,
        directions: plain,
    };
    Check::done(CONTRAST, detail, 1.0, vec![finding])
}

/// Looks for samples at the largest value.
pub(crate) fn saturation(statistics: &Statistics) -> Check {
    let of_image = ranked(statistics, |view, light| statistics.clipped_share(view, light));
    let share =
        of_image.iter().fold(0.0, |sum, (_, share)| sum + share) / statistics.images.len().max(1) as f64;
    let count = share * statistics.samples as f64 * statistics.images.len() as f64;
    let worst = of_image.first().map_or(0.0, |(_, share)| *share);
    let detail = format!(
        "{:.2} % of all samples at the largest value, {:.0} % of the worst image",
        100.0 * share,
        100.0 * worst
    );
    let clipped = of_image.iter().filter(|(_, share)| *share > CLIPPED.0).count();
    let clipped = clipped as f64 / statistics.images.len().max(1) as f64;
    let alarm = (share / CLIPPED.0).min(clipped / CLIPPED_IMAGES);
    if alarm <= 1.0 || count < LEAST_CLIPPED as f64 {
        return Check::done(SATURATION, detail, alarm, Vec::new());
    }
    let severity = if share > CLIPPED.1 { Severity::Fault } else { Severity::Suspicion };
    let many: Vec<(ImageSelection, f64)> =
        of_image.into_iter().filter(|(_, share)| *share > CLIPPED.0).collect();
    let mean = |lights: bool| -> Vec<f64> {
        let (outer, inner) = if lights {
            (statistics.lights.len(), statistics.views.len())
        } else {
            (statistics.views.len(), statistics.lights.len())
        };
        let share = |a: usize, b: usize| {
            if lights { statistics.clipped_share(b, a) } else { statistics.clipped_share(a, b) }
        };
        (0..outer).map(|a| round((0..inner).map(|b| share(a, b)).sum::<f64>() / inner as f64, 4)).collect()
    };
    let finding = Finding {
        code: "saturated",
        severity,
        confidence: confidence(alarm),
        message: format!(
            "{:.1} % of all samples are at the largest value {}: highlights are cut off, mostly in {}",
            100.0 * share,
            statistics.largest,
            names(&only(&many), statistics)
        ),
        evidence: json!({
            "share": round(share, 5), "largest": statistics.largest,
            "by_view": mean(false), "by_light": mean(true), "images": listed(&many),
        }),
        repair: None,
        directions: only(&many),
    };
    Check::done(SATURATION, detail, alarm, vec![finding])
}

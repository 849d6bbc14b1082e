//! One photograph under two names.
//!
//! Two photographs never have the same samples: the sensor's noise sees to that. Nearly the same thumbnails mean one
//! photograph stored twice with another compression, but images with light and view exchanged may come near to it on a
//! flat material (reciprocity), so that they are not looked at.

use std::collections::{BTreeMap, HashMap};

use serde_json::json;

use super::angular::angle;
use super::finding::{Check, Finding, ImageSelection, Severity, confidence, round};
use super::statistics::Statistics;
use crate::words::counted;
use btfkit_formats::Direction;

/// Name of the check.
pub(crate) const NAME: &str = "duplicate-images";

/// Directions nearer than this are one direction, degrees.
const SAME_DEG: f64 = 0.5;

/// Pairs of directions that are nearly each other's exchange, degrees.
const RECIPROCAL_DEG: f64 = 3.0;

/// Root mean square difference of thumbnails, relative to their mean, below which images are one photograph.
const NEARLY: f64 = 0.002;

/// Thumbnails with less contrast than this are too plain to be told apart.
const PLAIN: f64 = 0.02;

/// Images of which more is clipped may be equal for that.
const CLIPPED: f64 = 0.5;

/// An image, what it is compared by, and its directions.
struct Candidate<'a> {
    place: (usize, usize),
    view: Direction,
    light: Direction,
    hash: u64,
    mean: f64,
    thumbnail: &'a [f32],
}

/// Looks for equal and nearly equal images of different directions.
pub(crate) fn check(statistics: &Statistics) -> Check {
    let lights = statistics.lights.len();
    let mut candidates: Vec<Candidate<'_>> = (0..statistics.images.len())
        .map(|at| (at / lights, at % lights))
        .filter(|&(view, light)| {
            !statistics.is_black(view, light)
                && !statistics.is_plain(view, light)
                && statistics.clipped_share(view, light) < CLIPPED
        })
        .map(|(view, light)| {
            let image = statistics.image(view, light);
            Candidate {
                place: (view, light),
                view: statistics.views[view],
                light: statistics.lights[light],
                hash: image.hash,
                mean: image.thumbnail.iter().map(|&v| f64::from(v)).sum::<f64>()
                    / image.thumbnail.len().max(1) as f64,
                thumbnail: &image.thumbnail,
            }
        })
        .collect();
    if candidates.len() < 2 {
        let found = counted(candidates.len(), "image");
        return Check::not_checked(
            NAME,
            format!("{found} that can be compared (black, plain or clipped ones cannot)"),
        );
    }
    let equal = equal(&candidates);
    candidates.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    let (least, near) = nearly_equal(&candidates);
    let near: Vec<_> = near
        .into_iter()
        .filter(|pair| !equal.iter().any(|group| group.contains(&pair.0) && group.contains(&pair.1)))
        .collect();
    let mut findings = Vec::new();
    if !equal.is_empty() {
        let places: Vec<ImageSelection> =
            equal.iter().flatten().map(|&(view, light)| ImageSelection::image(view, light)).collect();
        findings.push(Finding {
            code: "duplicate-image",
            severity: Severity::Fault,
            confidence: 1.0,
            message: format!(
                "images of different directions are equal in every sample: {}",
                grouped(
                    equal.iter().flat_map(|group| group[1..].iter().map(|&other| [group[0], other])),
                    statistics
                )
            ),
            evidence: json!({"groups": equal}),
            repair: None,
            directions: places,
        });
    }
    if !near.is_empty() {
        let places: Vec<ImageSelection> = near
            .iter()
            .flat_map(|(a, b, _)| [a, b])
            .map(|&(view, light)| ImageSelection::image(view, light))
            .collect();
        let pairs: Vec<_> =
            near.iter().map(|(a, b, difference)| json!([a, b, round(*difference, 5)])).collect();
        findings.push(Finding {
            code: "nearly-duplicate-image",
            severity: Severity::Suspicion,
            confidence: confidence(NEARLY / least.max(1e-9)),
            message: format!(
                "images of different directions are nearly equal: {}",
                grouped(near.iter().map(|&(a, b, _)| [a, b]), statistics)
            ),
            evidence: json!({"pairs": pairs, "threshold": NEARLY}),
            repair: None,
            directions: places,
        });
    }
    let (least_percent, nearly) = (100.0 * least, 100.0 * NEARLY);
    let detail = match (equal.iter().map(Vec::len).sum::<usize>(), near.len()) {
        (0, 0) => {
            format!("no two images are nearer than {least_percent:.2} %, nearly equal below {nearly:.2} %")
        }
        (0, pairs) => {
            format!("{pairs} pairs of images of different directions are nearly equal (below {nearly:.2} %)")
        }
        (images, 0) => format!("{images} images of different directions are equal"),
        (images, pairs) => {
            format!(
                "{images} images of different directions are equal, {pairs} pairs nearly (below {nearly:.2} %)"
            )
        }
    };
    Check::done(NAME, detail, NEARLY / least.max(1e-9), findings)
}

/// Groups of images with the same samples under different directions.
fn equal(candidates: &[Candidate<'_>]) -> Vec<Vec<(usize, usize)>> {
    let mut by_hash: HashMap<u64, Vec<&Candidate<'_>>> = HashMap::new();
    for candidate in candidates {
        by_hash.entry(candidate.hash).or_default().push(candidate);
    }
    let mut groups: Vec<Vec<(usize, usize)>> = by_hash
        .into_values()
        .filter(|group| group.iter().any(|other| !same(group[0], other)))
        .map(|group| group.iter().map(|candidate| candidate.place).collect())
        .collect();
    groups.sort();
    groups
}

/// Pairs of images in words: those of two views under one light each are told together, and those of two lights; the
/// largest groups first.
fn grouped(pairs: impl Iterator<Item = [(usize, usize); 2]>, statistics: &Statistics) -> String {
    const NAMED: usize = 6;
    let mut groups: BTreeMap<[ImageSelection; 2], Vec<[(usize, usize); 2]>> = BTreeMap::new();
    for pair in pairs {
        let [a, b] = pair;
        let key = match (a.0 == b.0, a.1 == b.1) {
            (false, true) => [a, b].map(|(view, _)| ImageSelection::view(view)),
            (true, false) => [a, b].map(|(_, light)| ImageSelection::light(light)),
            _ => [a, b].map(|(view, light)| ImageSelection::image(view, light)),
        };
        groups.entry(key).or_default().push(pair);
    }
    let mut groups: Vec<_> = groups.into_iter().collect();
    groups.sort_by_key(|(_, pairs)| std::cmp::Reverse(pairs.len()));
    let told = |key: &[ImageSelection; 2], pairs: &[[(usize, usize); 2]]| {
        let [a, b] = key.map(|place| place.named(statistics));
        let [(view, light), _] = pairs[0];
        let shared = match (key[0], pairs.len()) {
            (ImageSelection { light: None, .. }, 1) => {
                format!(" under {}", ImageSelection::light(light).named(statistics))
            }
            (ImageSelection { view: None, .. }, 1) => {
                format!(" from {}", ImageSelection::view(view).named(statistics))
            }
            (ImageSelection { light: None, .. }, count) => format!(" under {}", counted(count, "light")),
            (ImageSelection { view: None, .. }, count) => format!(" from {}", counted(count, "view")),
            _ => String::new(),
        };
        format!("{a} and {b}{shared}")
    };
    let mut texts: Vec<String> = groups.iter().take(NAMED).map(|(key, pairs)| told(key, pairs)).collect();
    if let Some(left @ [_, ..]) = groups.get(NAMED..) {
        let pairs = left.iter().map(|(_, pairs)| pairs.len()).sum::<usize>();
        texts.push(format!("and {} more", counted(pairs, "pair")));
    }
    texts.join("; ")
}

fn same(a: &Candidate<'_>, b: &Candidate<'_>) -> bool {
    let near = |a, b| angle(a, b) < SAME_DEG.to_radians();
    near(a.view, b.view) && near(a.light, b.light)
}

fn reciprocal(a: &Candidate<'_>, b: &Candidate<'_>) -> bool {
    let near = |a, b| angle(a, b) < RECIPROCAL_DEG.to_radians();
    near(a.view, b.light) && near(a.light, b.view)
}

/// Two images and their difference.
type Pair = ((usize, usize), (usize, usize), f64);

/// The least difference of two images, and those below the threshold. Sorted by mean, few need comparing.
fn nearly_equal(candidates: &[Candidate<'_>]) -> (f64, Vec<Pair>) {
    /// Means of pairs that are compared, relative to each other: beyond it the least difference is not exact.
    const REACH: f64 = 10.0 * NEARLY;
    let mut least = REACH;
    let mut found = Vec::new();
    for (number, a) in candidates.iter().enumerate() {
        if contrast(a.thumbnail, a.mean) < PLAIN {
            continue;
        }
        for b in candidates[number + 1..].iter().take_while(|b| b.mean <= a.mean * (1.0 + REACH)) {
            let difference = difference(a.thumbnail, b.thumbnail, a.mean * REACH) / a.mean;
            if difference < least.max(NEARLY) && !same(a, b) && !reciprocal(a, b) {
                least = least.min(difference);
                if difference < NEARLY {
                    found.push((a.place, b.place, difference));
                }
            }
        }
    }
    (least, found)
}

fn contrast(thumbnail: &[f32], mean: f64) -> f64 {
    let square: f64 = thumbnail.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum();
    (square / thumbnail.len().max(1) as f64).sqrt() / mean.max(f64::MIN_POSITIVE)
}

/// Root mean square difference, infinite where it is beyond `bound`.
fn difference(a: &[f32], b: &[f32], bound: f64) -> f64 {
    let enough = bound * bound * a.len() as f64;
    let mut sum = 0.0;
    for (a, b) in a.chunks(16).zip(b.chunks(16)) {
        sum += a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        if sum > enough {
            return f64::INFINITY;
        }
    }
    (sum / a.len().max(1) as f64).sqrt()
}

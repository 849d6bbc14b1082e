//! Do the views lie on each other?
//!
//! Images are rectified to the plane, so that the mean images of neighbouring views show one texture at one place.
//! Parallax moves what lies above the plane one way and what lies below the other, a view that was rectified badly
//! moves as a whole against all its neighbours.

use rayon::prelude::*;
use serde_json::json;

use super::angular::Neighbourhood;
use super::finding::{Check, Finding, ImageSelection, Severity, apart, confidence, names, round};
use super::plane::{Plane, displacement};
use super::statistics::{Statistics, median};

/// Name of the check.
pub const NAME: &str = "registration";

/// Largest displacement looked for, texels.
const REACH: usize = 6;

/// Least side of the plane, texels.
const LEAST_SIDE: usize = 4 * REACH;

/// Neighbours that each view is laid upon.
const NEIGHBOURS: usize = 5;

/// How many of them must agree, and by how many texels.
const MOST: usize = 3;
const AGREE: f64 = 1.0;

/// Displacement that counts, texels; from this elevation on it grows with the tangent, as parallax does ...
const DISPLACED: f64 = 1.4;
const STEEP_DEG: f64 = 60.0;

/// ... and this many times what views of about that elevation are displaced by ...
const TIMES: f64 = 4.0;

/// ... where views agree with their neighbours at least so well after being moved ...
const CORRELATION: f64 = 0.6;

/// ... and by this much better than before.
const GAIN: f64 = 0.05;

/// Fewer views do not tell which of them is wrong.
const LEAST_VIEWS: usize = 12;

/// Views farther apart than this differ by their parallax, degrees.
const SPACING_DEG: f64 = 38.0;

/// Views count as of about one elevation within this angle, degrees.
const ELEVATION_DEG: f64 = 16.0;

/// How a view lies on its neighbours, texels.
struct Offset {
    down: f64,
    right: f64,
    correlation: f64,
    gain: f64,
}

impl Offset {
    fn length(&self) -> f64 {
        self.down.hypot(self.right)
    }
}

/// Looks for displaced views.
pub fn check(statistics: &Statistics) -> Check {
    let count = statistics.views.len();
    let near = Neighbourhood::new(&statistics.views);
    let spacing_deg = near.spacing_rad.to_degrees();
    if count < LEAST_VIEWS || spacing_deg > SPACING_DEG {
        return Check::not_checked(
            NAME,
            format!(
                "{}, expected at least {LEAST_VIEWS} within {SPACING_DEG}",
                apart(count, "view", spacing_deg)
            ),
        );
    }
    if statistics.window.height.min(statistics.window.width) < LEAST_SIDE {
        return Check::not_checked(
            NAME,
            format!("images of {}, expected at least {LEAST_SIDE} texels a side", statistics.size),
        );
    }
    let pictures: Vec<Plane> = statistics
        .view_means
        .iter()
        .map(|mean| {
            let values = mean.iter().map(|&value| f64::from(value).max(1e-4).ln()).collect();
            Plane::new(statistics.window, values).smoothed().details(6)
        })
        .collect();
    let offsets: Vec<Option<Offset>> =
        (0..count).into_par_iter().map(|view| offset(&pictures, &near, view)).collect();
    let mut worst: f64 = 0.0;
    let mut displaced = Vec::new();
    let mut unclear = 0;
    for (view, offset) in offsets.iter().enumerate() {
        let Some(offset) = offset.as_ref().filter(|offset| offset.correlation >= CORRELATION) else {
            unclear += 1;
            continue;
        };
        let alike = |other: usize| {
            let apart = statistics.views[other].theta_rad - statistics.views[view].theta_rad;
            other != view && apart.abs() < ELEVATION_DEG.to_radians()
        };
        let usual = median(
            (0..count)
                .filter(|&other| alike(other))
                .filter_map(|other| offsets[other].as_ref())
                .map(Offset::length),
        );
        let parallax = statistics.views[view].theta_rad.tan() / STEEP_DEG.to_radians().tan();
        let threshold = (DISPLACED * parallax.max(1.0)).max(TIMES * usual);
        let share = (offset.length() / threshold).min(offset.gain / GAIN);
        worst = worst.max(share);
        if share > 1.0 {
            displaced.push((view, offset, offset.length() / threshold));
        }
    }
    if unclear == count {
        return Check::not_checked(NAME, "no view looks enough like its neighbours to be laid upon them");
    }
    let largest = offsets
        .iter()
        .flatten()
        .filter(|o| o.correlation >= CORRELATION)
        .map(Offset::length)
        .fold(0.0, f64::max);
    let mut detail = format!("views are displaced against their neighbours by {largest:.2} texels at most");
    if unclear > 0 {
        detail += &format!("; {unclear} of {count} views look too different from their neighbours to tell");
    }
    Check::done(NAME, detail, worst, finding(statistics, &displaced).into_iter().collect())
}

/// The median displacement of a view against its neighbours, if most of them agree about it.
fn offset(pictures: &[Plane], near: &Neighbourhood, view: usize) -> Option<Offset> {
    let found: Vec<_> = near
        .of(view)
        .take(NEIGHBOURS)
        .filter_map(|other| displacement(&pictures[view], &pictures[other], REACH))
        .collect();
    let offset = Offset {
        down: median(found.iter().map(|d| d.down)),
        right: median(found.iter().map(|d| d.right)),
        correlation: median(found.iter().map(|d| d.correlation)),
        gain: median(found.iter().map(|d| d.correlation - d.correlation_in_place)),
    };
    let agree = found.iter().filter(|d| (d.down - offset.down).hypot(d.right - offset.right) < AGREE).count();
    (agree >= MOST).then_some(offset)
}

fn finding(statistics: &Statistics, displaced: &[(usize, &Offset, f64)]) -> Option<Finding> {
    let &(first, offset, times) = displaced.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    let places: Vec<ImageSelection> =
        displaced.iter().map(|&(view, ..)| ImageSelection::view(view)).collect();
    let list: Vec<_> = displaced
        .iter()
        .map(|(view, offset, _)| {
            json!({"view": view, "down": round(offset.down, 2), "right": round(offset.right, 2),
                "correlation": round(offset.correlation, 3), "gain": round(offset.gain, 3)})
        })
        .collect();
    Some(Finding {
        code: "view-displaced",
        severity: Severity::Fault,
        confidence: confidence(times),
        message: format!(
            "views lie beside their neighbours, the first {:.1} texels down and {:.1} right: {}",
            offset.down,
            offset.right,
            names(&places, statistics)
        ),
        evidence: json!({"views": list}),
        repair: Some(format!("--drop-view {first}")),
        directions: places,
    })
}

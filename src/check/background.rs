//! Parts of the plane that are black in every image: a backdrop or a mask beside the sample, and no material.

use serde_json::json;

use super::finding::{Check, Finding, Severity, confidence, round};
use super::statistics::Statistics;

/// Name of the check.
pub(crate) const NAME: &str = "background";

/// Mean luminance of a cell of the plane, of white, that a backdrop stays below in every image.
const BLACK: f32 = 0.005;

/// How much brighter than that the brightest cell must be: a material that is dark all over has no backdrop.
const TIMES: f32 = 10.0;

/// Share of the plane that is worth a note.
const MUCH: f64 = 0.25;

/// Looks for cells of the thumbnails that are black in all images.
pub fn check(statistics: &Statistics) -> Check {
    let cells = statistics.images.first().map_or(0, |image| image.thumbnail.len());
    let of_cell = |cell: usize| statistics.images.iter().filter_map(move |image| image.thumbnail.get(cell));
    let brightest: Vec<f32> = (0..cells).map(|cell| of_cell(cell).copied().fold(0.0, f32::max)).collect();
    if brightest.iter().copied().fold(0.0, f32::max) < TIMES * BLACK {
        return Check::not_checked(NAME, "the whole plane is dark in every image");
    }
    let black = brightest.iter().filter(|&&value| value < BLACK).count();
    let share = black as f64 / cells.max(1) as f64;
    let percent = 100.0 * share;
    let mut findings = Vec::new();
    if share >= MUCH {
        findings.push(Finding {
            code: "black-background",
            severity: Severity::Note,
            confidence: confidence(share / MUCH),
            message: format!(
                "{percent:.0} % of the plane is black in every image: a backdrop or a mask, and no material. Tiles and \
                 enlargements would show it: crop the pictures to the material and import them again"
            ),
            evidence: json!({"black_share": round(share, 3)}),
            repair: None,
            directions: Vec::new(),
        });
    }
    let detail = format!("{percent:.0} % of the plane is black in every image");
    Check::done(NAME, detail, share / MUCH, findings)
}

//! What a diagnosis says.

use serde::Serialize;
use serde_json::{Value, json};

use super::statistics::Statistics;
use crate::words::counted;

/// Below this confidence a finding is a suspicion and no fault: a person should look. Evidence of 1.43
/// times its threshold has it.
pub(crate) const SURE: f64 = 0.65;

/// What is shown of an alarm at most: more says no more.
pub const MOST_ALARM: f64 = 10.0;

/// What is shown of it at most where nothing was found.
const BELOW_ALARM: f64 = 0.99;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Something may be wrong; a person should look.
    Suspicion,
    /// The data are wrong, or not what they are said to be.
    Fault,
}

/// The image, or all images of a view or a light, that a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct ImageSelection {
    /// Number of the view; all views if there is none.
    pub view: Option<usize>,
    /// Number of the light; all lights if there is none.
    pub light: Option<usize>,
}

impl ImageSelection {
    /// One image.
    pub fn image(view: usize, light: usize) -> Self {
        Self { view: Some(view), light: Some(light) }
    }

    /// All images of a view.
    pub fn view(view: usize) -> Self {
        Self { view: Some(view), light: None }
    }

    /// All images of a light.
    pub fn light(light: usize) -> Self {
        Self { view: None, light: Some(light) }
    }

    /// With its angles in degrees, for people.
    pub(super) fn named(self, statistics: &Statistics) -> String {
        let angles = |direction: btfkit_formats::Direction| {
            let (theta, phi) = direction.degrees();
            // What rounds to a whole turn is 0.
            format!("({}, {})", round(theta, 1), round(phi, 1) % 360.0)
        };
        let view = self.view.map(|view| format!("view {view} {}", angles(statistics.views[view])));
        let light = self.light.map(|light| format!("light {light} {}", angles(statistics.lights[light])));
        [view, light].into_iter().flatten().collect::<Vec<_>>().join(" ")
    }
}

/// Something found.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// What it is, in kebab case.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// How sure the finding is, 0..1: how far beyond its threshold the evidence lies.
    pub confidence: f64,
    /// For people.
    pub message: String,
    /// The numbers behind it.
    pub evidence: Value,
    /// The option of `btf import` that repairs it, if there is one.
    pub repair: Option<String>,
    /// Where.
    pub directions: Vec<ImageSelection>,
}

/// One question asked of the data and its answer.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Which, in kebab case.
    pub name: &'static str,
    /// How it ended.
    pub state: State,
    /// What was measured, or why nothing was.
    pub detail: String,
    /// The worst value measured as a share of the one that raises the alarm: below 1 where nothing was found, else from
    /// 1 to [`MOST_ALARM`], which stands for all that is more.
    pub alarm: Option<f64>,
    /// What was found.
    pub findings: Vec<Finding>,
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Nothing was found.
    Ok,
    /// Something was.
    Finding,
    /// The data do not tell.
    NotChecked,
}

impl Check {
    /// What was measured, and what was found in it.
    pub(super) fn done(
        name: &'static str,
        detail: impl Into<String>,
        alarm: f64,
        mut findings: Vec<Finding>,
    ) -> Self {
        let found = !findings.is_empty();
        for finding in &mut findings {
            if finding.confidence < SURE {
                finding.severity = finding.severity.min(Severity::Suspicion);
            }
        }
        // A share and its verdict never contradict each other: what is found has at least all of the alarm.
        let alarm = if found { alarm.abs().max(1.0) } else { alarm.abs().min(BELOW_ALARM) };
        let alarm = round(if alarm.is_nan() { f64::from(u8::from(found)) } else { alarm.min(MOST_ALARM) }, 3);
        let state = if found { State::Finding } else { State::Ok };
        Self { name, state, detail: detail.into(), alarm: Some(alarm), findings }
    }

    /// Why the data do not tell.
    pub(super) fn not_checked(name: &'static str, reason: impl Into<String>) -> Self {
        Self { name, state: State::NotChecked, detail: reason.into(), alarm: None, findings: Vec::new() }
    }
}

/// Confidence of evidence that is `times` its threshold: 1/2 at it, towards 1 far beyond.
pub(super) fn confidence(times: f64) -> f64 {
    round(1.0 - 0.5 / times.max(0.5), 3)
}

/// A number with few decimals, for evidence.
pub(super) fn round(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (value * unit).round() / unit
}

/// How many directions there are and how far apart; one alone is apart from nothing.
pub(super) fn apart(count: usize, what: &str, spacing_deg: f64) -> String {
    let counted = counted(count, what);
    if count < 2 { counted } else { format!("{counted} {spacing_deg:.0} degrees apart") }
}

/// The names of places, the first few of them.
pub(super) fn names(places: &[ImageSelection], statistics: &Statistics) -> String {
    const NAMED: usize = 6;
    let mut names: Vec<String> = places.iter().take(NAMED).map(|place| place.named(statistics)).collect();
    if places.len() > NAMED {
        names.push(format!("and {} more", places.len() - NAMED));
    }
    names.join("; ")
}

/// Places and a number of each, as evidence.
pub(super) fn listed(places: &[(ImageSelection, f64)]) -> Value {
    const LISTED: usize = 100;
    places
        .iter()
        .take(LISTED)
        .map(|(place, value)| json!({"view": place.view, "light": place.light, "value": round(*value, 4)}))
        .collect()
}

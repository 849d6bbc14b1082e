//! A doctor for measurements: finds what users of BTF data lose weeks to, before they do.
//!
//! One pass over the views gathers [`statistics`]; each diagnosis is a pure function of them in a file of its
//! own, and says what it found, or how far from its alarm the data are, or why they do not tell.

mod angular;
pub mod archive_views;
pub mod azimuth;
pub mod background;
pub(crate) mod duplicates;
pub mod exposure;
pub mod finding;
pub mod misplaced;
pub mod picture;
mod plane;
pub mod radiometry;
pub mod registration;
mod repair;
pub mod samples;
pub mod source;
pub mod statistics;

use std::collections::HashSet;

use serde::Serialize;

use crate::error::Result;
use crate::run::Context;
pub use finding::{Check, Finding, ImageSelection, Severity, State};
use source::Views;
pub use statistics::Statistics;

/// All checks and their answers.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One a question.
    pub checks: Vec<Check>,
}

impl Report {
    /// All findings.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.checks.iter().flat_map(|check| &check.findings)
    }

    /// The findings that are faults.
    pub fn faults(&self) -> impl Iterator<Item = &Finding> {
        self.findings().filter(|finding| finding.severity == Severity::Fault)
    }
}

/// Reads a source once and examines it; the statistics are handed back for pictures.
///
/// # Errors
/// What the source fails with, or [`crate::ErrorKind::Stopped`].
pub fn run(source: &dyn Views, context: &Context<'_>) -> Result<(Statistics, Report)> {
    let statistics = statistics::gather(source, context)?;
    let report = context.compute(|| examine(&statistics));
    Ok((statistics, report))
}

/// All diagnoses. Images with one fault are not blamed for what follows from it.
pub fn examine(statistics: &Statistics) -> Report {
    let saturation = samples::saturation(statistics);
    let contrast = samples::contrast(statistics, !saturation.findings.is_empty());
    let mut checks = vec![samples::numbers(statistics), samples::black(statistics), contrast];
    let put_off = |names: &[&'static str], reason: &str| -> Vec<Check> {
        names.iter().map(|name| Check::not_checked(name, format!("{reason}: repair that first"))).collect()
    };
    if has_fault(&checks, samples::CONTRAST) {
        let names = [
            background::NAME,
            samples::SATURATION,
            duplicates::NAME,
            radiometry::NAME,
            azimuth::NAME,
            misplaced::NAME,
            exposure::NAME,
            registration::NAME,
        ];
        checks.extend(put_off(&names, "no image shows anything"));
        return Report { checks };
    }
    checks.push(background::check(statistics));
    checks.push(saturation);
    checks.push(duplicates::check(statistics));
    if has_fault(&checks, samples::SATURATION) {
        checks.push(azimuth::check(statistics));
        let names = [radiometry::NAME, misplaced::NAME, exposure::NAME];
        checks.extend(put_off(&names, "clipping flattens the images"));
        checks.push(registration::check(statistics));
        return Report { checks };
    }
    checks.push(radiometry::check(statistics));
    if has_fault(&checks, radiometry::NAME) {
        let names = [azimuth::NAME, misplaced::NAME, exposure::NAME, registration::NAME];
        checks.extend(put_off(&names, "samples are not the light they are said to be"));
        return Report { checks };
    }
    checks.push(azimuth::check(statistics));
    if checks.iter().flat_map(|check| &check.findings).any(|finding| azimuth::APART.contains(&finding.code)) {
        // Which images are alike depends on the azimuth between light and view.
        let names = [misplaced::NAME, exposure::NAME];
        checks.extend(put_off(&names, "azimuths of light and view contradict each other"));
        checks.push(registration::check(statistics));
        return Report { checks };
    }
    let misplaced = misplaced::check(statistics, &explained(&checks, &[samples::BLACK, duplicates::NAME]));
    checks.push(misplaced);
    let names = [samples::BLACK, duplicates::NAME, misplaced::NAME, samples::NUMBERS];
    let exposure = exposure::check(statistics, &explained(&checks, &names));
    checks.push(exposure);
    checks.push(registration::check(statistics));
    Report { checks }
}

/// Whether the check of this name has found a fault.
fn has_fault(checks: &[Check], name: &str) -> bool {
    let of_name = checks.iter().filter(|check| check.name == name);
    of_name.flat_map(|check| &check.findings).any(|finding| finding.severity == Severity::Fault)
}

/// Places that the findings of the named checks are about.
fn explained(checks: &[Check], names: &[&str]) -> HashSet<ImageSelection> {
    checks
        .iter()
        .filter(|check| names.contains(&check.name))
        .flat_map(|check| &check.findings)
        .flat_map(|finding| finding.directions.iter().copied())
        .collect()
}

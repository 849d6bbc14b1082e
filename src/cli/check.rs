use std::path::{Path, PathBuf};

use btfkit::archive::views::ArchiveViews;
use btfkit::error::{Error, Result};
use btfkit::picture::Ending;
use btfkit::run::Context;
use btfkit::stage::check::finding::MOST_ALARM;
use btfkit::stage::check::{self, Finding, Report, State};
use btfkit::stage::import;
use btfkit::store::measurement::Measurement;
use clap::Args;

use super::Tell;
use super::source::SourceArgs;
use super::table::{row, table};

/// Examine a measurement: swapped or mirrored directions, wrong curves, images black, double or misplaced
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf check wood.zarr
  btf check UBO_WOOD256.zip --picture wood.png
  btf check felt.btf --azimuth mirrored             does that repair it?
Exits with 65 if there is a fault. docs/check.md explains every check.")]
pub(super) struct Check {
    /// A measurement, or an archive (in pieces perhaps)
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Write a sheet of what was measured, .png
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Tell all as JSON
    #[arg(long)]
    json: bool,
}

impl Check {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        self.picture.as_deref().map(Ending::of).transpose()?;
        let path = self.paths.first().map_or(Path::new(""), PathBuf::as_path);
        let (statistics, report) =
            if path.join("zarr.json").exists() || path.extension().is_some_and(|e| e == "zarr") {
                check::run(&open(path)?, context)?
            } else {
                let source = self.source.open(&self.paths)?;
                let description = import::describe(source.as_ref(), 1.0);
                check::run(&ArchiveViews::new(source.as_ref(), description), context)?
            };
        if self.json {
            let value = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
            tell.plan(&value)?;
        } else {
            tell_report(&report, tell);
        }
        if let Some(path) = &self.picture {
            let findings: Vec<&Finding> = report.findings().collect();
            check::picture::sheet(&statistics, &findings).write(path, context.existing)?;
        }
        let faults: Vec<&str> = report.faults().map(|fault| fault.code).collect();
        if faults.is_empty() {
            return Ok(());
        }
        Err(Error::input(format!("{}: {}", path.display(), faults.join(", ")))
            .hint("docs/check.md tells how each is recognised and what to do"))
    }
}

/// A measurement that is complete.
fn open(path: &Path) -> Result<Measurement> {
    let measurement = Measurement::open(path)?;
    let (done, views) = (measurement.views_done(), measurement.description().views.len());
    if done < views {
        return Err(Error::missing(format!("{}: {done} of {views} views are there", path.display()))
            .hint("run its import again to the end"));
    }
    Ok(measurement)
}

fn tell_report(report: &Report, tell: Tell) {
    let mut rows = vec![row!["check", "result", "of alarm"]];
    for check in &report.checks {
        let state = match check.state {
            State::Ok => "ok",
            State::Finding => "FINDING",
            State::NotChecked => "not checked",
        };
        let alarm = check.alarm.map_or(String::new(), |alarm| {
            let more = if alarm >= MOST_ALARM { ">" } else { "" };
            format!("{more}{:.0} %", 100.0 * alarm)
        });
        rows.push(row![check.name, state, alarm]);
    }
    // The reasons follow the table as they are: a column for them would be as wide as the longest.
    for (line, check) in table(&rows).lines().zip(std::iter::once(None).chain(report.checks.iter().map(Some)))
    {
        tell.line(format!("{line}  {}", check.map_or("", |check| &check.detail)).trim_end().to_owned());
    }
    for finding in report.findings() {
        let severity = format!("{:?}", finding.severity).to_lowercase();
        tell.line("");
        tell.line(format!("{severity}: {} (confidence {:.2})", finding.code, finding.confidence));
        tell.line(format!("  {}", finding.message));
        tell.line(format!("  evidence: {}", evidence(finding)));
        if let Some(repair) = &finding.repair {
            tell.line(format!("  repair:   btf import ... {repair}"));
        }
    }
}

/// The evidence on one line, cut where lists make it long.
fn evidence(finding: &Finding) -> String {
    const LONGEST: usize = 400;
    let text = finding.evidence.to_string();
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}... (--json tells all)", &text[..end]),
        None => text,
    }
}

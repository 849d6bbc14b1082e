use std::path::{Path, PathBuf};

use btfkit::check::archive_views::ArchiveViews;
use btfkit::check::finding::MOST_ALARM;
use btfkit::check::{self, Finding, Report, State, Statistics};
use btfkit::error::{Error, Result};
use btfkit::picture::Ending;
use btfkit::run::Context;
use btfkit::stage::import;
use btfkit::store::measurement::Measurement;
use clap::Args;
use serde_json::Value;

use super::each::{Ended, Line, Outcome, each};
use super::given::{Given, is_store};
use super::source::SourceArgs;
use super::table::{row, table};
use super::{Console, as_json};

/// Look for mistakes in a measurement: swapped or mirrored directions, a wrong gamma, black, duplicate or misplaced
/// images
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf check wood.zarr
  btf check UBO_WOOD256.zip --picture wood.png
  btf check felt.btf --azimuth mirrored             see whether this option repairs the fault
  btf check archives/*                              one line each, and a count
The exit code is 65 if there is a fault. docs/how-to/check.md explains every check.")]
pub(super) struct Check {
    /// Measurements and archives; if there are several, each gets one line
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// The archives are pieces of one measurement
    #[arg(long)]
    pieces: bool,
    /// Also write one picture with all that was found: .png, .jpg, .webp or .tif
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

impl Check {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<Ended> {
        self.picture.as_deref().map(|path| Ending::of(path, &Ending::DISPLAY)).transpose()?;
        if self.paths.len() > 1 && !self.pieces {
            if self.picture.is_some() {
                return Err(Error::usage(format!("got --picture for {} inputs", self.paths.len()))
                    .hint("check one at a time for a sheet, or say --pieces if they are one measurement"));
            }
            let name = |path: &PathBuf| path.display().to_string();
            return each(&self.paths, name, self.json, context, console, |path| {
                self.one_of_many(path, given, context)
            });
        }
        let Examined { statistics, report, notes } = self.examine(&self.paths, given, context)?;
        if self.json {
            console.plan(&with_notes(&report, &notes)?)?;
        } else {
            // What is a store already is made anew.
            let again = if is_store(first(&self.paths)) { "--force " } else { "" };
            print_report(&report, again, console);
            console.notes(&notes);
        }
        if let Some(path) = &self.picture {
            let findings: Vec<&Finding> = report.findings().collect();
            check::picture::sheet(&statistics, &findings).write(path, context.existing)?;
        }
        faults(first(&self.paths), &report).map_or(Ok(Ended::Done), Err)
    }

    /// Examines one input, which may lie in pieces.
    fn examine(&self, paths: &[PathBuf], given: &Given, context: &Context<'_>) -> Result<Examined> {
        let path = first(paths);
        if is_store(path) {
            given.refuse_for_stores(paths)?;
            let measurement = open(path)?;
            let (statistics, mut report) = check::run(&measurement, context)?;
            let reading = measurement.recipe().how_read().map_err(Error::input)?;
            report.beside(&reading.adaptation);
            return Ok(Examined { statistics, report, notes: Vec::new() });
        }
        let source = self.source.open(paths)?;
        let description = import::describe(source.as_ref(), 1.0);
        let (statistics, mut report) = check::run(&ArchiveViews::new(source.as_ref(), description), context)?;
        report.beside(&source.reading().adaptation);
        Ok(Examined { statistics, report, notes: btfkit::archive::notes(source.as_ref()) })
    }

    fn one_of_many(&self, path: &PathBuf, given: &Given, context: &Context<'_>) -> Result<Outcome> {
        let Examined { report, notes, .. } = self.examine(std::slice::from_ref(path), given, context)?;
        let suspected: Vec<&str> = report.findings().map(|finding| finding.code).collect();
        let line = if self.json {
            Line::Json(with_notes(&report, &notes)?)
        } else {
            let found = match suspected.as_slice() {
                [] => "nothing found".to_owned(),
                list => format!("no fault; noted: {}", list.join(", ")),
            };
            Line::Text(std::iter::once(found).chain(notes).collect::<Vec<_>>().join("; note: "))
        };
        Ok((line, faults(path, &report)))
    }
}

/// What was found out about an input, and what its archive says of itself that a user should know.
struct Examined {
    statistics: Statistics,
    report: Report,
    notes: Vec<String>,
}

/// A report with the notes beside it.
fn with_notes(report: &Report, notes: &[String]) -> Result<Value> {
    let mut value = as_json(report)?;
    if let Some(map) = value.as_object_mut() {
        map.insert("notes".to_owned(), notes.into());
    }
    Ok(value)
}

fn first(paths: &[PathBuf]) -> &Path {
    paths.first().map_or(Path::new(""), PathBuf::as_path)
}

/// The error that tells the faults of an input, where it has any.
fn faults(path: &Path, report: &Report) -> Option<Error> {
    let faults: Vec<&str> = report.faults().map(|fault| fault.code).collect();
    let error =
        (!faults.is_empty()).then(|| Error::input(format!("{}: {}", path.display(), faults.join(", "))))?;
    Some(error.hint("docs/how-to/check.md says what each means and what to do about it"))
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

fn print_report(report: &Report, again: &str, console: Console) {
    let mut rows = vec![row!["check", "result", "of alarm", ""]];
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
        rows.push(row![check.name, state, alarm, check.detail]);
    }
    console.text(&table(&rows));
    for finding in report.findings() {
        let severity = format!("{:?}", finding.severity).to_lowercase();
        console.line("");
        console.line(format!("{severity}: {} (confidence {:.2})", finding.code, finding.confidence));
        console.line(format!("  {}", finding.message));
        console.line(format!("  evidence: {}", evidence(&finding.evidence)));
        if let Some(repair) = &finding.repair {
            console.line(format!("  repair:   btf import ... {again}{repair}"));
        }
    }
}

/// The evidence in words, on one line; of long lists the first few.
fn evidence(value: &Value) -> String {
    const LISTED: usize = 5;
    let words = |name: &str| name.replace('_', " ");
    match value {
        Value::Object(members) => {
            let members = members.iter().filter(|(_, value)| !value.is_null());
            members
                .map(|(name, value)| format!("{} {}", words(name), evidence(value)))
                .collect::<Vec<_>>()
                .join(", ")
        }
        Value::Array(list) => {
            let mut shown: Vec<String> = list.iter().take(LISTED).map(evidence).collect();
            if list.len() > LISTED {
                shown.push(format!("and {} more (--json lists them)", list.len() - LISTED));
            }
            format!("({})", shown.join("; "))
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

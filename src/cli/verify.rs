use std::path::{Path, PathBuf};

use btfkit::error::{Error, ErrorKind, Result};
use btfkit::run::Context;
use btfkit::run::shard::Shard;
use btfkit::stage::verify::{self, Beside, Finding, Found, measurement};
use btfkit::store::measurement::Measurement;
use btfkit::text::escaped;
use btfkit::words::counted;
use clap::Args;

use super::each::{Ended, Line, each};
use super::given::Given;
use super::source::SourceArgs;
use super::table::{row, table};
use super::{Console, as_json};

/// Check that a store is whole and undamaged; with --source, compare a measurement with its archive
#[derive(Args)]
#[command(after_help = "\
Everything is read: every chunk of every array, and all metadata, which must agree with each other.

Examples:
  btf verify wood.zarr
  btf verify wood.zarr --source UBO_WOOD256.zip     sample by sample, read as it was imported
  btf verify wood.model.zarr
  btf verify wood-4k.zarr                           with its model, which lies beside it or is named by --model
  btf verify wood-4k.dzi                            a Deep Zoom pyramid
  btf verify stores/*.zarr                          one line each, and a count
  btf verify wall.zarr --shard 3/8                  the fourth of eight jobs that share the work; all must end with 0
The exit code is 65 if something is damaged or different, and 66 if something is missing.")]
pub(super) struct Verify {
    /// Measurements, models, enlargements and Deep Zoom pyramids (the .dzi or the folder of tiles); if there are
    /// several, each gets one line
    #[arg(required = true, value_name = "STORE")]
    stores: Vec<PathBuf>,
    /// The model of an enlargement [default: where it was when the enlargement was made; else of that name beside it
    /// or in the current folder]
    #[arg(long)]
    model: Option<PathBuf>,
    /// Compare with the archive that the measurement was made of; repeat the option for each piece
    #[arg(long = "source", value_name = "ARCHIVE")]
    archive: Vec<PathBuf>,
    /// Look only at part K of N of the views of a measurement, or of the rows of shards of an enlargement or of tiles of a
    /// pyramid, K from 0, so that N jobs share the work; `env` takes both from the variables of Slurm or MPI
    #[arg(long, value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

impl Verify {
    pub(super) fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<Ended> {
        if self.archive.is_empty() {
            given.refuse_all::<SourceArgs>("without --source: it says how an archive is read", "")?;
        }
        let [store] = self.stores.as_slice() else {
            if !self.archive.is_empty() {
                return Err(Error::usage(format!("got --source for {} stores", self.stores.len()))
                    .hint("compare one store at a time with its archive"));
            }
            let name = |store: &PathBuf| store.display().to_string();
            return each(&self.stores, name, self.json, context, console, |store| {
                let found = self.look(store, context)?;
                let line =
                    if self.json { Line::Json(as_json(&found)?) } else { Line::Text(in_short(&found)) };
                Ok((line, judge(store, &found).err()))
            });
        };
        let found = self.look(store, context)?;
        if self.json {
            console.plan(&as_json(&found)?)?;
        } else {
            console.text(&text_of(&found));
        }
        judge(store, &found).map(|()| Ended::Done)
    }

    /// Looks at one store or pyramid.
    fn look(&self, path: &Path, context: &Context<'_>) -> Result<Found> {
        let source = if self.archive.is_empty() {
            None
        } else {
            let reading = Measurement::open(path)
                .map(|store| store.recipe().how_read().unwrap_or_default())
                .unwrap_or_default();
            Some(self.source.open_as_in(reading, &self.archive)?)
        };
        let model = self.model.clone();
        verify::run(path, &Beside { source: source.as_deref(), model, shard: self.shard }, context)
    }
}

/// What was found of one of many that nothing is wrong with.
fn in_short(found: &Found) -> String {
    let (kind, notes) = match found {
        Found::Measurement { report, .. } => ("measurement", &report.notes),
        Found::Other(report) => (report.kind, &report.notes),
    };
    let notes: String = notes.iter().map(|note| format!("; note: {note}")).collect();
    format!("{kind}, whole and undamaged{notes}")
}

/// What was found, for people.
fn text_of(found: &Found) -> String {
    let (mut text, findings, notes) = match found {
        Found::Measurement { views, report } => {
            (of_measurement(report, *views), &report.findings, &report.notes)
        }
        Found::Other(report) => {
            let mut rows = vec![row!["kind", report.kind]];
            rows.extend(report.checked.iter().map(|(name, what)| row![name, what]));
            (table(&rows), &report.findings, &report.notes)
        }
    };
    for (number, Finding { part, what, todo, missing }) in findings.iter().enumerate() {
        let word = if *missing { "missing" } else { "damaged" };
        text.push_str(&format!("\n{word}: {}: {}", escaped(part), escaped(what)));
        // What is to be done about several that follow each other is said once, and of the last at the very end.
        let next = findings.get(number + 1).map(|next| &next.todo);
        let is_said =
            next == Some(todo) || next.is_none() && findings.first().map(|first| &first.todo) == Some(todo);
        if let Some(todo) = todo.as_ref().filter(|_| !is_said) {
            text.push_str(&format!("\n  {}", escaped(todo)));
        }
    }
    for note in notes {
        text.push_str(&format!("\nnote: {}", escaped(note)));
    }
    if judge(Path::new(""), found).is_ok() {
        text.push_str("\nwhole and undamaged");
    }
    text
}

fn of_measurement(report: &measurement::Report, views: usize) -> String {
    let mut rows = vec![
        row!["kind", "measurement"],
        row!["views", format!("{} of {views}", report.views_found)],
        row!["damaged chunks", report.damaged.len()],
        row!["samples above white", report.samples.clipped],
        row!["samples not finite", report.samples.not_finite],
        row!["samples negative", report.samples.negative],
    ];
    if let Some(different) = report.different {
        rows.push(row!["samples unlike the archive's", different]);
    }
    let mut text = table(&rows);
    for damage in &report.damaged {
        let [y, x] = damage.texel;
        text.push_str(&format!(
            "\ndamaged: {} of view {}, chunk at row {y}, column {x}, in {}: {}",
            damage.array,
            damage.view,
            escaped(&damage.file),
            escaped(&damage.what)
        ));
    }
    for (view, light) in &report.different_images {
        text.push_str(&format!("\ndifferent: view {view}, light {light}"));
    }
    let more = report.images_different.saturating_sub(report.different_images.len());
    if more > 0 {
        text.push_str(&format!("\nand {more} more"));
    }
    text
}

/// The error that a report amounts to, if it does.
fn judge(store: &Path, found: &Found) -> Result<()> {
    let store = store.display();
    let findings = match found {
        Found::Measurement { report, .. } => {
            if !report.damaged.is_empty() {
                let error =
                    Error::input(format!("{store}: {}", counted(report.damaged.len(), "damaged chunk")));
                let advice = "delete the files named and import again, if you have the archive: only their views are read";
                return Err(error.hint(advice));
            }
            match report.different {
                Some(count) if count > 0 => {
                    let what = format!("{store}: {} unlike the archive's", counted(count, "sample"));
                    return Err(Error::input(what).hint(
                        "the archive is read as it was imported unless an option here asks for another reading; \
                         --pattern and --table are to be given again",
                    ));
                }
                _ => {}
            }
            if !report.views_missing.is_empty() {
                let error = Error::missing(format!(
                    "{store}: {} missing",
                    counted(report.views_missing.len(), "view")
                ));
                return Err(
                    error.hint("run the command that makes this store again; it goes on where it stopped")
                );
            }
            &report.findings
        }
        Found::Other(report) => &report.findings,
    };
    let damaged = findings.iter().find(|finding| !finding.missing);
    let Some(first) = damaged.or(findings.first()) else { return Ok(()) };
    let kind = if damaged.is_some() { ErrorKind::Input } else { ErrorKind::Missing };
    let more = match findings.len() {
        1 => String::new(),
        count => format!(" (and {} more)", count - 1),
    };
    let word = if damaged.is_some() { "damaged" } else { "not whole" };
    let error = Error::new(kind, format!("{store}: {word}: {}: {}{more}", first.part, first.what));
    Err(match &first.todo {
        Some(todo) => error.hint(todo.clone()),
        None => error,
    })
}

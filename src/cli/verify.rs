use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::stage::verify;
use btfkit::store::measurement::Measurement;
use btfkit::text::escaped;
use btfkit::words::counted;
use clap::Args;

use super::each::{Ended, Line, Outcome, each};
use super::source::SourceArgs;
use super::table::{row, table};
use super::{Tell, as_json};

/// Is a measurement whole and undamaged? Names each damaged chunk; --source compares with the archive
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf verify wood.zarr
  btf verify wood.zarr --source UBO_WOOD256.zip     sample by sample; give the options that the import was given
  btf verify stores/*.zarr                          a line each, and a count
Exit code 65 if something is damaged or different, 66 if views are missing.")]
pub(super) struct Verify {
    /// Measurements; of several each has a line
    #[arg(required = true, value_name = "STORE")]
    stores: Vec<PathBuf>,
    /// The archive that it was made of; may be given several times for one in pieces
    #[arg(long = "source", value_name = "ARCHIVE")]
    archive: Vec<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

impl Verify {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<Ended> {
        let [store] = self.stores.as_slice() else {
            if !self.archive.is_empty() {
                return Err(Error::usage(format!("got --source for {} stores", self.stores.len()))
                    .hint("compare one store at a time with its archive"));
            }
            let name = |store: &PathBuf| store.display().to_string();
            return each(&self.stores, name, self.json, context, tell, |store| {
                self.one_of_many(store, context)
            });
        };
        let (report, views) = self.report(store, context)?;
        if self.json {
            tell.plan(&as_json(&report)?)?;
        } else {
            tell.text(&self.told(&report, views));
        }
        judge(store, &report).map(|()| Ended::Done)
    }

    fn report(&self, store: &Path, context: &Context<'_>) -> Result<(verify::Report, usize)> {
        let measurement = Measurement::open(store)?;
        let source = if self.archive.is_empty() { None } else { Some(self.source.open(&self.archive)?) };
        let report = verify::run(&measurement, source.as_deref(), context)?;
        Ok((report, measurement.description().views.len()))
    }

    fn one_of_many(&self, store: &Path, context: &Context<'_>) -> Result<Outcome> {
        let (report, views) = self.report(store, context)?;
        let line = if self.json {
            Line::Json(as_json(&report)?)
        } else {
            Line::Text(format!("whole and undamaged, {}", counted(views, "view")))
        };
        Ok((line, judge(store, &report).err()))
    }

    fn told(&self, report: &verify::Report, views: usize) -> String {
        let mut rows = vec![
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
        text
    }
}

fn judge(store: &Path, report: &verify::Report) -> Result<()> {
    let store = store.display();
    if !report.damaged.is_empty() {
        let error = Error::input(format!("{store}: {}", counted(report.damaged.len(), "damaged chunk")));
        return Err(error.hint("delete the files named and import again: only their views are read"));
    }
    match report.different {
        Some(count) if count > 0 => {
            return Err(Error::input(format!("{store}: {} unlike the archive's", counted(count, "sample"))));
        }
        _ => {}
    }
    if report.views_missing.is_empty() {
        return Ok(());
    }
    let error = Error::missing(format!("{store}: {} missing", counted(report.views_missing.len(), "view")));
    Err(error.hint("run the command that makes this store again; it goes on where it stopped"))
}

use std::path::PathBuf;

use btfkit::error::{Error, Result};
use btfkit::run::Context;
use btfkit::stage::verify;
use btfkit::store::measurement::Measurement;
use btfkit::text::escaped;
use clap::Args;

use super::Tell;
use super::source::SourceArgs;
use super::table::{row, table};

/// Is a measurement whole and undamaged? Names each damaged chunk; --source compares with the archive
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf verify wood.zarr
  btf verify wood.zarr --source UBO_WOOD256.zip     sample by sample; give the options that the import was given
Exit code 65 if something is damaged or different, 66 if views are missing.")]
pub(super) struct Verify {
    /// A measurement
    store: PathBuf,
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
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<()> {
        let measurement = Measurement::open(&self.store)?;
        let source = if self.archive.is_empty() { None } else { Some(self.source.open(&self.archive)?) };
        let report = verify::run(&measurement, source.as_deref(), context)?;
        if self.json {
            let report = serde_json::to_value(&report).map_err(|error| Error::internal(error.to_string()))?;
            tell.plan(&report)?;
        } else {
            tell.text(&self.told(&report, measurement.description().views.len()));
        }
        self.judge(&report)
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

    fn judge(&self, report: &verify::Report) -> Result<()> {
        let store = self.store.display();
        if !report.damaged.is_empty() {
            let error = Error::input(format!("{store}: {} damaged chunks", report.damaged.len()));
            return Err(error.hint("delete the files named and import again: only their views are read"));
        }
        match report.different {
            Some(count) if count > 0 => {
                return Err(Error::input(format!("{store}: {count} samples are not those of the archive")));
            }
            _ => {}
        }
        if report.views_missing.is_empty() {
            return Ok(());
        }
        let error = Error::missing(format!("{store}: {} views are missing", report.views_missing.len()));
        Err(error.hint("run the command that makes this store again; it goes on where it stopped"))
    }
}

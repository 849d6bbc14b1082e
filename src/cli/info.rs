use std::path::PathBuf;

use btfkit::archive;
use btfkit::error::Result;
use btfkit::stage::{cluster, import};
use btfkit::store::Store;
use btfkit::store::enlarged::{self, Enlarged};
use btfkit::store::measurement::{self, Measurement};
use btfkit::store::model::{self, Model, Stage};
use clap::Args;
use serde_json::Value;

use super::table::{row, table};
use super::{Tell, bytes_text};

/// Tell what an archive or a store holds and how far it is
#[derive(Args)]
pub(super) struct Info {
    /// An archive or a store
    path: PathBuf,
}

impl Info {
    pub(super) fn run(&self, tell: Tell) -> Result<()> {
        let store = self.path.join("zarr.json").exists();
        let rows = match store.then(|| Store::at(&self.path).attributes()).transpose()?.flatten() {
            None => self.archive()?,
            Some(attributes) => match attributes.get("kind").and_then(Value::as_str) {
                Some(measurement::KIND) => self.measurement()?,
                Some(model::KIND) => self.model()?,
                Some(enlarged::KIND) => self.enlarged()?,
                kind => vec![row!["kind", kind.unwrap_or("unknown")]],
            },
        };
        tell.line(table(&rows));
        Ok(())
    }

    fn archive(&self) -> Result<Vec<Vec<String>>> {
        let source = archive::open(std::slice::from_ref(&self.path), &archive::Options::default())?;
        let contents = source.contents();
        let description = import::describe(source.as_ref(), 1.0);
        Ok(vec![
            row!["kind", format!("archive, {}", contents.format)],
            row!["views x lights", format!("{} x {}", contents.views.len(), contents.lights.len())],
            row!["raw", bytes_text(description.bytes())],
        ])
    }

    fn measurement(&self) -> Result<Vec<Vec<String>>> {
        let measurement = Measurement::open(&self.path)?;
        let description = measurement.description();
        Ok(vec![
            row!["kind", measurement::KIND],
            row!["views x lights", format!("{} x {}", description.views.len(), description.lights.len())],
            row!["size", format!("{}, {} channels", description.size, description.n_channels())],
            row!["transfer", format!("{:?}", description.transfer).to_lowercase()],
            row!["raw", bytes_text(description.bytes())],
            row!["views done", format!("{} of {}", measurement.views_done(), description.views.len())],
        ])
    }

    fn model(&self) -> Result<Vec<Vec<String>>> {
        let model = Model::open(&self.path)?;
        let mut rows = vec![row!["kind", model::KIND]];
        for stage in [Stage::Tile, Stage::Cluster, Stage::Normals, Stage::Fit] {
            let done = if model.stage(stage)?.is_some() { "done" } else { "not run" };
            rows.push(row![stage.name(), done]);
        }
        if model.stage(Stage::Cluster)?.is_some() {
            let report: cluster::Report = model.report(Stage::Cluster)?;
            for (number, pass) in report.passes.iter().enumerate() {
                let found = format!(
                    "mean weighted |dL*| {:.4}, {} texels moved",
                    pass.mean_lightness_error, pass.moved
                );
                rows.push(row![format!("  pass {}", number + 1), found]);
            }
        }
        Ok(rows)
    }

    fn enlarged(&self) -> Result<Vec<Vec<String>>> {
        let enlarged = Enlarged::open(&self.path)?;
        let done = (0..enlarged.shard_rows()).filter(|&row| enlarged.has_shard_row(row)).count();
        Ok(vec![
            row!["kind", enlarged::KIND],
            row!["size", enlarged.size()],
            row!["rows of shards done", format!("{done} of {}", enlarged.shard_rows())],
        ])
    }
}

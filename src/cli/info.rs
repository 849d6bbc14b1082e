use std::path::PathBuf;

use btfkit::archive::Archive;
use btfkit::error::Result;
use btfkit::stage::cluster;
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
        let archive = Archive::open(&self.path)?;
        let catalogue = archive.catalogue();
        let first = archive.image_bytes(0, 0)?;
        let header = btfkit_formats::jpeg::header(&first, archive.limits())?;
        let (views, lights) = (catalogue.views().len() as u64, catalogue.lights().len() as u64);
        let bytes =
            views * lights * u64::from(header.width) * u64::from(header.height) * u64::from(header.channels);
        Ok(vec![
            row!["kind", "archive, UBO2003 layout"],
            row!["views x lights", format!("{views} x {lights}")],
            row!["images", format!("{}x{}, {} channels", header.width, header.height, header.channels)],
            row!["raw", bytes_text(bytes)],
            row!["other entries", catalogue.ignored()],
        ])
    }

    fn measurement(&self) -> Result<Vec<Vec<String>>> {
        let measurement = Measurement::open(&self.path)?;
        let description = measurement.description();
        Ok(vec![
            row!["kind", measurement::KIND],
            row!["views x lights", format!("{} x {}", description.views.len(), description.lights.len())],
            row!["size", format!("{}, {} channels", description.size, description.channels)],
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

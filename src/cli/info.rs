use std::path::{Path, PathBuf};

use btfkit::error::Result;
use btfkit::run::Context;
use btfkit::stage::{cluster, estimate, import};
use btfkit::store::Store;
use btfkit::store::codec::Chain;
use btfkit::store::enlarged::{self, Enlarged};
use btfkit::store::measurement::{self, Description, Measurement};
use btfkit::store::model::{self, Model, Stage};
use btfkit::words::counted;
use btfkit_formats::Direction;
use clap::Args;
use serde_json::Value;

use super::each::{Ended, Line, each};
use super::source::SourceArgs;
use super::table::{row, table};
use super::{Tell, bytes_text};

/// Tell what an archive or a store holds, how far it is, and how large the store of an archive will be
#[derive(Args)]
#[command(after_help = "\
Archives are told apart by their content:
  zips and folders of pictures (JPEG, PNG, TIFF, Radiance, OpenEXR) with angles in their names, a table or an .lp list;
  Bonn .btf (DFMF, FMF, PVF, BDI); MLVQ databases; UTIA BIG and MIF; numpy arrays; HDF5.

Examples:
  btf info UBO_WOOD256.zip
  btf info scans/ --pattern '{theta_v}_{phi_v}_{theta_i}_{phi_i}.png'
  btf info wood.zarr
  btf info archives/*                               a line each, and a count")]
pub(super) struct Info {
    /// Archives and stores; of several each has a line
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// The archives are pieces of one measurement
    #[arg(long)]
    pieces: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// Rows that tell what a measurement, or an archive as a measurement, holds.
fn described(description: &Description) -> Vec<Vec<String>> {
    let directions = |list: &[Direction]| {
        let thetas: Vec<f64> = list.iter().map(|d| d.degrees().0).collect();
        let (low, high) = thetas.iter().fold((f64::MAX, f64::MIN), |(l, h), &t| (l.min(t), h.max(t)));
        format!("{}, theta {low:.1} to {high:.1} degrees", list.len())
    };
    let channels = match description.channels.as_slice() {
        [first, .., last] if description.n_channels() > 4 => {
            format!("{} channels, {first} to {last}", description.n_channels())
        }
        names => names.join(" "),
    };
    vec![
        row!["views", directions(&description.views)],
        row!["lights", directions(&description.lights)],
        row!["size", format!("{}, {channels}, {}", description.size, description.sample_type.name())],
        row!["transfer", format!("{:?}", description.transfer).to_lowercase()],
        row!["raw", bytes_text(description.bytes())],
    ]
}

impl Info {
    pub(super) fn run(&self, context: &Context<'_>, tell: Tell) -> Result<Ended> {
        if self.paths.len() > 1 && !self.pieces {
            let name = |path: &PathBuf| path.display().to_string();
            return each(&self.paths, name, false, context, tell, |path| {
                Ok((Line::Text(in_short(&self.rows(std::slice::from_ref(path), context)?)), None))
            });
        }
        tell.text(&table(&self.rows(&self.paths, context)?));
        Ok(Ended::Done)
    }

    /// What is to be told of one input, which may lie in pieces.
    fn rows(&self, paths: &[PathBuf], context: &Context<'_>) -> Result<Vec<Vec<String>>> {
        let path = paths.first().map_or(Path::new(""), PathBuf::as_path);
        let store = path.join("zarr.json").exists();
        match store
            .then(|| Store::at(path).expect_one_of(&[measurement::KIND, model::KIND, enlarged::KIND]))
            .transpose()?
        {
            None => self.archive(paths, context),
            Some(attributes) => match attributes.get("kind").and_then(Value::as_str) {
                Some(measurement::KIND) => measurement(path),
                Some(model::KIND) => model(path),
                Some(enlarged::KIND) => enlarged(path),
                kind => Ok(vec![row!["kind", kind.unwrap_or("unknown")]]),
            },
        }
    }

    fn archive(&self, paths: &[PathBuf], context: &Context<'_>) -> Result<Vec<Vec<String>>> {
        let source = self.source.open(paths)?;
        let contents = source.contents();
        let description = import::describe(source.as_ref(), 1.0);
        let mut rows = vec![row!["kind", format!("archive, {}", contents.format)]];
        rows.extend(described(&description));
        for codec in [Chain::Stock, Chain::Predictive] {
            let bytes = estimate::store_bytes(source.as_ref(), codec, context)?;
            rows.push(row![format!("store, about ({})", codec.name()), bytes_text(bytes)]);
        }
        rows.extend(contents.remarks.iter().map(|(name, value)| row![name, value]));
        rows.extend(source.notes().iter().map(|note| row!["note", note]));
        rows.extend(contents.assumptions.iter().map(|assumption| row!["assumed", assumption]));
        Ok(rows)
    }
}

/// What tells an input apart from others, of what is told of it.
fn in_short(rows: &[Vec<String>]) -> String {
    const TOLD: [&str; 6] = ["views", "lights", "size", "views done", "method", "shards done"];
    let told = rows.iter().filter_map(|row| match row.as_slice() {
        [name, value] if name == "kind" => Some(value.clone()),
        [name, value] if name == "size" => Some(value.clone()),
        [name, value] if TOLD.contains(&name.as_str()) => {
            let value = value.split_once(',').map_or(value.as_str(), |(first, _)| first);
            Some(format!("{name} {value}"))
        }
        [name, value] if Stage::ALL.iter().any(|stage| stage.name() == name) => {
            Some(format!("{name} {value}"))
        }
        _ => None,
    });
    told.collect::<Vec<_>>().join(", ")
}

fn measurement(path: &Path) -> Result<Vec<Vec<String>>> {
    let measurement = Measurement::open(path)?;
    let description = measurement.description();
    let mut rows = vec![row!["kind", measurement::KIND]];
    rows.extend(described(description));
    rows.push(row!["white", description.white]);
    rows.push(row!["views done", format!("{} of {}", measurement.views_done(), description.views.len())]);
    let attributes = measurement.attributes()?;
    let assumptions = attributes.get("assumptions").and_then(Value::as_array);
    let texts = assumptions.into_iter().flatten().filter_map(Value::as_str);
    rows.extend(texts.map(|assumption| row!["assumed", assumption]));
    Ok(rows)
}

fn model(path: &Path) -> Result<Vec<Vec<String>>> {
    let model = Model::open(path)?;
    let mut rows = vec![row!["kind", model::KIND]];
    for stage in Stage::ALL {
        let done = if model.stage(stage)?.is_some() { "done" } else { "not run" };
        rows.push(row![stage.name(), done]);
    }
    if model.stage(Stage::Cluster)?.is_some() {
        let report: cluster::Report = model.report(Stage::Cluster)?;
        for (number, pass) in report.passes.iter().enumerate() {
            let found = format!(
                "mean weighted |dL*| {:.4}, {} moved",
                pass.mean_lightness_error,
                counted(pass.moved, "texel")
            );
            rows.push(row![format!("  pass {}", number + 1), found]);
        }
    }
    Ok(rows)
}

fn enlarged(path: &Path) -> Result<Vec<Vec<String>>> {
    let enlarged = Enlarged::open(path)?;
    let shards = enlarged.shards();
    let done = enlarged.shards_done();
    Ok(vec![
        row!["kind", enlarged::KIND],
        row!["size", enlarged.size()],
        row!["method", format!("{:?}", enlarged.method()).to_lowercase()],
        row!["source", if enlarged.has_source() { "kept" } else { "not kept" }],
        row!["shards done", format!("{done} of {}", shards.texels())],
    ])
}

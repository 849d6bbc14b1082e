//! A model: each stage that is done, its arrays against their ranges and against what they follow from.

use super::report::{OLDEST_NOTE, Report, consolidated};
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::store::model::components::ComponentsReport;
use crate::store::model::{KIND, Model, Stage};
use crate::words::counted;
use crate::zarr::metadata::OLDEST_FORMAT;

/// Reads all of a model.
pub(super) fn run(model: &Model, context: &Context<'_>) -> Result<Report> {
    let mut report = Report::new(KIND);
    context.progress.begin("verify", Stage::ALL.len() as u64, Counted::Items("stages"));
    for stage in Stage::ALL.into_iter().chain(Stage::OPTIONAL) {
        context.check_stop()?;
        if model.has(stage)? {
            let before = report.findings.len();
            input(model, stage, &mut report)?;
            context.install(|| of_stage(model, stage, context, &mut report))?;
            let found = report.findings.len() - before;
            report.checked(stage.name(), if found == 0 { "whole" } else { "damaged" });
        } else if !Stage::OPTIONAL.contains(&stage) {
            report.checked(stage.name(), "not run");
        }
        context.progress.advance(1);
    }
    context.progress.end();
    if !model.has(Stage::Tile)? {
        // Its root holds a copy of all metadata from the first stage on.
        let what = format!("{}: it was begun, and no stage of it is done", model.path().display());
        let error = Error::missing(what).hint("run the command that makes this store again");
        report.keep("tile", Err::<(), _>(error))?;
    } else if model.format() == OLDEST_FORMAT {
        report.notes.push(OLDEST_NOTE.to_owned());
    } else {
        consolidated(model.path(), model.is_consolidated(), &mut report.findings)?;
    }
    Ok(report)
}

/// Whether a stage was run on what the stage before it is now.
fn input(model: &Model, stage: Stage, report: &mut Report) -> Result<()> {
    let found = report.keep(&format!("recipe of {}", stage.name()), model.input_digest(stage))?;
    let (Some(Some(found)), Some(before)) = (found, stage.input()) else { return Ok(()) };
    let Some(expected) = report.keep(stage.name(), model.stage_digest(before))? else { return Ok(()) };
    if found != expected {
        let what =
            format!("{}: stage {} is not of this {}", model.path().display(), stage.name(), before.name());
        report.find(stage.name(), what, &format!("run btf {} on it again, with --force", stage.name()));
    }
    Ok(())
}

fn of_stage(model: &Model, stage: Stage, context: &Context<'_>, report: &mut Report) -> Result<()> {
    match stage {
        Stage::Tile => {
            report.keep("tile_source", model.tile())?;
            report.keep("triangles", model.triangles())?;
            report.keep("angle coordinates", model.check_coordinates())?;
        }
        Stage::Cluster => {
            report.keep("report of cluster", model.cluster_report())?;
            report.keep("index", model.index())?;
            report.keep("centres", model.centres())?;
            report.keep("representative_texel", model.representative_texels())?;
            // Where it cannot be told how many there are, that has been found.
            let clusters = model.clusters().map(|clusters| clusters as u64);
            // What is not all there is not read, whatever it claims to be.
            if let (Ok(clusters), true) = (clusters, model.has_arrays(stage)?) {
                let distances = format!("verifying the distances of {}", counted(clusters, "cluster"));
                // As they are read and as they are packed.
                context.require(&distances, clusters * clusters * 8)?;
            }
            report.keep("distance", model.distance())?;
            for clusters in report.keep("representatives", model.representative_chunks())?.unwrap_or_default()
            {
                context.check_stop()?;
                let read = model.representatives_of(clusters).and_then(|values| values.decoder());
                report.keep("representatives", read)?;
            }
        }
        Stage::Normals => {
            report.keep("report of normals", model.normals_report())?;
            report.keep("normals", model.normals())?;
        }
        Stage::Fit => {
            report.keep("mrf", model.surface())?;
        }
        Stage::Appearance => {
            report.keep("appearance", model.appearance())?;
        }
        Stage::Components => {
            report.keep("report of components", model.report::<ComponentsReport>(stage))?;
            if model.has_arrays(stage)? {
                let bytes = model.components_bytes()?;
                context.require("verifying components", bytes)?;
            }
            report.keep("components", model.components())?;
        }
    }
    Ok(())
}

//! An enlarged index: every shard, and what its texels are in the model.

use std::path::Path;

use super::report::{Finding, MOST_FINDINGS, OLDEST_NOTE, Report, consolidated, kept, unfinished};
use crate::error::{ErrorKind, Result};
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::run::{Context, units};
use crate::shape::{Size, Window};
use crate::stage::image::model_of;
use crate::store::enlarged::{Enlarged, KIND, SHARD_SIDE};
use crate::store::model::Stage;
use crate::words::counted;
use crate::zarr::metadata::OLDEST_FORMAT;

/// Memory that a shard takes while it is looked at.
const SHARD_BYTES: u64 = (SHARD_SIDE * SHARD_SIDE * 40) as u64;

/// What the texels of the model's tile are.
struct Tile {
    index: Vec<u16>,
    normals: Option<Vec<[f32; 3]>>,
}

/// Reads all of an enlarged index, or a part of its rows of shards; its model is the one named, or lies beside it.
pub(super) fn run(path: &Path, model: Option<&Path>, shard: Shard, context: &Context<'_>) -> Result<Report> {
    let enlarged = Enlarged::open(path)?;
    let mut report = Report::new(KIND);
    let tile = tile(&enlarged, path, model, &mut report)?;
    let found = enlarged.shards_found();
    let total = enlarged.shards().texels();
    report.checked("size", enlarged.size().to_string());
    report.checked("shards", format!("{} of {total}", found.len()));
    if found.len() < total {
        report.findings.push(Finding {
            part: "index".to_owned(),
            what: format!(
                "{}: {} of {total} shards have not been written",
                path.display(),
                total - found.len()
            ),
            todo: Some("run the command that makes this store again; it goes on where it stopped".to_owned()),
            missing: true,
        });
    }
    let whole = found.len() == total;
    let found: Vec<[usize; 2]> = found.into_iter().filter(|&[row, _]| shard.has(row)).collect();
    if shard != Shard::WHOLE {
        report.notes.push(shard.looked_at(found.len(), &counted(total, "shard")));
    }
    context.progress.begin("verify", found.len() as u64, Counted::Items("shards"));
    let in_flight = units::in_flight(context, "verifying a shard", SHARD_BYTES)?;
    let findings = units::for_each(context, &found, in_flight, |&place| {
        let mut findings = Vec::new();
        of_shard(&enlarged, window(place, enlarged.size()), tile.as_ref(), &mut findings)?;
        context.progress.advance(1);
        Ok(findings)
    })?;
    context.progress.end();
    let intact = findings.iter().all(Vec::is_empty);
    report.findings.extend(findings.into_iter().flatten().take(MOST_FINDINGS));
    if enlarged.format() == OLDEST_FORMAT {
        report.notes.push(OLDEST_NOTE.to_owned());
    } else if !enlarged.is_finished()? {
        if whole && intact {
            report.findings.push(unfinished(path));
        }
    } else {
        consolidated(path, enlarged.is_consolidated(), &mut report.findings)?;
        let mut rows: Vec<usize> = found.iter().map(|&[row, _]| row).collect();
        rows.dedup();
        // What is missing or damaged is told already.
        for row in rows.into_iter().filter(|_| intact && whole) {
            for folder in report.keep("checksums", enlarged.exchanged(row))?.unwrap_or_default() {
                let what = format!(
                    "{}: the checksum of this row of shards is not the one that was kept: one was exchanged",
                    folder.display()
                );
                let todo =
                    "delete this folder and run the command that made it again, which writes what is missing";
                report.find("checksums", what, todo);
            }
        }
    }
    Ok(report)
}

/// The tile of the model, where it is found.
fn tile(enlarged: &Enlarged, path: &Path, named: Option<&Path>, report: &mut Report) -> Result<Option<Tile>> {
    let model = match model_of(enlarged, path, named) {
        Ok(model) => model,
        Err(error)
            if named.is_none()
                && matches!(error.kind(), ErrorKind::Missing | ErrorKind::Recipe | ErrorKind::Input) =>
        {
            let note = format!("not compared with its model, name it with --model: {error}");
            report.notes.push(note);
            return Ok(None);
        }
        Err(error) => return Err(error),
    };
    let described = [model.tile_report()?.size(), Size::new(model.clusters()?, 0)];
    let of_index = [enlarged.tile().unwrap_or(described[0]), Size::new(enlarged.clusters(), 0)];
    if enlarged.format() > OLDEST_FORMAT && described != of_index {
        let what = format!(
            "{}: got a tile of {} and {}, the model has {} and {}",
            path.display(),
            of_index[0],
            counted(of_index[1].height, "cluster"),
            described[0],
            described[1].height
        );
        report.find("attributes", what, "enlarge anew, under another name");
        return Ok(None);
    }
    let has_normals = enlarged.has_normals() && model.has(Stage::Normals)?;
    let normals = has_normals.then(|| model.normals()).transpose()?;
    let name = model.path().display().to_string();
    report.checked("compared with", name);
    Ok(Some(Tile { index: model.index()?, normals }))
}

fn window([row, column]: [usize; 2], plane: Size) -> Window {
    let (y, x) = (row * SHARD_SIDE, column * SHARD_SIDE);
    let size = Size::new(SHARD_SIDE.min(plane.height - y), SHARD_SIDE.min(plane.width - x));
    Window { y, x, size }
}

/// Reads a shard of all arrays and compares them.
fn of_shard(
    enlarged: &Enlarged,
    window: Window,
    tile: Option<&Tile>,
    findings: &mut Vec<Finding>,
) -> Result<()> {
    let index = kept(enlarged.read(window), "index", findings)?;
    let source = kept(enlarged.read_source(window), "source", findings)?.flatten();
    let normals = kept(enlarged.read_normals(window), "normals", findings)?.flatten();
    let (Some(tile), Some(index), Some(source)) = (tile, index, source) else { return Ok(()) };
    let mut unlike = |array: &str, at: usize| {
        let (row, column) = (window.y / SHARD_SIDE, window.x / SHARD_SIDE);
        let shard = enlarged.path().join(array).join("c").join(row.to_string()).join(column.to_string());
        findings.push(Finding {
            part: array.to_owned(),
            what: format!(
                "{}: row {}, column {} is not what the model has at its source",
                shard.display(),
                window.y + at / window.size.width,
                window.x + at % window.size.width
            ),
            todo: Some("delete this file and run the command that made it again".to_owned()),
            missing: false,
        });
    };
    let of_model = |texel: u32| tile.index.get(texel as usize);
    if let Some(at) = (0..index.len()).find(|&at| of_model(source[at]) != Some(&index[at])) {
        unlike("index", at);
    }
    if let (Some(normals), Some(of_tile)) = (normals, &tile.normals)
        && let Some(at) =
            (0..normals.len()).find(|&at| of_tile.get(source[at] as usize) != Some(&normals[at]))
    {
        unlike("normals", at);
    }
    Ok(())
}

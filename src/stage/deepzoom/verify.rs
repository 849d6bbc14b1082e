//! Is a pyramid whole and undamaged? Its description and its viewer follow from the recipe, and every tile is decoded.

use std::path::{Path, PathBuf};

use btfkit_formats::{Limits, picture};
use rayon::prelude::*;
use serde::ser::Error as _;
use serde::{Serialize, Serializer};

use super::place::PyramidFiles;
use super::recipe::{PyramidRecipe, State};
use crate::disk::mapped::MappedFile;
use crate::error::{Error, Result};
use crate::picture::deepzoom::pyramid::Pyramid;
use crate::picture::deepzoom::{Encoding, page};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::run::recipe::Recipe;
use crate::run::shard::Shard;
use crate::shape::Size;
use crate::stage::kept::{Kept, bytes_below};
use crate::stage::verify::report::Report;
use crate::store::recognise::PYRAMID_FOLDER;
use crate::words::counted;
use crate::zarr::checksums::DIGITS;
use crate::zarr::metadata;

const ANEW: &str =
    "delete this file and run the command that made the pyramid again, which writes what is missing";

/// What a Deep Zoom pyramid is.
#[derive(Clone, Debug, Serialize)]
pub struct Pyramidal {
    /// As of a store; the bytes are those of its tiles.
    #[serde(flatten)]
    pub kept: Kept,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Number of levels.
    pub levels: u32,
    /// Number of tiles of all levels.
    pub tiles: u64,
    /// Side of a tile without its overlap.
    pub tile_side: usize,
    /// Pixels of its neighbours that a tile holds.
    pub overlap: usize,
    /// Format of the tiles.
    pub tile_format: &'static str,
    /// What it shows, and how.
    #[serde(serialize_with = "as_stored")]
    pub recipe: PyramidRecipe,
}

fn as_stored<S: Serializer>(recipe: &PyramidRecipe, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    recipe.to_value().map_err(S::Error::custom)?.serialize(serializer)
}

/// Checksums of the tiles: for each level, [`DIGITS`] hexadecimal digits for each row of tiles.
pub(super) fn checksums(pyramid: &Pyramid, place: &PyramidFiles) -> Result<Vec<String>> {
    let of_level = |level: u32| {
        let rows = pyramid.grid(pyramid.level(level)).height;
        let sums: Result<Vec<String>> =
            (0..rows).into_par_iter().map(|row| checksum(pyramid, place, level, row)).collect();
        Ok(sums?.concat())
    };
    (0..=pyramid.top()).map(of_level).collect()
}

fn checksum(pyramid: &Pyramid, place: &PyramidFiles, level: u32, row: usize) -> Result<String> {
    let columns = pyramid.grid(pyramid.level(level)).width;
    let mut sum = 0;
    for column in 0..columns {
        sum = crc32c::crc32c_append(sum, open(&place.tile(level, row, column))?.as_ref());
    }
    Ok(format!("{sum:08x}"))
}

fn open(path: &Path) -> Result<MappedFile> {
    MappedFile::open(path).map_err(|error| match error.kind() {
        _ if metadata::is_absent(&error) => Error::missing(format!("{}: no such tile", path.display()))
            .hint("run the command that makes the pyramid again; it goes on where it stopped"),
        std::io::ErrorKind::InvalidInput => Error::input(format!("{}: {error}", path.display())).hint(ANEW),
        _ => Error::io("read", path, error),
    })
}

/// A pyramid that is there.
pub(super) struct Opened {
    pub(super) description: PathBuf,
    pub(super) state: State,
    recipe: PyramidRecipe,
    pub(super) pyramid: Pyramid,
    pub(super) place: PyramidFiles,
}

impl Opened {
    /// The pyramid whose description, or folder of tiles, lies at a path.
    pub(super) fn at(path: &Path) -> Result<Self> {
        let path: PathBuf = path.components().collect();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let description = match name.strip_suffix(PYRAMID_FOLDER) {
            Some(stem) => path.with_file_name(format!("{stem}.dzi")),
            None => path.clone(),
        };
        let refused = |what: &str| {
            Error::input(format!("{}: the recipe of its tiles: {what}", description.display()))
                .hint("make the pyramid anew: under another name, or with --force")
        };
        let state = PyramidFiles::new(&description, Encoding::Png)?.state()?.ok_or_else(|| {
            Error::missing(format!(
                "{}: no folder of tiles with a recipe of this program",
                description.display()
            ))
        })?;
        let recipe = PyramidRecipe::from_value(&state.recipe).map_err(|what| refused(&what))?;
        let pyramid = recipe.pyramid().map_err(|what| refused(&what))?;
        let place = PyramidFiles::new(&description, recipe.tiles)?;
        Ok(Self { description, state, recipe, pyramid, place })
    }
}

/// Tells what a pyramid is, without reading its tiles.
///
/// # Errors
/// Where there is none, or its recipe is damaged.
pub(crate) fn about(path: &Path) -> Result<Pyramidal> {
    let Opened { description, state, recipe, pyramid, place } = Opened::at(path)?;
    Ok(Pyramidal {
        kept: Kept {
            version: state.version.unwrap_or_default(),
            layout: state.format.unwrap_or(metadata::OLDEST_FORMAT),
            stored_bytes: bytes_below(place.folder()),
            finished: description.exists(),
        },
        width: pyramid.size.width,
        height: pyramid.size.height,
        levels: pyramid.top() + 1,
        tiles: pyramid.tiles(),
        tile_side: pyramid.side,
        overlap: pyramid.overlap,
        tile_format: recipe.tiles.ending(),
        recipe,
    })
}

/// Reads all of a pyramid, or a part of the rows of tiles of each level: `path` is its description or the folder of its
/// tiles.
///
/// # Errors
/// Where there is none, or its recipe is damaged; and those of the operating system.
pub(crate) fn verify(path: &Path, shard: Shard, context: &Context<'_>) -> Result<Report> {
    let Opened { description, state, recipe, pyramid, place } = Opened::at(path)?;
    let mut report = Report::new("deepzoom");
    report.checked("size", pyramid.size.to_string());
    report.checked("levels", (pyramid.top() + 1).to_string());
    report.checked("tiles", pyramid.tiles().to_string());
    texts(&pyramid, &place, recipe.tiles, &mut report)?;
    let kept = state.checksums.as_ref();
    if kept.is_none() && state.format.is_some() && report.findings.is_empty() {
        report.find(
            "checksums",
            format!("{}: none are kept", description.display()),
            "run the command that makes the pyramid again; it only ends it",
        );
    }
    let mut looked_at = 0;
    context.progress.begin("verify", pyramid.tiles(), Counted::Items("tiles"));
    for level in 0..=pyramid.top() {
        let grid = pyramid.grid(pyramid.level(level));
        for row in (0..grid.height).filter(|&row| shard.has(row)) {
            looked_at += grid.width;
            context.check_stop()?;
            let before = report.findings.len();
            let looked: Vec<Result<()>> = context.install(|| {
                (0..grid.width)
                    .into_par_iter()
                    .map(|column| tile(&pyramid, &place, level, row, column))
                    .collect()
            });
            context.progress.advance(grid.width as u64);
            for result in looked {
                report.keep("tiles", result)?;
            }
            // An interrupted pyramid of any size would miss them one by one.
            if report.findings.iter().filter(|finding| finding.missing).count() > MOST_MISSING {
                return Ok(report);
            }
            if report.findings.len() > before {
                continue;
            }
            let kept = kept.and_then(|kept| kept.get(level as usize));
            let kept = kept.and_then(|digits| digits.get(row * DIGITS..(row + 1) * DIGITS));
            let found = report.keep("tiles", checksum(&pyramid, &place, level, row))?;
            if state.checksums.is_some() && kept != found.as_deref() {
                let what = format!(
                    "{}: the checksum of this row of {} tiles is not the one that was kept",
                    place.tile(level, row, 0).display(),
                    grid.width
                );
                report.find(
                    "tiles",
                    what,
                    "delete these files and run the command that made the pyramid again",
                );
            }
        }
    }
    context.progress.end();
    if shard != Shard::WHOLE {
        let tiles = counted(pyramid.tiles() as usize, "tile");
        report.notes.push(shard.looked_at(looked_at, &tiles));
    }
    Ok(report)
}

/// Missing tiles that are told one by one.
const MOST_MISSING: usize = 20;

/// Decodes a tile and looks at its size.
fn tile(pyramid: &Pyramid, place: &PyramidFiles, level: u32, row: usize, column: usize) -> Result<()> {
    let path = place.tile(level, row, column);
    let damaged = |what: String| Error::input(format!("{}: {what}", path.display())).hint(ANEW);
    let file = open(&path)?;
    let decoded =
        picture::decode(file.as_ref(), &Limits::default()).map_err(|error| damaged(error.to_string()))?;
    let expected = pyramid.tile(pyramid.level(level), row, column).size;
    let found = Size::new(decoded.height as usize, decoded.width as usize);
    if found == expected {
        Ok(())
    } else {
        Err(damaged(format!("got a tile of {found}, expected {expected}")))
    }
}

/// Compares the description and the viewer with what they follow from.
fn texts(pyramid: &Pyramid, place: &PyramidFiles, encoding: Encoding, report: &mut Report) -> Result<()> {
    let page = page::viewer(pyramid, encoding, &place.name)?;
    for (path, expected) in [(&place.description, page::description(pyramid, encoding)), (&place.page, page)]
    {
        let found = metadata::read_file(path).and_then(|found| {
            found.ok_or_else(|| {
                Error::missing(format!("{}: it is not there", path.display()))
                    .hint("run the command that makes the pyramid again; it goes on where it stopped")
            })
        });
        if report.keep("description", found)?.is_some_and(|found| found != expected.as_bytes()) {
            let what = format!("{}: not the text that follows from the recipe", path.display());
            report.find(
                "description",
                what,
                "move this file away and run the command that makes the pyramid again, which writes it anew",
            );
        }
    }
    Ok(())
}

//! Which file is the image of which directions: by a table, a light list, or the names themselves.

use std::collections::HashMap;
use std::path::Path;

use btfkit_formats::named::{self, Pattern};
use btfkit_formats::{Angles, Catalogue, CatalogueErrors, Limits, Pair, rti, table, ubo2003};

use super::files::Files;
use super::{Options, read_beside};
use crate::error::{Error, Kind, Result};

/// A complete set of images, how it was found, and what had to be assumed.
pub(super) struct Found {
    pub(super) catalogue: Catalogue,
    pub(super) format: String,
    pub(super) assumptions: Vec<String>,
}

const FRONTAL: &str = "there are no view directions: one frontal view";

/// Sorts out the files of an archive.
///
/// # Errors
/// Names every missing and every duplicate image; or says why the names tell nothing.
pub(super) fn find(archive: &Path, files: &Files, options: &Options, limits: &Limits) -> Result<Found> {
    let complete = |pairs: Vec<Option<Pair>>| {
        Catalogue::from_pairs(files.names().zip(pairs)).map_err(|errors| incomplete(archive, &errors))
    };
    if let Some(path) = &options.table {
        let table = table::read(&read_beside(path)?, limits)
            .map_err(|error| Error::from(error).context(path.display()))?;
        let rows = table.rows.iter().map(|row| (row.file.as_str(), row.pair)).collect();
        let catalogue = complete(match_files(path, files, rows)?)?;
        let assumptions = if table.has_view { Vec::new() } else { vec![FRONTAL.to_owned()] };
        return Ok(Found { catalogue, format: "pictures with a table".to_owned(), assumptions });
    }
    if let Some(text) = &options.pattern {
        let pattern = Pattern::parse(text)?;
        return by_pattern(&pattern, files, complete);
    }
    if let Some(list) = files.names().position(|name| has_extension(name, "lp")) {
        return by_light_list(files, list, limits, complete);
    }
    let pairs: Vec<Option<Pair>> = files.names().map(of_ubo2003_name).collect();
    if pairs.iter().any(Option::is_some) {
        return Ok(Found {
            catalogue: complete(pairs)?,
            format: "pictures named as in UBO2003".to_owned(),
            assumptions: Vec::new(),
        });
    }
    let pattern = named::recognise(files.names()).map_err(|error| {
        Error::from(error).context(archive.display()).hint(
            "expected names like `00081 tl015 pl000 tv000 pv000.jpg`; --pattern '{theta_v}_{phi_v}_{theta_i}_{phi_i}.png' \
             says where the angles stand, --table FILE.csv lists them, `btf import --help` explains",
        )
    })?;
    by_pattern(&pattern, files, complete)
}

fn by_pattern(
    pattern: &Pattern,
    files: &Files,
    complete: impl Fn(Vec<Option<Pair>>) -> Result<Catalogue>,
) -> Result<Found> {
    let catalogue = complete(files.names().map(|name| pattern.angles(name)).collect())?;
    let mut assumptions = vec![format!("names follow the pattern {pattern}")];
    if !pattern.has_view() {
        assumptions.push(FRONTAL.to_owned());
    }
    Ok(Found { catalogue, format: "pictures named by a pattern".to_owned(), assumptions })
}

fn of_ubo2003_name(name: &str) -> Option<Pair> {
    ubo2003::parse_name(name).map(|image| Pair { view: image.view, light: image.light })
}

fn by_light_list(
    files: &Files,
    list: usize,
    limits: &Limits,
    complete: impl Fn(Vec<Option<Pair>>) -> Result<Catalogue>,
) -> Result<Found> {
    let name = files.name(list);
    let lights = rti::read_lp(&files.bytes(list)?, limits).map_err(|error| error.in_entry(name))?;
    let frontal = |light: Angles| Pair { view: Angles::FRONTAL, light };
    let named: Option<Vec<(&str, Pair)>> =
        lights.lamps.iter().map(|lamp| Some((lamp.file.as_deref()?, frontal(lamp.light)))).collect();
    let pairs = match named {
        Some(rows) => match_files(Path::new(name), files, rows)?,
        None => in_order(name, files, lights.lamps.iter().map(|lamp| frontal(lamp.light)).collect())?,
    };
    let mut assumptions = vec![FRONTAL.to_owned()];
    assumptions.extend(lights.warnings);
    Ok(Found { catalogue: complete(pairs)?, format: "RTI light list (.lp)".to_owned(), assumptions })
}

/// The pair of each file that a list names; the list lies at `list`, its paths are relative to that folder.
fn match_files(list: &Path, files: &Files, rows: Vec<(&str, Pair)>) -> Result<Vec<Option<Pair>>> {
    let folder = list.parent().unwrap_or(Path::new(""));
    let by_path: HashMap<&Path, usize> =
        files.names().enumerate().map(|(number, name)| (Path::new(name), number)).collect();
    let mut pairs = vec![None; files.len()];
    for (file, pair) in rows {
        // Beside the list, or (in a zip, or for a table that lies elsewhere) anywhere under that name.
        let number = by_path.get(folder.join(file).as_path()).copied().or_else(|| {
            let mut ends = files.names().enumerate().filter(|(_, name)| Path::new(name).ends_with(file));
            ends.next().filter(|_| ends.next().is_none()).map(|(number, _)| number)
        });
        let number = number
            .ok_or_else(|| Error::input(format!("{}: lists {file:?}, which is not there", list.display())))?;
        pairs[number] = Some(pair);
    }
    Ok(pairs)
}

/// Pictures in the order of their names are the lights of a list without names.
fn in_order(list: &str, files: &Files, lights: Vec<Pair>) -> Result<Vec<Option<Pair>>> {
    let mut pictures: Vec<usize> =
        (0..files.len()).filter(|&number| is_picture(files.name(number))).collect();
    pictures.sort_by_key(|&number| files.name(number));
    if pictures.len() != lights.len() {
        return Err(Error::input(format!(
            "{list}: got {} lights without names and {} pictures, expected as many",
            lights.len(),
            pictures.len()
        )));
    }
    let mut pairs = vec![None; files.len()];
    for (number, pair) in pictures.into_iter().zip(lights) {
        pairs[number] = Some(pair);
    }
    Ok(pairs)
}

fn is_picture(name: &str) -> bool {
    ["jpg", "jpeg", "png", "tif", "tiff", "hdr", "exr"].iter().any(|e| has_extension(name, e))
}

fn has_extension(name: &str, extension: &str) -> bool {
    Path::new(name).extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

fn incomplete(archive: &Path, errors: &CatalogueErrors) -> Error {
    Error::list(Kind::Input, errors.to_string().lines())
        .context(archive.display())
        .hint("expected one picture for each pair of directions")
}

//! Finds the stores that a picture needs beside the one that was named, and reads what a stage of a model left.

use std::path::{Path, PathBuf};

use crate::error::{Error, ErrorKind, Result};
use crate::stage::cluster::open_measurement_of;
use crate::store::enlarged::Enlarged;
use crate::store::measurement::Measurement;
use crate::store::model::{Model, Stage, measurement_name};
use crate::store::origin;

/// The measurement that a model was made of; where it is not named, it is looked for where it lay then as seen from the
/// model, beside the model, and in the current folder.
pub(super) fn measurement_of(model: &Model, named: Option<&Path>) -> Result<Measurement> {
    if let Some(path) = named {
        return open_measurement_of(model, path);
    }
    let name = measurement_name(model.path());
    let places = origin::places(model.path(), origin::MEASUREMENT, name.to_str());
    let error = match found_at(&places, |path| open_measurement_of(model, path)) {
        Ok(measurement) => return Ok(measurement),
        Err(Some(error)) => return Err(error),
        Err(None) => Error::missing(format!(
            "{}: the measurement that it was made of is not there; looked for {}",
            model.path().display(),
            listed(&places)
        )),
    };
    Err(error.hint("name the measurement with --measurement"))
}

/// What is opened at the first of some places that can be; else the first error, if there is anything at any of them.
fn found_at<T>(
    places: &[PathBuf],
    open: impl Fn(&Path) -> Result<T>,
) -> std::result::Result<T, Option<Error>> {
    let mut failed = None;
    for path in places.iter().filter(|path| path.exists()) {
        match open(path) {
            Ok(found) => return Ok(found),
            Err(error) => drop(failed.get_or_insert(error)),
        }
    }
    Err(failed)
}

fn listed(places: &[PathBuf]) -> String {
    places.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ")
}

/// The model that an enlarged index at a path refers to; where it is not named, it is looked for where it lay when the
/// index was made, as seen from the index, and beside it.
pub(crate) fn model_of(enlarged: &Enlarged, place: &Path, named: Option<&Path>) -> Result<Model> {
    let stages = enlarged.method().stages();
    let open = |path: &Path| {
        let model = Model::open(path)?;
        if let Some(&lost) = stages.iter().rev().find(|&&stage| !model.has(stage).unwrap_or(true)) {
            let todo = format!("{}, then {}", model.how_to_make(lost), again(enlarged, place, path));
            return Err(changed(place, path).hint(todo));
        }
        if enlarged.recipe().model == model.digest_of(stages)? {
            return Ok(model);
        }
        Err(changed(place, path).hint(format!(
            "name the model as it was with --model; or, to have it of the model as it is now: {}",
            again(enlarged, place, path)
        )))
    };
    if let Some(path) = named {
        return open(path);
    }
    let places = origin::places(place, origin::MODEL, enlarged.model_name());
    let error = match found_at(&places, open) {
        Ok(model) => return Ok(model),
        Err(Some(error)) => return Err(error),
        Err(None) => Error::missing(format!(
            "{}: the model that it was enlarged from is not there; looked for {}",
            place.display(),
            listed(&places)
        )),
    };
    Err(error.hint("name the model with --model"))
}

/// The error of an enlarged index whose model is not what it was.
fn changed(place: &Path, model: &Path) -> Error {
    Error::recipe(format!(
        "{} was enlarged from another model than {}, or from this one before it was changed",
        place.display(),
        model.display()
    ))
}

/// The command that makes an enlarged index of its model as it is now.
fn again(enlarged: &Enlarged, place: &Path, model: &Path) -> String {
    let size = enlarged.size();
    let method = format!("{:?}", enlarged.method()).to_lowercase();
    format!(
        "btf enlarge {} {} --size {}x{} --method {method} --force",
        model.display(),
        place.display(),
        size.width,
        size.height
    )
}

/// Reads what a stage of a model left; where that is not there, the error says which command makes it.
pub(crate) fn of_stage<T>(model: &Model, stage: Stage, read: impl FnOnce(&Model) -> Result<T>) -> Result<T> {
    model.stage_digest(stage)?;
    read(model).map_err(|error| match error.kind() {
        ErrorKind::Missing => error.hint(format!("{} makes again what is missing", model.command(stage))),
        _ => error,
    })
}

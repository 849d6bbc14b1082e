//! What to do about a model that lacks the result of a stage. Only this file decides it, by what the model holds, so that
//! whoever follows the advice gets on.

use std::ffi::OsString;
use std::path::Path;

use super::components::ComponentsRecipe;
use super::tile::TileRecipe;
use super::{Model, Stage};
use crate::error::Error;
use crate::names::with_ending;
use crate::run::recipe::Recipe;
use crate::store::measurement::Measurement;
use crate::store::origin;

/// What begins the name of a measurement that is only known by the packed file that a model was unpacked from.
pub(crate) const UNPACKED: &str = "packed:";

/// The name that the measurement of a model has by default: `wood.zarr` of `wood.model.zarr`.
pub(crate) fn measurement_name(model: &Path) -> OsString {
    with_ending(model, &[".model.zarr", ".zarr"], ".zarr")
}

impl Model {
    /// The error of a stage that has not been run, with what to do.
    pub(super) fn lacks(&self, stage: Stage) -> Error {
        let path = self.path().display();
        if self.is_unpacked() {
            return Error::missing(format!(
                "{path}: btf unpack made this model: it has a tile and components, but no clusters and nothing that is \
                 made of them (stage {})",
                stage.name()
            ))
            .hint(format!(
                "btf image {path} --out NAME.png shows it; for more, make a model of the measurement, or of the packed file \
                 imported as one: btf model MEASUREMENT NAME.model.zarr"
            ));
        }
        Error::missing(format!("{path}: stage {} has not been run", stage.name()))
            .hint(format!("run {}", self.how_to_make(stage)))
    }

    /// Whether it was unpacked from a file that does not say which texels of which measurement its tile holds.
    pub(crate) fn is_unpacked(&self) -> bool {
        let is_packed = || {
            let recipe = self.recipe_if_any::<ComponentsRecipe>(Stage::Components);
            recipe.is_some_and(|recipe| recipe.packed.is_some())
        };
        let tile = self.recipe_if_any::<TileRecipe>(Stage::Tile);
        tile.is_some_and(|recipe| recipe.measurement.starts_with(UNPACKED)) && is_packed()
    }

    /// The recipe of a stage, without an error where there is none: that would ask for advice in turn.
    fn recipe_if_any<T: Recipe>(&self, stage: Stage) -> Option<T> {
        let value = self.recipe_text(stage).ok().flatten()?;
        T::from_value(&value).ok()
    }

    /// The commands that make the result of a stage, with those of earlier stages that are missing too.
    pub(crate) fn how_to_make(&self, stage: Stage) -> String {
        let mut stages = vec![stage];
        while let Some(input) = stages.last().and_then(|last| last.input())
            && !self.has(input).unwrap_or(false)
        {
            stages.push(input);
        }
        let first = stages.last().copied();
        let commands: Vec<String> = match first {
            // Without a tile there is nothing yet, and one command makes it all.
            Some(Stage::Tile) => {
                let more = Stage::OPTIONAL.contains(&stage).then(|| self.command(stage));
                std::iter::once(format!("btf model {} {}", self.likely_measurement(), self.path().display()))
                    .chain(more)
                    .collect()
            }
            _ => stages.iter().rev().map(|&stage| self.command(stage)).collect(),
        };
        commands.join(", then ")
    }

    /// The command that runs a stage.
    pub(crate) fn command(&self, stage: Stage) -> String {
        let (name, model) = (stage.name(), self.path().display());
        match stage {
            Stage::Tile | Stage::Cluster | Stage::Normals | Stage::Components => {
                format!("btf {name} {} {model}", self.likely_measurement())
            }
            Stage::Fit | Stage::Appearance => format!("btf {name} {model}"),
        }
    }

    /// The measurement that it was made of where it is found, else a word for it.
    fn likely_measurement(&self) -> String {
        let digest = self.recipe_if_any::<TileRecipe>(Stage::Tile).map(|recipe| recipe.measurement);
        let name = measurement_name(self.path());
        let places = origin::places(self.path(), origin::MEASUREMENT, name.to_str());
        let found = places.into_iter().find(|place| {
            place.is_dir()
                && Measurement::open(place)
                    .is_ok_and(|there| digest.as_ref().is_none_or(|digest| there.digest() == digest))
        });
        found.map_or_else(|| "MEASUREMENT".to_owned(), |place| place.display().to_string())
    }
}

//! Which stages of a model are done, by which recipes, and with which checksums of their arrays.

use std::collections::BTreeMap;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::appearance::AppearanceRecipe;
use super::clusters::{ClusterRecipe, TakenRecipe};
use super::components::ComponentsRecipe;
use super::field::FitRecipe;
use super::normals::NormalsRecipe;
use super::tile::TileRecipe;
use super::{KIND, Model, Stage};
use crate::disk::lock::Lock;
use crate::disk::temporary::expect_own;
use crate::error::{Error, Result};
use crate::run::recipe::{self, Made, Recipe};
use crate::run::{Context, Existing};
use crate::store::is_of_array;
use crate::zarr::Layout;
use crate::zarr::metadata::OLDEST_FORMAT;

/// The attribute with an entry for each stage that is done.
pub(super) const STAGES: &str = "stages";

/// The stages that are done.
pub(super) type Entries = BTreeMap<Stage, Entry>;

/// What the attributes hold of a stage that is done.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    recipe: Value,
    digest: String,
    pub(super) report: Value,
    /// Of its arrays, by name; not in the oldest layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) checksums: Option<BTreeMap<String, String>>,
}

/// Name of the lock of a stage.
fn lock_name(stage: Stage) -> String {
    format!("-{}", stage.name())
}

impl Model {
    /// The stages that are done.
    pub(super) fn entries(&self) -> Result<Entries> {
        self.parse_entries(&self.store.expect(KIND)?)
    }

    /// The stages that are done, by the attributes of the root.
    fn parse_entries(&self, attributes: &Map<String, Value>) -> Result<Entries> {
        let damaged = |what: String| {
            Error::input(format!("{}: attribute btfkit.{STAGES}: {what}", self.path().display()))
                .hint("make the model anew, under another name")
        };
        let stages = attributes.get(STAGES).cloned().unwrap_or_default();
        let entries: Entries = serde_json::from_value(stages).map_err(|error| damaged(error.to_string()))?;
        for (stage, entry) in &entries {
            let name = stage.name();
            if entry.digest != recipe::digest(&entry.recipe) {
                return Err(damaged(format!("{name}: digest: it is not that of the recipe")));
            }
            if entry.checksums.is_none() && self.store.format() > OLDEST_FORMAT {
                return Err(damaged(format!("{name}: no checksums")));
            }
        }
        Ok(entries)
    }

    fn entry(&self, stage: Stage) -> Result<Option<Entry>> {
        Ok(self.entries()?.remove(&stage))
    }

    /// The entry of a stage that must be done, which must be the same whenever it is read.
    pub(super) fn done(&self, stage: Stage) -> Result<Entry> {
        self.seen(stage)?.ok_or_else(|| self.lacks(stage))
    }

    /// The same of a stage that may not be done yet.
    pub(super) fn seen(&self, stage: Stage) -> Result<Option<Entry>> {
        self.store.expect_unchanged()?;
        let entry = self.entry(stage)?;
        if let Some(entry) = &entry {
            self.store.see(stage.name(), &entry.digest);
            self.store.expect_unchanged()?;
        }
        Ok(entry)
    }

    /// Whether a stage is done, by whatever recipe.
    pub fn has(&self, stage: Stage) -> Result<bool> {
        Ok(self.entry(stage)?.is_some())
    }

    /// The recipe of a stage as it is stored, for people to read; none of one that is not done.
    pub fn recipe_text(&self, stage: Stage) -> Result<Option<Value>> {
        Ok(self.entry(stage)?.map(|entry| entry.recipe))
    }

    /// The recipe of a stage that must be done.
    ///
    /// # Errors
    /// Where it is not done, or its recipe is another stage's or holds what no recipe does.
    pub fn recipe<T: Recipe>(&self, stage: Stage) -> Result<T> {
        T::from_value(&self.done(stage)?.recipe).map_err(|what| {
            Error::input(format!("{}: recipe of {}: {what}", self.path().display(), stage.name()))
                .hint("if another version of the program made this model, make it anew")
        })
    }

    /// The report of a stage that is done.
    pub fn report<T: DeserializeOwned>(&self, stage: Stage) -> Result<T> {
        self.typed(stage, &self.done(stage)?.report)
    }

    pub(super) fn typed<T: DeserializeOwned>(&self, stage: Stage, report: &Value) -> Result<T> {
        serde_json::from_value(report.clone()).map_err(|error| {
            Error::input(format!("{}: report of {}: {error}", self.path().display(), stage.name()))
                .hint("if another version of the program made this model, make it anew")
        })
    }

    /// What a report holds that does not fit together.
    pub(super) fn damaged_report(&self, stage: Stage, what: &str) -> Error {
        Error::input(format!("{}: report of {}: {what}", self.path().display(), stage.name()))
            .hint("make the model anew, under another name")
    }

    /// Digest of the stage that a stage worked on, as its recipe names it; none of the first stage.
    ///
    /// # Errors
    /// As [`Model::recipe`].
    pub(crate) fn input_digest(&self, stage: Stage) -> Result<Option<String>> {
        Ok(match stage {
            Stage::Tile => {
                self.recipe::<TileRecipe>(stage)?;
                None
            }
            Stage::Cluster => Some(match self.recipe::<TakenRecipe>(stage) {
                Ok(recipe) => recipe.tile,
                Err(_) => self.recipe::<ClusterRecipe>(stage)?.tile,
            }),
            Stage::Normals => Some(self.recipe::<NormalsRecipe>(stage)?.tile),
            Stage::Fit => Some(self.recipe::<FitRecipe>(stage)?.normals),
            Stage::Appearance => Some(self.recipe::<AppearanceRecipe>(stage)?.cluster),
            Stage::Components => Some(self.recipe::<ComponentsRecipe>(stage)?.tile),
        })
    }

    /// Digest of a stage that must be done.
    pub(crate) fn stage_digest(&self, stage: Stage) -> Result<String> {
        Ok(self.done(stage)?.digest)
    }

    /// Digest of some stages together.
    pub fn digest_of(&self, stages: &[Stage]) -> Result<String> {
        let digests: Map<String, Value> = stages
            .iter()
            .map(|&stage| Ok((stage.name().to_owned(), json!(self.stage_digest(stage)?))))
            .collect::<Result<_>>()?;
        Ok(recipe::digest(&Value::Object(digests)))
    }

    /// Begins a stage and holds it against other processes; none where it is done by this recipe and
    /// its arrays are all there. Where results may be replaced, what another recipe made is taken back first, and with
    /// it every stage that builds on it.
    ///
    /// # Errors
    /// Where it has been run by another recipe.
    pub fn begin(&self, stage: Stage, recipe: &Value, context: &Context<'_>) -> Result<Option<Lock>> {
        let lock = self.store.lock(&lock_name(stage), context)?;
        self.store.sweep()?;
        if context.existing == Existing::Replace {
            self.take_back(stage, recipe, context)?;
        }
        if !self.is_done(stage, recipe)? {
            return Ok(Some(lock));
        }
        // Another program may have changed an array's attributes since.
        if !self.is_consolidated().unwrap_or(true) {
            let _lock = self.store.lock("", context)?;
            let attributes = self.store.expect(KIND)?;
            let entries = self.parse_entries(&attributes)?;
            self.write_root(attributes, entries)?;
        }
        Ok(None)
    }

    /// Takes back a stage that another recipe made, and those that build on it: their entries first, then their arrays.
    fn take_back(&self, stage: Stage, recipe: &Value, context: &Context<'_>) -> Result<()> {
        match self.entry(stage)? {
            Some(entry) if entry.digest != recipe::digest(recipe) => {}
            _ => return Ok(()),
        }
        // In the order of the data flow, as everybody takes them.
        let _later: Vec<Lock> = stage
            .builders()
            .iter()
            .map(|&stage| self.store.lock(&lock_name(stage), context))
            .collect::<Result<_>>()?;
        let mut arrays = Vec::new();
        {
            let _lock = self.store.lock("", context)?;
            let attributes = self.store.expect(KIND)?;
            let mut entries = self.parse_entries(&attributes)?;
            let mut later = Vec::new();
            for taken in stage.builders().iter().chain([&stage]) {
                let Some(entry) = entries.remove(taken) else { continue };
                let of_stage = self.arrays(*taken, &entry.report).unwrap_or_default();
                arrays.extend(of_stage.into_iter().map(|(name, _)| name));
                later.extend((*taken != stage).then_some(*taken));
            }
            // Before anything is taken back.
            for folder in arrays.iter().map(|array| self.path().join(array)).filter(|folder| folder.is_dir())
            {
                expect_own(&folder, |path| is_of_array(&folder, path))?;
            }
            self.write_root(attributes, entries)?;
            self.tell_taken(&later, context);
            stage.builders().iter().chain([&stage]).for_each(|taken| self.store.forget(taken.name()));
        }
        for array in arrays {
            self.store.remove(&array)?;
        }
        Ok(())
    }

    /// Says which stages went with the one that they were built on, and what makes them again; not those that follow by
    /// themselves.
    fn tell_taken(&self, taken: &[Stage], context: &Context<'_>) {
        let left = || taken.iter().filter(|stage| !(context.follows_up() && Stage::ALL.contains(stage)));
        if left().next().is_none() {
            return;
        }
        let names: Vec<&str> = left().map(|stage| stage.name()).collect();
        let commands: Vec<String> = left().map(|&stage| self.command(stage)).collect();
        context.progress.notice(&format!(
            "{}: what was built on it went with it: {}; to make it again: {}",
            self.path().display(),
            names.join(", "),
            commands.join(", then ")
        ));
    }

    /// Whether a stage is done by this recipe, and its arrays are all there.
    ///
    /// # Errors
    /// Where it has been run by another recipe.
    pub fn is_done(&self, stage: Stage, recipe: &Value) -> Result<bool> {
        let Some(entry) = self.entry(stage)? else { return Ok(false) };
        let place = format!("{} ({})", self.path().display(), stage.name());
        Made { digest: &entry.digest, recipe: &entry.recipe }.expect(Path::new(&place), recipe)?;
        self.has_arrays(stage)
    }

    /// Whether the arrays of a stage that is done are all there.
    pub(crate) fn has_arrays(&self, stage: Stage) -> Result<bool> {
        let report = self.done(stage)?.report;
        // Arrays that do not even have their metadata are not there.
        let Ok(arrays) = self.arrays(stage, &report) else { return Ok(false) };
        Ok(arrays.iter().all(|(name, layout)| {
            self.store.open_array(name, layout).is_ok_and(|array| self.store.has_all(&array))
        }))
    }

    /// Declares a stage done; to be called after its arrays are written.
    pub fn finish(
        &self,
        stage: Stage,
        recipe: &Value,
        report: &impl Serialize,
        context: &Context<'_>,
    ) -> Result<()> {
        let failed = |error: serde_json::Error| Error::internal(error.to_string());
        let report = serde_json::to_value(report).map_err(failed)?;
        let checksum = |(name, layout): (String, Layout<'_>)| {
            let array = self.store.open_array(&name, &layout)?;
            Ok((name, self.store.checksums(&array)?))
        };
        let checksums = self.arrays(stage, &report)?.into_iter().map(checksum).collect::<Result<_>>()?;
        let digest = recipe::digest(recipe);
        let entry = Entry { recipe: recipe.clone(), digest, report, checksums: Some(checksums) };
        // Another stage may be writing its own entry.
        let _lock = self.store.lock("", context)?;
        let attributes = self.store.expect(KIND)?;
        let mut entries = self.parse_entries(&attributes)?;
        entries.insert(stage, entry);
        self.write_root(attributes, entries)
    }

    /// Writes the root with the metadata of the arrays of all stages that are done, as far as they are there.
    fn write_root(&self, mut attributes: Map<String, Value>, entries: Entries) -> Result<()> {
        let arrays = |(&stage, entry): (&Stage, &Entry)| self.arrays(stage, &entry.report).ok();
        let arrays: Option<Vec<_>> = entries.iter().map(arrays).collect();
        let names =
            |arrays: Vec<Vec<(String, _)>>| arrays.into_iter().flatten().map(|(name, _)| name).collect();
        let names: Option<Vec<String>> = arrays.map(names);
        let entries = serde_json::to_value(entries).map_err(|error| Error::internal(error.to_string()))?;
        attributes.insert(STAGES.to_owned(), entries);
        match names.filter(|names| self.store.consolidated(names).is_ok()) {
            Some(names) => self.store.write_finished(attributes, &names),
            None => self.store.write_group("", attributes),
        }
    }

    /// Whether the root holds the metadata of all arrays as they are.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn is_consolidated(&self) -> Result<bool> {
        let mut names = Vec::new();
        for (stage, entry) in self.entries()? {
            names.extend(self.arrays(stage, &entry.report)?.into_iter().map(|(name, _)| name));
        }
        self.store.is_consolidated(&names)
    }
}

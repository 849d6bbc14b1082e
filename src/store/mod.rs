//! What lies on disk: Zarr v3 groups of arrays with attributes of ours (see `docs/reference/stores.md`).
//!
//! [`Store`] is a group with its arrays; [`measurement`], [`model`] and [`enlarged`] say which arrays.

pub mod clustering;
mod directions;
pub mod enlarged;
pub mod measurement;
pub mod model;
pub(crate) mod origin;
pub mod recognise;

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::disk::lock::Lock;
use crate::disk::temporary::{Temporary, remove_folder};
use crate::error::{Error, Result};
use crate::run::{Context, Existing, recipe};
use crate::zarr::{FORMAT, Store, metadata};

/// Name of the lock that whoever writes a store by a recipe shares with others who do.
const WRITING: &str = "-writing";

impl Store {
    /// Opens a store of this kind, and its attributes.
    ///
    /// # Errors
    /// As [`Store::expect`].
    pub fn open(path: &Path, kind: &str) -> Result<(Self, Map<String, Value>)> {
        let mut store = Self::at(path);
        let attributes = store.expect(kind)?;
        store.format = attributes.get("format").and_then(Value::as_u64).unwrap_or(FORMAT);
        store.opened = attributes.get("digest").and_then(Value::as_str).map(str::to_owned);
        Ok((store, attributes))
    }

    /// Waits until no other process holds the lock `name` of this store.
    pub fn lock(&self, name: &str, context: &Context<'_>) -> Result<Lock> {
        Lock::wait(self.path(), name, context)
    }

    /// Begins a store of this kind with these attributes, unless there is one; returns those that hold.
    ///
    /// # Errors
    /// Where there is something else.
    pub fn begin(
        &mut self,
        kind: &str,
        attributes: Map<String, Value>,
        context: &Context<'_>,
    ) -> Result<Map<String, Value>> {
        // Looked at before the lock, which makes a file: none in a folder that is not ours.
        self.expect_ours_or_nothing()?;
        let _lock = self.lock("", context)?;
        self.expect_ours_or_nothing()?;
        if self.attributes()?.is_none() {
            let own = [
                ("kind", json!(kind)),
                ("format", json!(FORMAT)),
                ("version", json!(env!("CARGO_PKG_VERSION"))),
            ];
            let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
            self.write_group("", own.chain(attributes).collect())?;
        }
        let found = self.expect(kind)?;
        self.format = found.get("format").and_then(Value::as_u64).unwrap_or(FORMAT);
        Ok(found)
    }

    /// Begins a store of this kind, or goes on with the one that the same recipe began; `more` are
    /// attributes beside the recipe. Where results may be replaced, another recipe's store of the same kind is removed.
    ///
    /// Returns a lock that keeps others from removing this one; it is to be held while the store is written.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] where another recipe's store lies there.
    pub fn begin_by_recipe(
        &mut self,
        kind: &str,
        recipe: &Value,
        more: Value,
        context: &Context<'_>,
    ) -> Result<Lock> {
        Temporary::sweep_beside(self.path());
        if context.existing == Existing::Replace {
            self.remove_another(kind, recipe, context)?;
        }
        let mut attributes = Map::new();
        attributes.insert("recipe".to_owned(), recipe.clone());
        attributes.insert("digest".to_owned(), json!(recipe::digest(recipe)));
        if let Value::Object(more) = more {
            attributes.extend(more);
        }
        let found = self.begin(kind, attributes, context)?;
        recipe::expect_same(self.path(), &found, recipe)?;
        let lock = Lock::share(self.path(), WRITING, context)?;
        // It may have been removed between.
        recipe::expect_same(self.path(), &self.expect(kind)?, recipe)?;
        self.sweep()?;
        Ok(lock)
    }

    /// Removes another recipe's store of this kind, or a damaged one, once nobody writes it any more.
    fn remove_another(&self, kind: &str, recipe: &Value, context: &Context<'_>) -> Result<()> {
        let is_another = || -> Result<bool> {
            match self.attributes() {
                Ok(None) => Ok(false),
                Ok(Some(_)) => Ok(recipe::expect_same(self.path(), &self.expect(kind)?, recipe).is_err()),
                Err(_) if self.claimed_kind().as_deref() == Some(kind) => Ok(true),
                Err(error) => Err(error),
            }
        };
        if !is_another()? {
            return Ok(());
        }
        let _lock = self.lock(WRITING, context)?;
        if !is_another()? {
            return Ok(());
        }
        remove_folder(self.path(), |path| {
            let is = |name: &str| path.file_name().is_some_and(|file| file == name);
            // Chunks lie in a folder `c` of their array.
            is(metadata::FILE)
                || path.components().any(|part| part.as_os_str() == "c")
                || [enlarged::state::NAME, origin::MODEL, origin::MEASUREMENT].into_iter().any(is)
        })
    }

    /// The kind that a root names, however damaged its other attributes are.
    fn claimed_kind(&self) -> Option<String> {
        let document = metadata::read_object(&self.metadata_path("")).ok()??;
        let kind = document.get("attributes")?.get("btfkit")?.get("kind")?;
        kind.as_str().map(str::to_owned)
    }

    fn expect_ours_or_nothing(&self) -> Result<()> {
        let occupied = match self.attributes()? {
            Some(_) => false,
            None => self.metadata_path("").exists() || recognise::other(self.path())?.is_some(),
        };
        if !occupied {
            return Ok(());
        }
        Err(Error::input(format!("{} exists and is not a Zarr store of this program", self.path().display()))
            .hint("choose another name for the result"))
    }

    /// The attributes of a store that must exist and be of this kind.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Missing`] where there is nothing; [`crate::ErrorKind::Input`] where there is something else,
    /// or a store whose attributes were changed: says what it is, and what to do.
    pub fn expect(&self, kind: &str) -> Result<Map<String, Value>> {
        self.expect_one_of(&[kind])
    }

    /// The attributes of a store that must exist and be of one of these kinds.
    ///
    /// # Errors
    /// As [`Store::expect`].
    pub fn expect_one_of(&self, kinds: &[&str]) -> Result<Map<String, Value>> {
        recognise::expect_readable(self.path())?;
        let Some(found) = self.attributes()? else {
            let other = match self.metadata_path("").exists() {
                true => Some(recognise::foreign(self.path())?),
                false => recognise::other(self.path())?,
            };
            return Err(match other {
                Some(other) => other.unexpected(self.path(), kinds),
                None => {
                    let expected = recognise::one_of(kinds);
                    Error::missing(format!("{}: no store here, expected {expected}", self.path().display()))
                        .hint(recognise::how_made(kinds))
                }
            });
        };
        let kind = found.get("kind").unwrap_or(&Value::Null);
        if kinds.iter().any(|expected| kind == expected) {
            return Ok(found);
        }
        Err(recognise::another_kind(self.path(), kind, kinds))
    }
}

//! What lies on disk: Zarr v3 groups of arrays with attributes of ours (see `docs/reference/stores.md`).
//!
//! [`Store`] is a group with its arrays; [`measurement`], [`model`] and [`enlarged`] say which arrays.

pub mod clustering;
mod directions;
pub mod enlarged;
pub mod measurement;
pub mod model;
pub(crate) mod origin;
pub(crate) mod packed;
pub mod recognise;

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::disk::lock::Lock;
use crate::disk::temporary::{Temporary, remove_folder};
use crate::error::{Error, Result};
use crate::run::recipe::{self, Made};
use crate::run::{Context, Existing};
use crate::zarr::{FORMAT, Store, metadata};

/// The kinds of store that a user names.
const KINDS: [&str; 3] = [measurement::KIND, model::KIND, enlarged::KIND];

/// Which kind of store lies at a path.
///
/// # Errors
/// As [`Store::expect`], where there is none of them.
pub fn kind_of(path: &Path) -> Result<&'static str> {
    kind_among(path, &KINDS)
}

/// The same among some kinds.
///
/// # Errors
/// As [`kind_of`].
pub(crate) fn kind_among(path: &Path, kinds: &[&'static str]) -> Result<&'static str> {
    let attributes = Store::at(path).expect_one_of(kinds)?;
    let kind = attributes.get("kind").and_then(Value::as_str).unwrap_or_default();
    let known = kinds.iter().find(|known| **known == kind);
    known.copied().ok_or_else(|| Error::internal(format!("{}: a store of kind {kind:?}", path.display())))
}

/// Whether a file of a store at `root` that a recipe makes is one that this program writes, by its way from the root.
fn is_own(root: &Path, path: &Path) -> bool {
    const ARRAYS: [&str; 14] = [
        "reflectance",
        "luminance",
        "view_direction",
        "view_theta",
        "view_phi",
        "light_direction",
        "light_theta",
        "light_phi",
        "index",
        "source",
        "normals",
        // Of the state of a clustering, in groups `pass_0000` and `part_00000`.
        "centres",
        "texels",
        "counts",
    ];
    let is_group = |name: &str| {
        ["pass_", "part_"].iter().any(|begin| {
            let digits = name.strip_prefix(begin).unwrap_or_default();
            !digits.is_empty() && digits.len() < 20 && digits.bytes().all(|byte| byte.is_ascii_digit())
        })
    };
    let Some(parts) = path.iter().map(|part| part.to_str()).collect::<Option<Vec<&str>>>() else {
        return false;
    };
    let groups = parts.iter().take_while(|name| is_group(name)).count();
    let array = parts.get(groups).filter(|name| ARRAYS.contains(name));
    match (array, &parts[groups..]) {
        (Some(_), [_, ..]) => {
            let folder: std::path::PathBuf = path.iter().take(groups + 1).collect();
            let within: std::path::PathBuf = path.iter().skip(groups + 1).collect();
            is_of_array(&root.join(folder), &within)
        }
        (None, [metadata::FILE | enlarged::state::NAME | origin::MODEL | origin::MEASUREMENT]) => true,
        _ => false,
    }
}

/// Whether a path in the folder of an array is one that a run writes: its metadata, or a chunk of those that there are.
pub(crate) fn is_of_array(folder: &Path, path: &Path) -> bool {
    let parts: Option<Vec<&str>> = path.iter().map(|part| part.to_str()).collect();
    match parts.as_deref() {
        Some([metadata::FILE]) => true,
        Some(["c", place @ ..]) => is_chunk(folder, place),
        _ => false,
    }
}

/// Whether an array has a chunk of this name. Of an array whose metadata are damaged every number is one.
fn is_chunk(folder: &Path, place: &[&str]) -> bool {
    let Some(place) = place.iter().map(|text| number(text)).collect::<Option<Vec<u64>>>() else {
        return false;
    };
    match grid_of(folder) {
        Some(grid) => {
            grid.len() == place.len() && place.iter().zip(grid).all(|(&number, length)| number < length)
        }
        None => !place.is_empty(),
    }
}

/// Chunks (or shards) of an array in each dimension, as its metadata claim.
fn grid_of(folder: &Path) -> Option<Vec<u64>> {
    let document = metadata::read_object(&folder.join(metadata::FILE)).ok()??;
    let list = |value: &Value| serde_json::from_value::<Vec<u64>>(value.clone()).ok();
    let shape = list(document.get("shape")?)?;
    let chunk = list(document.get("chunk_grid")?.get("configuration")?.get("chunk_shape")?)?;
    let divided = |(&length, &side): (&u64, &u64)| (side > 0).then(|| length.div_ceil(side));
    (shape.len() == chunk.len()).then(|| shape.iter().zip(&chunk).map(divided).collect())?
}

/// The number that a text is, as names of chunks are written.
fn number(text: &str) -> Option<u64> {
    text.parse().ok().filter(|number: &u64| number.to_string() == text)
}

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
        if let Some(digest) = attributes.get("digest").and_then(Value::as_str) {
            store.see("", digest);
        }
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
    pub(crate) fn begin_by_recipe(
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
        Made::of(&found).expect(self.path(), recipe)?;
        let lock = Lock::share(self.path(), WRITING, context)?;
        // It may have been removed between.
        Made::of(&self.expect(kind)?).expect(self.path(), recipe)?;
        self.sweep()?;
        Ok(lock)
    }

    /// Removes another recipe's store of this kind, or a damaged one, once nobody writes it any more.
    fn remove_another(&self, kind: &str, recipe: &Value, context: &Context<'_>) -> Result<()> {
        let is_another = || -> Result<bool> {
            match self.attributes() {
                Ok(None) => Ok(false),
                Ok(Some(_)) => Ok(Made::of(&self.expect(kind)?).expect(self.path(), recipe).is_err()),
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
        // Moved away with the rest, what others noted beside our attributes would be missed.
        let others: Vec<String> =
            self.root().ok().flatten().unwrap_or_default().into_iter().map(|(name, _)| name).collect();
        let others: Vec<&str> = others
            .iter()
            .map(String::as_str)
            .filter(|name| !["btfkit", "coordinates"].contains(name))
            .collect();
        if !others.is_empty() {
            context.progress.notice(&format!(
                "{} is made anew without the attributes that were added to it: {}",
                self.path().display(),
                others.join(", ")
            ));
        }
        remove_folder(self.path(), |path| is_own(self.path(), path))
    }

    /// The kind that a root names, however damaged its other attributes are.
    fn claimed_kind(&self) -> Option<String> {
        let document = metadata::read_object(&self.metadata_path("")).ok()??;
        let kind = document.get("attributes")?.get("btfkit")?.get("kind")?;
        kind.as_str().map(str::to_owned)
    }

    fn expect_ours_or_nothing(&self) -> Result<()> {
        // A link that leads nowhere is no free name.
        if self.path().is_symlink() {
            let found = recognise::expect_readable(self.path());
            found.map_err(|error| {
                Error::input(error.to_string()).hint("choose another name for the result")
            })?;
        }
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

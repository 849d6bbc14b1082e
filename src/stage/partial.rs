//! Results of single units, kept in a folder until all are there to be put together: for work whose result is a few
//! numbers, so that many jobs can share it.
//!
//! There is one file a unit, not one a job, so that the number of jobs changes nothing. A file is named by the digest of
//! all that its content depends on, and appears whole or not at all; two jobs that make the same write the same.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::disk::output::expect_outside_stores;
use crate::disk::temporary::{Temporary, write_file};
use crate::error::{Error, Result};
use crate::run::recipe;
use crate::run::shard::Shard;
use crate::words::counted;
use crate::zarr::metadata;

/// Where results of units are kept, and what a run does about them.
#[derive(Clone, Debug)]
pub struct Sharing {
    /// The folder.
    pub folder: PathBuf,
    /// The part of the units that this run does; none where it only puts results together.
    pub shard: Option<Shard>,
}

/// Work that runs share, as far as it is done by all of them.
#[derive(Clone, Debug)]
pub struct Shared<R> {
    /// How far it is, in words: `sums/1f0c: 3 of 9 views compared`.
    pub told: String,
    /// The result, once all units are done.
    pub result: Option<R>,
}

/// A work that is made of units, for [`Sharing::run`].
pub(crate) struct Work<'a> {
    /// All that its results depend on.
    pub(crate) what: &'a Value,
    /// How many units it has.
    pub(crate) units: usize,
    /// What a unit is, and what it is when it is done: `["view", "compared"]`.
    pub(crate) words: [&'a str; 2],
}

impl Sharing {
    /// Does this run's part of the units that are missing, by `make`, which keeps the result of each; where those of all
    /// units are there, puts them together in their order. `check` refuses a result that no unit has.
    ///
    /// # Errors
    /// Those of the steps; and [`crate::ErrorKind::Missing`] where nothing is to be done but something is missing.
    pub(crate) fn run<T: DeserializeOwned, R>(
        &self,
        work: &Work<'_>,
        check: impl Fn(&T) -> Result<()>,
        make: impl FnOnce(&[usize], &Partial) -> Result<()>,
        put_together: impl FnOnce(Vec<T>) -> Result<R>,
    ) -> Result<Shared<R>> {
        let partial = Partial::at(&self.folder, work.what)?;
        let kept = || {
            let read = |unit| {
                let Some(found) = partial.read::<T>(unit) else { return Ok(None) };
                check(&found).map(|()| Some(found)).map_err(|error| {
                    error
                        .context(partial.path(unit).display())
                        .hint("delete this file and run its part again")
                })
            };
            (0..work.units).map(read).collect::<Result<Vec<Option<T>>>>()
        };
        if let Some(shard) = self.shard {
            let found = kept()?;
            let missing: Vec<usize> =
                (0..work.units).filter(|&unit| shard.has(unit) && found[unit].is_none()).collect();
            make(&missing, &partial)?;
        }
        let results = kept()?;
        let done = results.iter().flatten().count();
        let [unit, finished] = work.words;
        let told =
            format!("{}: {done} of {} {finished}", partial.folder.display(), counted(work.units, unit));
        if done < work.units && self.shard.is_none() {
            return Err(Error::missing(told)
                .hint("run all parts first: the same command with --shard K/N instead of --reduce"));
        }
        let all: Option<Vec<T>> = results.into_iter().collect();
        Ok(Shared { told, result: all.map(put_together).transpose()? })
    }
}

/// Results of the units of one work.
pub(crate) struct Partial {
    folder: PathBuf,
    /// What each file has to hold: the digest of the work.
    digest: String,
}

impl Partial {
    /// Results in a folder, which is made; `what` is all that they depend on.
    ///
    /// # Errors
    /// Those of making the folder, and a place inside of a store.
    fn at(folder: &Path, what: &Value) -> Result<Self> {
        let digest = recipe::digest(what);
        let folder = folder.join(recipe::shortened(&digest));
        expect_outside_stores(&folder)?;
        std::fs::create_dir_all(&folder).map_err(|error| Error::io("make", &folder, error))?;
        Ok(Self { folder, digest })
    }

    /// The file of a unit.
    fn path(&self, unit: usize) -> PathBuf {
        self.folder.join(format!("{unit}.json"))
    }

    /// The result of a unit; `None` where it is not there, or damaged: then it has to be made again.
    fn read<T: DeserializeOwned>(&self, unit: usize) -> Option<T> {
        let bytes = metadata::read_file(&self.path(unit)).ok()??;
        let mut document: Value = serde_json::from_slice(&bytes).ok()?;
        let value = document.get_mut("value")?.take();
        let seal = document.get("digest")?.as_str()?;
        if seal != self.seal(unit, &value) {
            return None;
        }
        serde_json::from_value(value).ok()
    }

    /// Keeps the result of a unit.
    ///
    /// # Errors
    /// Those of writing; and [`crate::ErrorKind::Internal`] for a result that could not be read back, such as one that is
    /// no number: it would be missing for ever.
    pub(crate) fn write<T: Serialize + DeserializeOwned>(&self, unit: usize, value: &T) -> Result<()> {
        let value = serde_json::to_value(value).map_err(|error| Error::internal(error.to_string()))?;
        serde_json::from_value::<T>(value.clone())
            .map_err(|error| Error::internal(format!("result of unit {unit}: {error}")))?;
        let document = json!({"digest": self.seal(unit, &value), "value": value});
        let path = self.path(unit);
        Temporary::sweep_beside(&path);
        write_file(&path, document.to_string().as_bytes())
    }

    /// The digest of a unit's result within this work.
    fn seal(&self, unit: usize, value: &Value) -> String {
        recipe::digest(&json!({"work": self.digest, "unit": unit, "value": value}))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_result_comes_back_as_it_was_and_a_changed_or_exchanged_one_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let partial = Partial::at(folder.path(), &json!({"a": 1})).unwrap();
        let values = vec![0.1 + 0.2, 1.0 / 3.0, f64::MAX, 5e-324, 1e16 + 2.0];
        partial.write(3, &values).unwrap();
        assert_eq!(partial.read::<Vec<f64>>(3), Some(values.clone()));
        assert_eq!(partial.read::<Vec<f64>>(2), None);
        // Another work has its own.
        assert!(partial.write(5, &vec![f64::NAN]).is_err());
        let other = Partial::at(folder.path(), &json!({"a": 2})).unwrap();
        assert_eq!(other.read::<Vec<f64>>(3), None);
        std::fs::copy(partial.path(3), partial.path(4)).unwrap();
        std::fs::copy(partial.path(3), other.path(3)).unwrap();
        assert_eq!((partial.read::<Vec<f64>>(4), other.read::<Vec<f64>>(3)), (None, None));
        let bytes = std::fs::read(partial.path(3)).unwrap();
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 1;
            std::fs::write(partial.path(3), &changed).unwrap();
            // Some last digits say the same number.
            assert!(partial.read::<Vec<f64>>(3).is_none_or(|found| found == values), "byte {at}");
            std::fs::write(partial.path(3), &bytes[..at]).unwrap();
            assert_eq!(partial.read::<Vec<f64>>(3), None, "cut after {at}");
        }
    }
}

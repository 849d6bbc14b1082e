//! `demo.json`: what the folder is a demo of, and how long each step took when it was run.

use std::path::PathBuf;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::disk::mapped::MappedFile;
use crate::disk::temporary::write_file;
use crate::error::{Error, Result};
use crate::run::recipe;
use crate::run::recipe::Made;

/// A step and the time that it took.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Step {
    /// Its name: the stage's, or what it makes.
    pub name: String,
    /// Wall time in seconds, over all runs that it took to finish.
    pub seconds: f64,
    /// Whether it has been finished.
    pub finished: bool,
}

/// The steps of a demo so far, kept in its folder so that a later run can tell them.
pub(super) struct Times {
    path: PathBuf,
    recipe: Value,
    pub(super) steps: Vec<Step>,
}

impl Times {
    /// Reads the record at `path`, or begins one.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] where the folder holds another demo.
    pub(super) fn open(path: PathBuf, recipe: Value) -> Result<Self> {
        let steps = match MappedFile::open(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(Error::io("read", &path, error)),
            Ok(bytes) => {
                let damaged = |error| Error::input(format!("{}: {error}", path.display()));
                let found: Value = serde_json::from_slice(bytes.as_ref()).map_err(damaged)?;
                Made::of(&found.as_object().cloned().unwrap_or_default()).expect(&path, &recipe)?;
                serde_json::from_value(found.get("steps").cloned().unwrap_or_default()).map_err(damaged)?
            }
        };
        let times = Self { path, recipe, steps };
        times.write()?;
        Ok(times)
    }

    fn write(&self) -> Result<()> {
        let value =
            json!({"recipe": self.recipe, "digest": recipe::digest(&self.recipe), "steps": self.steps});
        let bytes = serde_json::to_vec_pretty(&value).map_err(|error| Error::internal(error.to_string()))?;
        write_file(&self.path, &bytes)
    }

    /// Runs a step and records its time. A step whose result was `found` keeps the time that is recorded.
    pub(super) fn time<T>(&mut self, name: &str, found: bool, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let began = Instant::now();
        let result = work();
        let at = self.steps.iter().position(|step| step.name == name).unwrap_or_else(|| {
            self.steps.push(Step { name: name.to_owned(), seconds: 0.0, finished: false });
            self.steps.len() - 1
        });
        let step = &mut self.steps[at];
        if found && step.finished {
            return result;
        }
        // A result that went missing is made anew; one that was stopped early is gone on with.
        let before = if step.finished { 0.0 } else { step.seconds };
        (step.seconds, step.finished) = (before + began.elapsed().as_secs_f64(), result.is_ok());
        self.write()?;
        result
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::error::ErrorKind;

    fn wait(milliseconds: u64) {
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
    }

    #[test]
    fn a_step_keeps_its_time_until_it_is_run_again() {
        let folder = tempfile::tempdir().unwrap();
        let open = || Times::open(folder.path().join("demo.json"), json!({"material": "wood"})).unwrap();
        let seconds = |times: &Times| times.steps[0].seconds;
        let stopped = || {
            wait(30);
            Err::<(), Error>(Error::stopped())
        };
        open().time("import", false, stopped).unwrap_err();
        let mut times = open();
        assert!(!times.steps[0].finished && seconds(&times) >= 0.03);
        let finished = || {
            wait(30);
            Ok(())
        };
        times.time("import", false, finished).unwrap();
        assert!(times.steps[0].finished && seconds(&times) >= 0.06);
        let both = seconds(&times);
        let mut times = open();
        times.time("import", true, || Ok(())).unwrap();
        assert_eq!(seconds(&times), both);
        times.time("import", false, || Ok(())).unwrap();
        assert!(seconds(&times) < 0.03);
    }

    #[test]
    fn the_folder_of_another_demo_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let open = |material: &str| {
            Times::open(folder.path().join("demo.json"), json!({"material": material})).map(|_| ())
        };
        open("wood").unwrap();
        assert_eq!(open("leather").unwrap_err().kind(), ErrorKind::Recipe);
        open("wood").unwrap();
    }
}

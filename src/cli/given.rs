//! The options that a command was given, so that those without effect are refused and none is ignored in silence.

use std::path::{Path, PathBuf};

use btfkit::error::{Error, Result};
use btfkit::store;
use btfkit::store::recognise::article;
use clap::parser::ValueSource;

use super::help;
use super::source::SourceArgs;

/// Options from the command line: their names in the program, and as they are written.
pub(super) struct Given(Vec<(String, String)>);

impl Given {
    pub(super) fn of(matches: &clap::ArgMatches) -> Self {
        let Some((name, found)) = matches.subcommand() else { return Self(Vec::new()) };
        let command = help::command();
        let is_given = |id: &str| {
            // Groups are among the names that were found, too.
            matches!(found.try_contains_id(id), Ok(true))
                && found.value_source(id) == Some(ValueSource::CommandLine)
        };
        let arguments = command.find_subcommand(name).into_iter().flat_map(clap::Command::get_arguments);
        let options =
            arguments.filter_map(|argument| Some((argument.get_id().as_str(), argument.get_long()?)));
        let given = options.filter(|(id, _)| is_given(id));
        Self(given.map(|(id, long)| (id.to_owned(), format!("--{long}"))).collect())
    }

    /// Refuses options that would change nothing; `why` goes on from there.
    pub(super) fn refuse(&self, is_idle: impl Fn(&str) -> bool, why: &str, hint: &str) -> Result<()> {
        match self.0.iter().find(|(id, _)| is_idle(id)) {
            None => Ok(()),
            Some((_, option)) => {
                Err(Error::usage(format!("{option} changes nothing {why}"))
                    .hint(format!("leave it out{hint}")))
            }
        }
    }

    /// Whether an option was given, by its name in the program.
    pub(super) fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(id, _)| id == name)
    }

    /// Refuses these options.
    pub(super) fn refuse_these(&self, idle: &[&str], why: &str) -> Result<()> {
        self.refuse(|name| idle.contains(&name), why, "")
    }

    /// Refuses the options that some arguments describe.
    pub(super) fn refuse_all<A: clap::Args>(&self, why: &str, hint: &str) -> Result<()> {
        let command = A::augment_args(clap::Command::new(""));
        self.refuse(|name| command.get_arguments().any(|argument| argument.get_id() == name), why, hint)
    }

    /// Refuses what concerns archives where a store was given, and more than one of those.
    pub(super) fn refuse_for_stores(&self, paths: &[PathBuf]) -> Result<()> {
        self.refuse_all::<SourceArgs>("of a store: it says how an archive is read", "")?;
        match paths {
            [store, _, ..] => {
                Err(Error::usage(format!("{} is a store, no piece of an archive", store.display()))
                    .hint("leave out --pieces: each store is looked at by itself"))
            }
            _ => Ok(()),
        }
    }
}

/// A store that a command names, and the kinds that it may be of.
pub(super) type Expected<'a> = (&'a Path, &'a [&'a str]);

/// Refuses two stores that are named in each other's place; `line` is the command as it was meant.
pub(super) fn expect_in_order([first, second]: [Expected<'_>; 2], line: &str) -> Result<()> {
    let is = |path: &Path, kinds: &[&str]| kind_at(path).filter(|kind| kinds.contains(kind));
    match (is(first.0, second.1), is(second.0, first.1)) {
        (Some(of_first), Some(of_second)) => Err(Error::usage(format!(
            "{} is {} and {} is {}, expected them the other way round",
            first.0.display(),
            article(of_first),
            second.0.display(),
            article(of_second)
        ))
        .hint(line)),
        _ => Ok(()),
    }
}

/// The kind of the store at a path, where a whole one of ours lies there.
pub(super) fn kind_at(path: &Path) -> Option<&'static str> {
    store::kind_of(path).ok()
}

/// Whether a path is that of a store, made or to be made.
pub(super) fn is_store(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zarr") || path.join("zarr.json").exists()
}

//! What the outputs of one or of many inputs are called, the same for every command that makes a store of a store.

use std::path::{Path, PathBuf};

use super::given::kind_at;
use btfkit::error::{Error, Result};
use btfkit::names::{ends_with, with_ending};
use btfkit::zarr::Store;

/// An input and the output to make of it.
pub(super) struct Pair {
    pub(super) input: PathBuf,
    pub(super) output: PathBuf,
}

/// How a command names what it makes.
pub(super) struct Naming<'a> {
    /// The kind of store that it reads.
    pub(super) reads: &'static str,
    /// How names of such stores end; a name with this ending is never an output.
    pub(super) ending: Option<&'a str>,
    /// What the ending of an input is exchanged for.
    pub(super) becomes: &'a str,
}

impl Naming<'_> {
    /// Pairs names from the command line. Of two names the second is the output, unless it is a store of the kind that
    /// is read; of more, and with a folder to put outputs into, every name is an input.
    ///
    /// # Errors
    /// Two inputs that would become one output.
    pub(super) fn pairs(&self, names: &[PathBuf], into: Option<&Path>) -> Result<Vec<Pair>> {
        if let ([input, output], None) = (names, into)
            && !self.is_input(output)
        {
            return Ok(vec![Pair { input: input.clone(), output: output.clone() }]);
        }
        if let ([first, second], None) = (names, into)
            && kind_at(second) == Some(self.reads)
            && self.is_output_named_first(first)
        {
            let (first, second, reads) = (first.display(), second.display(), self.reads);
            return Err(Error::usage(format!("{first}: no {reads}, but {second} is one"))
                .hint(format!("what is read is named first, what is made last: {second} {first}")));
        }
        // Nothing is begun where a name is wrong, or stands in another's place.
        if let ([_, .., last], None) = (names, into)
            && last.symlink_metadata().is_err()
        {
            return Err(Error::missing(format!("{}: no such {}", last.display(), self.reads)).hint(format!(
                "the result of one input is named last, and does not end in {}; for many inputs use --into FOLDER",
                self.ending.unwrap_or_default()
            )));
        }
        let pair = |input: &PathBuf| Pair { input: input.clone(), output: self.output(input, into) };
        let pairs: Vec<Pair> = names.iter().map(pair).collect();
        match wanted_twice(pairs.iter().map(|pair| pair.output.as_path())) {
            None => Ok(pairs),
            Some(output) => Err(Error::usage(format!("two inputs would both become {}", output.display()))
                .hint("give them one by one and name the outputs")),
        }
    }

    /// Whether the first of two names, of which the second is an input, is a result: nothing is there yet, or another
    /// kind of store.
    fn is_output_named_first(&self, name: &Path) -> bool {
        let by_ending = self.ending.is_some_and(|ending| ends_with(name, ending));
        !by_ending
            && (name.symlink_metadata().is_err() || kind_at(name).is_some_and(|kind| kind != self.reads))
    }

    fn is_input(&self, name: &Path) -> bool {
        let by_ending = self.ending.is_some_and(|ending| ends_with(name, ending));
        by_ending || Store::at(name).expect_one_of(&[self.reads]).is_ok()
    }

    /// The output of an input: beside it, or in a folder.
    fn output(&self, input: &Path, into: Option<&Path>) -> PathBuf {
        let endings: Vec<&str> = self.ending.into_iter().chain([".zarr"]).collect();
        let name = with_ending(input, &endings, self.becomes);
        match into {
            Some(folder) => folder.join(name),
            // A trailing slash would make the input its own folder.
            None => input.components().collect::<PathBuf>().with_file_name(name),
        }
    }
}

/// An output that two inputs would become, if there is one.
pub(super) fn wanted_twice<'a>(outputs: impl Iterator<Item = &'a Path>) -> Option<&'a Path> {
    let mut outputs: Vec<&Path> = outputs.collect();
    outputs.sort();
    outputs.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}

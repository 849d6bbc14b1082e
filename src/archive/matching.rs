//! Which file a list means: lists are written on other machines, for other folders, before files are renamed.
//!
//! A name in a list means the file that is called so. If there is none, it means the one that differs in the Unicode
//! form only (macOS takes letters apart), then in case, then in the ending, where both are those of pictures (a list
//! for raw files, and the JPEGs of them). Of several files of the name, the one with the longest common end of the path
//! is meant, then the one beside the list. What is still ambiguous is refused.

use std::collections::HashMap;
use std::path::Path;

use unicode_normalization::UnicodeNormalization;

use crate::error::{Error, Result};

/// How a name in a list may differ from the file's, from best to worst.
const LEVELS: [&str; 4] = ["", "in its Unicode form", "in case", "in its ending"];

/// Endings of camera raws and of other pictures that are not read but may have been, before they were converted.
const OTHER_PICTURES: [&str; 31] = [
    "3fr", "arw", "avif", "bmp", "cr2", "cr3", "crw", "dng", "erf", "fff", "gif", "heic", "heif", "iiq",
    "jp2", "jpe", "jxl", "kdc", "mef", "mos", "mrw", "nef", "nrw", "orf", "pef", "psd", "raf", "raw", "rw2",
    "srw", "webp",
];

/// Whether a name ends as one of a picture does. (`foo.v2` does not, nor does `p0.png 0.5`: what follows the point
/// there is part of the name, without which it may mean another file.)
fn is_any_picture(name: &str) -> bool {
    let other =
        |(_, ending): (&str, &str)| OTHER_PICTURES.iter().any(|known| known.eq_ignore_ascii_case(ending));
    super::files::is_picture(name) || name.rsplit_once('.').is_some_and(other)
}

/// What a name is compared by, at each level.
fn at_level(name: &str, level: usize) -> String {
    let composed = || name.nfc().collect::<String>();
    match level {
        0 => name.to_owned(),
        1 => composed(),
        2 => composed().to_lowercase(),
        _ => stem(&composed().to_lowercase()).to_owned(),
    }
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

fn parts(path: &str) -> impl DoubleEndedIterator<Item = &str> {
    path.split(['/', '\\']).filter(|part| !part.is_empty())
}

/// The files of an archive, to be found by names in lists.
pub(super) struct Matcher<'a> {
    names: Vec<&'a str>,
    /// By the loosest form of the last part.
    by_stem: HashMap<String, Vec<usize>>,
    /// Names for messages.
    shown: &'a dyn Fn(usize) -> String,
}

/// A file that a list names.
pub(super) struct Listed<'a> {
    /// Path inside the list's folder.
    pub(super) file: &'a str,
    /// With all folders that the list gives.
    pub(super) path: &'a str,
}

/// A file that was found, and in what its name differs from the list's, if in anything.
pub(super) struct Match {
    pub(super) number: usize,
    pub(super) differs: Option<&'static str>,
}

impl<'a> Matcher<'a> {
    pub(super) fn new(names: impl Iterator<Item = &'a str>, shown: &'a dyn Fn(usize) -> String) -> Self {
        let names: Vec<&str> = names.collect();
        let mut by_stem: HashMap<String, Vec<usize>> = HashMap::new();
        for (number, name) in names.iter().enumerate() {
            let last = parts(name).next_back().unwrap_or_default();
            by_stem.entry(at_level(last, LEVELS.len())).or_default().push(number);
        }
        Self { names, by_stem, shown }
    }

    /// The file that is meant by a list that lies in `folder`.
    ///
    /// # Errors
    /// Says that there is none, or names those that may be meant.
    pub(super) fn find(&self, listed: &Listed<'_>, folder: &Path) -> Result<Match> {
        let last = parts(listed.path).next_back().unwrap_or_default();
        let candidates = self.by_stem.get(&at_level(last, LEVELS.len())).map_or(&[][..], Vec::as_slice);
        for (level, difference) in LEVELS.into_iter().enumerate() {
            let wanted = at_level(last, level);
            let fits = |&&number: &&usize| {
                let name = parts(self.names[number]).next_back().unwrap_or_default();
                at_level(name, level) == wanted
                    && (level < 3 || is_any_picture(last) && super::files::is_picture(name))
            };
            let found: Vec<usize> = candidates.iter().filter(fits).copied().collect();
            if found.is_empty() {
                continue;
            }
            let differs = Some(difference).filter(|difference| !difference.is_empty());
            return match self.meant(&found, listed, folder) {
                Ok(number) => Ok(Match { number, differs }),
                Err(several) => {
                    let names: Vec<String> = several.iter().map(|&number| (self.shown)(number)).collect();
                    Err(Error::input(format!(
                        "lists {:?}, which is there {} times: {}",
                        listed.path,
                        names.len(),
                        names.join(", ")
                    ))
                    .hint("name the folder in the list, or take the others away"))
                }
            };
        }
        Err(Error::input(format!("lists {:?}, which is not there", listed.path)))
    }

    /// The one of these with the longest common end, or beside the list; else all that are left.
    fn meant(
        &self,
        found: &[usize],
        listed: &Listed<'_>,
        folder: &Path,
    ) -> std::result::Result<usize, Vec<usize>> {
        let common = |number: usize| {
            // The last part is the same as far as that is asked for.
            let (a, b) = (parts(self.names[number]).rev().skip(1), parts(listed.path).rev().skip(1));
            a.zip(b).take_while(|(a, b)| at_level(a, 2) == at_level(b, 2)).count()
        };
        let longest = found.iter().map(|&number| common(number)).max().unwrap_or(0);
        let left: Vec<usize> = found.iter().copied().filter(|&number| common(number) == longest).collect();
        let beside = folder.join(listed.file);
        let beside = beside.parent().unwrap_or(folder);
        let near = |&&number: &&usize| Path::new(self.names[number]).parent() == Some(beside);
        let mut nearest = left.iter().filter(near);
        match (left.as_slice(), nearest.next(), nearest.next()) {
            (&[only], ..) | (_, Some(&only), None) => Ok(only),
            _ => Err(left),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn found(names: &[&str], path: &str) -> std::result::Result<(String, Option<&'static str>), String> {
        let shown = |number: usize| names[number].to_owned();
        let matcher = Matcher::new(names.iter().copied(), &shown);
        let file = path.rsplit('/').next().unwrap();
        let listed = Listed { file, path };
        let found = matcher.find(&listed, Path::new("set")).map_err(|error| error.to_string())?;
        Ok((names[found.number].to_owned(), found.differs))
    }

    #[test]
    fn the_best_that_there_is_is_meant() {
        let composed = "set/\u{fc}1.jpg";
        for (names, path, name, differs) in [
            (&["set/a.jpg", "set/A.jpg"][..], "a.jpg", "set/a.jpg", None),
            (&["set/a.jpg", "set/b.jpg"], "A.JPG", "set/a.jpg", Some("in case")),
            (&["set/a.jpg", "set/a.txt"], "a.CR2", "set/a.jpg", Some("in its ending")),
            (&[composed], "u\u{308}1.jpg", composed, Some("in its Unicode form")),
            (&["set/raw/a.jpg", "set/jpeg/a.jpg"], "x/jpeg/a.jpg", "set/jpeg/a.jpg", None),
            (&["set/raw/a.jpg", "set/Jpeg/a.jpg"], "x/jpeg/a.jpg", "set/Jpeg/a.jpg", None),
            (&["set/a.jpg", "set/raw/a.jpg"], "a.jpg", "set/a.jpg", None),
            (&["set/a.jpg", "set/raw/a.jpg"], "other/a.jpg", "set/a.jpg", None),
            (&["set/x/a.jpg"], "a.jpg", "set/x/a.jpg", None),
            (&["set/a.v2.jpg"], "a.v2.Tif", "set/a.v2.jpg", Some("in its ending")),
        ] {
            assert_eq!(found(names, path), Ok((name.to_owned(), differs)), "{path} of {names:?}");
        }
    }

    #[test]
    fn what_is_ambiguous_or_missing_is_refused_by_name() {
        for (names, path, words) in [
            (&["set/x/a.jpg", "set/y/a.jpg"][..], "a.jpg", "there 2 times: set/x/a.jpg, set/y/a.jpg"),
            (&["set/a.jpg", "set/A.jpg"], "A.JPG", "there 2 times"),
            (&["set/a.jpg", "set/a.png"], "a.CR2", "there 2 times"),
            (&["set/a.txt"], "a.jpg", "not there"),
            (&["set/b.jpg"], "a.jpg", "not there"),
            (&["set/a.jpg"], "a.v2", "not there"),
            (&["set/a.jpg"], "a.png 0.5", "not there"),
            (&["set/a.jpg"], "a.5", "not there"),
            (&["set/a.jpg"], "a", "not there"),
            (&["set/a.png"], "a.png 1", "not there"),
        ] {
            let error = found(names, path).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}

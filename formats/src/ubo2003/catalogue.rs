//! Which entry is the image of which view and light, and what is missing.

use std::fmt;

use super::{Angles, parse_name};

/// Missing pairs that are listed one by one; more are only counted, since a few names can lack millions.
const MAX_LISTED: usize = 1 << 16;

/// Pairs of each kind that [`CatalogueErrors`] spells out when displayed.
const MAX_SHOWN: usize = 20;

/// Names of one duplicate that are spelled out when displayed.
const MAX_NAMES_SHOWN: usize = 4;

/// A complete set of images: one for every view and light.
///
/// Views and lights are sorted by theta, then phi; the published sets are numbered in that order. All views
/// have the same lights. A set of one view, or of one light, is legal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Catalogue {
    views: Vec<Angles>,
    lights: Vec<Angles>,
    /// Position in the list of names, `[view][light]`.
    images: Vec<usize>,
    ignored: usize,
}

/// One view and one light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// Direction to the viewer.
    pub view: Angles,
    /// Direction to the light.
    pub light: Angles,
}

impl fmt::Display for Pair {
    /// As in file names, in degrees without leading zeros.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Pair { view, light } = self;
        let (tl, pl) = (light.theta_deg(), light.phi_deg());
        write!(f, "tl{tl} pl{pl} tv{} pv{}", view.theta_deg(), view.phi_deg())
    }
}

/// A pair of directions that has more than one image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Duplicate {
    /// The pair.
    pub pair: Pair,
    /// The names of all its images, in the order given.
    pub names: Vec<String>,
}

/// Why a list of names is not a complete set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.describe())]
pub struct CatalogueErrors {
    /// Views that any image has.
    pub views: usize,
    /// Lights that any image has.
    pub lights: usize,
    /// Names that are images.
    pub images: usize,
    /// Names that are not.
    pub ignored: usize,
    /// Pairs of these views and lights without an image, sorted: all, or the first 65 536.
    pub missing: Vec<Pair>,
    /// Number of all pairs without an image.
    pub missing_count: u64,
    /// Pairs with several images, sorted: all.
    pub duplicates: Vec<Duplicate>,
}

impl Catalogue {
    /// Sorts out a list of entry or file names. Names that are not images are counted and otherwise ignored.
    ///
    /// # Errors
    ///
    /// Everything that keeps the set from being complete, at once: all pairs that are missing, all that are
    /// there twice; or that no name is an image.
    pub fn from_names<'a>(
        names: impl IntoIterator<Item = &'a str>,
    ) -> Result<Catalogue, Box<CatalogueErrors>> {
        let mut ignored = 0usize;
        let mut found: Vec<(Pair, usize, &str)> = Vec::new();
        for (position, name) in names.into_iter().enumerate() {
            match parse_name(name) {
                Some(image) => found.push((Pair { view: image.view, light: image.light }, position, name)),
                None => ignored = ignored.saturating_add(1),
            }
        }
        found.sort_unstable_by_key(|&(pair, position, _)| (pair, position));
        let views = distinct(found.iter().map(|(pair, ..)| pair.view));
        let lights = distinct(found.iter().map(|(pair, ..)| pair.light));

        let groups = || found.chunk_by(|(a, ..), (b, ..)| a == b);
        let duplicates: Vec<Duplicate> = groups().filter_map(duplicate).collect();
        let pairs = count(views.len()).saturating_mul(count(lights.len()));
        let missing_count = pairs.saturating_sub(count(groups().count()));
        if found.is_empty() || missing_count > 0 || !duplicates.is_empty() {
            let present = groups().filter_map(|group| Some(group.first()?.0));
            let listed = usize::try_from(missing_count).unwrap_or(usize::MAX).min(MAX_LISTED);
            return Err(Box::new(CatalogueErrors {
                views: views.len(),
                lights: lights.len(),
                images: found.len(),
                ignored,
                missing: gaps(&views, &lights, present).take(listed).collect(),
                missing_count,
                duplicates,
            }));
        }
        // Complete and sorted by view, then light: the list is the grid.
        let images = found.iter().map(|&(_, position, _)| position).collect();
        Ok(Catalogue { views, lights, images, ignored })
    }

    /// Directions of the views, sorted.
    pub fn views(&self) -> &[Angles] {
        &self.views
    }

    /// Directions of the lights, sorted; the same for every view.
    pub fn lights(&self) -> &[Angles] {
        &self.lights
    }

    /// Position, in the list that the catalogue was made from, of the image of view number `view` and light
    /// number `light`; `None` if there is no such view or light.
    pub fn image(&self, view: usize, light: usize) -> Option<usize> {
        if light >= self.lights.len() {
            return None;
        }
        let at = view.checked_mul(self.lights.len())?.checked_add(light)?;
        self.images.get(at).copied()
    }

    /// How many names were not images.
    pub fn ignored(&self) -> usize {
        self.ignored
    }
}

fn distinct(directions: impl Iterator<Item = Angles>) -> Vec<Angles> {
    let mut list: Vec<Angles> = directions.collect();
    list.sort_unstable();
    list.dedup();
    list
}

/// The pairs of the grid that are not in `present`, which is sorted and a part of the grid.
fn gaps(
    views: &[Angles],
    lights: &[Angles],
    present: impl Iterator<Item = Pair>,
) -> impl Iterator<Item = Pair> {
    let grid = views.iter().flat_map(|&view| lights.iter().map(move |&light| Pair { view, light }));
    let mut present = present.peekable();
    grid.filter(move |pair| present.next_if_eq(pair).is_none())
}

fn count(n: usize) -> u64 {
    u64::try_from(n).unwrap_or(u64::MAX)
}

fn duplicate(group: &[(Pair, usize, &str)]) -> Option<Duplicate> {
    match group {
        [(pair, ..), _, ..] => {
            let names = group.iter().map(|&(_, _, name)| name.to_owned()).collect();
            Some(Duplicate { pair: *pair, names })
        }
        _ => None,
    }
}

impl Duplicate {
    fn describe(&self) -> String {
        let shown: Vec<String> = self.names.iter().take(MAX_NAMES_SHOWN).map(|n| format!("{n:?}")).collect();
        let more = self.names.len().saturating_sub(MAX_NAMES_SHOWN);
        let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}: {}{tail}", self.pair, shown.join(", "))
    }
}

impl CatalogueErrors {
    fn describe(&self) -> String {
        if self.images == 0 {
            return format!(
                "found no image among {} names, expected names like `00000 tl000 pl000 tv000 pv000.jpg`",
                self.ignored
            );
        }
        let mut text = format!(
            "found {} images of {} views and {} lights, expected one for every pair",
            self.images, self.views, self.lights
        );
        let missing = self.missing.iter().map(ToString::to_string);
        push_list(&mut text, "missing", missing, self.missing_count);
        let doubled = self.duplicates.iter().map(Duplicate::describe);
        push_list(&mut text, "more than once", doubled, count(self.duplicates.len()));
        text
    }
}

/// Appends the first items of a list, one a line, and how many more there are.
fn push_list(text: &mut String, title: &str, items: impl Iterator<Item = String>, total: u64) {
    if total == 0 {
        return;
    }
    text.push_str(&format!("\n{title}: {total}"));
    for item in items.take(MAX_SHOWN) {
        text.push_str("\n  ");
        text.push_str(&item);
    }
    let more = total.saturating_sub(count(MAX_SHOWN));
    if more > 0 {
        text.push_str(&format!("\n  and {more} more"));
    }
}

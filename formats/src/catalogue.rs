//! Which file is the image of which view and light, and what is missing.

use std::fmt;

use crate::spare::{Without, kept, spare};
use crate::words::counted;
use crate::{Angles, azimuth_digits, six_digits};

/// Missing pairs that are listed one by one; more are only counted, since a few names can lack millions.
const MAX_LISTED: usize = 1 << 16;

/// Pairs of each kind that [`CatalogueErrors`] spells out when displayed.
const MAX_SHOWN: usize = 20;

/// Names of one duplicate that are spelled out when displayed.
const MAX_NAMES_SHOWN: usize = 4;

/// Directions nearer to each other than this are one: sets write them with few digits, or as vectors.
const SAME_RAD: f64 = 1e-6;

/// A complete set of images: one for every view and light, but for those that are left out.
///
/// Views and lights are sorted by theta, then phi; the published sets are numbered in that order. Directions
/// less than a millionth radian apart are one, and so are thetas in the sorting. All views
/// have the same lights. A set of one view, or of one light, is legal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Catalogue {
    views: Vec<Angles>,
    lights: Vec<Angles>,
    /// Number of each view and of each light among those that are not left out.
    kept: [Vec<Option<usize>>; 2],
    /// Position in the list of names, `[view][light]`, of those that are not left out.
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
    /// As in file names, in degrees without leading zeros, to six digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (tl, pl) = (six_digits(self.light.theta_deg()), azimuth_digits(self.light.phi_deg()));
        let (tv, pv) = (six_digits(self.view.theta_deg()), azimuth_digits(self.view.phi_deg()));
        write!(f, "tl{tl} pl{pl} tv{tv} pv{pv}")
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

/// Why a list of files is not a complete set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.describe())]
pub struct CatalogueErrors {
    /// Views that any image has.
    pub views: usize,
    /// Lights that any image has.
    pub lights: usize,
    /// Files that are images.
    pub images: usize,
    /// Files that are not.
    pub ignored: usize,
    /// Pairs of these views and lights without an image, sorted: all, or the first 65 536.
    pub missing: Vec<Pair>,
    /// Number of all pairs without an image.
    pub missing_count: u64,
    /// Pairs with several images, sorted: all.
    pub duplicates: Vec<Duplicate>,
    /// Names of images that are the only one of their light or view, where others have more: they may be misnamed.
    pub lone: Vec<String>,
    /// A few views and lights, with their directions, without which the set would be complete; none where many would
    /// have to go.
    pub spare_views: Vec<(usize, Angles)>,
    /// The lights among them.
    pub spare_lights: Vec<(usize, Angles)>,
}

impl Catalogue {
    /// Sorts out the files of a set: the name of each, from one container or from several one after the
    /// other, and the directions that it was taken under; `None` is no image, counted and otherwise ignored.
    ///
    /// ```
    /// use btfkit_formats::{Angles, Catalogue, Pair};
    ///
    /// let light = |theta, phi| Some(Pair { view: Angles::FRONTAL, light: Angles::new(theta, phi)? });
    /// let files = [("a.png", light(45.0, 90.0)), ("notes.txt", None), ("b.png", light(30.0, 180.0))];
    /// let set = Catalogue::from_pairs(files).unwrap();
    /// assert_eq!((set.views().len(), set.lights().len(), set.ignored()), (1, 2, 1));
    /// assert_eq!(set.image(0, 0), Some(2));
    /// ```
    ///
    /// # Errors
    ///
    /// Everything that keeps the set from being complete, at once: all pairs that are missing, all that are
    /// there twice; or that no file is an image.
    pub fn from_pairs<'a>(
        files: impl IntoIterator<Item = (&'a str, Option<Pair>)>,
    ) -> Result<Catalogue, Box<CatalogueErrors>> {
        Catalogue::from_pairs_without(files, &Without::default())
    }

    /// The same, but nothing is missing of the views and lights that are left out, nor too often there. They keep their
    /// numbers, so those of the others stay what they are.
    ///
    /// ```
    /// use btfkit_formats::{Angles, Catalogue, Pair, Without};
    ///
    /// let pair = |view, light| Some(Pair { view: Angles::new(view, 0.0)?, light: Angles::new(light, 0.0)? });
    /// let files = [("a", pair(0.0, 15.0)), ("b", pair(0.0, 30.0)), ("c", pair(45.0, 30.0))];
    /// assert!(Catalogue::from_pairs(files).is_err());
    /// let set = Catalogue::from_pairs_without(files, &Without { views: vec![1], lights: vec![] }).unwrap();
    /// assert_eq!((set.views().len(), set.images()), (2, &[0, 1][..]));
    /// assert_eq!(set.image(1, 1), None);
    /// ```
    ///
    /// # Errors
    ///
    /// As of [`Catalogue::from_pairs`]; or that nothing is left.
    pub fn from_pairs_without<'a>(
        files: impl IntoIterator<Item = (&'a str, Option<Pair>)>,
        without: &Without,
    ) -> Result<Catalogue, Box<CatalogueErrors>> {
        let mut ignored = 0usize;
        let mut named: Vec<(usize, &str)> = Vec::new();
        let (mut views, mut lights) = (Vec::new(), Vec::new());
        for (position, (name, pair)) in files.into_iter().enumerate() {
            match pair {
                Some(pair) => {
                    named.push((position, name));
                    views.push(pair.view);
                    lights.push(pair.light);
                }
                None => ignored = ignored.saturating_add(1),
            }
        }
        let ((views, view_numbers), (lights, light_numbers)) = (number(&views), number(&lights));
        let cells = view_numbers.into_iter().zip(light_numbers);
        let mut found: Vec<(Cell, usize, &str)> =
            cells.zip(named).map(|(cell, (position, name))| (cell, position, name)).collect();
        found.sort_unstable_by_key(|&(cell, position, _)| (cell, position));
        let kept = [kept(views.len(), &without.views), kept(lights.len(), &without.lights)];
        let [of_views, of_lights] = &kept;
        let is_kept = |(view, light): Cell| {
            let is = |of: &[Option<usize>], number: usize| of.get(number).is_some_and(Option::is_some);
            is(of_views, view) && is(of_lights, light)
        };
        found.retain(|&(cell, ..)| is_kept(cell));

        let groups = || found.chunk_by(|(a, ..), (b, ..)| a == b);
        let pair = |(view, light): Cell| Some(Pair { view: *views.get(view)?, light: *lights.get(light)? });
        let duplicates: Vec<Duplicate> = groups()
            .filter(|group| group.len() > 1)
            .filter_map(|group| {
                let names = group.iter().map(|&(_, _, name)| name.to_owned()).collect();
                Some(Duplicate { pair: pair(group.first()?.0)?, names })
            })
            .collect();
        let [kept_views, kept_lights] = [of_views, of_lights].map(|of| {
            (0..of.len()).filter(|&number| of.get(number).is_some_and(Option::is_some)).collect::<Vec<_>>()
        });
        let cells = count(kept_views.len()).saturating_mul(count(kept_lights.len()));
        let missing_count = cells.saturating_sub(count(groups().count()));
        if found.is_empty() || missing_count > 0 || !duplicates.is_empty() {
            let present = groups().filter_map(|group| Some(group.first()?.0));
            let listed = usize::try_from(missing_count).unwrap_or(usize::MAX).min(MAX_LISTED);
            let gaps: Vec<Cell> = gaps(&kept_views, &kept_lights, present).take(listed).collect();
            let doubled = groups().filter(|group| group.len() > 1).filter_map(|group| Some(group.first()?.0));
            let faults: Vec<Cell> = gaps.iter().copied().chain(doubled).collect();
            let all_listed = count(gaps.len()) == missing_count;
            let spare = if all_listed { spare(faults, kept_views.len(), kept_lights.len()) } else { None };
            let Without { views: spare_views, lights: spare_lights } = spare.unwrap_or_default();
            let named = |numbers: Vec<usize>, of: &[Angles]| {
                numbers.into_iter().filter_map(|number| Some((number, *of.get(number)?))).collect()
            };
            return Err(Box::new(CatalogueErrors {
                views: kept_views.len(),
                lights: kept_lights.len(),
                images: found.len(),
                ignored,
                missing: gaps.into_iter().filter_map(pair).collect(),
                missing_count,
                duplicates,
                lone: lone(&found, views.len(), lights.len()),
                spare_views: named(spare_views, &views),
                spare_lights: named(spare_lights, &lights),
            }));
        }
        // Complete and sorted by view, then light: the list is the grid.
        let images = found.iter().map(|&(_, position, _)| position).collect();
        Ok(Catalogue { views, lights, kept, images, ignored })
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
    /// number `light`; `None` if there is no such view or light, or one of them is left out.
    pub fn image(&self, view: usize, light: usize) -> Option<usize> {
        self.images.get(self.place(view, light)?).copied()
    }

    /// Where the image of a view and a light stands in [`Catalogue::images`].
    pub fn place(&self, view: usize, light: usize) -> Option<usize> {
        let [views, lights] = &self.kept;
        let view = (*views.get(view)?)?;
        let light = (*lights.get(light)?)?;
        view.checked_mul(lights.iter().flatten().count())?.checked_add(light)
    }

    /// Positions of all images, by view, then light, of those that are not left out.
    pub fn images(&self) -> &[usize] {
        &self.images
    }

    /// How many files were not images.
    pub fn ignored(&self) -> usize {
        self.ignored
    }
}

/// View number, light number.
type Cell = (usize, usize);

/// The distinct ones of some directions, sorted, and for each of those given the number of the one that it is.
fn number(given: &[Angles]) -> (Vec<Angles>, Vec<usize>) {
    let mut sorted: Vec<(Angles, usize)> = given.iter().copied().zip(0..).collect();
    sorted.sort_unstable();
    // Rings of one theta: within a ring the order is that of phi alone.
    let (mut ring, mut ring_deg) = (0usize, f64::NEG_INFINITY);
    let mut in_rings: Vec<(usize, Angles, usize)> = Vec::with_capacity(sorted.len());
    for (angles, position) in sorted {
        if (angles.theta_deg() - ring_deg).to_radians() > SAME_RAD {
            ring = ring.saturating_add(1);
            ring_deg = angles.theta_deg();
        }
        in_rings.push((ring, angles, position));
    }
    in_rings.sort_by(|(a_ring, a, _), (b_ring, b, _)| {
        a_ring.cmp(b_ring).then(a.phi_deg().total_cmp(&b.phi_deg())).then(a.cmp(b))
    });

    let mut distinct: Vec<Angles> = Vec::new();
    let mut numbers = vec![0; given.len()];
    for ring in in_rings.chunk_by(|(a, ..), (b, ..)| a == b) {
        let first = distinct.len();
        for &(_, angles, position) in ring {
            let is = |number: &usize| distinct.get(*number).is_some_and(|&known| near(known, angles));
            // The last one is as near as any, but for a phi just below 360.
            let last = distinct.len().saturating_sub(1).max(first);
            let known = Some(last).filter(is).or(Some(first).filter(is));
            if let Some(slot) = numbers.get_mut(position) {
                *slot = known.unwrap_or(distinct.len());
            }
            if known.is_none() {
                distinct.push(angles);
            }
        }
    }
    (distinct, numbers)
}

/// The first direction that was there before, or one so near that it counts as the same: both positions,
/// earlier and later.
pub(crate) fn repeated_direction(given: &[Angles]) -> Option<(usize, usize)> {
    let mut first: Vec<Option<usize>> = vec![None; given.len()];
    number(given).1.into_iter().enumerate().find_map(|(at, number)| {
        let first = first.get_mut(number)?;
        let earlier = *first;
        *first = earlier.or(Some(at));
        Some((earlier?, at))
    })
}

fn near(a: Angles, b: Angles) -> bool {
    if a == b {
        return true;
    }
    let apart = a.direction().vector().into_iter().zip(b.direction().vector()).map(|(a, b)| (a - b).powi(2));
    apart.sum::<f64>() <= SAME_RAD * SAME_RAD
}

/// Names of the images that are the only one of their light or view, where another one has more.
fn lone(found: &[(Cell, usize, &str)], views: usize, lights: usize) -> Vec<String> {
    let (mut of_view, mut of_light) = (vec![0u64; views], vec![0u64; lights]);
    let add = |counts: &mut Vec<u64>, number: usize| {
        if let Some(count) = counts.get_mut(number) {
            *count = count.saturating_add(1);
        }
    };
    for &((view, light), ..) in found {
        add(&mut of_view, view);
        add(&mut of_light, light);
    }
    let others_have_more = [&of_view, &of_light].map(|counts| counts.iter().any(|&count| count > 1));
    let is_lone = |counts: &[u64], number: usize, side: usize| {
        counts.get(number) == Some(&1) && others_have_more.get(side) == Some(&true)
    };
    let alone = found
        .iter()
        .filter(|((view, light), ..)| is_lone(&of_view, *view, 0) || is_lone(&of_light, *light, 1));
    alone.map(|&(_, _, name)| name.to_owned()).collect()
}

/// The cells of the grid that are not in `present`, which is sorted and a part of the grid.
fn gaps(
    views: &[usize],
    lights: &[usize],
    present: impl Iterator<Item = Cell>,
) -> impl Iterator<Item = Cell> {
    let grid = views.iter().flat_map(move |&view| lights.iter().map(move |&light| (view, light)));
    let mut present = present.peekable();
    grid.filter(move |cell| present.next_if_eq(cell).is_none())
}

fn count(n: usize) -> u64 {
    u64::try_from(n).unwrap_or(u64::MAX)
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
                "found no image among {}, expected one for every view and light",
                counted(self.ignored, "name")
            );
        }
        let mut text = format!(
            "found {} of {} and {}, expected one for every pair",
            counted(self.images, "image"),
            counted(self.views, "view"),
            counted(self.lights, "light")
        );
        let missing = self.missing.iter().map(ToString::to_string);
        push_list(&mut text, "missing", missing, self.missing_count);
        let doubled = self.duplicates.iter().map(Duplicate::describe);
        push_list(&mut text, "more than once", doubled, count(self.duplicates.len()));
        let lone = self.lone.iter().map(|name| format!("{name:?}"));
        let title = "the only picture of its light or view, so perhaps misnamed";
        push_list(&mut text, title, lone, count(self.lone.len()));
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

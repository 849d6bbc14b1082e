//! Views and lights that a set can do without.

use std::collections::{HashMap, HashSet};

/// Views and lights that need no images, by their numbers in the sorted lists of all directions that names give.
/// Numbers that there are none of say nothing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Without {
    /// Views.
    pub views: Vec<usize>,
    /// Lights.
    pub lights: Vec<usize>,
}

/// The number of each direction among those that are not left out.
pub(crate) fn kept(count: usize, without: &[usize]) -> Vec<Option<usize>> {
    let without: HashSet<usize> = without.iter().copied().collect();
    let mut next = 0usize;
    let number = |at| {
        if without.contains(&at) {
            return None;
        }
        let number = next;
        next = next.saturating_add(1);
        Some(number)
    };
    (0..count).map(number).collect()
}

/// Views and lights without which none of these cells is left, most faults first; none where more than a few are
/// needed, or nothing would be left.
pub(crate) fn spare(mut faults: Vec<(usize, usize)>, views: usize, lights: usize) -> Option<Without> {
    const A_FEW: usize = 6;
    let mut spare = Without::default();
    while !faults.is_empty() {
        let most = |numbers: &mut dyn Iterator<Item = usize>| {
            let mut counts: HashMap<usize, usize> = HashMap::new();
            numbers.for_each(|number| {
                let count = counts.entry(number).or_default();
                *count = count.saturating_add(1);
            });
            // Of equal ones the first, whatever the order in the map.
            counts.into_iter().max_by_key(|&(number, count)| (count, std::cmp::Reverse(number)))
        };
        let view = most(&mut faults.iter().map(|cell| cell.0))?;
        let light = most(&mut faults.iter().map(|cell| cell.1))?;
        // Where one picture is missing, it costs fewer images to leave out its view if there are more views.
        if (view.1, views) >= (light.1, lights) {
            spare.views.push(view.0);
            faults.retain(|cell| cell.0 != view.0);
        } else {
            spare.lights.push(light.0);
            faults.retain(|cell| cell.1 != light.0);
        }
        let too_many = spare.views.len().saturating_add(spare.lights.len()) > A_FEW;
        if too_many || spare.views.len() >= views || spare.lights.len() >= lights {
            return None;
        }
    }
    Some(spare)
}

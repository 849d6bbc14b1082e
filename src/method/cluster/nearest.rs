//! The texels nearest to centres, which become their representatives, and those farthest, which found new clusters.

use serde::{Deserialize, Serialize};

/// A texel and its distance to a centre, ordered by distance, then texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Near {
    /// Fixed-point distance of (1).
    pub distance: u64,
    /// Texel number.
    pub texel: u32,
}

impl Near {
    /// Farther than every texel.
    pub const NONE: Self = Self { distance: u64::MAX, texel: u32::MAX };
}

/// The nearer of two texels for each centre.
pub fn nearer(mut first: Vec<Near>, second: Vec<Near>) -> Vec<Near> {
    for (first, second) in first.iter_mut().zip(second) {
        *first = second.min(*first);
    }
    first
}

/// The texels farthest from their own centres, farthest first, ties by texel number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Farthest {
    texels: Vec<Near>,
}

impl Farthest {
    /// Most that are kept, and so most clusters that a pass can found anew.
    pub(crate) const MOST: usize = 64;

    /// Those among `texels`.
    pub fn of(texels: impl IntoIterator<Item = Near>) -> Self {
        let mut farthest = Self::default();
        farthest.add(texels);
        farthest
    }

    /// Takes more texels into account.
    pub fn add(&mut self, texels: impl IntoIterator<Item = Near>) {
        let key = |near: &Near| (std::cmp::Reverse(near.distance), near.texel);
        for near in texels {
            let full = self.texels.len() == Self::MOST;
            let last = self.texels.last().filter(|_| full);
            if near.distance > 0 && last.is_none_or(|last| key(&near) < key(last)) {
                let at = self.texels.partition_point(|other| key(other) < key(&near));
                self.texels.insert(at, near);
                self.texels.truncate(Self::MOST);
            }
        }
    }

    /// The texels, farthest first.
    pub fn texels(&self) -> &[Near] {
        &self.texels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    #[test]
    fn the_farthest_are_those_of_sorting_however_they_come() {
        let hash = Hash::new(2, 0);
        let mut all: Vec<Near> = (0..1000)
            .map(|texel| Near { distance: u64::from(hash.words(texel, 0, 0)[0] % 300), texel })
            .collect();
        let at_once = Farthest::of(all.iter().copied());
        let mut backwards = Farthest::of(all[500..].iter().rev().copied());
        backwards.add(all[..500].iter().copied());
        all.sort_by_key(|near| (std::cmp::Reverse(near.distance), near.texel));
        assert_eq!(at_once.texels(), &all[..Farthest::MOST]);
        assert_eq!(backwards, at_once);
    }
}

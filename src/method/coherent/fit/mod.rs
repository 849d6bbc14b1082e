//! From clusters to an appearance, by floating point: once, by the program that fits. What comes out is small whole
//! numbers that every reader shares, so no reader has to repeat this.

mod basis;
mod features;

pub use features::{Clusters, features};

use super::appearance::{Appearance, FEATURES, levels_of};
use super::appearance_image::Features;
use crate::lattice::WaveCounts;
use crate::shape::Window;

/// Fits an appearance.
///
/// `texels` are the clusters of the exemplar's texels, row by row, each with an entry in `features`.
pub fn fit(
    exemplar: Window,
    wraps: bool,
    texels: &[u16],
    features: Vec<[i8; FEATURES]>,
    lattice: WaveCounts,
) -> Appearance {
    let of_texels = texels.iter().map(|&cluster| features[usize::from(cluster)]);
    let mut blurred = Features::new(exemplar.size, of_texels);
    let count = levels_of(exemplar.size);
    let levels = (0..count)
        .map(|level| {
            let basis = basis::fit(&blurred, level, count);
            blurred.blur(1 << level);
            basis
        })
        .collect();
    Appearance { exemplar, wraps, features, levels, lattice }
}

//! The cheap part of a judgement, which takes no measurement: for the end of an enlargement.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::subject::Subject;
use super::whole::{self, Material};
use super::{exemplar_of, middle, pairs};
use crate::error::Result;
use crate::likeness::Lightness;
use crate::likeness::verdict::{Verdict, WINDOW_SIDE, excess_peak};
use crate::run::Context;

/// What can be said of an enlargement without real crops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quick {
    /// Over the whole of it.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// By how much the largest far autocorrelation of a window in its middle exceeds the exemplar's, by the clusters' L*
    /// under the most frontal view and a low light.
    pub excess_peak: f64,
}

/// Looks at an enlarged index once, row by row; `model` is beside it under its recorded name where it is not given.
///
/// # Errors
/// An enlargement that is not whole or not of this model, and those of reading.
pub fn quick(enlarged: &Path, model: Option<&Path>, context: &Context<'_>) -> Result<Quick> {
    let (subject, model) = Subject::open(enlarged, model, None)?;
    let (tile, index, centres) = (model.tile()?, model.index()?, model.centres()?);
    let (exemplar, wraps, _) = exemplar_of(&model, &tile)?;
    let [views, lights] = model.directions()?;
    let brdf = views.len() * lights.len();
    let material =
        Material { tile: tile.size, index: &index, exemplar, wraps, clusters: centres.len() / brdf.max(1) };
    let (verdict, _) = whole::look(&subject, &material, &[], context)?;
    let at = pairs::spread(&views, &lights, 1).first().map_or(0, |[view, light]| view * lights.len() + light);
    let codes: Vec<u8> = centres.iter().skip(at).step_by(brdf.max(1)).copied().collect();
    let shown = |index: &[u16]| index.iter().map(|&cluster| codes[usize::from(cluster)]).collect::<Vec<u8>>();
    let window = middle(subject.size(), WINDOW_SIDE);
    let texels = subject.texels(window, material.clusters, material.tile)?;
    let own = Lightness::of_codes(tile.size, shown(&index)).part(exemplar);
    let seen = Lightness::of_codes(window.size, shown(&texels.index));
    Ok(Quick { verdict, excess_peak: excess_peak(&seen, &own) })
}

//! How a measurement's texels look under a few direction pairs: seams and lattices are told by it.

use crate::error::Result;
use crate::lattice::{Lattice, detect};
use crate::method::components::leading;
use crate::method::tile::Features;
use crate::run::Context;
use crate::run::progress::Counted;
use crate::store::measurement::Measurement;

/// Views by which seams are judged.
const FEATURE_VIEWS: usize = 6;

/// Lights of each of them.
const FEATURE_LIGHTS: usize = 8;

/// Leading components of the codes in which a lattice is looked for.
const COMPONENTS: usize = 8;

/// L* codes of the plane under a spread of direction pairs.
pub(crate) fn features(measurement: &Measurement, context: &Context<'_>) -> Result<Features> {
    let description = measurement.description();
    let spread = |count: usize, all: usize| -> Vec<usize> {
        let count = count.min(all);
        (0..count).map(|n| n * all / count).collect()
    };
    let views = spread(FEATURE_VIEWS, description.views.len());
    let lights = spread(FEATURE_LIGHTS, description.lights.len());
    let count = views.len() * lights.len();
    let mut codes = vec![0; description.size.texels() * count];
    context.progress.begin("tile", views.len() as u64, Counted::Items("views"));
    for (number, &view) in views.iter().enumerate() {
        context.check_stop()?;
        let luminance = measurement.read_luminance(view, description.size.window())?;
        for (texel, to) in luminance.chunks_exact(description.lights.len()).zip(codes.chunks_exact_mut(count))
        {
            for (to, &light) in to[number * lights.len()..].iter_mut().zip(&lights) {
                *to = texel[light];
            }
        }
        context.progress.advance(1);
    }
    context.progress.end();
    Ok(Features { size: description.size, count, codes })
}

/// The lattice of a plane, whose borders join or not.
pub(super) fn lattice_of(features: &Features, wraps: bool) -> Result<Lattice> {
    let (components, dims) = leading(&features.codes, features.count, COMPONENTS)?;
    Ok(detect(features.size, dims, &components, wraps).lattice)
}

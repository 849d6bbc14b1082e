//! What only the whole of an enlargement shows, as its rows stream by: shares, copies, bands.

use super::codes::Codes;
use super::subject::Subject;
use crate::error::Result;
use crate::likeness::Lightness;
use crate::likeness::copies::LargestCopy;
use crate::likeness::repetition::{Profiles, wavy_bands};
use crate::likeness::verdict::{Tally, Verdict};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::shape::{Size, Window};

/// Side of the window in which wavy bands are sought.
const WAVY_SIDE: usize = 768;

/// What does not depend on where one looks.
pub(super) struct Material<'a> {
    pub(super) tile: Size,
    pub(super) index: &'a [u16],
    pub(super) exemplar: Window,
    pub(super) wraps: bool,
    pub(super) clusters: usize,
}

/// The verdict, and the largest correlation of rows' and columns' means in any pair.
pub(super) fn look(
    subject: &Subject,
    material: &Material<'_>,
    codes: &[&Codes],
    context: &Context<'_>,
) -> Result<(Verdict, [Option<f64>; 2])> {
    let size = subject.size();
    let copy = subject
        .has_source()
        .then(|| LargestCopy::new(material.exemplar, material.tile.width, material.wraps));
    let mut tally = Tally::new(material.index, material.clusters, copy);
    let mut profiles: Vec<Profiles> = codes.iter().map(|_| Profiles::new(size.width)).collect();
    context.progress.begin("look at it all", size.height as u64, Counted::Items("rows"));
    for top in (0..size.height).step_by(subject.band_rows()) {
        context.check_stop()?;
        let rows = subject.band_rows().min(size.height - top);
        let window = Window { y: top, x: 0, size: Size::new(rows, size.width) };
        let texels = context.compute(|| subject.texels(window, material.clusters, material.tile))?;
        for row in 0..rows {
            let range = row * size.width..(row + 1) * size.width;
            let index = &texels.index[range.clone()];
            let source = texels.source.as_ref().map_or(&[][..], |source| &source[range]);
            tally.push(index, source);
            for (profile, codes) in profiles.iter_mut().zip(codes) {
                if source.is_empty() {
                    profile.push(index.iter().map(|&cluster| codes.clusters[usize::from(cluster)]));
                } else {
                    profile.push(source.iter().map(|&texel| codes.tile[texel as usize]));
                }
            }
        }
        context.progress.advance(rows as u64);
    }
    context.progress.end();
    let bands: Vec<[Option<f64>; 2]> =
        profiles.iter().map(|profile| profile.bands(material.exemplar.size)).collect();
    let largest = |axis: usize| bands.iter().filter_map(|bands| bands[axis]).reduce(f64::max);
    Ok((tally.verdict(), [largest(0), largest(1)]))
}

/// Wavy bands in a window in the middle.
pub(super) fn wavy(subject: &Subject, material: &Material<'_>, codes: &Codes) -> Result<[Option<f64>; 2]> {
    let window = subject.size().middle(Size::new(WAVY_SIDE, WAVY_SIDE));
    let texels = subject.texels(window, material.clusters, material.tile)?;
    let values = match texels.source {
        Some(source) => source.iter().map(|&texel| codes.tile[texel as usize]).collect::<Vec<_>>(),
        None => texels.index.iter().map(|&cluster| codes.clusters[usize::from(cluster)]).collect(),
    };
    Ok(wavy_bands(&Lightness::of_codes(window.size, values), material.exemplar.size))
}

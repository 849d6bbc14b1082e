//! A measurement: every chunk decoded, L* codes worked out again, and compared with an archive.

use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::report::{Finding, OLDEST_NOTE, consolidated, kept, unfinished};
use crate::archive::{Source, read_groups};
use crate::color::Remarkable;
use crate::error::{Error, ErrorKind, Result};
use crate::run::progress::Counted;
use crate::run::shard::Shard;
use crate::run::{Context, units};
use crate::shape::Window;
use crate::store::measurement::gather::{self, Images};
use crate::store::measurement::{Measurement, SampleArray};
use crate::words::counted;
use crate::zarr::metadata::OLDEST_FORMAT;

/// What was found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Views that are there.
    pub views_found: usize,
    /// Views that have not been written.
    pub views_missing: Vec<usize>,
    /// Chunks that cannot be decoded, or whose L* codes are not those of their samples.
    pub damaged: Vec<Damage>,
    /// Samples beyond their range.
    pub samples: Remarkable,
    /// Samples that differ from the archive's, where it was compared.
    pub different: Option<u64>,
    /// How many images have such samples.
    pub images_different: usize,
    /// Images with such samples, (view, light): the first of them.
    pub different_images: Vec<(usize, usize)>,
    /// What else is wrong, or has to be done.
    pub findings: Vec<Finding>,
    /// What could not be told.
    pub notes: Vec<String>,
}

/// A chunk that is not as it should be.
#[derive(Clone, Debug, Serialize)]
pub struct Damage {
    /// The array.
    pub array: &'static str,
    /// The view.
    pub view: usize,
    /// Row and column of the chunk's first texel.
    pub texel: [usize; 2],
    /// The file that it lies in.
    pub file: String,
    /// What is wrong.
    pub what: String,
}

/// Images with differences that are named one by one.
const NAMED_IMAGES: usize = 20;

/// Reads all of a measurement, or a part of its views; and, where a source is given, its archive.
///
/// # Errors
/// An archive of another shape, and those of the operating system; what is damaged is reported.
pub fn run(
    measurement: &Measurement,
    source: Option<&dyn Source>,
    shard: Shard,
    context: &Context<'_>,
) -> Result<Report> {
    let description = measurement.description();
    if let Some(source) = source {
        expect_same_shape(measurement, source)?;
    }
    // A view is looked at where anything has the name of one of its files: a pipe there is damage, not a view to come.
    let n_views = description.views.len();
    let (found, missing): (Vec<usize>, Vec<usize>) = (0..n_views)
        .filter(|&view| shard.has(view))
        .partition(|&view| measurement.has_view(view) || measurement.obstructed(view));
    context.progress.begin("verify", found.len() as u64, Counted::Items("views"));
    let view = description.view_bytes();
    let unit_bytes = source.map_or(2 * view, |source| 4 * view + source.bytes_beside_image());
    let what = format!(
        "verifying views of {} under {}",
        description.size,
        counted(description.lights.len(), "light")
    );
    let in_flight = units::in_flight(context, &what, unit_bytes)?;
    let different = AtomicU64::new(0);
    let views = units::for_each(context, &found, in_flight, |&view| {
        let (damaged, remarkable) = verify_view(measurement, view)?;
        let mut images = Vec::new();
        if let Some(source) = source.filter(|_| damaged.is_empty()) {
            let expected = Images::new(
                description.size,
                description.n_channels(),
                description.sample_type,
                read_groups(source, view)?,
            )?;
            let (count, lights) = compare(measurement, view, &expected)?;
            different.fetch_add(count, Ordering::Relaxed);
            images.extend(lights.into_iter().map(|light| (view, light)));
        }
        context.progress.advance(1);
        Ok((damaged, remarkable, images))
    })?;
    context.progress.end();
    let mut report = Report {
        views_found: found.len(),
        views_missing: missing,
        different: source.map(|_| different.into_inner()),
        ..Report::default()
    };
    if shard != Shard::WHOLE {
        report.notes.push(shard.looked_at(found.len(), &counted(n_views, "view")));
    }
    other_findings(measurement, &mut report)?;
    for (damaged, remarkable, images) in views {
        report.damaged.extend(damaged);
        report.samples += remarkable;
        report.different_images.extend(images);
    }
    report.images_different = report.different_images.len();
    report.different_images.truncate(NAMED_IMAGES);
    Ok(report)
}

/// What does not lie in single chunks.
fn other_findings(measurement: &Measurement, report: &mut Report) -> Result<()> {
    let findings = &mut report.findings;
    kept(measurement.check_coordinates(), "angle coordinates", findings)?;
    if measurement.format() == OLDEST_FORMAT {
        report.notes.push(OLDEST_NOTE.to_owned());
    } else if !measurement.is_finished()? {
        if (0..measurement.description().views.len()).all(|view| measurement.has_view(view)) {
            findings.push(unfinished(measurement.path()));
        }
    } else {
        consolidated(measurement.path(), measurement.is_consolidated(), findings)?;
    }
    Ok(())
}

fn expect_same_shape(measurement: &Measurement, source: &dyn Source) -> Result<()> {
    let (description, contents) = (measurement.description(), source.contents());
    let found = (
        contents.width as usize,
        contents.height as usize,
        contents.channels.len(),
        contents.views.len(),
        contents.lights.len(),
        contents.sample_type,
    );
    let expected = (
        description.size.width,
        description.size.height,
        description.n_channels(),
        description.views.len(),
        description.lights.len(),
        description.sample_type,
    );
    if found == expected {
        return Ok(());
    }
    Err(Error::input(format!(
        "{} holds {found:?} (width, height, channels, views, lights, type), {} holds {expected:?}",
        source.path().display(),
        measurement.path().display()
    ))
    .hint("leave out the options that ask for another reading than that of the import: it is taken from the store"))
}

/// Decodes a view, chunk by chunk where it cannot be decoded whole, and works out its L* codes again.
fn verify_view(measurement: &Measurement, view: usize) -> Result<(Vec<Damage>, Remarkable)> {
    let description = measurement.description();
    let codes = description.codes()?;
    let mut damaged = Vec::new();
    let mut remarkable = Remarkable::default();
    let whole = description.size.window();
    let check = |window: Window| -> std::result::Result<(bool, Remarkable), (SampleArray, Error)> {
        let samples =
            measurement.read_reflectance(view, window).map_err(|error| (SampleArray::Reflectance, error))?;
        let stored =
            measurement.read_luminance(view, window).map_err(|error| (SampleArray::Luminance, error))?;
        let mut expected = vec![0; stored.len()];
        let remarkable = codes.fill(&samples, &mut expected);
        Ok((stored == expected, remarkable))
    };
    if let Ok((true, found)) = check(whole) {
        // Each chunk is intact, but the view may be another one.
        if let Some(array) = measurement.exchanged(view)? {
            let file = measurement.shard_path(array, view, whole).display().to_string();
            let what =
                "its checksum is not the one that was kept: the shard of another view, or store".to_owned();
            damaged.push(Damage { array: array.name(), view, texel: [0, 0], file, what });
        }
        return Ok((damaged, found));
    }
    for window in measurement.chunk_windows() {
        let (array, what) = match check(window) {
            Ok((true, found)) => {
                remarkable += found;
                continue;
            }
            Ok((false, _)) => {
                (SampleArray::Luminance, "L* codes that are not those of the samples".to_owned())
            }
            Err((_, error)) if error.kind() == ErrorKind::Io => return Err(error),
            Err((array, error)) => (array, error.to_string()),
        };
        let file = measurement.shard_path(array, view, window).display().to_string();
        damaged.push(Damage { array: array.name(), view, texel: [window.y, window.x], file, what });
    }
    Ok((damaged, remarkable))
}

/// Samples of a view that differ from these images, and the lights of the images with some.
fn compare(measurement: &Measurement, view: usize, expected: &Images) -> Result<(u64, Vec<usize>)> {
    let description = measurement.description();
    let (lights, channels) = (description.lights.len(), description.n_channels());
    let mut by_light = vec![0u64; lights];
    for window in measurement.chunk_row_windows() {
        let [found, expected] = [measurement.read_reflectance(view, window)?, expected.gather(window)];
        let [found, expected] = [gather::bytes(&found), gather::bytes(&expected)];
        if found == expected {
            continue;
        }
        let sample = description.sample_type.bytes();
        for (at, (a, b)) in found.chunks_exact(sample).zip(expected.chunks_exact(sample)).enumerate() {
            by_light[at / channels % lights] += u64::from(a != b);
        }
    }
    let different = (0..lights).filter(|&light| by_light[light] > 0).collect();
    Ok((by_light.iter().sum(), different))
}
